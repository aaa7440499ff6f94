#pragma once
// Checks of a solve's input.
#include "solve/receding.h"

namespace bielle {

/// Of options. More threads than that would take all memory for nothing.
inline constexpr int kMostIterations = 1000000, kMostThreads = 1024;

/// Throws std::invalid_argument on options that make no sense, naming them.
void checkOptions(const FddpOptions& options);
void checkOptions(const RecedingOptions& options);
/// Throws std::invalid_argument if the sizes of the trajectory are not those of the problem.
void checkSizes(const ShootingProblem& problem, const ShootingTrajectory& trajectory);

}  // namespace bielle
