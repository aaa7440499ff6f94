#include "bielle/math/so3.h"

#include <cmath>

namespace bielle {
namespace {

constexpr double kSmallAngleSquared = 1e-2;  // series below: their first missing terms are under rounding

// The even functions of the angle t that the exponential and its Jacobian are made of.
struct AngleFunctions {
  double sinc;        // sin t / t
  double cosc;        // (1 - cos t) / t^2
  double sinc_minus;  // (t - sin t) / t^3
};

AngleFunctions calcAngleFunctions(double t2) {
  if (t2 < kSmallAngleSquared)
    return {1 - t2 / 6 * (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72))),
            0.5 * (1 - t2 / 12 * (1 - t2 / 30 * (1 - t2 / 56 * (1 - t2 / 90)))),
            1.0 / 6 * (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110))))};
  const double t = std::sqrt(t2);
  const double half = std::sin(0.5 * t);
  return {std::sin(t) / t, 2 * half * half / t2, (t - std::sin(t)) / (t2 * t)};
}

}  // namespace

Matrix3d exp3(const Vector3d& w) {
  const AngleFunctions f = calcAngleFunctions(w.squaredNorm());
  const Matrix3d S = skew(w);
  return Matrix3d::Identity() + f.sinc * S + f.cosc * S * S;
}

Eigen::Quaterniond exp3AsQuaternion(const Vector3d& w) {
  const double t2 = w.squaredNorm();
  double sine, cosine;  // sin(t/2) / t, cos(t/2)
  if (t2 < kSmallAngleSquared) {
    const double u = 0.25 * t2;
    sine = 0.5 * (1 - u / 6 * (1 - u / 20 * (1 - u / 42 * (1 - u / 72))));
    cosine = 1 - u / 2 * (1 - u / 12 * (1 - u / 30 * (1 - u / 56 * (1 - u / 90))));
  } else {
    const double t = std::sqrt(t2);
    sine = std::sin(0.5 * t) / t;
    cosine = std::cos(0.5 * t);
  }
  return {cosine, sine * w.x(), sine * w.y(), sine * w.z()};
}

Matrix3d makeAxisRotation(const Vector3d& axis, double angle) {
  const double s = std::sin(angle), c = std::cos(angle);
  const Vector3d sa = s * axis, ca = (1 - c) * axis;
  Matrix3d R;
  R(0, 0) = ca.x() * axis.x() + c;
  R(1, 1) = ca.y() * axis.y() + c;
  R(2, 2) = ca.z() * axis.z() + c;
  const double xy = ca.x() * axis.y(), xz = ca.x() * axis.z(), yz = ca.y() * axis.z();
  R(0, 1) = xy - sa.z();
  R(1, 0) = xy + sa.z();
  R(0, 2) = xz + sa.y();
  R(2, 0) = xz - sa.y();
  R(1, 2) = yz - sa.x();
  R(2, 1) = yz + sa.x();
  return R;
}

Vector3d log3(const Matrix3d& R) {
  // Small angles: sin t times the axis is the antisymmetric part, and t = asin(sin t) by its series.
  const Vector3d sine = 0.5 * Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  const double s2 = sine.squaredNorm();
  if (s2 < 1e-3 && R.trace() > 0)
    return (1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336 + s2 * (105.0 / 3456 + s2 * 945.0 / 42240))))) * sine;
  // Through the quaternion: its vector part is sin(t/2) times the axis, which stays well conditioned near t = pi.
  Eigen::Quaterniond quat(R);
  quat.normalize();
  if (quat.w() < 0) quat.coeffs() *= -1;
  const double s = quat.vec().norm();
  if (s < 1e-8) return 2 * quat.vec() / quat.w();
  return 2 * std::atan2(s, quat.w()) / s * quat.vec();
}

Matrix3d calcRightJacobian3(const Vector3d& w) {
  const AngleFunctions f = calcAngleFunctions(w.squaredNorm());
  const Matrix3d S = skew(w);
  return Matrix3d::Identity() - f.cosc * S + f.sinc_minus * S * S;
}

double calcJacobianInverseFactor(double t2) {
  if (t2 < kSmallAngleSquared)
    return 1.0 / 12 + t2 * (1.0 / 720 + t2 * (1.0 / 30240 + t2 * (1.0 / 1209600 + t2 / 47900160)));
  const double t = std::sqrt(t2);
  return (1 - 0.5 * t / std::tan(0.5 * t)) / t2;
}

Matrix3d calcRightJacobianInverse3(const Vector3d& w) {
  const Matrix3d S = skew(w);
  return Matrix3d::Identity() + 0.5 * S + calcJacobianInverseFactor(w.squaredNorm()) * S * S;
}

}  // namespace bielle
