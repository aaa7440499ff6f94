#pragma once
/// \file Which feet stand where and when, as a small readable list.
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"

namespace bielle {

/// Some time with the same contacts.
struct ContactPhase {
  std::string name;                     ///< e.g. "double support"
  int nodes = 0;                        ///< stages it lasts
  std::vector<ContactTarget> contacts;  ///< feet on the ground, with their places
};

struct ContactSchedule {
  double dt = 0.015;  ///< s
  std::vector<ContactPhase> phases;

  int numStages() const {
    int n = 0;
    for (const ContactPhase& phase : phases) n += phase.nodes;
    return n;
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
