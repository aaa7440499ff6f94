#pragma once
// Allocations up to the end of each iteration of a solve. Include as count_allocations.h, in its place.
#include <vector>

#include "bielle/solve/fddp.h"
#include "count_allocations.h"

namespace bielle::test {

inline std::vector<long> countAllocations(const FddpOptions& options, const ShootingProblem& problem,
                                          ShootingTrajectory& trajectory) {
  std::vector<long> counts;
  counts.reserve(1000);
  FddpObserver observer;
  observer.callback = [&](const FddpIteration&) {
    counts.push_back(num_allocations);
    return FddpAction::Continue;
  };
  Fddp(options).solve(problem, trajectory, observer);
  return counts;
}

}  // namespace bielle::test
