#include "bielle/dynamics/ground.h"

#include "dynamics/cell.h"
#include "dynamics/ground_step.h"

namespace bielle {
namespace {

// With a top that may be inclined, vertical sides, and a bottom so deep that nothing leaves through it.
Cell makeCell(const GroundStep& step, double floor) {
  constexpr double kBelow = 10;  // m
  const double depth = step.top.z() - floor + kBelow;
  Matrix3d edges;
  edges << calcHalfEdges(step), Vector3d(0, 0, depth / 2);
  return {step.top - Vector3d(0, 0, depth / 2), edges, 0};
}

}  // namespace

ShapeDistance calcGroundDistance(const Ground& ground, const Shape& shape, const SE3& X_WB) {
  const Cell cell = makeCell(shape, X_WB);
  ShapeDistance nearest;  // that of the plane: its normal is z
  Vector3d lowest = cell.center - Vector3d(0, 0, cell.radius);
  for (int i = 0; i < 3; ++i)
    if (cell.edges(2, i) != 0) lowest -= std::copysign(1.0, cell.edges(2, i)) * cell.edges.col(i);
  nearest.distance = lowest.z() - ground.height;
  nearest.point_a = nearest.point_b = lowest;
  nearest.point_b.z() = ground.height;
  for (const GroundStep& step : ground.steps) {
    if (step.top.z() <= ground.height) continue;
    const ShapeDistance distance = calcCellDistance(cell, makeCell(step, ground.height));
    if (distance.distance < nearest.distance) nearest = distance;
  }
  return nearest;
}

}  // namespace bielle
