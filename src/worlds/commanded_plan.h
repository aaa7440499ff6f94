#pragma once
/// \file A walk that follows a file of commands, made while it is carried out.
#include "worlds/plan.h"

namespace bielle::worlds {

/// The reference of the plan is the standing posture, moved along the path that the commands foresee, with the ground and the
/// contacts of that path; there is only predictive control.
/// \param request  of the motion 'walk'; its settings are those of locomotion.h   \param file  of commands (motion/commanded_walk.h)
/// \throws InputError when the file cannot be read, a command is impossible, the motion is no walk or an option does not exist
std::unique_ptr<Plan> makeCommandedPlan(const PlanRequest& request, const std::string& file,
                                        const PredictiveOptions& predictive = {});

}  // namespace bielle::worlds
