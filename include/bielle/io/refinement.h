#pragma once
/// \file Motions whose stages turn out too long, and what is tried in their place.
#include <optional>

#include "bielle/io/motion_registry.h"
#include "bielle/io/record.h"
#include "bielle/io/result.h"

namespace bielle {

/// How far differences of velocities across midpoint steps are off the accelerations in their middle: the largest, in the
/// norm of the inertia of the robot, over the largest acceleration. `bielle check` allows kAllowedStepError. Of Euler steps 0.
double calcStepError(const Model& model, const MotionRecord& record);
inline constexpr double kLargestStepError = 0.004, kAllowedStepError = 0.005;

/// How much too long the stages of a solved motion are, which they are above 1: the larger of calcStepError() over
/// kLargestStepError and of the way of standing soles over kLargestSlip; `bielle check` allows 0.1 mm off the ground. Of Euler
/// steps 0.
double calcStageExcess(const Model& model, const MotionResult& result);
inline constexpr double kLargestSlip = 1e-4;  // m, of a corner, at most

/// The motion of a request once more, in stages half as long and with the solution as its guess, if their length was left to
/// the motion (`time_step` 0), no duration is free, the objective is not the least peak torque, and calcStageExcess() of the
/// solution is above 1. Sets `time_step`.
/// \param result  the solution of `solved`
std::optional<Motion> refineStages(const MotionRequest& request, const Model& model, const ProblemOptions& problem,
                                   const Motion& solved, const MotionResult& result);

/// The motion of least effort of a request, no sequence, once more from its plan, with linkages farther from their dead points
/// (kWideDeadPointMargin), if calcStepError() exceeds kLargestStepError where one of them is near its margin, and no duration is
/// free: near a dead point motors reverse within a stage, of whatever length. The length of stages stays as it is.
std::optional<Motion> avoidDeadPoints(const MotionRequest& request, const Model& model, ProblemOptions problem,
                                      const MotionRecord& record);
inline constexpr double kWideDeadPointMargin = 0.4;

}  // namespace bielle
