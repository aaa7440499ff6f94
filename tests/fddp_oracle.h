#pragma once
// Shared by the tests of FDDP: guesses, and an oracle that knows neither models nor sweeps, the gradient of the cost
// along its own rollouts by central differences.
#include <catch2/catch.hpp>

#include "solve_in_place.h"
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

// One node, evaluated alone.
inline std::unique_ptr<NodeEvaluation> evaluate(const ShootingProblem& problem, int node, const VectorXd& x,
                                                const VectorXd* u = nullptr) {
  auto out = problem.makeEvaluation();
  EvaluateTask task;
  task.node = node;
  task.x = &x;
  task.u = u;
  task.out = out.get();
  problem.evaluate(&task, 1, problem.makeScratch().get());
  return out;
}

inline double calcCost(const ShootingProblem& problem, const std::vector<VectorXd>& us) {
  VectorXd x = problem.initialState();
  double total = 0;
  for (size_t k = 0; k < us.size(); ++k) {
    const auto node = evaluate(problem, static_cast<int>(k), x, &us[k]);
    total += node->cost;
    x = node->x_next;
  }
  return total + evaluate(problem, problem.numStages(), x)->cost;
}

// Cost of the node states as they are, whatever the gaps between them.
inline double calcCostAlong(const ShootingProblem& problem, const ShootingTrajectory& t) {
  double total = 0;
  for (size_t k = 0; k < t.us.size(); ++k) total += evaluate(problem, static_cast<int>(k), t.xs[k], &t.us[k])->cost;
  return total + evaluate(problem, problem.numStages(), t.xs.back())->cost;
}

// df/du by central differences, f a function of the controls, stage after stage.
template <class Function>
VectorXd calcControlGradient(std::vector<VectorXd> us, const Function& f) {
  const double h = 1e-5;
  std::vector<double> gradient;
  for (VectorXd& u : us) {
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      const double saved = u[i];
      u[i] = saved + h;
      const double above = f(us);
      u[i] = saved - h;
      gradient.push_back((above - f(us)) / (2 * h));
      u[i] = saved;
    }
  }
  return Eigen::Map<VectorXd>(gradient.data(), static_cast<Eigen::Index>(gradient.size()));
}

// dJ/du of the rollout from the initial state.
inline VectorXd calcShootingGradient(const ShootingProblem& problem, const std::vector<VectorXd>& us) {
  return calcControlGradient(us, [&](const std::vector<VectorXd>& all) { return calcCost(problem, all); });
}

inline double calcLargestGap(const ShootingProblem& problem, const ShootingTrajectory& t) {
  const int N = problem.numStages();
  double gap = 0;
  for (int k = 0; k < N; ++k) {
    const auto node = evaluate(problem, k, t.xs[k], &t.us[k]);
    const auto next = evaluate(problem, k + 1, t.xs[k + 1], k + 1 < N ? &t.us[k + 1] : nullptr);
    VectorXd dx(problem.tangentSize(k + 1));
    const DifferenceTask task{k + 1, next.get(), &node->x_next, &dx};
    problem.difference(&task, 1, problem.makeScratch().get());
    gap = std::max(gap, dx.norm());
  }
  return gap;
}

inline void checkOptimal(const ShootingProblem& problem, const FddpSummary& summary, const ShootingTrajectory& result) {
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
