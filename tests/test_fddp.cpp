// FDDP on small problems: optima, contraction of the gaps, bounds, threads, segments, no allocation.
#include <catch2/catch.hpp>
#include <random>

#include "count_solver_allocations.h"
#include "fddp_oracle.h"
#include "solve/lq_sweep.h"
#include "solve/receding.h"

using namespace bielle;
using namespace bielle::test;

TEST_CASE("a linear-quadratic problem is solved by one full step from any guess") {
  auto problem = makeLinear();
  ShootingTrajectory t = makeLine(problem);
  for (VectorXd& u : t.us) u.setRandom();
  REQUIRE(calcLargestGap(problem, t) > 0.01);
  FddpOptions options;
  options.gradient_tolerance = 1e-14;
  const FddpSummary summary = solveInPlace(problem, t, options);
  checkOptimal(problem, summary, t);
  CHECK(summary.iterations == 1);
  REQUIRE(summary.log.size() == 2);
  CHECK(summary.log[0].step == 1);
  CHECK(summary.log[1].step == 0);
}

TEST_CASE("a pendulum swings up from feasible and infeasible guesses") {
  auto problem = makePendulum();
  for (const ShootingTrajectory& guess : {makeGuess(problem), makeLine(problem)}) {
    ShootingTrajectory t = guess;
    checkOptimal(problem, solveInPlace(problem, t, makeTightOptions()), t);
    CHECK((t.xs.back() - problem.goal).norm() < 0.05);
  }
}

TEST_CASE("a cart-pole swings up from feasible and infeasible guesses") {
  auto problem = makeCartPole();
  for (const ShootingTrajectory& guess : {makeGuess(problem), makeLine(problem)}) {
    ShootingTrajectory t = guess;
    checkOptimal(problem, solveInPlace(problem, t, makeTightOptions()), t);
    CHECK((t.xs.back() - problem.goal).norm() < 0.05);
  }
}

TEST_CASE("a body turns on SO(3), from a guess that jumps about") {
  TurningBody problem;
  problem.goal << 0.6, 0.4, -0.3, -0.2;
  problem.goal.normalize();
  problem.start.tail(3) << 0.3, -0.5, 1;
  ShootingTrajectory t = makeGuess(problem);
  std::mt19937 rng(1);
  std::normal_distribution<double> normal(0, 0.4);
  for (size_t k = 1; k < t.xs.size(); ++k) {
    const VectorXd dx = VectorXd::NullaryExpr(6, [&](Eigen::Index) { return normal(rng); }), x = t.xs[k];
    problem.calcSum(x, dx, t.xs[k]);
  }
  REQUIRE(calcLargestGap(problem, t) > 0.5);
  checkOptimal(problem, solveInPlace(problem, t, makeTightOptions()), t);
}

TEST_CASE("multiple shooting brings an unstable plant to rest from a guess from which rollouts in one piece do not") {
  auto problem = makeCartPole();
  problem.stages = 200;
  problem.start << 0, 0.4, 0, 0;
  problem.goal.setZero();  // its pole is upright, and stays there, but for what the guess says
  FddpSummary summaries[2];
  for (const bool multiple : {false, true}) {
    ShootingTrajectory t = makeGuess(problem);
    std::mt19937 rng(7);  // other guesses are solved by both, and a few by the other way alone
    std::normal_distribution<double> normal;
    for (VectorXd& x : t.xs) x = VectorXd::NullaryExpr(4, [&](Eigen::Index) { return 2 * normal(rng); });
    for (VectorXd& u : t.us) u.setConstant(10 * normal(rng));
    FddpOptions options;
    options.multiple_shooting = multiple;
    summaries[multiple] = solveInPlace(problem, t, options);
  }
  CHECK(summaries[true].termination == FddpTermination::Converged);
  CHECK(summaries[true].cost == Approx(0.223682).epsilon(1e-5));  // that of the guess that stays upright
  CHECK(summaries[true].iterations < 30);
  CHECK(summaries[false].cost > 1.01 * summaries[true].cost);
}

TEST_CASE("the gaps contract by 1 - alpha, and the log tells so") {
  auto problem = makeCartPole();
  ShootingTrajectory t = makeLine(problem);
  FddpOptions options;
  options.max_iterations = 3;
  const double before = calcLargestGap(problem, t);
  const FddpSummary summary = solveInPlace(problem, t, options);
  CHECK(summary.termination == FddpTermination::MaxIterations);
  REQUIRE(summary.log.size() == 3);
  double expected = before;
  for (const FddpIteration& line : summary.log) {
    CHECK(line.gap == Approx(expected).epsilon(1e-9));
    REQUIRE(line.step < 1);
    expected *= 1 - line.step;
  }
  CHECK(summary.gap == Approx(expected).epsilon(1e-9));
  CHECK(calcLargestGap(problem, t) == Approx(expected).epsilon(1e-9));
}

TEST_CASE("bounds hold, and the controls on them press outwards") {
  const auto check = [](auto problem, const ShootingTrajectory& guess) {
    ShootingTrajectory t = guess;
    FddpOptions options = makeTightOptions();
    options.gradient_tolerance = 1e-14;
    const FddpSummary summary = solveInPlace(problem, t, options);
    CAPTURE(summary.message, summary.iterations);
    CHECK(summary.termination == FddpTermination::Converged);
    CHECK(calcLargestGap(problem, t) < 1e-10);
    CHECK((t.xs.back() - problem.goal).norm() < 0.1);
    const VectorXd gradient = calcShootingGradient(problem, t.us);
    int at_bound = 0, inside = 0;
    for (size_t k = 0; k < t.us.size(); ++k) {
      const double u = t.us[k][0];
      REQUIRE(std::abs(u) <= problem.bound);
      const double projected = std::clamp(u - gradient[k], -problem.bound, problem.bound) - u;
      CHECK(std::abs(projected) < 1e-4);
      (std::abs(u) == problem.bound ? at_bound : inside) += 1;
    }
    CHECK(at_bound > 5);
    CHECK(inside > 5);
  };
  auto pendulum = makePendulum();
  pendulum.stages = 150;
  pendulum.bound = 5;
  check(pendulum, makeGuess(pendulum));
  check(pendulum, makeLine(pendulum));
  auto cart_pole = makeCartPole();
  cart_pole.bound = 12;
  check(cart_pole, makeGuess(cart_pole));
}

TEST_CASE("bounds that are far away, or infinite beside them, change nothing but rounding") {
  struct FarBounds : TurningBody {
    void getControlBounds(int, VectorRef lower, VectorRef upper) const override {
      lower << -1e6, -std::numeric_limits<double>::infinity(), -1e6;
      upper << std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), 1e6;
    }
  } bounded;
  TurningBody problem;
  problem.goal << 0.6, 0.4, -0.3, 0.2;
  problem.goal.normalize();
  ShootingTrajectory free = makeGuess(problem), boxed = free;
  FddpOptions options;
  options.gradient_tolerance = 1e-16;
  bounded.goal = problem.goal;
  CHECK(bounded.hasControlBounds());
  CHECK_FALSE(problem.hasControlBounds());
  const FddpSummary first = solveInPlace(problem, free, options), second = solveInPlace(bounded, boxed, options);
  CHECK(first.iterations == second.iterations);
  CHECK(first.cost == Approx(second.cost).epsilon(1e-12));
  for (size_t k = 0; k < free.us.size(); ++k) CHECK((free.us[k] - boxed.us[k]).norm() < 1e-6);
}

namespace {

// A swing-up whose cost is known only up to an error, as long sums and badly conditioned dynamics leave it.
struct RoundedPendulum : PlantProblem<Pendulum> {
  explicit RoundedPendulum(const PlantProblem<Pendulum>& problem) : PlantProblem(problem) {}
  double error = 0;  // over a constant that the cost contains
  double calcTerminalCost(const VectorXd& x) const override {
    return PlantProblem::calcTerminalCost(x) + 10 * (1 + error * std::sin(1e13 * x[0]));
  }
};

}  // namespace

TEST_CASE("a decrease that rounding hides ends a solve as converged, and a larger error of the cost does not") {
  RoundedPendulum problem(makePendulum());
  FddpOptions options = makeTightOptions();
  options.gradient_tolerance = 1e-30;
  options.cost_tolerance = 0;
  for (double error : {3e-13, 1e-8}) {
    CAPTURE(error);
    problem.error = error;
    ShootingTrajectory t = makeGuess(problem);
    const FddpSummary summary = solveInPlace(problem, t, options);
    const bool hidden = error < 1e-12;
    CHECK((summary.termination == FddpTermination::Converged) == hidden);
    if (!hidden) continue;
    CHECK(summary.message == "the cost no longer decreases");
    CHECK(summary.iterations < 60);
    problem.error = 0;
    checkOptimal(problem, summary, t);
  }
}

TEST_CASE("the number of threads does not change one bit of the result") {
  auto problem = makeCartPole();
  ShootingTrajectory one = GENERATE(0, 1) ? makeLine(problem) : makeGuess(problem), two = one;
  FddpOptions options;
  options.threads = 1;
  const FddpSummary first = solveInPlace(problem, one, options);
  options.threads = 2;
  const FddpSummary second = solveInPlace(problem, two, options);
  CHECK(first.iterations == second.iterations);
  CHECK(first.cost == second.cost);
  CHECK(one.xs == two.xs);
  CHECK(one.us == two.us);
}

TEST_CASE("a rollout in segments leads to the same optimum in about as many iterations") {
  const auto check = [](auto& problem, const ShootingTrajectory& guess) {
    FddpOptions options;
    options.gradient_tolerance = 1e-14;
    options.cost_tolerance = 0;
    options.rollout_segments = 1;
    ShootingTrajectory one = guess;
    const FddpSummary whole = solveInPlace(problem, one, options);
    checkOptimal(problem, whole, one);
    for (const int segments : {2, 3, 5}) {
      options.rollout_segments = segments;
      ShootingTrajectory t = guess;
      const FddpSummary summary = solveInPlace(problem, t, options);
      CAPTURE(segments, whole.iterations);
      checkOptimal(problem, summary, t);
      CHECK(summary.iterations <= whole.iterations + 2 + whole.iterations / 5);
      CHECK(summary.cost == Approx(whole.cost).epsilon(1e-9));
    }
  };
  auto pendulum = makePendulum();
  check(pendulum, makeGuess(pendulum));
  auto cart_pole = makeCartPole();
  check(cart_pole, makeGuess(cart_pole));
  TurningBody body;
  body.stages = 100;
  body.goal << 0.6, 0.4, -0.3, -0.2;
  body.goal.normalize();
  check(body, makeGuess(body));
}

namespace {

// Long enough for several segments, from a start that turns already.
void makeLongTurn(TurningBody& body) {
  body.stages = 100;
  body.goal << 0.6, 0.4, -0.3, -0.2;
  body.goal.normalize();
  body.start.tail(3) << 0.3, -0.5, 1;
}

}  // namespace

TEST_CASE("the gaps that segments open are there, known, and closed by the last iteration allowed") {
  TurningBody problem;
  makeLongTurn(problem);
  FddpOptions options;
  options.threads = GENERATE(1, 2);
  ShootingTrajectory t = makeGuess(problem);
  std::vector<double> gaps;
  FddpObserver observer;
  observer.callback = [&](const FddpIteration&, const ShootingTrajectory& iterate) {
    gaps.push_back(calcLargestGap(problem, iterate));
    return FddpAction::Continue;
  };
  options.max_iterations = 4;
  const FddpSummary summary = solveInPlace(problem, t, options, observer);
  REQUIRE(summary.termination == FddpTermination::MaxIterations);
  double largest = 0;
  for (size_t i = 1; i < summary.log.size(); ++i) {
    REQUIRE(summary.log[i - 1].step == 1);
    // gaps[i - 1] is read about the new node states, as linearizing does.
    CHECK(summary.log[i].gap == Approx(gaps[i - 1]).epsilon(1e-9).margin(1e-13));
    largest = std::max(largest, gaps[i - 1]);
  }
  CHECK(largest > 1e-6);
  CHECK(gaps.back() < 1e-13);
  CHECK(summary.gap == 0);

  // Stopped in between, the summary tells the open gap: to first order about the old node states.
  ShootingTrajectory stopped = makeGuess(problem);
  observer.callback = [&](const FddpIteration& line, const ShootingTrajectory&) {
    return line.iteration == 2 ? FddpAction::Stop : FddpAction::Continue;
  };
  const FddpSummary open = solveInPlace(problem, stopped, options, observer);
  const double actual = calcLargestGap(problem, stopped);
  REQUIRE(actual > 1e-6);
  CHECK(open.gap == Approx(actual).epsilon(0.3));
}

// Beyond the goals that the cart can reach, the models of its last steps foresee half of the curvature: full steps go too
// far by as much.
TEST_CASE("steps in segments that open ever wider gaps are given up for steps in one piece") {
  PlantProblem<CartPole> problem;
  problem.stages = 58;
  problem.control_weight = 0.0841713;
  problem.weight.setConstant(0.0393561);
  problem.terminal_weight.setConstant(48.4722);
  problem.start[1] = 0.247705;
  problem.goal << -0.90931, 5.14581, -1.49833, -1.39276;
  FddpOptions options;
  ShootingTrajectory t = makeGuess(problem), whole = t;
  const FddpSummary summary = solveInPlace(problem, t, options);
  options.rollout_segments = 1;
  const FddpSummary in_one_piece = solveInPlace(problem, whole, options);
  CAPTURE(summary.iterations, in_one_piece.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
  CHECK(summary.cost == Approx(in_one_piece.cost).epsilon(1e-9));
  CHECK(summary.iterations < 3 * in_one_piece.iterations);
}

TEST_CASE("a short last step closes the gaps by a second rollout in segments, a long one by a rollout in one piece") {
  struct CountingBody : TurningBody {
    mutable std::atomic<int> steps{0};
    double calcStep(int stage, const VectorXd& x, const VectorXd& u, VectorXd& x_next) const override {
      ++steps;
      return TurningBody::calcStep(stage, x, u, x_next);
    }
  } problem;
  makeLongTurn(problem);
  FddpOptions options;
  RecedingOptions receding;
  options.threads = receding.threads = GENERATE(1, 2);
  options.gradient_tolerance = receding.gradient_tolerance = 1e-30;  // the end of the iterations is theirs
  int short_steps = 0, long_steps = 0;
  for (int iterations = 2; iterations <= 9; ++iterations) {
    CAPTURE(iterations);
    options.max_iterations = receding.iterations = iterations;
    const auto countSteps = [&](bool closes, double& gap) {
      ShootingTrajectory t = makeGuess(problem);
      problem.steps = 0;
      const FddpSummary summary = closes ? solveInPlace(problem, t, options) : Receding(problem, receding).step(t);
      REQUIRE(summary.log.back().step == 1);
      const int steps = problem.steps;
      gap = calcLargestGap(problem, t);
      CHECK(summary.gap == Approx(gap).epsilon(0.3).margin(1e-13));
      return steps;
    };
    double open = 0, closed = 0;
    const int steps = countSteps(false, open), more = countSteps(true, closed) - steps;
    CHECK(closed <= options.gap_tolerance);
    if (open <= options.gap_tolerance) {
      CHECK(more == 0);
      continue;
    }
    CHECK((more == 0 || more == problem.stages));
    ++(more > 0 ? short_steps : long_steps);
    if (more > 0) CHECK(closed < 1e-3 * open);
  }
  CHECK(short_steps > 0);
  CHECK(long_steps > 0);
}

TEST_CASE(
    "the seconds of evaluations, linearization, sweeps and rollouts are parts of those of the solve on one thread") {
  auto problem = makeCartPole();
  FddpOptions options;
  options.threads = 1;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = solveInPlace(problem, t, options);
  const double models = summary.evaluate_seconds + summary.linearize_seconds;
  const double parts = models + summary.sweep_seconds + summary.rollout_seconds;
  CHECK(std::min(
            {summary.evaluate_seconds, summary.linearize_seconds, summary.sweep_seconds, summary.rollout_seconds}) > 0);
  CHECK(parts <= summary.seconds);
  const int iterates = static_cast<int>(summary.log.size());
  CHECK(summary.linearizations == iterates * (problem.stages + 1));
  CHECK(summary.sweeps >= iterates);
  CHECK(summary.rollouts + summary.searches >= summary.iterations);
  CHECK((summary.search_seconds > 0) == (summary.searches > 0));
  CHECK(summary.search_seconds <= summary.rollout_seconds);
}

TEST_CASE("gains lead to the optimum from another start, which for a linear-quadratic problem they do exactly") {
  auto problem = makeLinear();
  const FddpResult at = solve(problem, makeGuess(problem));
  REQUIRE(at.summary.log.back().step == 0);
  REQUIRE(at.gains.size() == at.trajectory.us.size());
  problem.start[1] += 1;
  const FddpResult off = solve(problem, makeGuess(problem));
  for (size_t k = 0; k < at.gains.size(); ++k) {
    CHECK(at.gains[k].k.norm() < 1e-3);
    const VectorXd expected = at.gains[k].K * (off.trajectory.xs[k] - at.trajectory.xs[k]);
    const VectorXd found = off.trajectory.us[k] - at.trajectory.us[k];
    CHECK((found - expected).norm() < 1e-4 * (1 + expected.norm()));
    if (k == 0) CHECK((found - 1.001 * expected).norm() > 1e-4 * (1 + expected.norm()));
  }
}

TEST_CASE("an iteration after the first allocates nothing") {
  const long before = num_allocations;
  const VectorXd by_malloc(100);
  const std::vector<double> by_new(100);
  REQUIRE(num_allocations == before + 2);
  const double bound = GENERATE(12.0, std::numeric_limits<double>::infinity());
  const int threads = GENERATE(1, 2);
  auto problem = makeCartPole();
  problem.bound = bound;
  ShootingTrajectory t = makeLine(problem);
  FddpOptions options;
  options.threads = threads;
  const std::vector<long> counts = countAllocations(options, problem, t);
  REQUIRE(counts.size() > 10);
  CHECK(counts.back() == counts.front());
}

TEST_CASE("sweeps of the full size allocate nothing after the first, stages without (free) controls included") {
  const int n = 108, nu = 12;
  std::vector<StageModel> models(4);
  for (size_t k = 0; k < models.size(); ++k) {
    models[k].resize(n, k < 2 ? nu : 0, n);
    models[k].Fx().setIdentity();
    models[k].Fu().setRandom();
    models[k].lu.setOnes();
    models[k].lxx().setIdentity();
    models[k].luu().setIdentity();
  }
  std::vector<ControlBox> boxes(3);
  for (int k = 0; k < 2; ++k) boxes[k] = {VectorXd::Constant(nu, -1e-3), VectorXd::Constant(nu, 1e-3)};
  LqSweep sweep;
  REQUIRE(sweep.update(models, {}).status == NumericalStatus::Ok);
  REQUIRE(sweep.update(models, {}, boxes).status == NumericalStatus::Ok);
  const long before = num_allocations;
  sweep.update(models, {});
  sweep.update(models, {}, boxes);
  CHECK(num_allocations == before);
}
