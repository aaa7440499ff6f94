#include "formats/mesh_inertia.h"

#include <cmath>

#include "formats/mesh_shells.h"

namespace bielle {
namespace {

using MeshTriangle = Eigen::Matrix3d;  // its corners

struct Moments {
  double mass = 0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();  // integral of x x^T
};

Vector3d calcArea(const MeshTriangle& t) { return (t.col(1) - t.col(0)).cross(t.col(2) - t.col(0)) / 2; }

// Adds a triangle (k = 3), or the tetrahedron between it and the origin (k = 4), of mass m: with the sum s of the corners, it has
// the first moment m s / k and the second m (s s^T + sum of x x^T) / (k (k + 1)).
void addSimplex(const MeshTriangle& t, double mass, int k, Moments& sum) {
  const Vector3d s = t.rowwise().sum();
  sum.mass += mass;
  sum.first += mass / k * s;
  sum.second += mass / (k * (k + 1)) * (s * s.transpose() + t * t.transpose());
}

// About `origin`. Volumes of tetrahedra have no sign if they may overlap.
Moments addUp(const Eigen::Matrix3Xd& corners, const Vector3d& origin, MeshSolid solid) {
  Moments sum;
  for (Eigen::Index i = 0; i + 2 < corners.cols(); i += 3) {
    const MeshTriangle t = corners.middleCols<3>(i).colwise() - origin;
    const double volume = t.determinant() / 6;
    if (solid == MeshSolid::Surface)
      addSimplex(t, calcArea(t).norm(), 3, sum);
    else
      addSimplex(t, solid == MeshSolid::Overlapping ? std::abs(volume) : volume, 4, sum);
  }
  return sum;
}

}  // namespace

std::optional<Inertia> calcMeshInertia(const Eigen::Matrix3Xd& given, MeshSolid solid) {
  const Eigen::Matrix3Xd corners = solid == MeshSolid::Enclosed ? turnShellsOutwards(given) : given;
  const Moments surface = addUp(corners, Vector3d::Zero(), MeshSolid::Surface);
  if (!(surface.mass > 0)) return {};
  const Vector3d middle = surface.first / surface.mass;  // of the faces
  Moments sum = addUp(corners, middle, solid);
  if (sum.mass < 0) sum = {-sum.mass, -sum.first, -sum.second};  // faces that are all seen from inside
  const double scale = std::sqrt(surface.mass);
  const double least = 1e-12 * (solid == MeshSolid::Surface ? scale * scale : scale * scale * scale);
  if (!(sum.mass > least)) return {};
  const Vector3d com = middle + sum.first / sum.mass;
  // Which tetrahedra overlap depends on the point that they share: MuJoCo takes the centre of mass for the moments.
  sum = addUp(corners, com, solid);
  if (sum.mass < 0) sum = {-sum.mass, -sum.first, -sum.second};
  if (!(sum.mass > least)) return {};  // the first one was rounding
  Inertia inertia;
  inertia.mass = sum.mass;
  inertia.com = com;
  inertia.I_com = sum.second.trace() * Matrix3d::Identity() - sum.second;
  if (!std::isfinite(inertia.mass) || !inertia.com.allFinite() || !inertia.I_com.allFinite()) return {};
  return inertia;
}

std::optional<Inertia> calcPrimitiveInertia(const std::string& type, const Vector3d& half) {
  const double a = half[0], b = half[1], c = half[2];
  double volume = 0;
  Vector3d moments = Vector3d::Zero();  // per mass
  const auto fromSquares = [](double xx, double yy, double zz) { return Vector3d(yy + zz, xx + zz, xx + yy); };
  if (type == "sphere" || type == "ellipsoid") {
    const double y = type == "sphere" ? a : b, z = type == "sphere" ? a : c;
    volume = 4 * EIGEN_PI / 3 * a * y * z;
    moments = fromSquares(a * a / 5, y * y / 5, z * z / 5);
  } else if (type == "box") {
    volume = 8 * a * b * c;
    moments = fromSquares(a * a / 3, b * b / 3, c * c / 3);
  } else if (type == "cylinder") {
    volume = 2 * EIGEN_PI * a * a * b;
    moments = fromSquares(a * a / 4, a * a / 4, b * b / 3);
  } else if (type == "capsule") {
    // A cylinder and two half balls, whose centres of mass are 3/8 of the radius beyond its ends.
    const double tube = 2 * EIGEN_PI * a * a * b, ball = 4 * EIGEN_PI / 3 * a * a * a, far = b + 3 * a / 8;
    volume = tube + ball;
    if (!(volume > 0)) return Inertia();
    const double xx = (tube * a * a / 4 + ball * a * a / 5) / volume,
                 zz = (tube * b * b / 3 + ball * (a * a / 5 - 9 * a * a / 64 + far * far)) / volume;
    moments = fromSquares(xx, xx, zz);
  } else {
    return {};
  }
  return Inertia{volume, Vector3d::Zero(), moments.asDiagonal()};
}

}  // namespace bielle
