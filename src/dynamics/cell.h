#pragma once
// What a shape is in the world, and the ground too: a parallelepiped with rounded edges.
#include "bielle/dynamics/distance.h"

namespace bielle {

struct Cell {
  Vector3d center;
  Matrix3d edges;  // columns: half of them; zero columns for spheres and capsules
  double radius;
};

inline Cell makeCell(const Shape& shape, const SE3& X_WB) {
  const SE3 X = X_WB * shape.X_BS;
  return {X.p, X.R * shape.half.asDiagonal(), shape.radius};
}

ShapeDistance calcCellDistance(const Cell& a, const Cell& b);

}  // namespace bielle
