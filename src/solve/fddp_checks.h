#pragma once
// Checks of a solve's input.
#include "bielle/solve/fddp.h"

namespace bielle {

/// Throws std::invalid_argument on options that make no sense, naming them.
void checkOptions(const FddpOptions& options);
/// Throws std::invalid_argument if the sizes of the trajectory are not those of the problem.
void checkSizes(const ShootingProblem& problem, const ShootingTrajectory& trajectory);

}  // namespace bielle
