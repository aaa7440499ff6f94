#pragma once
/// \file The record of what happens in a world, row by row.
#include "bielle/control/policy.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/motion/record.h"
#include "bielle/worlds/world.h"

namespace bielle::worlds {

/// Writes a record as the motion happens: a node, then by turns a stage and the node at its end.
class MotionRecorder {
 public:
  MotionRecorder(const Model& model, int stages);

  /// The state of the next node.
  void addNode(const World& world, const std::vector<PredictedFoothold>& footholds = {});
  /// The forces and torques that act from the last node on. Those of closures are not known (NaN).
  void addStage(const World& world);
  /// After addStage(): forces of the closures at the state of the last node, by the full system, where neither ground nor stops
  /// touch the robot; where rows are redundant, those of least norm.
  void addClosureForces(const World& world);
  Vector3d com() const { return record_.com.row(node_ - 1); }  ///< at the last node, m
  /// What was recorded from an instant on [s], a stage at least; accelerations are means.
  MotionRecord getRecord(double since = 0) const;

 private:
  void addFootholds(const std::vector<PredictedFoothold>& footholds);

  Model model_;
  const ConstraintSet loops_;
  Workspace ws_;
  ConstrainedWorkspace cws_;
  MotionRecord record_;
  int node_ = 0;
};

/// Left less right side of Books' Eq. (1), J.
double calcImbalance(const Books& start, const Books& end);

}  // namespace bielle::worlds
