#pragma once
/// \file Products and triangular solves of matrices of a few rows, where a general routine spends more time on overhead
/// than on arithmetic. Column-major; inner loops run down columns, so that the compiler vectorizes them.
#include <type_traits>
#include <vector>

#include "bielle/math/types.h"
#include "math/lanes.h"

namespace bielle {

/// sum += s x, `Rows` numbers each. For lanes it avoids an Eigen expression, which would store the factor at every step.
template <int Rows, typename T>
inline void addScaled(const T& s, const T* x, T* sum) {
  if constexpr (std::is_same_v<T, double>) {
    using Rows_ = Eigen::Array<T, Rows, 1>;
    Eigen::Map<Rows_>(sum) += s * Eigen::Map<const Rows_>(x);
  } else {
    for (int i = 0; i < Rows; ++i) sum[i] += s * x[i];
  }
}

/// out += sum over k of s b(k) A.col(k) for `Rows` rows from `row` on, in registers throughout.
template <int Rows, typename A_, typename B_>
inline void addSmallColumns(const A_& A, const B_& B, Eigen::Index column, Eigen::Index row, double s,
                            typename A_::Scalar* out) {
  using Rows_ = Eigen::Array<typename A_::Scalar, Rows, 1>;
  Rows_ sum = Rows_::Zero();
  const auto* a = A.data() + row;
  for (Eigen::Index k = 0; k < A.cols(); ++k, a += A.outerStride())
    addScaled<Rows, typename A_::Scalar>(B.coeff(k, column), a, sum.data());
  Eigen::Map<Rows_>(out + row) += s * sum;
}

/// out += s A B, with A (n x k), B (k x m), out (n x m); no aliasing.
template <typename A_, typename B_, typename C_>
inline void addSmallProduct(const A_& A, const B_& B, C_&& out, double s = 1) {
  const Eigen::Index n = A.rows(), m = B.cols();
  for (Eigen::Index c = 0; c < m; ++c) {
    auto* x = out.data() + c * out.outerStride();
    Eigen::Index row = 0;
    for (; row + 8 <= n; row += 8) addSmallColumns<8>(A, B, c, row, s, x);
    if (row + 4 <= n) addSmallColumns<4>(A, B, c, row, s, x), row += 4;
    if (row + 2 <= n) addSmallColumns<2>(A, B, c, row, s, x), row += 2;
    if (row < n) addSmallColumns<1>(A, B, c, row, s, x);
  }
}

/// Entries (r .. r + Rows, c .. c + Cols) of out += s A^T B: independent sums.
template <int Rows, int Cols, typename A_, typename B_, typename C_>
inline void addSmallDots(const A_& A, const B_& B, Eigen::Index r, Eigen::Index c, double s, C_& out) {
  typename A_::Scalar sums[Cols][Rows] = {};
  const auto *a = A.data() + r * A.outerStride(), *b = B.data() + c * B.outerStride();
  for (Eigen::Index k = 0; k < A.rows(); ++k)
    for (int j = 0; j < Cols; ++j)
      for (int i = 0; i < Rows; ++i) sums[j][i] += a[i * A.outerStride() + k] * b[j * B.outerStride() + k];
  for (int j = 0; j < Cols; ++j)
    for (int i = 0; i < Rows; ++i) out.coeffRef(r + i, c + j) += s * sums[j][i];
}

/// out += s A^T B, with A (k x n), B (k x m), out (n x m); no aliasing.
template <typename A_, typename B_, typename C_>
inline void addSmallProductTransposed(const A_& A, const B_& B, C_&& out, double s = 1) {
  const Eigen::Index n = A.cols(), m = B.cols();
  Eigen::Index c = 0;
  const auto addColumns = [&](auto cols) {
    Eigen::Index r = 0;
    for (; r + 4 <= n; r += 4) addSmallDots<4, cols>(A, B, r, c, s, out);
    for (; r + 2 <= n; r += 2) addSmallDots<2, cols>(A, B, r, c, s, out);
    if (r < n) addSmallDots<1, cols>(A, B, r, c, s, out);
    c += cols;
  };
  while (c + 2 <= m) addColumns(std::integral_constant<int, 2>());
  if (c < m) addColumns(std::integral_constant<int, 1>());
}

/// Solves L L^T x = b in place for N known at compile time; unrolled, so that columns overlap.
template <int N, typename T>
inline void solveSmallCholeskyColumn(const T* __restrict l, Eigen::Index stride, T* __restrict out) {
  T x[N];
#pragma GCC unroll 12
  for (int k = 0; k < N; ++k) x[k] = out[k];
#pragma GCC unroll 12
  for (int k = 0; k < N; ++k) {
    x[k] *= 1 / l[k * stride + k];
#pragma GCC unroll 12
    for (int r = k + 1; r < N; ++r) x[r] -= x[k] * l[k * stride + r];
  }
#pragma GCC unroll 12
  for (int k = N - 1; k >= 0; --k) {
    T sum = 0, other = 0;
#pragma GCC unroll 12
    for (int r = N - 1; r > k; --r) ((r - k) % 2 ? sum : other) += l[k * stride + r] * x[r];
    x[k] = (x[k] - (other + sum)) * (1 / l[k * stride + k]);
  }
#pragma GCC unroll 12
  for (int k = 0; k < N; ++k) out[k] = x[k];
}

/// Solves L L^T X = B in place, L the lower triangle of `factor` (n x n), X (n x m).
template <typename L_, typename X_>
inline void solveSmallCholesky(const L_& factor, X_&& X) {
  const Eigen::Index n = factor.rows(), stride = factor.outerStride();
  const auto* l = factor.data();
  for (Eigen::Index c = 0; c < X.cols(); ++c) {
    auto* __restrict x = X.data() + c * X.outerStride();
    // One or two Weld6D closures, the most common blocks.
    if (n == 6) {
      solveSmallCholeskyColumn<6>(l, stride, x);
      continue;
    }
    if (n == 12) {
      solveSmallCholeskyColumn<12>(l, stride, x);
      continue;
    }
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto f = x[k] *= 1 / l[k * stride + k];
      for (Eigen::Index r = k + 1; r < n; ++r) x[r] -= f * l[k * stride + r];
    }
    for (Eigen::Index k = n - 1; k >= 0; --k) {
      const auto f = x[k] *= 1 / l[k * stride + k];
      for (Eigen::Index r = 0; r < k; ++r) x[r] -= f * l[r * stride + k];
    }
  }
}

/// Factors of A (n x n) in place by elimination with partial pivoting; `pivots` (n) holds the row each was swapped
/// with. False if A is singular. Matrices of double or of Lanes.
template <typename Matrix>
typename LogicOf<typename Matrix::Scalar>::Mask factorizeSmall(
    Matrix& A, std::vector<typename LogicOf<typename Matrix::Scalar>::Index>& pivots);
/// Solves A X = B in place with the factors of A, X (n x m).
template <typename Matrix>
void solveFactorized(const Matrix& factors, const std::vector<typename LogicOf<typename Matrix::Scalar>::Index>& pivots,
                     typename ArgumentsOf<typename Matrix::Scalar>::Matrix X);

}  // namespace bielle
