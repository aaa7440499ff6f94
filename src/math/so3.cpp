#include "math/so3.h"

#include <cmath>

#include "math/small_angle.h"

namespace bielle {
namespace {

// Coefficients of the exponential and its Jacobian: sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3.
template <typename T>
std::array<T, 3> calcAngleSeries(const T& t2) {
  return {1 - t2 / 6 * (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72))),
          0.5 * (1 - t2 / 12 * (1 - t2 / 30 * (1 - t2 / 56 * (1 - t2 / 90)))),
          1.0 / 6 * (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110))))};
}

std::array<double, 3> calcAngleFunctions(double t2) {
  if (t2 < kSmallAngleSquared) return calcAngleSeries(t2);
  const double t = std::sqrt(t2);
  const double half = std::sin(0.5 * t);
  return {std::sin(t) / t, 2 * half * half / t2, (t - std::sin(t)) / (t2 * t)};
}
std::array<Lanes, 3> calcAngleFunctions(const Lanes& t2) {
  return replaceLarge(t2, calcAngleSeries(t2), [](double one) { return calcAngleFunctions(one); });
}

template <typename T>
T calcInverseSeries(const T& t2) {
  return 1.0 / 12 + t2 * (1.0 / 720 + t2 * (1.0 / 30240 + t2 * (1.0 / 1209600 + t2 / 47900160)));
}

// sin(t/2) / t and cos(t/2).
template <typename T>
std::array<T, 2> calcHalfAngleSeries(const T& t2) {
  const T u = 0.25 * t2;
  return {0.5 * (1 - u / 6 * (1 - u / 20 * (1 - u / 42 * (1 - u / 72)))),
          1 - u / 2 * (1 - u / 12 * (1 - u / 30 * (1 - u / 56 * (1 - u / 90))))};
}
std::array<double, 2> calcHalfAngle(double t2) {
  if (t2 < kSmallAngleSquared) return calcHalfAngleSeries(t2);
  const double t = std::sqrt(t2);
  return {std::sin(0.5 * t) / t, std::cos(0.5 * t)};
}
std::array<Lanes, 2> calcHalfAngle(const Lanes& t2) {
  return replaceLarge(t2, calcHalfAngleSeries(t2), [](double one) { return calcHalfAngle(one); });
}

// 1 + a [w x] + b [w x]^2
template <typename T>
Matrix3<T> makeFromSkew(const Vector3<T>& w, const T& a, const T& b) {
  const Matrix3<T> S = skew(w);
  return Matrix3<T>::Identity() + a * S + b * S * S;
}

}  // namespace

template <typename T>
Matrix3<T> exp3(const Vector3<T>& w) {
  const auto [sinc, cosc, sinc_minus] = calcAngleFunctions(w.squaredNorm());
  return makeFromSkew<T>(w, sinc, cosc);
}
Matrix3d exp3(const Vector3d& w) { return exp3<double>(w); }
template Matrix3<Lanes> exp3(const Vector3<Lanes>&);

template <typename T>
Matrix3<T> calcRightJacobian3(const Vector3<T>& w) {
  const auto [sinc, cosc, sinc_minus] = calcAngleFunctions(w.squaredNorm());
  return makeFromSkew<T>(w, -cosc, sinc_minus);
}
Matrix3d calcRightJacobian3(const Vector3d& w) { return calcRightJacobian3<double>(w); }
template Matrix3<Lanes> calcRightJacobian3(const Vector3<Lanes>&);

template <typename T>
Matrix3<T> calcRightJacobianInverse3(const Vector3<T>& w) {
  return makeFromSkew<T>(w, 0.5, calcJacobianInverseFactor(w.squaredNorm()));
}
Matrix3d calcRightJacobianInverse3(const Vector3d& w) { return calcRightJacobianInverse3<double>(w); }
template Matrix3<Lanes> calcRightJacobianInverse3(const Vector3<Lanes>&);

template <typename T>
Eigen::Quaternion<T> exp3AsQuaternion(const Vector3<T>& w) {
  const auto [sine, cosine] = calcHalfAngle(w.squaredNorm());
  return {cosine, sine * w.x(), sine * w.y(), sine * w.z()};
}
Eigen::Quaterniond exp3AsQuaternion(const Vector3d& w) { return exp3AsQuaternion<double>(w); }
template Eigen::Quaternion<Lanes> exp3AsQuaternion(const Vector3<Lanes>&);

template <typename T>
Matrix3<T> makeAxisRotation(const Vector3d& axis, const T& angle) {
  T s, c;
  calcSineCosine(angle, s, c);
  const Vector3<T> sa = axis.cast<T>() * s, ca = axis.cast<T>() * (1 - c);
  Matrix3<T> R;
  R(0, 0) = ca.x() * axis.x() + c;
  R(1, 1) = ca.y() * axis.y() + c;
  R(2, 2) = ca.z() * axis.z() + c;
  const T xy = ca.x() * axis.y(), xz = ca.x() * axis.z(), yz = ca.y() * axis.z();
  R(0, 1) = xy - sa.z();
  R(1, 0) = xy + sa.z();
  R(0, 2) = xz + sa.y();
  R(2, 0) = xz - sa.y();
  R(1, 2) = yz - sa.x();
  R(2, 1) = yz + sa.x();
  return R;
}
template Matrix3d makeAxisRotation(const Vector3d&, const double&);
template Matrix3<Lanes> makeAxisRotation(const Vector3d&, const Lanes&);

namespace {

constexpr double kSmallSineSquared = 1e-3;

// asin(s) / s from s^2
template <typename T>
T calcArcSineSeries(const T& s2) {
  return 1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336 + s2 * (105.0 / 3456 + s2 * 945.0 / 42240))));
}

template <typename T>
Vector3<T> calcSine(const Matrix3<T>& R) {
  return 0.5 * Vector3<T>(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
}

}  // namespace

Vector3d log3(const Matrix3d& R) {
  // Small angles: sin t times the axis is the antisymmetric part, and t = asin(sin t) by its series.
  const Vector3d sine = calcSine(R);
  const double s2 = sine.squaredNorm();
  if (s2 < kSmallSineSquared && R.trace() > 0) return calcArcSineSeries(s2) * sine;
  // By the quaternion: its vector part is sin(t/2) times the axis, which stays well conditioned near t = pi.
  Eigen::Quaterniond quat(R);
  quat.normalize();
  if (quat.w() < 0) quat.coeffs() *= -1;
  const double s = quat.vec().norm();
  if (s < 1e-8) return 2 * quat.vec() / quat.w();
  return 2 * std::atan2(s, quat.w()) / s * quat.vec();
}

template <>
Vector3<Lanes> log3(const Matrix3<Lanes>& R) {
  const Vector3<Lanes> sine = calcSine(R);
  const Lanes s2 = sine.squaredNorm(), trace = R.trace();
  Vector3<Lanes> out = calcArcSineSeries(s2) * sine;
  for (Eigen::Index l = 0; l < kLane; ++l) {
    if (s2[l] < kSmallSineSquared && trace[l] > 0) continue;
    Matrix3d one;
    unpackLane(R.data(), l, 9, one.data());
    const Vector3d w = log3(one);
    for (int k = 0; k < 3; ++k) out[k].set(l, w[k]);
  }
  return out;
}

double calcJacobianInverseFactor(double t2) {
  if (t2 < kSmallAngleSquared) return calcInverseSeries(t2);
  const double t = std::sqrt(t2);
  return (1 - 0.5 * t / std::tan(0.5 * t)) / t2;
}

Lanes calcJacobianInverseFactor(const Lanes& t2) {
  Lanes out = calcInverseSeries(t2);
  for (Eigen::Index l = 0; l < kLane; ++l)
    if (!(t2[l] < kSmallAngleSquared)) out.set(l, calcJacobianInverseFactor(t2[l]));
  return out;
}

}  // namespace bielle
