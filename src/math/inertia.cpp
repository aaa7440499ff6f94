#include "bielle/math/se3.h"

namespace bielle {

Inertia Inertia::transformed(const SE3& X_AB) const {
  return {mass, X_AB.act(com), X_AB.R * I_com * X_AB.R.transpose()};
}

Inertia Inertia::operator+(const Inertia& o) const {
  Inertia sum;
  sum.mass = mass + o.mass;
  if (sum.mass <= 0) return {0, com, I_com + o.I_com};
  sum.com = (mass * com + o.mass * o.com) / sum.mass;
  const Matrix3d a = skew(com - sum.com), b = skew(o.com - sum.com);
  sum.I_com = I_com + o.I_com - mass * a * a - o.mass * b * b;
  return sum;
}

Matrix6d Inertia::toMatrix() const {
  Matrix6d Y;
  const Matrix3d C = skew(com);
  Y.topLeftCorner<3, 3>() = mass * Matrix3d::Identity();
  Y.topRightCorner<3, 3>() = -mass * C;
  Y.bottomLeftCorner<3, 3>() = mass * C;
  Y.bottomRightCorner<3, 3>() = I_com - mass * C * C;
  return Y;
}

}  // namespace bielle
