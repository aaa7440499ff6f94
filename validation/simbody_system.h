#pragma once
// The Simbody objects behind a SimbodyBridge.
#include <optional>

#include "saddle_solver.h"
#include "simbody_bridge.h"
#include "worlds/simbody_tree.h"

namespace bielle::validation {

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
