#pragma once
/// \file Products and triangular solves of matrices of a few rows, where a general routine spends more on its own
/// administration than on arithmetic. Column-major; inner loops run down columns, so that the compiler vectorizes them.
#include "bielle/math/types.h"

namespace bielle {

/// out += s A B, with A (n x k), B (k x m), out (n x m); no aliasing.
template <typename A_, typename B_, typename C_>
inline void addSmallProduct(const A_& A, const B_& B, C_&& out, double s = 1) {
  const Eigen::Index n = A.rows(), inner = A.cols(), m = B.cols();
  for (Eigen::Index c = 0; c < m; ++c) {
    double* __restrict x = out.data() + c * out.outerStride();
    for (Eigen::Index k = 0; k < inner; ++k) {
      const double f = s * B.coeff(k, c);
      const double* __restrict a = A.data() + k * A.outerStride();
      for (Eigen::Index r = 0; r < n; ++r) x[r] += f * a[r];
    }
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
  const Eigen::Index n = factor.rows(), m = X.cols();
  for (Eigen::Index c = 0; c < m; ++c) {
    double* __restrict x = X.data() + c * X.outerStride();
    for (Eigen::Index k = 0; k < n; ++k) {
      const double* __restrict l = factor.data() + k * factor.outerStride();
      const double f = x[k] /= l[k];
      for (Eigen::Index r = k + 1; r < n; ++r) x[r] -= f * l[r];
    }
    for (Eigen::Index k = n - 1; k >= 0; --k) {
      const double* __restrict l = factor.data() + k * factor.outerStride();
      double sum = x[k];
      for (Eigen::Index r = k + 1; r < n; ++r) sum -= l[r] * x[r];
      x[k] = sum / l[k];
    }
  }
}

/// Solves A X = B in place by elimination with partial pivoting, A (n x n) is destroyed, X (n x m). False when A is singular.
bool solveSmall(MatrixRef A, MatrixRef X);

}  // namespace bielle
