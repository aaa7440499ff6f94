#pragma once
/// \file The record of what happens in a world, row by row.
#include "bielle/dynamics/constrained.h"
#include "worlds/execution.h"
#include "worlds/terrain.h"

namespace bielle::worlds {

/// Notes what happens in a world, and writes it down as a record: a node, then by turns a stage and the node at its end.
class MotionRecorder {
 public:
  /// \param world  must outlive it
  MotionRecorder(const World& world, int stages);

  /// The state of the next node. Books begin with the first.
  void addNode(const std::vector<PredictedFoothold>& footholds = {});
  /// The forces and torques that act from the last node on. Those of closures are not known (NaN).
  void addStage();
  /// After addStage(): forces of the closures at the state of the last node, by the full system, where neither ground nor stops
  /// touch the robot; where rows are redundant, those of least norm.
  void addClosureForces();
  /// Gaps, slips, and how feet stand, after the world has advanced, which took so long on the clock, s.
  void noteAdvance(double seconds);

  /// Of the centre of mass, from the first node to the last, m.
  Vector3d way() const { return (record_.com.row(node_ - 1) - record_.com.row(0)).transpose(); }
  int numNodes() const { return node_; }
  const std::vector<Books>& books() const { return books_; }  ///< per node
  /// Up to now, with what was recorded from an instant on [s], a stage at least; accelerations are means.
  Execution describe(double since = 0) const;

  Execution happened;  ///< for what is noted by others

 private:
  void noteFoot(int contact);
  void addFootholds(const std::vector<PredictedFoothold>& footholds);
  MotionRecord getRecord(double since) const;

  const World& world_;
  const Model& model_;
  const ConstraintSet loops_;
  const Terrain terrain_;
  Workspace ws_;
  ConstrainedWorkspace cws_;
  MotionRecord record_;
  std::vector<Books> books_;
  double exchanged_ = 0;  // energy that motors, pushes and losses have moved, J
  int node_ = 0;
};

/// Left less right side of Books' Eq. (1), J.
double calcImbalance(const Books& start, const Books& end);

}  // namespace bielle::worlds
