#pragma once
/// \file The smallest residuals that loops can have, and the least change of one place that closes them: Eqs. (1) and
/// (3) of loop_conflict.h.
///
/// Both are nonlinear least squares, min |R(z)|^2 / 2, by Newton's method
///     (R_z^T R_z + sum_i R_i d^2 R_i) dz = -R_z^T R                                                                (1)
/// whose second term is found by differences of R_z^T R at fixed R. Eigenvalues are taken absolute, so that every step
/// descends, and where the gradient vanishes at a saddle, the step goes along its most negative one. For the least change,
/// with multipliers y and a penalty rho,
///     R = (p, sqrt(rho) (r + y / rho)),    y <- y + rho r                                                          (2)
#include "bielle/dynamics/variation.h"
#include "dynamics/loop_conflict.h"

namespace bielle {

/// Freedoms that a place is given.
enum class Change { None, Translation, Rotation, Offset };

/// Configuration and change of the place.
struct LoopPoint {
  VectorXd q;
  SE3 change;
  double offset = 0;
};

/// A model with some closures of `model` alone, and nothing that has no part in closing them.
Model selectClosures(const Model& model, const std::vector<int>& closures);

/// The closures of a model (not none) as functions of their dofs and of one place of it.
class LoopProblem {
 public:
  /// \param length  L of loop_conflict.h, m
  /// \param model   with no other closures; it is copied
  LoopProblem(const Model& model, double length, Change change = Change::None, const ModelPlace& place = {});

  /// Goes to the nearest minimum of |r|.
  void minimise(LoopPoint& z);
  /// Eq. (3) of loop_conflict.h; false when this place cannot close the loops.
  bool findLeastChange(LoopPoint& z);

  /// r, in m.
  VectorXd calcResidual(const LoopPoint& z);
  /// Derivative of r with respect to dofs, then to the change (m).
  MatrixXd calcJacobian(const LoopPoint& z);
  /// Step along the columns of calcJacobian().
  LoopPoint move(const LoopPoint& z, const VectorXd& step) const;
  /// p, in m.
  VectorXd calcChange(const LoopPoint& z) const;

 private:
  struct Squares {
    VectorXd R;
    MatrixXd R_z;
  };
  int size() const { return static_cast<int>(dofs_.size()) + directions(); }
  int directions() const { return static_cast<int>(variations_.size()); }
  Squares calcSquares(const LoopPoint& z);
  double calcObjective(const LoopPoint& z);
  MatrixXd calcCurvature(const LoopPoint& z, const Squares& squares);
  bool search(LoopPoint& z, const VectorXd& step, double slope);
  void update(const LoopPoint& z);

  Model model_, changed_;
  ConstraintSet set_;
  Workspace ws_;
  VariationWorkspace variation_;
  MotionVariation still_;
  double length_;
  Change change_;
  ModelPlace place_;
  double unit_;  // m per m, rad or unit of the offset of a coupler
  std::vector<int> dofs_;
  VectorXd scale_;  // rows of the set, m per m or rad
  std::vector<ModelVariation> variations_;
  SE3 made_change_;  // of changed_
  double made_offset_ = 0;
  double rho_ = 0;  // 0: Eq. (1) without p
  VectorXd y_;
};

/// L of loop_conflict.h: the mean distance of joints and ends of closures in the loops from the joints that carry them.
double calcTypicalLength(const Model& model, const std::vector<int>& closures);

}  // namespace bielle
