#pragma once
/// \file Friction of rod ends (dynamics/rod_friction.h) under the forces of the same instant, for worlds that integrate
/// accelerations.
///
/// Friction changes the forces that it depends on, by about its radius over a rod's length: taken in turn, they
/// converge at that rate.
#include <utility>
#include <vector>

#include "bielle/dynamics/workspace.h"
#include "dynamics/rod_friction.h"
#include "math/decompositions.h"

namespace bielle::worlds {

class RodForces {
 public:
  /// \throws InputError as makeRodBearings() does
  RodForces(const Model& model, const std::vector<RodFriction>& frictions);

  bool empty() const { return bearings_.empty(); }
  /// Goes to the positions and velocities of a workspace, before everything else.
  void move(const Workspace& ws);
  /// Adds the friction under the present forces to tau (nv). \returns its power, W. No allocation.
  double add(VectorXd& tau) const;
  /// The forces of least norm by which the closures make accelerations a (nv) of tau (nv). \returns by how much they
  /// have changed, N
  double update(ConstVectorRef a, const VectorXd& tau);
  double largest() const { return sizes_.maxCoeff(); }  ///< N

 private:
  // The loops of one cluster that hold bearings.
  struct Loops {
    std::vector<int> dofs;
    std::vector<std::pair<int, int>> closures;                 // of the model, with their first rows
    std::vector<std::pair<Eigen::Index, int>> bearings;        // with the first rows of their closures
    MatrixXd J, transposed;                                    // rows x nv; dofs x rows
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;  // of the latter
    VectorXd load, lambda;
  };

  Model model_;
  std::vector<RodBearing> bearings_;
  std::vector<Loops> loops_;
  Workspace ws_;
  VectorXd sizes_, before_;
};

}  // namespace bielle::worlds
