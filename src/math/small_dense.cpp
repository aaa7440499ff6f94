#include "math/small_dense.h"

#include <cmath>
#include <utility>

namespace bielle {
namespace {

// Swaps entries p and `other` of a column.
template <typename T, typename Index>
void swapEntries(T* x, int p, const Index& other) {
  const T value = getEntry(x, other);
  setEntry(x, other, x[p]);
  x[p] = value;
}

}  // namespace

// A = P^T L U with unit upper triangular U.
template <typename Matrix>
typename LogicOf<typename Matrix::Scalar>::Mask factorizeSmall(
    Matrix& A, std::vector<typename LogicOf<typename Matrix::Scalar>::Index>& pivots) {
  using T = typename Matrix::Scalar;
  using std::abs;
  const int n = static_cast<int>(A.rows());
  auto regular = T(0) <= T(0);
  for (int p = 0; p < n; ++p) {
    const auto here = makeIndex<T>(p);
    auto best = here;
    T largest = abs(A(p, p));
    for (int r = p + 1; r < n; ++r) {
      const T size = abs(A(r, p));
      const auto larger = size > largest;
      largest = select(larger, size, largest);
      best = select(larger, r, best);
    }
    regular = regular && largest > T(0);
    if (!any(regular)) return regular;
    pivots[p] = best;
    if (best != here)
      for (int c = 0; c < n; ++c) swapEntries(&A(0, c), p, best);
    const T* __restrict pivot = &A(0, p);
    const T inverse = 1 / pivot[p];
    for (int c = p + 1; c < n; ++c) {
      T* __restrict x = &A(0, c);
      const T f = x[p] *= inverse;
      for (int r = p + 1; r < n; ++r) x[r] -= f * pivot[r];
    }
  }
  return regular;
}

template <typename Matrix>
void solveFactorized(const Matrix& factors, const std::vector<typename LogicOf<typename Matrix::Scalar>::Index>& pivots,
                     typename ArgumentsOf<typename Matrix::Scalar>::Matrix X) {
  using T = typename Matrix::Scalar;
  const int n = static_cast<int>(factors.rows());
  const Eigen::Index m = X.cols();
  for (int p = 0; p < n; ++p)  // all swaps first: whole rows of L were swapped
    if (pivots[p] != makeIndex<T>(p))
      for (Eigen::Index c = 0; c < m; ++c) swapEntries(&X(0, c), p, pivots[p]);
  for (int p = 0; p < n; ++p) {
    const T* __restrict column = factors.data() + p * factors.outerStride();
    const T inverse = 1 / column[p];
    for (Eigen::Index c = 0; c < m; ++c) {
      T* __restrict x = &X(0, c);
      const T f = x[p] *= inverse;
      for (int r = p + 1; r < n; ++r) x[r] -= f * column[r];
    }
  }
  for (int p = n - 1; p > 0; --p) {
    const T* __restrict column = factors.data() + p * factors.outerStride();
    for (Eigen::Index c = 0; c < m; ++c) {
      T* __restrict x = &X(0, c);
      for (int r = 0; r < p; ++r) x[r] -= x[p] * column[r];
    }
  }
}

template bool factorizeSmall(MatrixXd&, std::vector<int>&);
template LaneMask factorizeSmall(MatrixX<Lanes>&, std::vector<LogicOf<Lanes>::Index>&);
template void solveFactorized(const MatrixXd&, const std::vector<int>&, MatrixRef);
template void solveFactorized(const MatrixX<Lanes>&, const std::vector<LogicOf<Lanes>::Index>&,
                              ArgumentsOf<Lanes>::Matrix);

}  // namespace bielle
