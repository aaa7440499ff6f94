#pragma once
/// \file Stages that turn out too long for a motion.
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

}  // namespace bielle
