#pragma once
/// \file Solving again motions whose time step is too coarse, or that come near dead points.
#include <optional>
#include <string>
#include <vector>

#include "bielle/motion/record.h"
#include "bielle/motion/registry.h"

namespace bielle {

/// Largest difference between velocity increments across midpoint steps and the accelerations in their middle, in the
/// norm of the robot's inertia, relative to the largest acceleration. `bielle check` allows kAllowedStepError. 0 for
/// Euler steps.
double calcStepError(const Model& model, const MotionRecord& record);
inline constexpr double kLargestStepError = 0.004, kAllowedStepError = 0.005;

/// How far a corner of a standing sole moves between the nodes, at most, m.
double calcSoleMotion(const Motion& motion, const MotionRecord& record);

/// Stages of a solved motion are too long if this exceeds 1: the larger of calcStepError() / kLargestStepError and the
/// slip of standing soles / kLargestSlip; `bielle check` allows 0.1 mm off the ground. 0 for Euler steps.
double calcStageExcess(const Motion& motion, const MotionRecord& record);
inline constexpr double kLargestSlip = 1e-4;  // m, of a corner, at most

struct RefinedMotion {
  Motion motion;
  StartingPoint start;
};
/// The motion of the same request with stages half as long, and the solution to start from. Made only if `time_step` was 0, no
/// duration is free, the objective is not the peak torque, and calcStageExcess() exceeds 1.
/// \param solved  made of a request, here and below   \param record  of its solution
std::optional<RefinedMotion> refineStages(const Motion& solved, const MotionRecord& record);

/// The motion of least effort of the same request, again from its plan, with linkages farther from their dead points
/// (kWideDeadPointMargin). Not for sequences. Made only if no duration is free and calcStepError() exceeds
/// kLargestStepError where a linkage is near its margin: near a dead point motors reverse within a stage of any length.
/// The length of stages is unchanged. \param solved  whose request it is   \param record  of the motion that is to be improved
std::optional<Motion> avoidDeadPoints(const Motion& solved, const MotionRecord& record);
inline constexpr double kWideDeadPointMargin = 0.4;

/// The motion of the same request, with linkages that keep kNearDeadPoint from dead points that the solution comes nearer to, and
/// that solution to start from: their margins are the transmissions that they have at that distance. Made only if the margin is
/// the default or more, the start leaves room for a larger one, no duration is free, and the objective is not the peak torque.
std::optional<RefinedMotion> keepFromDeadPoints(const Motion& solved, const MotionRecord& record);

}  // namespace bielle
