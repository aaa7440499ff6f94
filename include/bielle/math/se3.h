#pragma once
/// \file Rigid placements, spatial cross products, the exponential of SE(3) with its Jacobians, and inertias.
///
/// Spatial vectors are linear first, then angular (see notation.h). For X = (R, p):
///     Ad(X) = [R, [p]x R; 0, R]     carries twists,    X_AB: frame B to frame A
///     Ad(X)^{-T} = [R, 0; [p]x R, R] carries wrenches.
#include <Eigen/Geometry>

#include "bielle/math/types.h"

namespace bielle {

/// [w x], 3x3.
template <typename V>
Matrix3<typename V::Scalar> skew(const Eigen::MatrixBase<V>& w_) {
  const Eigen::Ref<const Vector3<typename V::Scalar>> w(w_.derived());
  Matrix3<typename V::Scalar> S;
  S << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return S;
}

/// Linear and angular part of a spatial vector.
template <typename V>
auto linear(V&& x) {
  return x.template head<3>();
}
template <typename V>
auto angular(V&& x) {
  return x.template tail<3>();
}

/// Placement of a frame B in a frame A (X_AB).
template <typename T>
struct SE3Of {
  Matrix3<T> R;
  Vector3<T> p;  ///< m

  SE3Of() : R(Matrix3<T>::Identity()), p(Vector3<T>::Zero()) {}
  SE3Of(const Matrix3<T>& rotation, const Vector3<T>& position) : R(rotation), p(position) {}
  static SE3Of Identity() { return {}; }
  template <typename U>
  SE3Of operator*(const SE3Of<U>& o) const {
    SE3Of out(Unset{});
    out.R.noalias() = R * o.R;
    out.p.noalias() = R * o.p;
    out.p += p;
    return out;
  }
  SE3Of inverse() const { return inlineInverse(); }
  /// inverse() * o
  SE3Of inverseTimes(const SE3Of& o) const { return inlineInverseTimes(o); }
  Vector3<T> act(const Vector3<T>& point) const { return inlineAct(point); }
  Vector6<T> actMotion(const Vector6<T>& m) const { return inlineActMotion(m); }
  Vector6<T> actInvMotion(const Vector6<T>& m) const { return inlineActInvMotion(m); }
  Vector6<T> actForce(const Vector6<T>& f) const { return inlineActForce(f); }
  Vector6<T> actInvForce(const Vector6<T>& f) const { return inlineActInvForce(f); }
  /// Ad(X), 6x6.
  Matrix6<T> toActionMatrix() const { return inlineToActionMatrix(); }

 private:
  struct Unset {};
  explicit SE3Of(Unset) {}
  SE3Of inlineInverse() const { return {R.transpose(), -(R.transpose() * p)}; }
  SE3Of inlineInverseTimes(const SE3Of& o) const { return {R.transpose() * o.R, R.transpose() * (o.p - p)}; }
  Vector3<T> inlineAct(const Vector3<T>& point) const { return p + R * point; }

  Vector6<T> inlineActMotion(const Vector6<T>& m) const {
    Vector6<T> out;
    angular(out).noalias() = R * angular(m);
    linear(out).noalias() = R * linear(m);
    linear(out) += p.cross(angular(out));
    return out;
  }
  Vector6<T> inlineActInvMotion(const Vector6<T>& m) const {
    Vector6<T> out;
    linear(out).noalias() = R.transpose() * (linear(m) - p.cross(angular(m)));
    angular(out).noalias() = R.transpose() * angular(m);
    return out;
  }
  Vector6<T> inlineActForce(const Vector6<T>& f) const {
    Vector6<T> out;
    linear(out).noalias() = R * linear(f);
    angular(out).noalias() = R * angular(f);
    angular(out) += p.cross(linear(out));
    return out;
  }
  Vector6<T> inlineActInvForce(const Vector6<T>& f) const {
    Vector6<T> out;
    linear(out).noalias() = R.transpose() * linear(f);
    angular(out).noalias() = R.transpose() * (angular(f) - p.cross(linear(f)));
    return out;
  }
  Matrix6<T> inlineToActionMatrix() const {
    Matrix6<T> A;
    A.template topLeftCorner<3, 3>() = R;
    A.template bottomRightCorner<3, 3>() = R;
    A.template topRightCorner<3, 3>().noalias() = skew(p) * R;
    A.template bottomLeftCorner<3, 3>().setZero();
    return A;
  }
};
using SE3 = SE3Of<double>;

// For double these are compiled once: every file that calls them would take the compiler half a second longer.
template <>
SE3 SE3::inverse() const;
template <>
SE3 SE3::inverseTimes(const SE3& o) const;
template <>
Vector3d SE3::act(const Vector3d& point) const;
template <>
Vector6d SE3::actMotion(const Vector6d& m) const;
template <>
Vector6d SE3::actInvMotion(const Vector6d& m) const;
template <>
Vector6d SE3::actForce(const Vector6d& f) const;
template <>
Vector6d SE3::actInvForce(const Vector6d& f) const;
template <>
Matrix6d SE3::toActionMatrix() const;

/// [v x] m
template <typename A, typename B>
Vector6<typename A::Scalar> crossMotion(const Eigen::MatrixBase<A>& v_, const Eigen::MatrixBase<B>& m_) {
  const Eigen::Ref<const Vector6<typename A::Scalar>> v(v_.derived()), m(m_.derived());
  Vector6<typename A::Scalar> out;
  linear(out) = angular(v).cross(linear(m)) + linear(v).cross(angular(m));
  angular(out) = angular(v).cross(angular(m));
  return out;
}

/// [v x*] f
template <typename A, typename B>
Vector6<typename A::Scalar> crossForce(const Eigen::MatrixBase<A>& v_, const Eigen::MatrixBase<B>& f_) {
  const Eigen::Ref<const Vector6<typename A::Scalar>> v(v_.derived()), f(f_.derived());
  Vector6<typename A::Scalar> out;
  linear(out) = angular(v).cross(linear(f));
  angular(out) = angular(v).cross(angular(f)) + linear(v).cross(linear(f));
  return out;
}

/// [v x], 6x6.
Matrix6d makeCrossMotionMatrix(const Vector6d& v);

/// Exponential of a twist (m, rad).
SE3 exp6(const Vector6d& twist);
/// Logarithm; angular part in [0, pi].
template <typename T>
Vector6<T> log6(const SE3Of<T>& X);
/// Right Jacobian of exp6 (Barfoot and Furgale's Q block, from its closed form), 6x6.
Matrix6d calcRightJacobian6(const Vector6d& twist);
/// Its inverse, 6x6. Singular at an angle of 2 pi.
template <typename T>
Matrix6<T> calcRightJacobianInverse6(const Vector6<T>& twist);
/// Jacobian of log6 at X: log6(X exp6(d)) = log6(X) + J d + O(d^2), 6x6.
Matrix6d calcLogJacobian6(const SE3& X);

/// Mass, centre of mass and rotational inertia of a body, in the body's frame.
struct Inertia {
  double mass = 0;                    ///< kg
  Vector3d com = Vector3d::Zero();    ///< centre of mass, m
  Matrix3d I_com = Matrix3d::Zero();  ///< about the centre of mass, in the axes of the body frame, kg m^2

  /// The same inertia in frame A, this one being given in frame B.
  Inertia transformed(const SE3& X_AB) const;
  /// Sum of two inertias given in the same frame (parallel axis theorem).
  Inertia operator+(const Inertia& o) const;
  /// 6x6 spatial inertia about the frame's origin: momentum = matrix * twist.
  Matrix6d toMatrix() const;
};

}  // namespace bielle
