#pragma once
/// \file A Model as a Simbody multibody system, and the maps between its coordinates and ours.
///
/// The tree becomes Simbody's own mobilizers, the closures its own constraints. Only the model's data and the conventions of
/// notation.h are Bielle's. Simbody has no rotor inertia: the armature is left out.
///
/// Signs: with the rows G of its constraints, Simbody's equations are M u' + G^T m = f. Its multipliers m, and what its
/// findConstraintForces(), getConstrainedBodyForcesAsVector() and calcConstraintForcesFromMultipliers() make of them, are thus
/// the opposite of the forces of constraints on bodies; its reactions of mobilizers and the tension of a Rod are not. All
/// forces of closures that leave validation/ have been turned into ours, J^T lambda on the right (notation.h); the worlds use
/// none.
///
/// | joint                | mobilizer | u of Simbody from our v                                                     |
/// |----------------------|-----------|-----------------------------------------------------------------------------|
/// | revolute, continuous | Pin       | u = v                                                                       |
/// | prismatic            | Slider    | u = v                                                                       |
/// | spherical            | Ball      | u = R w, angular velocity in the parent's frame F; R = R_FM                 |
/// | universal            | Universal | u = v; axes not perpendicular: two Pins about a massless body, u = v        |
/// | planar               | Planar    | u = (rate, R2 (v_x, v_y)), R2 the rotation by the joint's angle             |
/// | free-flyer           | Free      | u = (R w, R v_lin)                                                          |
///
/// 6D closure: Weld. 3D: Ball. 5D: Ball and two ConstantAngle constraints, the axis in body 2 normal to two directions
/// of body 1. Coupler: CoordinateCoupler of a linear function or a sum of polynomials. Distance: Rod. Slider: PointOnLine and
/// ConstantOrientation. All together u = T(q) v, in the order of our dofs.
///
/// The time of a step goes with the number of constraints. A weld that has a leaf on a spherical joint at one side closes the
/// same loop as a ball in place of that joint (model/ball_leaf.h): with LoopCut::FewestRows the leaf is
/// welded to the other body of the closure, for good, and its joint becomes the Ball. Its coordinates are then read from
/// the placements of its bodies, and what is scattered to them is dropped.
#include <Simbody.h>

#include "bielle/model/model.h"

namespace bielle {

// Copies between the types of Eigen and Simbody.
inline SimTK::Vec3 toSimTK(const Vector3d& v) { return {v[0], v[1], v[2]}; }
inline Vector3d toEigen(const SimTK::Vec3& v) { return {v[0], v[1], v[2]}; }
inline SimTK::Rotation toSimTKRotation(const Matrix3d& R) {
  SimTK::Mat33 m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m(i, j) = R(i, j);
  return SimTK::Rotation(m, true);  // already orthogonal, not normalized
}
inline Matrix3d toEigen(const SimTK::Mat33& m) {
  Matrix3d R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R(i, j) = m(i, j);
  return R;
}
inline SimTK::Transform toSimTK(const SE3& X) { return {toSimTKRotation(X.R), toSimTK(X.p)}; }

enum class LoopCut { AsModelled, FewestRows };

/// Where Simbody has coordinate k of v of a joint among the u of its mobilizer.
inline int getSimbodySpeed(const Joint& joint, int k) {
  if (joint.kind == JointKind::FreeFlyer) return (k + 3) % 6;  // angular first
  if (joint.kind == JointKind::Planar) return (k + 1) % 3;     // the angle first
  return k;
}

struct SimbodyTree {
  /// Bodies, constraints, gravity, joint forces and point springs (TwoPointLinearSpring, TwoPointLinearDamper). Other forces,
  /// bodies and constraints may be added until finish().
  /// \param closures  of the model, and any others such as contacts
  SimbodyTree(const Model& model, const std::vector<Closure>& closures, LoopCut cut = LoopCut::AsModelled);
  SimbodyTree(const SimbodyTree&) = delete;
  SimbodyTree& operator=(const SimbodyTree&) = delete;
  /// Makes the state.
  void finish();

  const Model model;
  const std::vector<Closure> closures;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::GeneralForceSubsystem forces;
  SimTK::Force::DiscreteForces torques;
  std::vector<SimTK::MobilizedBody> bodies;      ///< per body of the model, ground first
  std::vector<SimTK::MobilizedBody> first_pins;  ///< of universal joints made of two Pins, else empty handles
  std::vector<std::vector<SimTK::Constraint>> constraints;  ///< per closure
  std::vector<int> cut_joints;                              ///< per closure, the joint that became a Ball, or -1
  std::vector<int> u_index;  ///< per dof, index into Simbody's u; -1: of a joint that became a Ball
  SimTK::State state;

  // At the state set last: u = T v.
  VectorXd v;       ///< nv
  MatrixXd T;       ///< nv x nv
  VectorXd Tdot_v;  ///< nv, (dT/dt) v

  /// Sets the coordinates of the state.
  void setCoordinates(ConstVectorRef q);
  /// Sets v, T and Tdot_v.
  void updateVelocityMap(ConstVectorRef q, ConstVectorRef v);
  /// q and v of a state of the system, in our coordinates; also those of T. It must have been realized to
  /// Stage::Velocity if joints became Balls.
  void readState(const SimTK::State& from, VectorXd& q, VectorXd& v);
  /// Between our order of dofs and Simbody's u; scatter() leaves those of other bodies alone.
  void scatter(const VectorXd& ours, SimTK::Vector& u) const;
  VectorXd gather(const SimTK::Vector& u) const;

 private:
  bool isCut(int joint) const;
  void addBody(int i);
  void addClosure(const Closure& closure);
  void addCoupler(const Closure& closure);
  void addJointForce(const JointForce& force);
  void addPointSpring(const PointSpring& spring);
  void addCutLoop(const Closure& closure, int joint);
  SimTK::Rotation calcJointRotation(const SimTK::State& from, int joint) const;
};

}  // namespace bielle
