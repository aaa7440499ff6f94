#pragma once
// Accelerations and constraint forces from mass matrix and Jacobian, in one precision or the other. Apart from Simbody's headers,
// which with it would be too much for the memory of small machines.
#include "math/decompositions.h"

namespace bielle::validation {

/// M a + J^T m = force, J a = target, for any number of columns.
///
/// With unit diagonal of D M D and rows E J D of unit length (links of a few milligrams beside others of kilograms are
/// usual): a = D z, m = E y. By the null space N of E J D, z = z_J + N w with E J D z_J = E target; N^T then leaves
///     N^T D M D N w = N^T D (force - M D z_J),    (E J D)^T y = D (force - M D z).
template <typename Real>
class SaddleSolver {
 public:
  SaddleSolver(const MatrixXd& M, const MatrixXd& J);
  void solve(const MatrixXd& force, const MatrixXd& target, MatrixXd& a, MatrixXd& multipliers) const;

 private:
  using MatrixXr = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using VectorXr = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  VectorXd D_;
  VectorXr E_;
  MatrixXr DMD_, N_;
  Eigen::CompleteOrthogonalDecomposition<MatrixXr> rows_, columns_;
  Eigen::LDLT<MatrixXr> within_;  // N^T D M D N
};

extern template class SaddleSolver<double>;
extern template class SaddleSolver<long double>;

}  // namespace bielle::validation
