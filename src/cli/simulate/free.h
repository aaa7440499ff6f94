#pragma once
// `bielle simulate ROBOT`: a mechanism that moves by itself, in one world or in several, without a plan.
#include "cli/simulate/arguments.h"

namespace bielle::worlds {

/// Whether the arguments name a robot rather than a motion.
bool isFree(const SimulateArguments& arguments);

/// \returns whether the motion came to its end in every world
bool simulateFreely(const SimulateArguments& arguments, const std::vector<std::string>& command);

/// The start of a free motion: a closed state, and the torques of its state file.
struct FreeStart {
  VectorXd q, v, u;
};
/// The posture of the arguments, with what their state file gives: loops are closed about the joints that it places, and the
/// joints that it does not mention follow those that it moves. What does not fit to the loops is reported as a warning.
/// \throws InputError
FreeStart makeFreeStart(const Model& model, const SimulateArguments& arguments, const std::string& robot);

}  // namespace bielle::worlds
