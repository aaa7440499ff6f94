#pragma once
/// \file Contact schedule: which feet stand where and when.
#include <algorithm>
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"

namespace bielle {

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
