// Oracle: the gradient of the cost along its own rollouts by central differences, which knows neither models nor
// sweeps.
#include <catch2/catch.hpp>
#include <random>
#include <sstream>

#include "bielle/solve/fddp.h"
#include "count_allocations.h"
#include "solve_problems.h"

using namespace bielle;
using namespace bielle::test;

namespace {

// Controls zero, every state the initial one.
ShootingTrajectory makeGuess(const ShootingProblem& problem) {
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

double calcCost(ShootingProblem& problem, const std::vector<VectorXd>& us) {
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
double calcCostAlong(ShootingProblem& problem, const ShootingTrajectory& t) {
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
VectorXd calcShootingGradient(ShootingProblem& problem, std::vector<VectorXd> us) {
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

double calcLargestGap(ShootingProblem& problem, const ShootingTrajectory& t) {
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

void checkOptimal(ShootingProblem& problem, const FddpSummary& summary, const ShootingTrajectory& result) {
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
FddpOptions makeTightOptions() {
  FddpOptions options;
  options.gradient_tolerance = 1e-18;
  options.cost_tolerance = 0;
  return options;
}

/// Forwards to a problem and spoils some of its answers.
class SpoiledProblem : public ShootingProblem {
 public:
  enum class Fault { Status, Nan, Throw };
  explicit SpoiledProblem(ShootingProblem& inner) : inner_(inner) {}

  Fault fault = Fault::Status;
  int bad_stage = -1;            ///< linearize() of this stage is spoiled
  double largest_state = 1e300;  ///< step() is spoiled where a state is larger
  std::atomic<int> num_spoiled{0};

  int numStages() const override { return inner_.numStages(); }
  int stateSize() const override { return inner_.stateSize(); }
  int tangentSize(int node) const override { return inner_.tangentSize(node); }
  int controlSize(int stage) const override { return inner_.controlSize(stage); }
  const VectorXd& initialState() const override { return inner_.initialState(); }
  void integrate(int k, ConstVectorRef x, ConstVectorRef dx, VectorRef out) const override {
    inner_.integrate(k, x, dx, out);
  }
  void difference(int k, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const override {
    inner_.difference(k, x0, x1, dx);
  }
  StepStatus step(int k, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) override {
    const StepStatus status = inner_.step(k, x, u, x_next, cost);
    return x.lpNorm<Eigen::Infinity>() > largest_state ? spoil(cost) : status;
  }
  StepStatus calcTerminalCost(ConstVectorRef x, double& cost) override { return inner_.calcTerminalCost(x, cost); }
  StepStatus linearize(int k, ConstVectorRef x, ConstVectorRef u, ConstVectorRef next, StageModel& out) override {
    const StepStatus status = inner_.linearize(k, x, u, next, out);
    return k == bad_stage ? spoil(out.Fx(0, 1)) : status;
  }
  StepStatus linearizeTerminal(ConstVectorRef x, StageModel& out) override { return inner_.linearizeTerminal(x, out); }

 private:
  StepStatus spoil(double& value) {
    ++num_spoiled;
    if (fault == Fault::Throw) throw std::runtime_error("the knee is locked");
    if (fault == Fault::Nan) value = std::numeric_limits<double>::quiet_NaN();
    return fault == Fault::Status ? StepStatus::Failed : StepStatus::Ok;
  }
  ShootingProblem& inner_;
};

}  // namespace

TEST_CASE("a linear-quadratic problem is solved by one full step from any guess") {
  auto problem = makeLinear();
  ShootingTrajectory t = makeLine(problem);
  for (VectorXd& u : t.us) u.setRandom();
  REQUIRE(calcLargestGap(problem, t) > 0.01);
  FddpOptions options;
  options.gradient_tolerance = 1e-14;
  const FddpSummary summary = Fddp(options).solve(problem, t);
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
    checkOptimal(problem, Fddp(makeTightOptions()).solve(problem, t), t);
    CHECK((t.xs.back() - problem.goal).norm() < 0.05);
  }
}

TEST_CASE("a cart-pole swings up from feasible and infeasible guesses") {
  auto problem = makeCartPole();
  for (const ShootingTrajectory& guess : {makeGuess(problem), makeLine(problem)}) {
    ShootingTrajectory t = guess;
    checkOptimal(problem, Fddp(makeTightOptions()).solve(problem, t), t);
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
    const VectorXd dx = VectorXd::NullaryExpr(6, [&](Eigen::Index) { return normal(rng); });
    problem.integrate(static_cast<int>(k), t.xs[k], dx, t.xs[k]);
  }
  REQUIRE(calcLargestGap(problem, t) > 0.5);
  checkOptimal(problem, Fddp(makeTightOptions()).solve(problem, t), t);
}

TEST_CASE("the gaps contract by 1 - alpha, and the log tells so") {
  auto problem = makeCartPole();
  ShootingTrajectory t = makeLine(problem);
  FddpOptions options;
  options.max_iterations = 3;
  const double before = calcLargestGap(problem, t);
  const FddpSummary summary = Fddp(options).solve(problem, t);
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

TEST_CASE("enforced bounds hold, and the controls on them press outwards") {
  const auto check = [](auto problem, const ShootingTrajectory& guess) {
    ShootingTrajectory t = guess;
    FddpOptions options = makeTightOptions();
    options.gradient_tolerance = 1e-14;
    options.bounds = ControlBounds::Enforce;
    const FddpSummary summary = Fddp(options).solve(problem, t);
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

TEST_CASE("enforced bounds that are infinite change nothing but rounding") {
  TurningBody problem;
  problem.goal << 0.6, 0.4, -0.3, 0.2;
  problem.goal.normalize();
  ShootingTrajectory free = makeGuess(problem), boxed = free;
  FddpOptions options;
  options.gradient_tolerance = 1e-16;
  const FddpSummary first = Fddp(options).solve(problem, free);
  options.bounds = ControlBounds::Enforce;
  const FddpSummary second = Fddp(options).solve(problem, boxed);
  CHECK(first.iterations == second.iterations);
  CHECK(first.cost == Approx(second.cost).epsilon(1e-12));
  for (size_t k = 0; k < free.us.size(); ++k) CHECK((free.us[k] - boxed.us[k]).norm() < 1e-6);
}

TEST_CASE("the number of threads does not change one bit of the result") {
  auto problem = makeCartPole();
  ShootingTrajectory one = GENERATE(0, 1) ? makeLine(problem) : makeGuess(problem), two = one;
  FddpOptions options;
  options.threads = 1;
  const FddpSummary first = Fddp(options).solve(problem, one);
  options.threads = 2;
  const FddpSummary second = Fddp(options).solve(problem, two);
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
    const FddpSummary whole = Fddp(options).solve(problem, one);
    checkOptimal(problem, whole, one);
    for (const int segments : {2, 3, 5}) {
      options.rollout_segments = segments;
      ShootingTrajectory t = guess;
      const FddpSummary summary = Fddp(options).solve(problem, t);
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

TEST_CASE("the gaps that segments open are there, known, and closed by the last iteration allowed") {
  TurningBody problem;
  problem.stages = 100;
  problem.goal << 0.6, 0.4, -0.3, -0.2;
  problem.goal.normalize();
  problem.start.tail(3) << 0.3, -0.5, 1;
  FddpOptions options;
  options.threads = GENERATE(1, 2);
  ShootingTrajectory t = makeGuess(problem);
  std::vector<double> gaps;
  FddpObserver observer;
  observer.callback = [&](const FddpIteration&) {
    gaps.push_back(calcLargestGap(problem, t));
    return FddpAction::Continue;
  };
  options.max_iterations = 4;
  const FddpSummary summary = Fddp(options).solve(problem, t, observer);
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
  observer.callback = [&](const FddpIteration& line) {
    return line.iteration == 2 ? FddpAction::Stop : FddpAction::Continue;
  };
  const FddpSummary open = Fddp(options).solve(problem, stopped, observer);
  const double actual = calcLargestGap(problem, stopped);
  REQUIRE(actual > 1e-6);
  CHECK(open.gap == Approx(actual).epsilon(0.3));
}

TEST_CASE("the seconds of linearization, sweeps and rollouts make up those of the solve on one thread") {
  auto problem = makeCartPole();
  FddpOptions options;
  options.threads = 1;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = Fddp(options).solve(problem, t);
  const double parts = summary.linearize_seconds + summary.sweep_seconds + summary.rollout_seconds;
  CHECK(std::min({summary.linearize_seconds, summary.sweep_seconds, summary.rollout_seconds}) > 0);
  CHECK(parts <= summary.seconds);
  CHECK(parts > 0.5 * summary.seconds);
}

TEST_CASE("one solver serves problems of other sizes without remembering them") {
  auto cart_pole = makeCartPole();
  auto linear = makeLinear();
  Fddp fddp;
  std::vector<ShootingTrajectory> results;
  for (int i = 0; i < 2; ++i) {
    ShootingTrajectory t = makeLine(cart_pole), other = makeLine(linear);
    CHECK(fddp.solve(cart_pole, t).termination == FddpTermination::Converged);
    CHECK(fddp.solve(linear, other).termination == FddpTermination::Converged);
    results.push_back(t);
  }
  CHECK(results[0].xs == results[1].xs);
  CHECK(results[0].us == results[1].us);
}

TEST_CASE("an iteration after the first allocates nothing") {
  const long before = num_allocations;
  const VectorXd by_malloc(100);
  const std::vector<double> by_new(100);
  REQUIRE(num_allocations == before + 2);
  const auto bounds = GENERATE(ControlBounds::Ignore, ControlBounds::Enforce);
  const int threads = GENERATE(1, 2);
  auto problem = makeCartPole();
  problem.bound = 12;
  ShootingTrajectory t = makeLine(problem);
  FddpOptions options;
  options.bounds = bounds;
  options.threads = threads;
  std::vector<long> counts;
  counts.reserve(1000);
  FddpObserver observer;
  observer.callback = [&](const FddpIteration&) {
    counts.push_back(num_allocations);
    return FddpAction::Continue;
  };
  Fddp(options).solve(problem, t, observer);
  REQUIRE(counts.size() > 10);
  CHECK(counts.back() == counts.front());
}

TEST_CASE("sweeps of the full size allocate nothing after the first, stages without (free) controls included") {
  const int n = 108, nu = 12;
  std::vector<StageModel> models(4);
  for (size_t k = 0; k < models.size(); ++k) {
    models[k].resize(n, k < 2 ? nu : 0, n);
    models[k].Fx.setIdentity();
    models[k].Fu.setRandom();
    models[k].lu.setOnes();
    models[k].lxx.setIdentity();
    models[k].luu.setIdentity();
  }
  std::vector<ControlBox> boxes(3);
  for (int k = 0; k < 2; ++k) boxes[k] = {VectorXd::Constant(nu, -1e-3), VectorXd::Constant(nu, 1e-3)};
  LqSweep sweep;
  REQUIRE(sweep.update(models, {}).status == LqStatus::Ok);
  REQUIRE(sweep.update(models, {}, boxes).status == LqStatus::Ok);
  const long before = num_allocations;
  sweep.update(models, {});
  sweep.update(models, {}, boxes);
  CHECK(num_allocations == before);
}

TEST_CASE("an interrupted solve keeps the iterate it had, by the flag as by the callback") {
  const bool by_flag = GENERATE(true, false);
  FddpOptions options;
  options.rollout_segments = GENERATE(1, 4);
  auto problem = makeCartPole();
  ShootingTrajectory t = makeGuess(problem), seen;
  std::atomic<bool> interrupt{false};
  FddpObserver observer;
  observer.interrupt = &interrupt;
  observer.callback = [&](const FddpIteration& line) {
    if (line.iteration == 5) {
      seen = t;
      interrupt = by_flag;
      if (!by_flag) return FddpAction::Stop;
    }
    return FddpAction::Continue;
  };
  const double start = calcCost(problem, t.us);
  const FddpSummary summary = Fddp(options).solve(problem, t, observer);
  CHECK(summary.termination == FddpTermination::Interrupted);
  CHECK(summary.iterations == 5);
  CHECK(t.xs == seen.xs);
  CHECK(t.us == seen.us);
  CHECK(calcCostAlong(problem, t) == Approx(summary.cost));
  CHECK(calcLargestGap(problem, t) == Approx(summary.gap).margin(1e-12));
  if (options.rollout_segments == 1) CHECK(calcCost(problem, t.us) == Approx(summary.cost));
  CHECK(summary.cost < start);
}

TEST_CASE("a problem that fails, throws or gives NaN at a node ends the solve with the node's name") {
  using Fault = SpoiledProblem::Fault;
  const Fault fault = GENERATE(Fault::Status, Fault::Nan, Fault::Throw);
  auto inner = makePendulum();
  SpoiledProblem problem(inner);
  problem.fault = fault;
  problem.bad_stage = 37;
  ShootingTrajectory t = makeGuess(problem);
  const ShootingTrajectory guess = t;
  const FddpSummary summary = Fddp().solve(problem, t);
  CHECK(summary.termination == FddpTermination::Failed);
  const bool named =
      summary.message.find("node 37") == 0 || (fault == Fault::Nan && summary.message.find("node 3") == 0);
  CHECK(named);
  if (fault == Fault::Throw) CHECK(summary.message.find("the knee is locked") != std::string::npos);
  CHECK(t.us == guess.us);
}

TEST_CASE("trials on which the problem fails, throws or gives NaN are only too long") {
  using Fault = SpoiledProblem::Fault;
  const Fault fault = GENERATE(Fault::Status, Fault::Nan, Fault::Throw);
  auto inner = makeCartPole();
  SpoiledProblem problem(inner);
  problem.fault = fault;
  problem.largest_state = 14;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = Fddp(makeTightOptions()).solve(problem, t);
  CHECK(problem.num_spoiled > 0);
  checkOptimal(inner, summary, t);
}

TEST_CASE("an indefinite problem is regularized until it can be solved") {
  DoubleWell problem;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = Fddp(makeTightOptions()).solve(problem, t);
  checkOptimal(problem, summary, t);
  CHECK(t.xs.back()[0] == Approx(1).margin(0.01));
  CHECK(summary.log.front().regularization > 1e-4);
  CHECK(summary.log.back().regularization < 1e-3 * summary.log.front().regularization);
}

TEST_CASE("a problem nothing can improve ends at the largest regularization") {
  auto inner = makeCartPole();
  SpoiledProblem problem(inner);
  problem.largest_state = 0;  // no rollout succeeds
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = Fddp().solve(problem, t);
  CHECK(summary.termination == FddpTermination::RegularizationMax);
  CHECK(summary.iterations == 0);
  CHECK(summary.message == "no step is acceptable even at the largest regularization");
}

TEST_CASE("options without sense are refused by name") {
  FddpOptions options;
  options.min_regularization = 0;
  CHECK_THROWS_WITH(Fddp(options), Catch::Contains("min_regularization"));
  options = FddpOptions();
  options.regularization_increase = 1;
  CHECK_THROWS_WITH(Fddp(options), Catch::Contains("regularization_increase"));
}

TEST_CASE("guesses of wrong sizes are refused with the sizes") {
  auto problem = makePendulum();
  ShootingTrajectory t = makeGuess(problem);
  t.us.pop_back();
  CHECK_THROWS_WITH(Fddp().solve(problem, t), Catch::Contains("101 states and 99 controls"));
  t = makeGuess(problem);
  t.xs[4].resize(3);
  CHECK_THROWS_WITH(Fddp().solve(problem, t), Catch::Contains("state 4 has size 3"));
}

TEST_CASE("the log prints a header and one line of the same columns per iteration") {
  std::ostringstream out;
  printFddpHeader(out);
  printFddpIteration(out, {7, 1.5, 2e-3, 3e-4, 0.5, 1e-9, 0.25});
  std::istringstream in(out.str());
  std::string header, line;
  std::getline(in, header);
  std::getline(in, line);
  CHECK(header.size() == line.size());
  CHECK(line.find("1.50000000e+00  2.000e-03  3.000e-04  5.000e-01  1.000e-09     0.250") != std::string::npos);
}
