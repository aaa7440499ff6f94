#pragma once
/// \file The feet of a closed robot in the coordinates of its sensors: trunk and motors.
///
/// With the tangent T (nv x r) of the trunk's and the motors' speeds (passive_joints.h), the closed robot obeys
///     T^T (M a + b) = T^T B u + sum_i (J_i T)^T f_i                                                                 (1)
/// with f_i the wrench of the ground on foot i. Where the acceleration a is taken from a filter, the f_i that fit best are
///     argmin |D (T^T (M a + b - B u) - A^T f)|^2 + e |f|^2,   A_i = J_i T                                           (2)
/// with D = diag(w, w/L) for forces and moments on the trunk, diag(1, 1/L) for those of motors, moments in f over L too,
/// L = 0.2 m, w = 0.1. The trunk's six rows weigh all feet together, the rows of its motors each leg. What pushes the trunk is
/// in its rows alone and no force of the ground: where the motors tell f, they decide (w = 1 took 100 N on the trunk for 60 N
/// on a foot in the air). J_i of an edge has no rotation about it: an edge bears no moment there, and rolls freely.
///
/// Standing feet are at rest. With A = (A_b, A_m) of trunk and motors, the speeds w of the motors that agree with that, given
/// the twist V of the trunk, and are nearest to observed ones are
///     w - A_m^T (A_m A_m^T + e)^-1 (A_b V + A_m w)                                                                  (3)
/// Encoders know speeds late, the trunk's twist is known at once: without (3) the two would make standing feet seem to move.
/// A foot that seems to move by more than 0.25 m/s (its rotation times L included), which is more than they are late by, does
/// move: it rolls over an edge, or slips.
#include <vector>

#include "bielle/dynamics/workspace.h"
#include "control/passive_joints.h"
#include "math/decompositions.h"

namespace bielle {

/// No function allocates but the constructor.
class FootModel {
 public:
  explicit FootModel(const Model& model);

  /// \param joints  at q   \param q, v, a  nq, nv, nv   \param u  torques of the motors (nu)
  void update(const PassiveJoints& joints, ConstVectorRef q, ConstVectorRef v, ConstVectorRef a, ConstVectorRef u);
  /// Eq. (3) at the q of the last update(). \param standing  per contact   \param twist  of the trunk (6, or 0 on a fixed base)
  void calmFeet(const std::vector<char>& standing, ConstVectorRef twist, VectorRef speeds);
  /// Wrench of the ground on a foot in its contact frame, N and N m; of points without a moment, of edges without one about x.
  const Vector6d& getWrench(size_t contact) const { return wrenches_[contact]; }
  /// Placements of bodies at q.
  const Workspace& workspace() const { return ws_; }

 private:
  void updateRows(const PassiveJoints& joints, size_t contact);

  Model model_;
  const int trunk_;  // rows of the free-flyer: 6 or 0
  Workspace ws_;
  std::vector<int> offsets_;  // of the rows of contacts
  MatrixXd standing_;         // the rows A of standing feet, those of others zero
  VectorXd scales_, motion_;  // trunk and motors
  MatrixXd A_, normal_;       // rows of the contacts x (trunk and motors); square
  VectorXd residual_, f_;     // trunk and motors; rows of the contacts
  Eigen::LLT<MatrixXd> factors_;
  std::vector<Vector6d> wrenches_;
};

}  // namespace bielle
