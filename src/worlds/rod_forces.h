#pragma once
/// \file Friction of rod ends (dynamics/rod_friction.h) under the forces of the same instant, for worlds that integrate
/// accelerations.
///
/// Friction changes the forces that it depends on, by about its radius over a rod's length: taken in turn, they
/// converge at that rate.
#include <vector>

#include "bielle/dynamics/workspace.h"
#include "dynamics/rod_friction.h"

namespace bielle::worlds {

class RodForces {
 public:
  /// \throws InputError as makeRodBearings() does
  RodForces(const Model& model, const std::vector<RodFriction>& frictions);

  bool empty() const { return bearings_.empty(); }
  /// Adds the friction under the present forces to tau (nv). Needs positions and velocities. \returns its power, W
  double add(const Workspace& ws, VectorXd& tau) const;
  /// The forces of least norm by which the closures make accelerations a (nv) of tau (nv). \returns by how much they
  /// have changed, N
  double update(const Workspace& ws, ConstVectorRef a, const VectorXd& tau);
  double largest() const { return sizes_.maxCoeff(); }  ///< N

 private:
  Model model_;
  std::vector<RodBearing> bearings_;
  Workspace own_;
  VectorXd sizes_;
};

}  // namespace bielle::worlds
