#include "math/direction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace bielle {

Matrix3d calcRotationOfZ(const Vector3d& direction) {
  constexpr double kNearlyOpposite = 1e-6;  // from there on 1 + c keeps ten digits
  const Vector3d along = direction.normalized(), normal = Vector3d::UnitZ().cross(along);
  const double c = std::max(along.z(), -1.0);
  Eigen::Quaterniond q;
  if (c < -1 + kNearlyOpposite) {
    const double w2 = normal.squaredNorm() / (2 * (1 - c));  // (1 + c) / 2
    q.w() = std::sqrt(w2);
    q.vec() = std::sqrt(1 - w2) * (normal.isZero(0) ? Vector3d(-1, 0, 0) : normal.normalized());
  } else {
    const double s = std::sqrt((1 + c) * 2);
    q.w() = s / 2;
    q.vec() = normal * (1 / s);
  }
  return q.toRotationMatrix();
}

Matrix3d makeRotation(const Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

}  // namespace bielle
