#pragma once
/// \file Motions whose stages turn out too long, and what is tried in their place.
#include <optional>

#include "bielle/io/motion_registry.h"
#include "bielle/io/record.h"

namespace bielle {

/// How far differences of velocities across midpoint steps are off the accelerations in their middle: the largest, in the
/// norm of the inertia of the robot, over the largest acceleration. `bielle check` allows 0.005. Of Euler steps 0.
double calcStepError(const Model& model, const MotionRecord& record);
inline constexpr double kLargestStepError = 0.004;

/// The motion of least effort of a request once more, in stages half as long and with the solution as its guess, if their
/// length was left to the motion (`time_step` 0), no duration is free and calcStepError() of the solution exceeds
/// kLargestStepError. Sets `time_step`.
/// \param record  of the solution of `solved`
std::optional<Motion> refineStages(const MotionRequest& request, const Model& model, const ProblemOptions& problem,
                                   const Motion& solved, const MotionRecord& record);

/// The motion of least effort of a request, no sequence, once more from its plan, with linkages farther from their dead points
/// (kWideDeadPointMargin), if calcStepError() exceeds kLargestStepError where one of them is near its margin, and no duration is
/// free: near a dead point motors reverse within a stage, of whatever length. The length of stages stays as it is.
std::optional<Motion> avoidDeadPoints(const MotionRequest& request, const Model& model, ProblemOptions problem,
                                      const MotionRecord& record);
inline constexpr double kWideDeadPointMargin = 0.4;

}  // namespace bielle
