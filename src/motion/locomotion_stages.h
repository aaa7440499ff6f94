#pragma once
/// \file The stages of a locomotion, node by node, with the costs and constraints of locomotion.h.
#include "motion/gait.h"
#include "motion/robot_size.h"

namespace bielle {

/// Data common to all stages.
struct Scene {
  const Model& model;
  const Stance& stance;  ///< before the first node
  const LocomotionTask& task;
  const LocomotionOptions& options;  ///< whose weights suit the size
  RobotSize size;
  Gait gait;
  VectorXd state_weights;  ///< 2 nv, by makeStageWeights()
  double ramp = 0;         ///< around the steps of the ground, m
};

VectorXd makeStageWeights(const Model& model, const RobotSize& size, const LocomotionOptions& options);

/// The gait of a task from rest: the first double support is lengthened until locomotion.h Eq. (1) holds.
/// \param options  with the length of the stages
Gait makeStartingGait(const Model& model, const Stance& stance, const LocomotionTask& task,
                      const LocomotionOptions& options);
/// Placements of both feet at a node.
std::array<SE3, 2> getFeet(const Scene& scene, const GaitNode& node);
/// The feet that stand in a phase.
std::vector<ContactTarget> makeTargets(const Scene& scene, const GaitPhase& phase);
/// E.g. "double support".
std::string nameOf(const GaitPhase& phase);

/// A step of the dynamics. \param k  index of the node   \param contacts  makeTargets() of its phase
StageSpec makeStage(const Scene& scene, int k, const std::vector<ContactTarget>& contacts);
/// A foot lands and stops instantly.
StageSpec makeImpact(const Scene& scene, const GaitNode& node, const std::vector<ContactTarget>& contacts);
StageSpec makeTerminalStage(const Scene& scene);
/// The last node of a cycle, where the next one begins: it costs nothing.
StageSpec makeSeam(const Scene& scene);
/// The standing posture, moved along the gait, at rest: nq + nv.
VectorXd makeGuess(const Scene& scene, const GaitNode& node);

}  // namespace bielle
