// Constraints from one solve to the next: multipliers that are kept and moved on, and iterations of receding horizons.
#include <catch2/catch.hpp>

#include "constrained_problem.h"
#include "fddp_oracle.h"

using namespace bielle;
using namespace bielle::test;

TEST_CASE("multipliers are worth keeping") {
  auto problem = makeBoundedCartPole();
  ShootingTrajectory t = makeGuess(problem);
  Fddp solver;
  const FddpSummary cold = solver.solve(problem, t);
  REQUIRE(cold.termination == FddpTermination::Converged);
  const Multipliers multipliers = solver.getMultipliers();
  problem.start[0] += 0.001;
  ShootingTrajectory warm = t, half = t;
  Fddp kept, forgotten;
  kept.setMultipliers(multipliers);
  const FddpSummary with = kept.solve(problem, warm), without = forgotten.solve(problem, half);
  CAPTURE(cold.iterations, with.iterations, without.iterations);
  CHECK(with.termination == FddpTermination::Converged);
  CHECK(with.iterations < without.iterations);
  // A solver that is used again starts anew.
  ShootingTrajectory again = makeGuess(problem), first = again;
  const FddpSummary second = kept.solve(problem, again), fresh = Fddp().solve(problem, first);
  CHECK(second.iterations == fresh.iterations);
  CHECK(again.us == first.us);
}

TEST_CASE("a horizon that advances takes its multipliers along") {
  auto problem = makeBoundedCartPole();
  ShootingTrajectory t = makeGuess(problem);
  Fddp solver;
  solver.solve(problem, t);
  const std::vector<VectorXd> before = solver.getMultipliers().values;
  solver.advance(t);
  const Multipliers after = solver.getMultipliers();
  const size_t N = t.us.size();
  REQUIRE(after.values.size() == N + 1);
  double largest = 0;
  for (size_t k = 0; k + 1 < N; ++k) {
    CHECK(after.values[k] == before[k + 1]);
    largest = std::max(largest, after.values[k].lpNorm<Eigen::Infinity>());
  }
  CHECK(largest > 0);
  CHECK(after.values[N - 1] == before[N - 1]);
  CHECK(after.values[N] == before[N]);
}

TEST_CASE("solves of one iteration, for receding horizons, linearize once each and reach the optimum together") {
  using Problem = Constrained<PlantProblem<Linear>>;
  struct Counted : Problem {
    explicit Counted(const Problem& problem) : Problem(problem) {}
    using Problem::linearize;
    void linearize(LinearizeTask& task, ProblemScratch* scratch) const override {
      ++linearized;
      Problem::linearize(task, scratch);
    }
    mutable int linearized = 0;
  };
  Counted problem{Problem(makeLinear())};
  problem.rows.push_back(
      {"speed", 1, problem.stages, -0.4, kFree, [](const Complex* x, const Complex*) { return x[1] + x[2]; }});
  ShootingTrajectory t = makeGuess(problem), optimum = t;
  REQUIRE(Fddp().solve(problem, optimum).termination == FddpTermination::Converged);
  FddpOptions options;
  options.threads = options.max_iterations = 1;
  options.last_rollout = LastRollout::Segments;
  options.constraints.initial_penalty = 1;
  options.constraints.penalty_increase = 1;
  Fddp solver(options);
  problem.linearized = 0;
  constexpr int kSolves = 25;
  const auto calcError = [&] {
    double error = 0;
    for (size_t k = 0; k < t.us.size(); ++k) error = std::max(error, (t.us[k] - optimum.us[k]).norm());
    return error;
  };
  double first = 0;
  for (int i = 0; i < kSolves; ++i) {
    if (i > 0) solver.setMultipliers(solver.getMultipliers());
    solver.solve(problem, t);
    CHECK(problem.linearized == (i + 1) * (problem.stages + 1));
    if (i == 0) first = calcError();
  }
  CAPTURE(first);
  CHECK(calcError() < 0.01 * first);
}

TEST_CASE("in receding horizons a row that binds does not come free and is violated in every other iteration") {
  Constrained<PlantProblem<Linear>> problem(makeLinear());
  ShootingTrajectory t = makeGuess(problem);
  REQUIRE(Fddp().solve(problem, t).termination == FddpTermination::Converged);  // violates what now comes
  problem.rows.push_back(
      {"speed", 1, problem.stages, -0.4, kFree, [](const Complex* x, const Complex*) { return x[1] + x[2]; }});
  const auto calcViolation = [&] {
    double violation = 0;
    for (int k = 1; k <= problem.stages; ++k) violation = std::max(violation, -0.4 - (t.xs[k][1] + t.xs[k][2]));
    return violation;
  };
  const double first = calcViolation();
  REQUIRE(first > 0.1);
  FddpOptions options;
  options.threads = options.max_iterations = 1;
  options.last_rollout = LastRollout::Segments;
  options.constraints.initial_penalty = 1000;  // the cost alone would let rows be violated by little
  options.constraints.penalty_increase = 1;
  Fddp solver(options);
  for (int i = 0; i < 6; ++i) {
    if (i > 0) solver.setMultipliers(solver.getMultipliers());
    solver.solve(problem, t);
    CAPTURE(i, first);
    if (i > 0) CHECK(calcViolation() < 0.05 * first);  // after the first, rows that had no multipliers are violated
  }
}
