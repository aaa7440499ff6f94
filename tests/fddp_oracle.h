#pragma once
// What the tests of FDDP share: guesses, and an oracle that knows neither models nor sweeps, the gradient of the cost along
// its own rollouts by central differences.
#include <catch2/catch.hpp>

#include "bielle/solve/fddp.h"
#include "solve_problems.h"

namespace bielle::test {

// Controls zero, every state the initial one.
inline ShootingTrajectory makeGuess(const ShootingProblem& problem) {
  ShootingTrajectory guess;
  guess.xs.assign(problem.numStages() + 1, problem.initialState());
  for (int k = 0; k < problem.numStages(); ++k) guess.us.push_back(VectorXd::Zero(problem.controlSize(k)));
  return guess;
}

// States on the straight line to the goal: large gaps.
template <class Plant>
ShootingTrajectory makeLine(const PlantProblem<Plant>& problem) {
  ShootingTrajectory guess = makeGuess(problem);
  for (int k = 0; k <= problem.stages; ++k) {
    guess.xs[k] += double(k) / problem.stages * (VectorXd(problem.goal) - problem.start);
  }
  return guess;
}

inline double calcCost(ShootingProblem& problem, const std::vector<VectorXd>& us) {
  VectorXd x = problem.initialState(), next = x;
  double total = 0, cost = 0;
  for (size_t k = 0; k < us.size(); ++k) {
    problem.step(static_cast<int>(k), x, us[k], next, cost);
    total += cost;
    x = next;
  }
  problem.calcTerminalCost(x, cost);
  return total + cost;
}

// Of the node states as they are, whatever the gaps between them.
inline double calcCostAlong(ShootingProblem& problem, const ShootingTrajectory& t) {
  VectorXd next = t.xs[0];
  double total = 0, cost = 0;
  for (size_t k = 0; k < t.us.size(); ++k) {
    problem.step(static_cast<int>(k), t.xs[k], t.us[k], next, cost);
    total += cost;
  }
  problem.calcTerminalCost(t.xs.back(), cost);
  return total + cost;
}

// dJ/du of the rollout from the initial state, stage after stage.
inline VectorXd calcShootingGradient(ShootingProblem& problem, std::vector<VectorXd> us) {
  const double h = 1e-5;
  std::vector<double> gradient;
  for (VectorXd& u : us) {
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      const double saved = u[i];
      u[i] = saved + h;
      const double above = calcCost(problem, us);
      u[i] = saved - h;
      gradient.push_back((above - calcCost(problem, us)) / (2 * h));
      u[i] = saved;
    }
  }
  return Eigen::Map<VectorXd>(gradient.data(), static_cast<Eigen::Index>(gradient.size()));
}

inline double calcLargestGap(ShootingProblem& problem, const ShootingTrajectory& t) {
  double gap = 0, cost;
  VectorXd next(problem.stateSize());
  for (size_t k = 0; k < t.us.size(); ++k) {
    const int node = static_cast<int>(k);
    VectorXd dx(problem.tangentSize(node + 1));
    problem.step(node, t.xs[k], t.us[k], next, cost);
    problem.difference(node + 1, t.xs[k + 1], next, dx);
    gap = std::max(gap, dx.lpNorm<Eigen::Infinity>());
  }
  return gap;
}

inline void checkOptimal(ShootingProblem& problem, const FddpSummary& summary, const ShootingTrajectory& result) {
  CAPTURE(summary.message, summary.iterations, summary.cost);
  CHECK(summary.termination == FddpTermination::Converged);
  CHECK(calcLargestGap(problem, result) < 1e-10);
  CHECK(summary.gap < 1e-10);
  CHECK(calcCost(problem, result.us) == Approx(summary.cost).epsilon(1e-8));
  CHECK(calcShootingGradient(problem, result.us).lpNorm<Eigen::Infinity>() < 1e-4);
  std::vector<VectorXd> poisoned = result.us;
  poisoned[poisoned.size() / 2][0] += 0.1;
  CHECK(calcShootingGradient(problem, poisoned).lpNorm<Eigen::Infinity>() > 3e-4);
}

// Small enough a gradient for the controls themselves to be exact, not only the cost.
inline FddpOptions makeTightOptions() {
  FddpOptions options;
  options.gradient_tolerance = 1e-18;
  options.cost_tolerance = 0;
  return options;
}
}  // namespace bielle::test
