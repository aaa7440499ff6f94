#pragma once
// The top of a step of the ground in space.
#include "bielle/dynamics/ground.h"
#include "math/direction.h"

namespace bielle {

// Its z is normal to the top.
inline Matrix3d calcRotation(const GroundStep& step) { return makeRotation({step.roll, step.pitch, step.yaw}); }

// Of a rectangle in the plane of the top: sides that are as long as those of the step, seen from above, m.
inline Eigen::Vector2d calcTopSize(const GroundStep& step) {
  return {step.length / std::cos(step.pitch), step.width / std::cos(step.roll)};
}

// Columns: halves of the edges of the top, along x and y of the step as seen from above, m (world).
inline Eigen::Matrix<double, 3, 2> calcHalfEdges(const GroundStep& step) {
  const double c = std::cos(step.yaw), s = std::sin(step.yaw);
  Eigen::Matrix<double, 3, 2> edges;
  edges << Vector3d(c, s, -std::tan(step.pitch)) * step.length / 2,
      Vector3d(-s, c, std::tan(step.roll) / std::cos(step.pitch)) * step.width / 2;
  return edges;
}

}  // namespace bielle
