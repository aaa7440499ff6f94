// Constraints from one solve to the next: multipliers that are kept and moved on, and iterations of receding horizons.
#include <catch2/catch.hpp>

#include "constrained_problem.h"
#include "fddp_oracle.h"
#include "solve/receding.h"

using namespace bielle;
using namespace bielle::test;

namespace {

RecedingOptions makeOptions(int iterations) {
  RecedingOptions options;
  options.iterations = iterations;
  return options;
}

Row makeSpeedRow(int stages) {
  return {"speed", 1, stages, -0.4, kFree, [](const Complex* x, const Complex*) { return x[1] + x[2]; }};
}

}  // namespace

TEST_CASE("multipliers are worth keeping") {
  auto problem = makeBoundedCartPole();
  const FddpResult cold = solve(problem, makeGuess(problem));
  REQUIRE(cold.summary.termination == FddpTermination::Converged);
  problem.start[0] += 0.001;
  const FddpSummary with = solve(problem, cold.trajectory, {}, {}, cold.multipliers).summary,
                    without = solve(problem, cold.trajectory).summary;
  CAPTURE(cold.summary.iterations, with.iterations, without.iterations);
  CHECK(with.termination == FddpTermination::Converged);
  CHECK(with.iterations < without.iterations);
  CHECK_THROWS_WITH(solve(problem, cold.trajectory, {}, {}, {cold.multipliers.values, 0}), Catch::Contains("penalty"));
}

TEST_CASE("a horizon that neither advances nor is given multipliers starts anew") {
  auto problem = makeBoundedCartPole();
  ShootingTrajectory t = makeGuess(problem), again = t, first = t;
  Receding kept(problem, makeOptions(20));
  kept.step(t);
  const FddpSummary second = kept.step(again), fresh = Receding(problem, makeOptions(20)).step(first);
  CHECK(second.iterations == fresh.iterations);
  CHECK(again.us == first.us);
}

TEST_CASE("a horizon that advances takes its multipliers along") {
  auto problem = makeBoundedCartPole();
  FddpResult result = solve(problem, makeGuess(problem));
  ShootingTrajectory& t = result.trajectory;
  Receding solver(problem);
  solver.setMultipliers(result.multipliers);
  solver.step(t);
  const std::vector<VectorXd> before = solver.multipliers().values;
  solver.advance(t);
  const Multipliers after = solver.multipliers();
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

  std::vector<NodeSource> halves(N + 1);
  for (size_t k = 0; k <= N; ++k) halves[k] = {static_cast<int>(k / 2), 0.5};
  solver.move(halves);
  for (size_t k = 0; k <= N; ++k) CHECK(solver.multipliers().values[k] == 0.5 * after.values[k / 2]);
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
  problem.rows.push_back(makeSpeedRow(problem.stages));
  ShootingTrajectory t = makeGuess(problem), optimum = t;
  REQUIRE(solveInPlace(problem, optimum).termination == FddpTermination::Converged);
  RecedingOptions options;
  options.threads = 1;
  options.constraints.initial_penalty = 1;
  options.constraints.penalty_increase = 1;
  Receding solver(problem, options);
  problem.linearized = 0;
  constexpr int kSolves = 25;
  const auto calcError = [&] {
    double error = 0;
    for (size_t k = 0; k < t.us.size(); ++k) error = std::max(error, (t.us[k] - optimum.us[k]).norm());
    return error;
  };
  double first = 0;
  for (int i = 0; i < kSolves; ++i) {
    if (i > 0) solver.setMultipliers(solver.multipliers());
    solver.step(t);
    CHECK(problem.linearized == (i + 1) * (problem.stages + 1));
    if (i == 0) first = calcError();
  }
  CAPTURE(first);
  CHECK(calcError() < 0.01 * first);
}

TEST_CASE("a receding step keeps the evaluations about which its gains are") {
  auto problem = makeBoundedCartPole();
  const int iterations = GENERATE(1, 3);
  ShootingTrajectory t = makeGuess(problem), linearized, last = t;
  FddpObserver observer;
  observer.callback = [&](const FddpIteration&, const ShootingTrajectory& trajectory) {
    linearized = std::exchange(last, trajectory);
    return FddpAction::Continue;
  };
  Receding solver(problem, makeOptions(iterations));
  REQUIRE(solver.step(t, observer).iterations == iterations);
  const size_t stages = t.us.size();
  for (size_t k = 0; k <= stages; ++k) {
    CAPTURE(iterations, k);
    CHECK(solver.getLinearized(static_cast<int>(k)).x == linearized.xs[k]);
    if (k > 0) CHECK(linearized.xs[k] != t.xs[k]);
  }
}

TEST_CASE("in receding horizons a row that binds does not come free and is violated in every other iteration") {
  Constrained<PlantProblem<Linear>> problem(makeLinear());
  ShootingTrajectory t = makeGuess(problem);
  REQUIRE(solveInPlace(problem, t).termination == FddpTermination::Converged);  // violates what now comes
  problem.rows.push_back(makeSpeedRow(problem.stages));
  const auto calcViolation = [&] {
    double violation = 0;
    for (int k = 1; k <= problem.stages; ++k) violation = std::max(violation, -0.4 - (t.xs[k][1] + t.xs[k][2]));
    return violation;
  };
  const double first = calcViolation();
  REQUIRE(first > 0.1);
  RecedingOptions options;
  options.threads = 1;
  options.constraints.initial_penalty = 1000;  // the cost alone would let rows be violated by little
  options.constraints.penalty_increase = 1;
  Receding solver(problem, options);
  for (int i = 0; i < 6; ++i) {
    if (i > 0) solver.setMultipliers(solver.multipliers());
    solver.step(t);
    CAPTURE(i, first);
    if (i > 0) CHECK(calcViolation() < 0.05 * first);  // after the first, rows that had no multipliers are violated
  }
}

TEST_CASE("a receding step without an acceptable trial leaves the trajectory and its multipliers as they are") {
  using Problem = Constrained<PlantProblem<Linear>>;
  struct Steep : Problem {
    explicit Steep(const Problem& problem) : Problem(problem) {}
    using Problem::linearize;
    void linearize(LinearizeTask& task, ProblemScratch* scratch) const override {
      Problem::linearize(task, scratch);
      task.out->lx *= slope;
      task.out->lu *= slope;
    }
    double slope = 1;
  };
  Steep problem{Problem(makeLinear())};
  problem.rows.push_back(makeSpeedRow(problem.stages));
  RecedingOptions options = makeOptions(GENERATE(1, 3));
  options.threads = 1;
  options.constraints.penalty_increase = 1;
  Receding solver(problem, options);
  ShootingTrajectory t = makeGuess(problem);
  std::vector<NodeSource> stays(t.xs.size());
  for (size_t k = 0; k < stays.size(); ++k) stays[k] = {static_cast<int>(k), 1, k > 0};
  const auto step = [&](bool prepares) {
    solver.move(stays);
    if (prepares) solver.prepare(t);
    return solver.step(t);
  };
  solver.step(t);
  const ShootingTrajectory before = t;
  const std::vector<VectorXd> multipliers = solver.multipliers().values;
  problem.slope = 1000;  // steps overshoot, and are rejected
  for (const bool prepares : {false, true, true}) {
    const FddpSummary summary = step(prepares);
    CAPTURE(prepares, options.iterations, summary.message);
    CHECK_THAT(summary.message, Catch::Contains("no step is acceptable"));
    CHECK(t.us == before.us);
    CHECK(solver.multipliers().values == multipliers);
  }
  problem.slope = 1;
  CHECK(step(true).iterations > 0);
  CHECK(solver.multipliers().values != multipliers);
}

TEST_CASE("a step that was prepared before its initial state was known is the same to the last bit") {
  auto problem = makeBoundedCartPole();
  FddpResult solved = solve(problem, makeGuess(problem));
  RecedingOptions options = makeOptions(GENERATE(1, 2));
  options.threads = GENERATE(1, 2);
  options.constraints.initial_penalty = solved.multipliers.penalty;
  options.constraints.penalty_increase = 1;
  Receding plain(problem, options), prepared(problem, options);
  ShootingTrajectory t = solved.trajectory, other = t;
  plain.setMultipliers(solved.multipliers);
  prepared.setMultipliers(solved.multipliers);
  std::vector<NodeSource> stays(t.xs.size());
  for (size_t k = 0; k < stays.size(); ++k) stays[k] = {static_cast<int>(k), 1, k > 0};
  const VectorXd nominal = problem.start;
  double moved = 0;
  for (int i = 0; i < 6; ++i) {
    CAPTURE(i, options.iterations, options.threads);
    prepared.prepare(other);
    if (i % 3 == 1) {  // for nothing: the window moves on otherwise
      prepared.move(stays);
      if (i == 4) prepared.prepare(other);
    }
    problem.start = nominal + VectorXd::Constant(nominal.size(), 1e-3 * (i + 1));
    const FddpSummary whole = plain.step(t), rest = prepared.step(other);
    CHECK(t.xs == other.xs);
    CHECK(t.us == other.us);
    CHECK(whole.cost == rest.cost);
    CHECK(whole.violation == rest.violation);
    CHECK(plain.multipliers().values == prepared.multipliers().values);
    for (size_t k = 0; k < t.us.size(); ++k) {
      moved = std::max(moved, (t.us[k] - solved.trajectory.us[k]).norm());
      CHECK(plain.getGains(static_cast<int>(k)).K == prepared.getGains(static_cast<int>(k)).K);
    }
    for (Receding* solver : {&plain, &prepared}) solver->move(stays);
  }
  CHECK(moved > 1e-3);
  prepared.prepare(other);
  other.us[3][0] += 1e-9;
  CHECK_THROWS_WITH(prepared.step(other), Catch::Contains("node 3"));
  Receding growing(problem);
  CHECK_THROWS_WITH(growing.prepare(t), Catch::Contains("constant penalty"));
}

namespace {

constexpr int kForeseen = 4;  // stages

struct Step {
  FddpSummary summary;
  Foresight foresight;
  int uses = 0;
};

Step foresee(Receding& solver, ShootingTrajectory& t) {
  Step out;
  out.foresight.stages = kForeseen;
  out.foresight.use = [&] { ++out.uses; };
  out.summary = solver.step(t, {}, &out.foresight);
  return out;
}

double calcDistance(const Foresight& foresight, const ShootingTrajectory& t) {
  double distance = 0;
  for (int k = 0; k <= kForeseen; ++k) distance = std::max(distance, (foresight.nodes.xs[k] - t.xs[k]).norm());
  for (int k = 0; k < kForeseen; ++k) distance = std::max(distance, (foresight.nodes.us[k] - t.us[k]).norm());
  return distance;
}

}  // namespace

TEST_CASE("what a receding step foresees is what its rollout leads to: to first order, and where models are exact") {
  auto linear = makeLinear();
  ShootingTrajectory t = makeGuess(linear);
  Receding exact(linear, makeOptions(1));
  const ShootingTrajectory guess = t;
  const Step step = foresee(exact, t);
  CHECK(step.uses == 1);
  CHECK((t.us[0] - guess.us[0]).norm() > 0.1);
  CHECK(calcDistance(step.foresight, t) < 1e-12);

  auto problem = makeCartPole();
  problem.start << 0.3, 0.3, 0, 0;
  const FddpResult solved = solve(problem, makeGuess(problem), makeTightOptions());
  REQUIRE(solved.summary.termination == FddpTermination::Converged);
  const VectorXd nominal = problem.start;
  const auto calcError = [&](double moved) {
    problem.start = nominal + VectorXd::Constant(nominal.size(), moved);
    ShootingTrajectory near = solved.trajectory;
    Receding solver(problem, makeOptions(1));
    const Step foreseen = foresee(solver, near);
    CHECK(foreseen.uses == 1);
    CHECK(foreseen.foresight.nodes.xs[0] == problem.start);
    if (moved > 0) {
      CHECK(foreseen.summary.log.back().step == 1);
      CHECK(foreseen.foresight.nodes.us[0] == near.us[0]);  // nothing has been rolled out before
    }
    return calcDistance(foreseen.foresight, near);
  };
  const double whole = calcError(0.02), half = calcError(0.01);
  CAPTURE(whole, half);
  CHECK(whole > 1e-7);
  CHECK(half < 0.3 * whole);
  CHECK(calcError(0) < 1e-6);

  problem.start = nominal + VectorXd::Constant(nominal.size(), 0.02);
  ShootingTrajectory once = solved.trajectory, twice = once;
  Receding one(problem, makeOptions(1)), two(problem, makeOptions(2));
  one.step(once);
  const Step last = foresee(two, twice);
  CHECK(last.uses == 1);
  CHECK(last.summary.iterations == 2);
  CHECK(calcDistance(last.foresight, twice) < 0.1 * calcDistance(last.foresight, once));  // of the last iteration
}

TEST_CASE("what a receding step foresees keeps to the bounds, and is told though the step is then rejected") {
  auto problem = makeCartPole();
  problem.bound = 0.5;
  ShootingTrajectory t = makeGuess(problem);
  problem.start[1] -= 0.5;
  Receding solver(problem, makeOptions(1));
  const Step bounded = foresee(solver, t);
  CHECK(bounded.uses == 1);
  int at_bound = 0;
  for (const VectorXd& u : bounded.foresight.nodes.us) {
    CHECK(std::abs(u[0]) <= problem.bound);
    at_bound += std::abs(u[0]) == problem.bound;
  }
  CHECK(at_bound > 0);

  struct Steep : PlantProblem<Linear> {
    Steep() : PlantProblem<Linear>(makeLinear()) {}
    using PlantProblem<Linear>::linearize;
    void linearize(LinearizeTask& task, ProblemScratch* scratch) const override {
      PlantProblem<Linear>::linearize(task, scratch);
      task.out->lx *= 1000;
      task.out->lu *= 1000;
    }
  } steep;
  t = makeGuess(steep);
  Receding overshooting(steep, makeOptions(2));
  const ShootingTrajectory before = t;
  const Step rejected = foresee(overshooting, t);
  CHECK_THAT(rejected.summary.message, Catch::Contains("no step is acceptable"));
  CHECK(rejected.uses == 1);
  CHECK(t.us == before.us);
}
