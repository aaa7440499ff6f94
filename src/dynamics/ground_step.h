#pragma once
// The top of a step of the ground in space.
#include <Eigen/Geometry>

#include "bielle/dynamics/ground.h"

namespace bielle {

// Rz(yaw) Ry(pitch) Rx(roll): its z is normal to the top.
inline Matrix3d calcRotation(const GroundStep& step) {
  return (Eigen::AngleAxisd(step.yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(step.pitch, Vector3d::UnitY()) *
          Eigen::AngleAxisd(step.roll, Vector3d::UnitX()))
      .toRotationMatrix();
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
