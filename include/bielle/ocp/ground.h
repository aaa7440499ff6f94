#pragma once
/// \file The ground that a motion happens on: a plane and boxes on it.
#include <algorithm>
#include <cmath>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

/// A box with a level top, e.g. a stair.
struct GroundStep {
  Vector3d top = Vector3d::Zero();  ///< centre of its top, m (world)
  double length = 0, width = 0;     ///< of the top, along its own x and y, m
  double yaw = 0;                   ///< of its x about the vertical, rad

  bool covers(double x, double y) const {
    const double dx = x - top.x(), dy = y - top.y(), c = std::cos(yaw), s = std::sin(yaw);
    return std::abs(c * dx + s * dy) <= length / 2 && std::abs(c * dy - s * dx) <= width / 2;
  }
};

struct Ground {
  double height = 0;              ///< of the plane, m
  double friction = 0.7;          ///< coefficient, 1
  std::vector<GroundStep> steps;  ///< the highest one counts

  /// Height of what is under a point, m.
  double calcHeight(double x, double y) const {
    double z = height;
    for (const GroundStep& step : steps)
      if (step.covers(x, y)) z = std::max(z, step.top.z());
    return z;
  }
};

}  // namespace bielle
