#pragma once
/// \file Rigid placements, spatial cross products, and the exponential of SE(3) with its Jacobians.
///
/// Spatial vectors are linear first, then angular (see notation.h). For X = (R, p):
///     Ad(X) = [R, [p]x R; 0, R]     carries twists,    X_AB: frame B to frame A
///     Ad(X)^{-T} = [R, 0; [p]x R, R] carries wrenches.
#include "bielle/math/so3.h"

namespace bielle {

/// Placement of a frame B in a frame A (X_AB).
struct SE3 {
  Matrix3d R = Matrix3d::Identity();
  Vector3d p = Vector3d::Zero();  ///< m

  static SE3 Identity() { return {}; }
  SE3 operator*(const SE3& o) const { return {R * o.R, p + R * o.p}; }
  SE3 inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
  /// inverse() * o
  SE3 inverseTimes(const SE3& o) const { return {R.transpose() * o.R, R.transpose() * (o.p - p)}; }
  Vector3d act(const Vector3d& point) const { return p + R * point; }

  Vector6d actMotion(const Vector6d& m) const {
    Vector6d out;
    out.tail<3>().noalias() = R * m.tail<3>();
    out.head<3>().noalias() = R * m.head<3>();
    out.head<3>() += p.cross(out.tail<3>());
    return out;
  }
  Vector6d actInvMotion(const Vector6d& m) const {
    Vector6d out;
    out.head<3>().noalias() = R.transpose() * (m.head<3>() - p.cross(m.tail<3>()));
    out.tail<3>().noalias() = R.transpose() * m.tail<3>();
    return out;
  }
  Vector6d actForce(const Vector6d& f) const {
    Vector6d out;
    out.head<3>().noalias() = R * f.head<3>();
    out.tail<3>().noalias() = R * f.tail<3>();
    out.tail<3>() += p.cross(out.head<3>());
    return out;
  }
  Vector6d actInvForce(const Vector6d& f) const {
    Vector6d out;
    out.head<3>().noalias() = R.transpose() * f.head<3>();
    out.tail<3>().noalias() = R.transpose() * (f.tail<3>() - p.cross(f.head<3>()));
    return out;
  }
  /// Ad(X), 6x6.
  Matrix6d toActionMatrix() const {
    Matrix6d A;
    A.topLeftCorner<3, 3>() = R;
    A.bottomRightCorner<3, 3>() = R;
    A.topRightCorner<3, 3>().noalias() = skew(p) * R;
    A.bottomLeftCorner<3, 3>().setZero();
    return A;
  }
};

/// [v x] m
inline Vector6d crossMotion(const Vector6d& v, const Vector6d& m) {
  Vector6d out;
  out.head<3>() = v.tail<3>().cross(m.head<3>()) + v.head<3>().cross(m.tail<3>());
  out.tail<3>() = v.tail<3>().cross(m.tail<3>());
  return out;
}

/// [v x*] f
inline Vector6d crossForce(const Vector6d& v, const Vector6d& f) {
  Vector6d out;
  out.head<3>() = v.tail<3>().cross(f.head<3>());
  out.tail<3>() = v.tail<3>().cross(f.tail<3>()) + v.head<3>().cross(f.head<3>());
  return out;
}

/// [v x], 6x6.
Matrix6d makeCrossMotionMatrix(const Vector6d& v);

/// Exponential of a twist (m, rad).
SE3 exp6(const Vector6d& twist);
/// Logarithm; angular part in [0, pi].
Vector6d log6(const SE3& X);
/// Right Jacobian of exp6 (Barfoot and Furgale's Q block, from its closed form), 6x6.
Matrix6d calcRightJacobian6(const Vector6d& twist);
/// Jacobian of log6 at X: log6(X exp6(d)) = log6(X) + J d + O(d^2), 6x6.
Matrix6d calcLogJacobian6(const SE3& X);

}  // namespace bielle
