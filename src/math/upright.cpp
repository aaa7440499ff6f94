#include "math/upright.h"

#include <cmath>

namespace bielle {

Matrix3d findUprightAxes(const Vector3d& up) {
  constexpr double kNear = 0.7;  // cosine
  if (!(up.z() <= kNear * up.norm())) return Matrix3d::Identity();
  int axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  const Vector3d z = std::copysign(1.0, up[axis]) * Vector3d::Unit(axis);
  const Vector3d x = axis == 0 ? Vector3d::UnitY() : Vector3d::UnitX();
  return (Matrix3d() << x, z.cross(x), z).finished();
}

}  // namespace bielle
