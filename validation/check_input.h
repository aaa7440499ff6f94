#pragma once
/// \file A motion read from its files.
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "bielle/results/result.h"

namespace bielle::validation {

/// A trajectory, its summary and its robot, consistent with each other.
struct CheckedMotion {
  Model model;
  MotionSummary summary;
  MotionRecord record;
  std::vector<std::string> warnings;  ///< of its robot (loadRobotOf)
  bool has_happened = false;          ///< it was carried out or recorded; else it is a plan

  int numStages() const { return static_cast<int>(record.time.size()) - 1; }
  /// Index of the phase of a node; the last node belongs to the last phase.
  int findPhase(int node) const;
  /// The contacts of a phase, in the order of the summary.
  std::vector<ContactTarget> getContacts(int phase) const;
  /// Length of a stage, s; 0 for a rigid impact.
  double getTimeStep(int stage) const { return summary.phases[findPhase(stage)].time_step; }
  /// Whether a stage is a rigid impact: no time passes, velocities jump.
  bool isImpact(int stage) const { return getTimeStep(stage) == 0; }
  /// Whether a contact of the model stands on the ground at a node: as planned, or where it was pressed, if that is known.
  bool stands(int contact, int node) const;
};

/// Reads DIR/summary.json, DIR/trajectory.npz and the robot, from its file or, if that no longer exists, by its name.
/// \throws InputError naming the file, the entry and what is wrong with it
CheckedMotion readMotion(const std::string& directory);

/// \throws InputError when names, sizes, phases or contacts of the parts contradict each other
void checkConsistency(const CheckedMotion& motion);

}  // namespace bielle::validation
