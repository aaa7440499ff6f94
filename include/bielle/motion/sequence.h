#pragma once
/// \file Motions one after the other, as one optimal control problem.
///
/// Each motion starts from the standing posture in which the previous one ends. Only the last motion keeps its terminal
/// costs, so that the others need not come to rest. The ground has the steps of all motions and the lowest of their
/// planes; higher soles stand on platforms.
#include <functional>

#include "bielle/motion/motion.h"

namespace bielle {

struct SequencePart {
  std::string name;  ///< prefix of its phases and options: "NAME.depth"
  std::function<MotionPlan(const Model&, const StandingRobot&)> plan;  ///< e.g. planSquat with its options
};

/// \throws InputError when there is no part, when one is impossible, or when they differ in friction or do not fit on
/// one ground
MotionPlan planSequence(const Model& model, const std::vector<SequencePart>& parts, const StandingRobot& standing);

/// From the robot's standing posture.
Motion makeSequence(const Model& model, const std::vector<SequencePart>& parts, const ProblemOptions& problem = {});

}  // namespace bielle
