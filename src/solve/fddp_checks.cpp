#include "solve/fddp_checks.h"

#include <stdexcept>

namespace bielle {

namespace {

[[noreturn]] void throwSize(const std::string& what, int index, Eigen::Index size, int expected) {
  throw std::invalid_argument("FDDP: " + what + " " + std::to_string(index) + " has size " + std::to_string(size) +
                              ", the problem expects " + std::to_string(expected));
}

void requireOf(const char* type, bool holds, const char* what) {
  if (!holds) throw std::invalid_argument(std::string(type) + ": " + what);
}

void checkIterationOptions(const char* type, const IterationOptions& o) {
  const auto require = [type](bool holds, const char* what) { requireOf(type, holds, what); };
  require(o.threads >= 0 && o.threads <= kMostThreads, "threads must lie between 0, which means all, and 1024");
  require(o.num_step_lengths >= 1, "num_step_lengths must be at least 1");
  require(o.min_regularization > 0, "min_regularization must be positive, or it could never be raised");
  require(o.initial_regularization >= o.min_regularization && o.initial_regularization <= o.max_regularization,
          "initial_regularization must lie between min_regularization and max_regularization");
  require(o.regularization_increase > 1 && o.regularization_decrease >= 1,
          "regularization_increase must exceed 1, and regularization_decrease must be at least 1");
  require(o.state_regularization_ratio >= 0, "state_regularization_ratio must not be negative");
  require(o.rollout_segments >= 1, "rollout_segments must be at least 1");
  require(o.acceptance > 0 && o.acceptance < 1, "acceptance must lie between 0 and 1");
}

}  // namespace

void checkOptions(const FddpOptions& o) {
  constexpr const char* kType = "FddpOptions";
  requireOf(kType, o.max_iterations >= 1 && o.max_iterations <= kMostIterations,
            "max_iterations must lie between 1 and 1000000");
  requireOf(kType, o.acceptable_decrease >= 0, "acceptable_decrease must not be negative");
  checkIterationOptions(kType, o);
}

void checkOptions(const RecedingOptions& o) {
  constexpr const char* kType = "RecedingOptions";
  requireOf(kType, o.iterations >= 1 && o.iterations <= kMostIterations, "iterations must lie between 1 and 1000000");
  checkIterationOptions(kType, o);
}

void checkSizes(const ShootingProblem& problem, const ShootingTrajectory& trajectory) {
  const int N = problem.numStages();
  if (N < 1) throw std::invalid_argument("FDDP: the problem has no stages");
  if (static_cast<int>(trajectory.xs.size()) != N + 1 || static_cast<int>(trajectory.us.size()) != N) {
    throw std::invalid_argument("FDDP: the guess has " + std::to_string(trajectory.xs.size()) + " states and " +
                                std::to_string(trajectory.us.size()) + " controls, the problem needs " +
                                std::to_string(N + 1) + " and " + std::to_string(N));
  }
  for (int k = 0; k <= N; ++k) {
    if (trajectory.xs[k].size() != problem.stateSize()) {
      throwSize("state", k, trajectory.xs[k].size(), problem.stateSize());
    }
    if (k < N && trajectory.us[k].size() != problem.controlSize(k)) {
      throwSize("control", k, trajectory.us[k].size(), problem.controlSize(k));
    }
  }
}

}  // namespace bielle
