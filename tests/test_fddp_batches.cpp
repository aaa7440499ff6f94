// FDDP on problems that process several tasks at once: results do not depend on batches or threads, and evaluations are
// kept.
#include <catch2/catch.hpp>
#include <random>

#include "batched_problem.h"
#include "count_solver_allocations.h"
#include "fddp_oracle.h"
#include "solve/fddp_solve.h"
#include "solve/receding.h"

using namespace bielle;
using namespace bielle::test;

namespace {

bool isSame(const FddpResult& a, const FddpResult& b) {
  const auto isSameLine = [](const FddpIteration& l, const FddpIteration& m) {
    return l.cost == m.cost && l.gap == m.gap && l.gradient == m.gradient && l.step == m.step &&
           l.regularization == m.regularization;
  };
  const auto &log = a.summary.log, &other = b.summary.log;
  return a.trajectory.xs == b.trajectory.xs && a.trajectory.us == b.trajectory.us && a.summary.cost == b.summary.cost &&
         a.summary.gap == b.summary.gap && a.summary.message == b.summary.message &&
         std::equal(log.begin(), log.end(), other.begin(), other.end(), isSameLine);
}

// Full steps in segments, short steps that leave gaps open, and closing rollouts all occur on the way.
struct Case {
  explicit Case(double bound) {
    cart_pole.bound = bound;
    body.stages = 100;
    body.goal << 0.6, 0.4, -0.3, -0.2;
    body.goal.normalize();
    body.start.tail(3) << 0.3, -0.5, 1;
  }
  PlantProblem<CartPole> cart_pole = makeCartPole();
  TurningBody body;
  DoubleWell well;
  template <class F>
  void visit(const F& f) const {
    f(cart_pole, makeGuess(cart_pole));
    f(cart_pole, makeLine(cart_pole));
    f(body, makeGuess(body));
    f(well, makeGuess(well));
  }
};

}  // namespace

TEST_CASE("neither batches nor threads change one bit of what comes out") {
  FddpOptions options;
  options.rollout_segments = GENERATE(1, 5);
  options.max_iterations = 25;
  int most_alike = 0;
  Case(GENERATE(12.0, std::numeric_limits<double>::infinity()))
      .visit([&](const PlainProblem& plain, const ShootingTrajectory& guess) {
        options.threads = 1;
        const FddpResult one = solve(plain, guess, options);
        for (const auto& [size, threads] : {std::pair(1, 2), {3, 1}, {3, 2}, {8, 1}, {8, 3}}) {
          CAPTURE(size, threads, one.summary.iterations);
          options.threads = threads;
          const BatchedProblem problem(plain, size);
          CHECK(isSame(solve(problem, guess, options), one));
          most_alike = std::max<int>(most_alike, problem.most_alike);
        }
      });
  CHECK(most_alike == 8);  // step lengths were tried side by side
}

TEST_CASE("a problem whose results depend on batches is told apart by its bits") {
  const auto cart_pole = makeCartPole();
  FddpOptions options;
  options.max_iterations = 5;
  std::vector<FddpResult> results;
  for (const int size : {1, 8}) {
    BatchedProblem problem(cart_pole, size);
    problem.spread = true;
    results.push_back(solve(problem, makeGuess(cart_pole), options));
  }
  CHECK_FALSE(isSame(results[0], results[1]));
}

TEST_CASE("the reason of a failure does not depend on batches") {
  // A cart that may not go far, on whichever segment.
  struct ShortTrack : PlantProblem<CartPole> {
    using PlantProblem<CartPole>::PlantProblem;
    void evaluate(EvaluateTask& task, ProblemScratch* scratch) const override {
      PlantProblem<CartPole>::evaluate(task, scratch);
      if (*task.x == start) return;
      task.out->status = NumericalStatus::Failed;
      task.out->failure = "the cart moved at " + std::to_string(task.node);
    }
  } problem;
  static_cast<PlantProblem<CartPole>&>(problem) = makeCartPole();
  std::vector<std::string> messages;
  for (const int size : {1, 3, 8})
    messages.push_back(solve(BatchedProblem(problem, size), makeGuess(problem), {}).summary.message);
  CHECK(messages[0].find("the cart moved at 1") != std::string::npos);
  CHECK(messages[1] == messages[0]);
  CHECK(messages[2] == messages[0]);
}

TEST_CASE("sweeps at larger regularizations linearize and evaluate nothing") {
  const DoubleWell well;
  const BatchedProblem problem(well, 1);
  FddpOptions options;
  options.max_iterations = 1;
  const FddpResult result = solve(problem, makeGuess(well), options);
  REQUIRE(result.summary.iterations == 1);
  REQUIRE(result.summary.log[0].regularization > 1e-4);
  const int num_nodes = well.numStages() + 1, num_trials = 1 - static_cast<int>(std::log2(result.summary.log[0].step));
  CHECK(result.summary.sweeps >= 5);
  CHECK(problem.num_linearized == num_nodes);
  CHECK(result.summary.linearizations == num_nodes);
  CHECK(problem.num_evaluated == num_nodes * (1 + num_trials));
}

TEST_CASE("a short step integrates only behind the gaps that are open") {
  auto cart_pole = makeCartPole();
  const ShootingTrajectory guess = makeGuess(cart_pole);  // hangs still: no gaps
  cart_pole.start[1] += 0.1;                              // but at the first stage
  const BatchedProblem problem(cart_pole, 1);
  FddpOptions options;
  options.rollout_segments = 1;
  options.max_iterations = 1;
  const FddpResult result = solve(problem, guess, options);
  REQUIRE(result.summary.iterations == 1);
  REQUIRE(result.summary.log[0].step < 1);
  CHECK(problem.num_integrated == -std::log2(result.summary.log[0].step));
  CHECK(calcLargestGap(problem, result.trajectory) == Approx(result.summary.gap).epsilon(1e-6));
}

TEST_CASE("in a receding horizon steps of all lengths are rolled out in segments, with the gaps they tell") {
  const auto cart_pole = makeCartPole();
  const BatchedProblem problem(cart_pole, 8);
  ShootingTrajectory t = makeLine(cart_pole);
  int num_short = 0;
  RecedingOptions options;
  options.num_step_lengths = 5;
  options.iterations = 20;  // with those of searches in vain
  FddpObserver once;
  once.callback = [](const FddpIteration&, const ShootingTrajectory&) { return FddpAction::Stop; };
  for (int i = 0; i < 8; ++i) {  // one accepted step each, from where the last one ended
    const FddpSummary summary = Receding(problem, options).step(t, once);
    REQUIRE(summary.iterations == 1);
    num_short += summary.log[0].step < 1;
    CHECK(calcLargestGap(problem, t) == Approx(summary.gap).epsilon(1e-6).margin(1e-12));
  }
  CHECK(num_short > 2);
  CHECK(problem.most_alike == 1);  // never in one piece, where step lengths go side by side

  options.gradient_tolerance = makeTightOptions().gradient_tolerance;
  options.iterations = 300;
  checkOptimal(problem, Receding(problem, options).step(t), t);
}

// Gaps of any size, twice: after four steps there are new ones.
TEST_CASE("a receding horizon that goes on cuts fewer steps short than one whose weight of gaps starts anew") {
  const auto problem = makeCartPole();
  const ShootingTrajectory optimum = solve(problem, makeLine(problem)).trajectory;
  RecedingOptions options;
  options.initial_regularization = options.min_regularization = 1e-6;
  std::vector<NodeSource> stays(optimum.xs.size());
  for (size_t k = 0; k < stays.size(); ++k) stays[k] = {static_cast<int>(k), 1, false};
  const auto countShort = [&](unsigned seed, bool goes_on) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 0.1);
    ShootingTrajectory t = optimum;
    Receding going(problem, options);
    int num_short = 0;
    for (int i = 0; i < 8; ++i) {
      if (i % 4 == 0)
        for (size_t k = 1; k < t.xs.size(); ++k) t.xs[k] += t.xs[k].unaryExpr([&](double) { return noise(random); });
      if (i > 0) going.move(stays);
      Receding anew(problem, options);
      const FddpSummary summary = (goes_on ? going : anew).step(t);
      num_short += summary.log.empty() || summary.log[0].step < 1;
    }
    return num_short;
  };
  int going = 0, anew = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    going += countShort(seed, true);
    anew += countShort(seed, false);
  }
  CAPTURE(going, anew);
  CHECK(anew > 20);
  CHECK(going < 0.7 * anew);
}

TEST_CASE("a horizon that advances evaluates only what is new, with the same bytes as one that evaluates all") {
  auto cart_pole = makeCartPole();  // all stages are alike
  BatchedProblem problem(cart_pole, GENERATE(1, 8));
  const int N = cart_pole.stages;
  RecedingOptions options;
  options.threads = 2;
  // Both then find a step each time; else the one that advances would be regularized more.
  options.initial_regularization = options.min_regularization = 1;
  Receding advancing(problem, options), plain(problem, options);
  ShootingTrajectory t = makeLine(cart_pole), other = t;
  const auto count = [&](Receding& receding, ShootingTrajectory& trajectory) {
    const int before = problem.num_evaluated;
    receding.step(trajectory);
    return problem.num_evaluated - before;
  };
  int num_saving = 0;
  for (int i = 0; i < 12; ++i) {
    const int num_new = count(advancing, t), num_all = count(plain, other);
    CHECK(t.xs == other.xs);
    CHECK(t.us == other.us);
    CHECK((num_new == num_all || num_new == num_all - (N + 1 - 3)));
    if (i > 0) num_saving += num_new < num_all;
    advancing.advance(t);
    other.xs.erase(other.xs.begin());
    other.xs.push_back(other.xs.back());
    other.us.erase(other.us.begin());
    other.us.push_back(other.us.back());
    cart_pole.start = other.xs[0] + VectorXd::Constant(4, 1e-3);  // as it was measured
    ++problem.first;
  }
  CHECK(num_saving == 11);

  t.us[N / 2][0] += 1e-9;
  const bool anew = GENERATE(false, true);
  if (anew) {  // multipliers that are set are those of nodes that may be others
    advancing.setMultipliers(advancing.multipliers());
    CHECK(count(advancing, t) > N);
  } else {
    CHECK_THROWS_WITH(advancing.step(t), Catch::Contains("node 50"));
  }
}

TEST_CASE("a window moves on to any other, and evaluates the nodes that are not the same") {
  auto cart_pole = makeCartPole();
  BatchedProblem problem(cart_pole, 8);
  const int N = cart_pole.stages;
  RecedingOptions options;
  options.threads = 2;
  options.initial_regularization = options.min_regularization = 1;
  Receding moving(problem, options), plain(problem, options);
  ShootingTrajectory t = makeLine(cart_pole), other = t;
  const auto count = [&](Receding& receding, ShootingTrajectory& trajectory) {
    const int before = problem.num_evaluated;
    receding.step(trajectory);
    return problem.num_evaluated - before;
  };
  count(moving, t);
  count(plain, other);
  std::vector<NodeSource> sources(N + 1);
  for (int shift : {3, 0, 7}) {
    CAPTURE(shift);
    for (int i = 0; i < shift; ++i) {
      t.xs.erase(t.xs.begin());
      t.xs.push_back(t.xs.back());
      t.us.erase(t.us.begin());
      t.us.push_back(t.us.back());
    }
    cart_pole.start = t.xs[0] + VectorXd::Constant(4, 1e-3);
    problem.first += shift;
    int num_same = 0;
    for (int k = 0; k <= N; ++k) {
      sources[k] = {std::min(k + shift, N), 1, k > 0 && k + shift < N};
      num_same += sources[k].same;
    }
    moving.move(sources);
    other = t;
    const int num_new = count(moving, t), num_all = count(plain, other);
    CHECK(num_new == num_all - num_same);
    CHECK(t.xs == other.xs);
    CHECK(t.us == other.us);
    for (int k = 0; k <= N; ++k) {
      REQUIRE(moving.getEvaluation(k));
      CHECK(moving.getEvaluation(k)->x == t.xs[k]);
    }
  }
  CHECK_THROWS_WITH(moving.move(std::vector<NodeSource>(N)), Catch::Contains("one source per node"));
  sources[4] = sources[3];
  CHECK_THROWS_WITH(moving.move(sources), Catch::Contains("two nodes are the same as node 10"));
}

TEST_CASE("evaluations are kept for a problem, and made anew for another one") {
  const auto cart_pole = makeCartPole();
  const int size = GENERATE(1, 3);
  BatchedProblem problem(cart_pole, size);
  const BatchedProblem copy(cart_pole, size);
  FddpMemory memory;
  const auto solveOnce = [&](const BatchedProblem& p) {
    ShootingTrajectory t = makeGuess(p);
    FddpSolve(FddpOptions(), p, t, {}, memory).run();
    return p.num_made.load();
  };
  const int made = solveOnce(problem);
  CHECK(made == 2 * (cart_pole.stages + 1) + (size > 1 ? 2 * size : 0));
  CHECK(solveOnce(problem) == made);
  CHECK(solveOnce(copy) == made);
  CHECK(solveOnce(problem) == 2 * made);
}

TEST_CASE("memory serves problems of other sizes without remembering them") {
  auto cart_pole = makeCartPole();
  auto linear = makeLinear();
  FddpMemory memory;
  const auto solveOnce = [&](const ShootingProblem& problem, ShootingTrajectory t) {
    CHECK(FddpSolve(FddpOptions(), problem, t, {}, memory).run().termination == FddpTermination::Converged);
    return t;
  };
  std::vector<ShootingTrajectory> results;
  for (int i = 0; i < 2; ++i) {
    results.push_back(solveOnce(cart_pole, makeLine(cart_pole)));
    solveOnce(linear, makeLine(linear));
  }
  CHECK(results[0].xs == results[1].xs);
  CHECK(results[0].us == results[1].us);
}

TEST_CASE("every problem has an id of its own, copies and those that were assigned to included") {
  DoubleWell a, b;
  const DoubleWell copy(a);
  CHECK(a.id() != b.id());
  CHECK(copy.id() != a.id());
  const auto before = b.id();
  b = a;
  CHECK(b.id() != before);
  CHECK(b.id() != a.id());
}

TEST_CASE("an iteration after the first allocates nothing, in batches") {
  auto cart_pole = makeCartPole();
  cart_pole.bound = GENERATE(12.0, std::numeric_limits<double>::infinity());
  const BatchedProblem problem(cart_pole, GENERATE(3, 8));
  ShootingTrajectory t = makeLine(cart_pole);
  FddpOptions options;
  options.threads = GENERATE(1, 2);
  const std::vector<long> counts = countAllocations(options, problem, t);
  REQUIRE(counts.size() > 10);
  REQUIRE(problem.most_alike > 1);
  CHECK(counts.back() == counts.front());
}

TEST_CASE("a receding horizon that finds no acceptable step keeps its trajectory and damps the next one") {
  auto cart_pole = makeCartPole();
  BatchedProblem problem(cart_pole, 8);
  RecedingOptions options;
  options.num_step_lengths = 1;
  Receding receding(problem, options);
  ShootingTrajectory t = makeLine(cart_pole);
  t.xs[0] = problem.initialState();
  int kept = 0, moved = 0;
  for (int i = 0; i < 40; ++i) {
    const ShootingTrajectory before = t;
    const FddpSummary summary = receding.step(t);
    REQUIRE(summary.termination == FddpTermination::MaxIterations);
    if (summary.iterations == 0) {
      CHECK(t.xs == before.xs);
      CHECK(t.us == before.us);
      CHECK_THAT(summary.message, Catch::Contains("the iterate is kept"));
      ++kept;
    } else {
      if (moved == 0)
        CHECK(summary.log[0].regularization == Approx(std::pow(10., kept) * options.initial_regularization));
      ++moved;
    }
    receding.advance(t);
    cart_pole.start = t.xs[0];
    ++problem.first;
    if (moved > 3) break;
  }
  CHECK(kept > 0);
  CHECK(moved > 0);
}
