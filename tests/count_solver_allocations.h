#pragma once
// Allocations up to the end of each iteration of a solve. Include as count_allocations.h, in its place.
#include <vector>

#include "count_allocations.h"
#include "solve_in_place.h"

namespace bielle::test {

inline std::vector<long> countAllocations(const FddpOptions& options, const ShootingProblem& problem,
                                          ShootingTrajectory& trajectory) {
  std::vector<long> counts;
  counts.reserve(1000);
  FddpObserver observer;
  observer.callback = [&](const FddpIteration&, const ShootingTrajectory&) {
    counts.push_back(num_allocations);
    return FddpAction::Continue;
  };
  solveInPlace(problem, trajectory, options, observer);
  return counts;
}

}  // namespace bielle::test
