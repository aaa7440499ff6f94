#include "math/direction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace bielle {

Matrix3d calcRotationOfZ(const Vector3d& direction) {
  const Vector3d along = direction.normalized(), normal = Vector3d::UnitZ().cross(along);
  const double c = std::max(along.z(), -1.0);
  Eigen::Quaterniond q;
  if (c < 0) {
    const double w2 = normal.squaredNorm() / (2 * (1 - c));  // (1 + c) / 2, with all its digits
    q.w() = std::sqrt(w2);
    q.vec() = std::sqrt(1 - w2) * (normal.isZero(0) ? Vector3d(-1, 0, 0) : normal.normalized());
  } else {
    const double s = std::sqrt((1 + c) * 2);
    q.w() = s / 2;
    q.vec() = normal * (1 / s);
  }
  return q.toRotationMatrix();
}

NearestAxis findNearestAxis(const Vector3d& direction) {
  constexpr double kTie = 1e-6;  // the first of those that are equally near but for rounding
  const Vector3d size = direction.cwiseAbs();
  Eigen::Index k = 0;
  while (size[k] < (1 - kTie) * size.maxCoeff()) ++k;
  const Vector3d axis = Vector3d::Unit(k) * std::copysign(1.0, direction[k]), normal = axis.cross(direction);
  const double angle = std::atan2(normal.norm(), axis.dot(direction));
  if (normal.isZero(0)) return {axis, 0, Matrix3d::Identity()};
  return {axis, angle, exp3(Vector3d(angle * normal.normalized()))};
}

Matrix3d makeRotation(const Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

Vector3d calcRollPitchYaw(const Matrix3d& R) {
  constexpr double kLocked = 1e-15;
  const double level = std::hypot(R(0, 0), R(1, 0)), pitch = std::atan2(-R(2, 0), level);
  if (level < kLocked) return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0};
  const double roll = std::atan2(R(2, 1), R(2, 2));
  const Vector3d y = std::cos(roll) * R.col(1) - std::sin(roll) * R.col(2);  // of R Rx(roll)^T = Rz(yaw) Ry(pitch)
  return {roll, pitch, std::atan2(-y.x(), y.y())};
}

}  // namespace bielle
