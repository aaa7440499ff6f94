#include "bielle/math/lane_product.h"

#include <cmath>

namespace bielle {

namespace {

// A vector of kLane numbers anywhere in memory; the compiler splits it if the processor's registers are shorter.
typedef double Lane __attribute__((vector_size(kLane * sizeof(double)), aligned(sizeof(double)), may_alias));

// With L lanes and C columns, L C sums, L vectors of A and one number of B are to fit into 32 registers.
#ifdef __AVX512F__
constexpr int kMaxLanes = 6;
#else
constexpr int kMaxLanes = 1;
#endif
constexpr int kColumns = 4;

template <int L, int C>
void addBlock(Eigen::Index depth, double sign, PaddedMatrix A, StridedMatrix B, PaddedMatrix out) {
  Lane sums[C][L] = {};
  const double *a = A.data, *b = B.data;
  for (Eigen::Index k = 0; k < depth; ++k, a += A.stride, b += B.row_stride) {
    Lane column[L];
#pragma GCC unroll 8
    for (int i = 0; i < L; ++i) column[i] = *reinterpret_cast<const Lane*>(a + i * kLane);
#pragma GCC unroll 8
    for (int j = 0; j < C; ++j) {
      const double factor = b[j * B.col_stride];
#pragma GCC unroll 8
      for (int i = 0; i < L; ++i) sums[j][i] += column[i] * factor;
    }
  }
#pragma GCC unroll 8
  for (int j = 0; j < C; ++j) {
#pragma GCC unroll 8
    for (int i = 0; i < L; ++i) *reinterpret_cast<Lane*>(out.data + j * out.stride + i * kLane) += sign * sums[j][i];
  }
}

template <int L>
void addRows(Eigen::Index cols, Eigen::Index depth, double sign, PaddedMatrix A, StridedMatrix B, PaddedMatrix C) {
  Eigen::Index j = 0;
  const auto addColumns = [&](auto block, Eigen::Index width) {
    for (; j + width <= cols; j += width) {
      block(depth, sign, A, {B.data + j * B.col_stride, B.row_stride, B.col_stride}, {C.data + j * C.stride, C.stride});
    }
  };
  addColumns(addBlock<L, kColumns>, kColumns);
  addColumns(addBlock<L, 1>, 1);
}

// As many lanes at a time as there are, up to L.
template <int L>
void addLanes(Eigen::Index lanes, Eigen::Index cols, Eigen::Index depth, double sign, PaddedMatrix A, StridedMatrix B,
              PaddedMatrix C) {
  for (; lanes >= L; lanes -= L, A.data += L * kLane, C.data += L * kLane) addRows<L>(cols, depth, sign, A, B, C);
  if constexpr (L > 1) addLanes<L - 1>(lanes, cols, depth, sign, A, B, C);
}

}  // namespace

void addProduct(Eigen::Index rows, Eigen::Index cols, Eigen::Index depth, double sign, PaddedMatrix A, StridedMatrix B,
                PaddedMatrix C) {
  addLanes<kMaxLanes>(roundUpToLane(rows) / kLane, cols, depth, sign, A, B, C);
}

void clearPadding(PaddedMap A) {
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    for (Eigen::Index i = A.rows(); i < A.outerStride(); ++i) A.data()[i + j * A.outerStride()] = 0;
  }
}

bool factorizeColumns(PaddedMap H, Eigen::Index num) {
  for (Eigen::Index j = 0; j < num; ++j) {
    const Eigen::Index i = j / kLane * kLane;
    addProduct(H.rows() - i, 1, j, -1, pad(H, i), {H.data() + j, H.outerStride(), 1}, pad(H, i, j));
    if (!(H(j, j) > 0)) return false;
    H.col(j).tail(H.rows() - j) /= std::sqrt(H(j, j));
  }
  return true;
}

void solveTransposedFromRight(ConstMatrixRef L, PaddedMap X) {
  for (Eigen::Index k = 0; k < X.cols(); ++k) {
    addProduct(X.rows(), 1, k, -1, pad(X), {L.data() + k, L.outerStride(), 0}, pad(X, 0, k));
    X.col(k) *= 1 / L(k, k);
  }
}

void solveFromRight(ConstMatrixRef L, PaddedMap X) {
  for (Eigen::Index k = X.cols() - 1; k >= 0; --k) {
    const Eigen::Index next = std::min(k + 1, X.cols() - 1);  // of the last one nothing is taken away
    addProduct(X.rows(), 1, X.cols() - 1 - k, -1, pad(X, 0, next), {L.data() + next + k * L.outerStride(), 1, 0}, pad(X, 0, k));
    X.col(k) *= 1 / L(k, k);
  }
}

void copyLowerToUpper(MatrixXd& A) {
  constexpr Eigen::Index kBlock = 8;
  for (Eigen::Index c = 0; c < A.cols(); c += kBlock) {
    const Eigen::Index width = std::min(kBlock, A.cols() - c), below = A.cols() - c - width;
    copyTransposed(A.block(c + width, c, below, width), A.block(c, c + width, width, below));
    for (Eigen::Index j = c; j < c + width; ++j) {
      for (Eigen::Index i = j + 1; i < c + width; ++i) A(j, i) = A(i, j);
    }
  }
}

void addLowerProduct(Eigen::Index begin, Eigen::Index depth, double sign, PaddedMap A, PaddedMap B, PaddedMap H) {
  for (Eigen::Index j = begin, end; j < H.cols(); j = end) {
    end = std::min((j / kLane + 1) * kLane, H.cols());
    const Eigen::Index i = j / kLane * kLane;
    addProduct(H.rows() - i, end - j, depth, sign, pad(A, i), {B.data() + j, B.outerStride(), 1}, pad(H, i, j));
  }
}

}  // namespace bielle
