#pragma once
/// \file The ground, a plane with boxes on it, and the distance of shapes from it.
#include <algorithm>
#include <cmath>
#include <vector>

#include "bielle/dynamics/distance.h"

namespace bielle {

/// A box, e.g. a stair. Its top may be inclined: its axes are those of Rz(yaw) Ry(pitch) Rx(roll).
struct GroundStep {
  Vector3d top = Vector3d::Zero();  ///< centre of its top, m (world)
  double length = 0, width = 0;     ///< of the box seen from above, along its own x and y, m
  double yaw = 0;                   ///< of its x about the vertical, rad
  double pitch = 0, roll = 0;       ///< rad; positive pitch: its x goes down

  bool covers(double x, double y) const {
    const double dx = x - top.x(), dy = y - top.y(), c = std::cos(yaw), s = std::sin(yaw);
    return std::abs(c * dx + s * dy) <= length / 2 && std::abs(c * dy - s * dx) <= width / 2;
  }
  /// Horizontal distance of a point from the top, m.
  double calcDistance(double x, double y) const {
    const double dx = x - top.x(), dy = y - top.y(), c = std::cos(yaw), s = std::sin(yaw);
    return std::hypot(std::max(0.0, std::abs(c * dx + s * dy) - length / 2),
                      std::max(0.0, std::abs(c * dy - s * dx) - width / 2));
  }
  /// Height of the plane of its top, m.
  double calcHeight(double x, double y) const {
    const double dx = x - top.x(), dy = y - top.y(), c = std::cos(yaw), s = std::sin(yaw);
    return top.z() - std::tan(pitch) * (c * dx + s * dy) + std::tan(roll) / std::cos(pitch) * (c * dy - s * dx);
  }
};

struct Ground {
  double height = 0;              ///< of the plane, m
  double friction = 0.7;          ///< coefficient, 1
  std::vector<GroundStep> steps;  ///< the highest one counts

  /// Height of the ground under a point, m.
  double calcHeight(double x, double y) const {
    double z = height;
    for (const GroundStep& step : steps)
      if (step.covers(x, y)) z = std::max(z, step.calcHeight(x, y));
    return z;
  }
};

/// Least distance of a shape from the plane and from the boxes that rise over it, m; where they overlap, minus the
/// smallest displacement that separates them. Point b is on the ground; for addDistanceGradient b is Shape(), which is
/// fixed in the world. \param X_WB  placement of the body
ShapeDistance calcGroundDistance(const Ground& ground, const Shape& shape, const SE3& X_WB);

}  // namespace bielle
