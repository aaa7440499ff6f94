#pragma once
/// \file Products and triangular solves of matrices of a few rows, where a general routine spends more on its own
/// administration than on arithmetic. Column-major; inner loops run down columns, so that the compiler vectorizes them.
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

/// out += sum over k of s b(k) A.col(k) for `Rows` rows from `row` on, in registers throughout.
template <int Rows, typename A_, typename B_>
inline void addSmallColumns(const A_& A, const B_& B, Eigen::Index column, Eigen::Index row, double s, double* out) {
  using Rows_ = Eigen::Array<double, Rows, 1>;
  Rows_ sum = Rows_::Zero();
  const double* a = A.data() + row;
  for (Eigen::Index k = 0; k < A.cols(); ++k, a += A.outerStride())
    sum += B.coeff(k, column) * Eigen::Map<const Rows_>(a);
  Eigen::Map<Rows_>(out + row) += s * sum;
}

/// out += s A B, with A (n x k), B (k x m), out (n x m); no aliasing.
template <typename A_, typename B_, typename C_>
inline void addSmallProduct(const A_& A, const B_& B, C_&& out, double s = 1) {
  const Eigen::Index n = A.rows(), m = B.cols();
  for (Eigen::Index c = 0; c < m; ++c) {
    double* x = out.data() + c * out.outerStride();
    Eigen::Index row = 0;
    for (; row + 8 <= n; row += 8) addSmallColumns<8>(A, B, c, row, s, x);
    if (row + 4 <= n) addSmallColumns<4>(A, B, c, row, s, x), row += 4;
    if (row + 2 <= n) addSmallColumns<2>(A, B, c, row, s, x), row += 2;
    if (row < n) addSmallColumns<1>(A, B, c, row, s, x);
  }
}

/// out += s A^T B, with A (k x n), B (k x m), out (n x m); no aliasing.
template <typename A_, typename B_, typename C_>
inline void addSmallProductTransposed(const A_& A, const B_& B, C_&& out, double s = 1) {
  const Eigen::Index n = A.cols(), inner = A.rows(), m = B.cols();
  for (Eigen::Index c = 0; c < m; ++c) {
    const double* __restrict b = B.data() + c * B.outerStride();
    for (Eigen::Index r = 0; r < n; ++r) {
      const double* __restrict a = A.data() + r * A.outerStride();
      double sum = 0;
      for (Eigen::Index k = 0; k < inner; ++k) sum += a[k] * b[k];
      out.coeffRef(r, c) += s * sum;
    }
  }
}

/// Solves L L^T X = B in place, L the lower triangle of `factor` (n x n), X (n x m).
template <typename L_, typename X_>
inline void solveSmallCholesky(const L_& factor, X_&& X) {
  const Eigen::Index n = factor.rows(), m = X.cols(), stride = X.outerStride();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double* __restrict l = factor.data() + k * factor.outerStride();
    const double inverse = 1 / l[k];
    double* __restrict x = X.data();
    for (Eigen::Index c = 0; c < m; ++c, x += stride) {
      const double f = x[k] *= inverse;
      for (Eigen::Index r = k + 1; r < n; ++r) x[r] -= f * l[r];
    }
  }
  for (Eigen::Index k = n - 1; k >= 0; --k) {
    const double* __restrict l = factor.data() + k * factor.outerStride();
    const double inverse = 1 / l[k];
    double* __restrict x = X.data();
    for (Eigen::Index c = 0; c < m; ++c, x += stride) {
      double sum = x[k];
      for (Eigen::Index r = k + 1; r < n; ++r) sum -= l[r] * x[r];
      x[k] = sum * inverse;
    }
  }
}

/// X L^{-T} in place, L the lower triangle of `factor` (n x n), X (m x n).
template <typename L_>
inline void solveTransposedFromRight(const L_& factor, MatrixRef X) {
  for (Eigen::Index k = 0; k < X.cols(); ++k) {
    addSmallProduct(X.leftCols(k), factor.row(k).head(k).transpose(), X.col(k), -1);
    X.col(k) *= 1 / factor(k, k);
  }
}

/// X L^{-1} in place, L the lower triangle of `factor` (n x n), X (m x n).
template <typename L_>
inline void solveFromRight(const L_& factor, MatrixRef X) {
  for (Eigen::Index k = X.cols() - 1; k >= 0; --k) {
    const Eigen::Index rest = X.cols() - 1 - k;
    addSmallProduct(X.rightCols(rest), factor.col(k).tail(rest), X.col(k), -1);
    X.col(k) *= 1 / factor(k, k);
  }
}

/// Factors of A (n x n) in place by elimination with partial pivoting; `pivots` (n) holds the row each was swapped with.
/// False when A is singular.
bool factorizeSmall(MatrixRef A, std::vector<int>& pivots);
/// Solves A X = B in place with the factors of A, X (n x m).
void solveFactorized(ConstMatrixRef factors, const std::vector<int>& pivots, MatrixRef X);

}  // namespace bielle
