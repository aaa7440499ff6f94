#include "bielle/math/small_dense.h"

#include <cmath>
#include <utility>

namespace bielle {

// A = P^T L U with unit upper triangular U.
bool factorizeSmall(MatrixRef A, std::vector<int>& pivots) {
  const Eigen::Index n = A.rows();
  for (Eigen::Index p = 0; p < n; ++p) {
    Eigen::Index best = p;
    for (Eigen::Index r = p + 1; r < n; ++r)
      if (std::abs(A(r, p)) > std::abs(A(best, p))) best = r;
    if (!(std::abs(A(best, p)) > 0)) return false;
    pivots[p] = static_cast<int>(best);
    if (best != p) A.row(p).swap(A.row(best));
    const double* __restrict pivot = &A(0, p);
    const double inverse = 1 / pivot[p];
    for (Eigen::Index c = p + 1; c < n; ++c) {
      double* __restrict x = &A(0, c);
      const double f = x[p] *= inverse;
      for (Eigen::Index r = p + 1; r < n; ++r) x[r] -= f * pivot[r];
    }
  }
  return true;
}

void solveFactorized(ConstMatrixRef factors, const std::vector<int>& pivots, MatrixRef X) {
  const Eigen::Index n = factors.rows(), m = X.cols();
  for (Eigen::Index p = 0; p < n; ++p)  // all of them first: rows of L were swapped as a whole
    if (pivots[p] != p) X.row(p).swap(X.row(pivots[p]));
  for (Eigen::Index p = 0; p < n; ++p) {
    const double* __restrict column = factors.data() + p * factors.outerStride();
    const double inverse = 1 / column[p];
    for (Eigen::Index c = 0; c < m; ++c) {
      double* __restrict x = &X(0, c);
      const double f = x[p] *= inverse;
      for (Eigen::Index r = p + 1; r < n; ++r) x[r] -= f * column[r];
    }
  }
  for (Eigen::Index p = n - 1; p > 0; --p) {
    const double* __restrict column = factors.data() + p * factors.outerStride();
    for (Eigen::Index c = 0; c < m; ++c) {
      double* __restrict x = &X(0, c);
      for (Eigen::Index r = 0; r < p; ++r) x[r] -= x[p] * column[r];
    }
  }
}

}  // namespace bielle
