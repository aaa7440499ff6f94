#pragma once
// The Simbody objects behind a SimbodyBridge.
#include <optional>

#include "math/decompositions.h"
#include "simbody_bridge.h"
#include "worlds/simbody_tree.h"

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

struct SimbodyBridge::System : SimbodyTree {
  System(const Model& model, const std::vector<Closure>& closures) : SimbodyTree(model, closures) { finish(); }

  VectorXd tau;           // nv, at the state set last
  SimTK::Vector applied;  // the same in Simbody's coordinates
  // What depends on the coordinates alone, made when it is first asked for: a midpoint is looked at with several velocities,
  // derivatives are differences over velocities and torques.
  VectorXd q;
  struct {
    std::optional<MatrixXd> M, J;
    std::optional<SaddleSolver<double>> saddle;
    std::optional<SaddleSolver<long double>> extended_saddle;
  } at_q;
  void setPlace(const VectorXd& place);

  // Forces of springs, dampers and friction on Simbody's mobilities.
  SimTK::Vector calcPassiveForces() const;

  // Accelerations (or velocities), with the constraint forces (or impulses) of their multipliers.
  OracleSolution makeSolution(const VectorXd& a, const VectorXd& multipliers) const;
  // Constraint forces of Simbody's multipliers.
  void readForces(const SimTK::Vector& multipliers, OracleSolution& out) const;
  // OracleSolution::rounding of Simbody's solver.
  double calcRounding() const;
};

}  // namespace bielle::validation
