#include "math/settled.h"

#include <Eigen/Geometry>
#include <cmath>

#include "math/direction.h"

namespace bielle {
namespace {

constexpr double kTie = 1e-6;  // what is nearer by less counts as equally near, so that rounding decides nothing

// The rotation of a cube next to R, the first of those equally near.
Matrix3d findCubeRotation(const Matrix3d& R) {
  Matrix3d best = Matrix3d::Identity();
  double most = best.cwiseProduct(R).sum();
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 6; ++y) {
      if (x / 2 == y / 2) continue;
      Matrix3d Q;
      Q.col(0) = Vector3d::Unit(x / 2) * (x % 2 ? -1 : 1);
      Q.col(1) = Vector3d::Unit(y / 2) * (y % 2 ? -1 : 1);
      Q.col(2) = Q.col(0).cross(Q.col(1));
      const double near = Q.cwiseProduct(R).sum();
      if (near > most + kTie) most = near, best = Q;
    }
  return best;
}

}  // namespace

Matrix3d settleRotation(const Matrix3d& R, int bits) {
  const Matrix3d Q = findCubeRotation(R);
  const Eigen::Quaterniond rest(Matrix3d(Q.transpose() * R));  // by at most 63 degrees, so w is large
  const double grid = std::ldexp(1.0, -bits), sign = rest.w() < 0 ? -1 : 1;
  const Vector3d v = rest.vec().unaryExpr([=](double x) { return std::round(sign * x / grid) * grid + 0.0; });
  if (v.isZero(0)) return Q;
  return Q * Eigen::Quaterniond(std::sqrt(1 - v.squaredNorm()), v.x(), v.y(), v.z()).toRotationMatrix();
}

Vector3d settleDirection(const Vector3d& direction, int bits) {
  const NearestAxis nearest = findNearestAxis(direction);
  return settleRotation(nearest.turn, bits) * nearest.axis;
}

Vector3d settlePoint(const Vector3d& p, double size) {
  const double units = std::pow(10.0, 14 - std::floor(std::log10(size * (1 + kTie))));  // exact
  return p.unaryExpr([=](double x) { return std::round(x * units) / units; });
}

}  // namespace bielle
