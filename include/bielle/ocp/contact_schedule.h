#pragma once
/// \file Contact schedule: which feet stand where and when; and the ground: a plane with boxes on it.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"
#include "bielle/math/types.h"

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

/// A period with constant contacts.
struct ContactPhase {
  std::string name;                     ///< e.g. "double support"
  int nodes = 0;                        ///< number of stages
  double dt = 0;                        ///< length of a stage, s; 0: a rigid impact
  std::vector<ContactTarget> contacts;  ///< feet on the ground, with their places
};

struct ContactSchedule {
  std::vector<ContactPhase> phases;

  int numStages() const {
    int n = 0;
    for (const ContactPhase& phase : phases) n += phase.nodes;
    return n;
  }
  /// Time of a node since the start, s.
  double getTime(int node) const {
    double time = 0;
    for (const ContactPhase& phase : phases) {
      time += std::min(node, phase.nodes) * phase.dt;
      node -= std::min(node, phase.nodes);
    }
    return time;
  }
  /// Phase of a stage; the terminal node belongs to the last one.
  const ContactPhase& getPhase(int stage) const {
    for (const ContactPhase& phase : phases) {
      if (stage < phase.nodes) return phase;
      stage -= phase.nodes;
    }
    return phases.back();
  }
};

}  // namespace bielle
