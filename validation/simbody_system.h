#pragma once
// The Simbody objects behind a SimbodyBridge.
#include "engines/simbody_tree.h"
#include "simbody_bridge.h"

namespace bielle::validation {

struct SimbodyBridge::System : SimbodyTree {
  System(const Model& model, const std::vector<Closure>& closures) : SimbodyTree(model, closures) { finish(); }

  VectorXd tau;           // nv, at the state set last
  SimTK::Vector applied;  // the same in Simbody's coordinates

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
