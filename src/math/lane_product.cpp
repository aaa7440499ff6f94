#include "math/lane_product.h"

#include <cmath>

namespace bielle {

namespace {

// With L lanes and C columns, L C sums, L vectors of A and one number of B must fit into the registers: 32 of AVX-512, else
// 16, of which a lane takes several.
#ifdef __AVX512F__
constexpr int kMaxLanes = 6;
#else
constexpr int kMaxLanes = 1;
#endif
constexpr int kColumns = kRegister == 2 ? 2 : 4;
constexpr int kParts = kLane / kRegister;

enum class Into { Sum, Nothing };  // whether a product is added to its destination or overwrites it

template <Into into, int L, int C>
void addBlock(Eigen::Index depth, double sign, ConstPaddedMatrix A, StridedMatrix B, PaddedMatrix out) {
  constexpr int kRows = L * kParts;
  Register sums[C][kRows] = {};
  const double *a = A.data, *b = B.data;
  for (Eigen::Index k = 0; k < depth; ++k, a += A.stride, b += B.row_stride) {
    Register column[kRows];
#pragma GCC unroll 8
    for (int i = 0; i < kRows; ++i) column[i] = *reinterpret_cast<const RegisterAnywhere*>(a + i * kRegister);
#pragma GCC unroll 8
    for (int j = 0; j < C; ++j) {
      const double factor = b[j * B.col_stride];
#pragma GCC unroll 8
      for (int i = 0; i < kRows; ++i) sums[j][i] += column[i] * factor;
    }
  }
#pragma GCC unroll 8
  for (int j = 0; j < C; ++j) {
#pragma GCC unroll 8
    for (int i = 0; i < kRows; ++i) {
      RegisterAnywhere& entry = *reinterpret_cast<RegisterAnywhere*>(out.data + j * out.stride + i * kRegister);
      entry = into == Into::Sum ? entry + sign * sums[j][i] : sign * sums[j][i];
    }
  }
}

template <Into into, int L>
void addRows(Eigen::Index cols, Eigen::Index depth, double sign, ConstPaddedMatrix A, StridedMatrix B, PaddedMatrix C) {
  Eigen::Index j = 0;
  const auto addColumns = [&](auto block, Eigen::Index width) {
    for (; j + width <= cols; j += width) {
      block(depth, sign, A, {B.data + j * B.col_stride, B.row_stride, B.col_stride}, {C.data + j * C.stride, C.stride});
    }
  };
  addColumns(addBlock<into, L, kColumns>, kColumns);
  if constexpr (kColumns > 2) addColumns(addBlock<into, L, 2>, 2);
  addColumns(addBlock<into, L, 1>, 1);
}

// Processes the remaining lanes, up to L at a time.
template <Into into, int L>
void addLanes(Eigen::Index lanes, Eigen::Index cols, Eigen::Index depth, double sign, ConstPaddedMatrix A,
              StridedMatrix B, PaddedMatrix C) {
  for (; lanes >= L; lanes -= L, A.data += L * kLane, C.data += L * kLane) addRows<into, L>(cols, depth, sign, A, B, C);
  if constexpr (L > 1) addLanes<into, L - 1>(lanes, cols, depth, sign, A, B, C);
}

// A lower triangle of at most kTriangle rows: the entries below its diagonal, and the inverse of its diagonal.
constexpr int kTriangle = 4;
struct Triangle {
  double entries[kTriangle][kTriangle], scales[kTriangle];
};

// X T^{-T} for X of C columns at distance `stride`, kept in registers.
template <int C>
void solveColumns(const Triangle& T, Eigen::Index rows, PaddedMatrix X, Eigen::Index stride) {
  for (Eigen::Index i = 0; i < rows; i += kRegister) {
    Register x[C];
#pragma GCC unroll 4
    for (int j = 0; j < C; ++j) {
      x[j] = *reinterpret_cast<const RegisterAnywhere*>(X.data + i + j * stride);
#pragma GCC unroll 4
      for (int m = 0; m < j; ++m) x[j] -= x[m] * T.entries[j][m];
      x[j] *= T.scales[j];
      *reinterpret_cast<RegisterAnywhere*>(X.data + i + j * stride) = x[j];
    }
  }
}

void solveColumns(const Triangle& T, int cols, Eigen::Index rows, PaddedMatrix X, Eigen::Index stride) {
  switch (cols) {
    case 1:
      return solveColumns<1>(T, rows, X, stride);
    case 2:
      return solveColumns<2>(T, rows, X, stride);
    case 3:
      return solveColumns<3>(T, rows, X, stride);
    default:
      return solveColumns<kTriangle>(T, rows, X, stride);
  }
}

}  // namespace

void addProduct(Eigen::Index rows, Eigen::Index cols, Eigen::Index depth, double sign, ConstPaddedMatrix A,
                StridedMatrix B, PaddedMatrix C) {
  addLanes<Into::Sum, kMaxLanes>(roundUpToLane(rows) / kLane, cols, depth, sign, A, B, C);
}

void setProduct(Eigen::Index rows, Eigen::Index cols, Eigen::Index depth, ConstPaddedMatrix A, StridedMatrix B,
                PaddedMatrix C) {
  addLanes<Into::Nothing, kMaxLanes>(roundUpToLane(rows) / kLane, cols, depth, 1, A, B, C);
}

void clearPadding(PaddedMap A) {
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    for (Eigen::Index i = A.rows(); i < A.outerStride(); ++i) A.data()[i + j * A.outerStride()] = 0;
  }
}

bool factorizeColumns(PaddedMap H, Eigen::Index num) {
  for (Eigen::Index k = 0; k < num; k += kTriangle) {
    const Eigen::Index i = k / kLane * kLane, cols = std::min<Eigen::Index>(kTriangle, num - k);
    addProduct(H.rows() - i, cols, k, -1, pad(H, i), {H.data() + k, H.outerStride(), 1}, pad(H, i, k));
    Triangle L;
    for (int j = 0; j < cols; ++j) {
      double pivot = H(k + j, k + j);
      for (int m = 0; m < j; ++m) {
        double entry = H(k + j, k + m);
        for (int n = 0; n < m; ++n) entry -= L.entries[j][n] * L.entries[m][n];
        L.entries[j][m] = entry * L.scales[m];
        pivot -= L.entries[j][m] * L.entries[j][m];
      }
      if (!(pivot > 0)) return false;
      L.scales[j] = 1 / std::sqrt(pivot);
    }
    solveColumns(L, static_cast<int>(cols), roundUpToLane(H.rows() - i), pad(H, i, k), H.outerStride());
  }
  return true;
}

void solveTransposedFromRight(ConstMatrixRef L, PaddedMap X) {
  for (Eigen::Index k = 0; k < X.cols(); k += kTriangle) {
    const Eigen::Index cols = std::min<Eigen::Index>(kTriangle, X.cols() - k);
    addProduct(X.rows(), cols, k, -1, pad(X), {L.data() + k, L.outerStride(), 1}, pad(X, 0, k));
    Triangle block;
    for (int j = 0; j < cols; ++j) {
      for (int m = 0; m < j; ++m) block.entries[j][m] = L(k + j, k + m);
      block.scales[j] = 1 / L(k + j, k + j);
    }
    solveColumns(block, static_cast<int>(cols), roundUpToLane(X.rows()), pad(X, 0, k), X.outerStride());
  }
}

// The same from the last column on.
void solveFromRight(ConstMatrixRef L, PaddedMap X) {
  for (Eigen::Index end = X.cols(), cols; end > 0; end -= cols) {
    cols = std::min<Eigen::Index>(kTriangle, end);
    const Eigen::Index k = end - cols, rest = X.cols() - end;
    if (rest > 0)
      addProduct(X.rows(), cols, rest, -1, pad(X, 0, end), {L.data() + end + k * L.outerStride(), 1, L.outerStride()},
                 pad(X, 0, k));
    Triangle block;
    for (int j = 0; j < cols; ++j) {
      for (int m = 0; m < j; ++m) block.entries[j][m] = L(end - 1 - m, end - 1 - j);
      block.scales[j] = 1 / L(end - 1 - j, end - 1 - j);
    }
    solveColumns(block, static_cast<int>(cols), roundUpToLane(X.rows()), pad(X, 0, end - 1), -X.outerStride());
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

namespace {

// Visits the columns from `begin` on, one lane of columns at a time.
template <typename Product>
void visitLower(Eigen::Index begin, const PaddedMap& H, const Product& product) {
  for (Eigen::Index j = begin, end; j < H.cols(); j = end) {
    end = std::min((j / kLane + 1) * kLane, H.cols());
    product(j / kLane * kLane, j, end - j);
  }
}

}  // namespace

void addLowerProduct(Eigen::Index begin, Eigen::Index depth, double sign, ConstPaddedMatrix A, ConstPaddedMatrix B,
                     PaddedMap H) {
  visitLower(begin, H, [&](Eigen::Index i, Eigen::Index j, Eigen::Index cols) {
    addProduct(H.rows() - i, cols, depth, sign, {A.data + i, A.stride}, {B.data + j, B.stride, 1}, pad(H, i, j));
  });
}

void setLowerProduct(Eigen::Index depth, ConstPaddedMatrix A, ConstPaddedMatrix B, PaddedMap H) {
  visitLower(0, H, [&](Eigen::Index i, Eigen::Index j, Eigen::Index cols) {
    setProduct(H.rows() - i, cols, depth, {A.data + i, A.stride}, {B.data + j, B.stride, 1}, pad(H, i, j));
  });
}

}  // namespace bielle
