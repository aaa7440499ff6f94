#pragma once
// A solve that leaves its last iterate where the guess was.
#include "bielle/solve/fddp.h"

namespace bielle::test {

inline FddpSummary solveInPlace(const ShootingProblem& problem, ShootingTrajectory& trajectory,
                                const FddpOptions& options = {}, const FddpObserver& observer = {}) {
  FddpResult result = bielle::solve(problem, trajectory, options, observer);
  trajectory = std::move(result.trajectory);
  return std::move(result.summary);
}

}  // namespace bielle::test
