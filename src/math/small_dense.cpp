#include "bielle/math/small_dense.h"

#include <cmath>

namespace bielle {

bool solveSmall(MatrixRef A, MatrixRef X) {
  const Eigen::Index n = A.rows(), m = X.cols();
  const auto eliminate = [n](double* __restrict x, const double* __restrict pivot, Eigen::Index p) {
    const double f = x[p] /= pivot[p];
    for (Eigen::Index r = p + 1; r < n; ++r) x[r] -= f * pivot[r];
  };
  for (Eigen::Index p = 0; p < n; ++p) {
    Eigen::Index best = p;
    for (Eigen::Index r = p + 1; r < n; ++r)
      if (std::abs(A(r, p)) > std::abs(A(best, p))) best = r;
    if (!(std::abs(A(best, p)) > 0)) return false;
    if (best != p) {
      A.row(p).swap(A.row(best));
      X.row(p).swap(X.row(best));
    }
    for (Eigen::Index c = p + 1; c < n; ++c) eliminate(&A(0, c), &A(0, p), p);
    for (Eigen::Index c = 0; c < m; ++c) eliminate(&X(0, c), &A(0, p), p);
  }
  // What is left is unit upper triangular.
  for (Eigen::Index c = 0; c < m; ++c) {
    double* x = &X(0, c);
    for (Eigen::Index p = n - 1; p > 0; --p) {
      const double* column = &A(0, p);
      for (Eigen::Index r = 0; r < p; ++r) x[r] -= x[p] * column[r];
    }
  }
  return true;
}

}  // namespace bielle
