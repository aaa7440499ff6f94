// The report of `bielle bench` is complete. Nothing here depends on speed.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

#include "bench/receding_horizon.h"
#include "bielle/model/error.h"
#include "own_robots.h"
#include "solve/window.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {
BenchmarkWalkOptions makeShortBenchmark() {
  BenchmarkWalkOptions walk;
  walk.start_nodes = 4;
  walk.swing_nodes = 6;
  walk.cycles = 1;
  walk.total_nodes = 24;
  return walk;
}
}  // namespace

TEST_CASE("bench: many worlds are measured on one thread and on two") {
  BenchOptions options;
  options.extent = BenchExtent::Quick;
  const BenchReport report = runBatchBench(loadOwn("bipetto").model, options);
  REQUIRE(report.batch.size() == 12);
  for (size_t i = 0; i < report.batch.size(); ++i) {
    const BatchTime& t = report.batch[i];
    CHECK(t.motion == (i < 4 ? BatchMotion::Stand : i < 8 ? BatchMotion::Walk : BatchMotion::Fall));
    CHECK(t.time_step == (i % 4 < 2 ? 1e-3 : 2.5e-4));
    CHECK(t.threads == 1 + static_cast<int>(i % 2));
    CHECK((t.rate > 0 && t.rounds >= (t.motion == BatchMotion::Fall ? 0 : 1) && t.rounds < 20 && t.broken == 0));
  }
  CHECK(report.nodes.empty());
}

TEST_CASE("bench: worlds of a walk begin all over it and follow it") {
  const Model model = loadOwn("bipetto").model;
  BatchTask task(model, BatchMotion::Walk);
  constexpr int kWorlds = 8;
  double first = 1, last = 0, largest = 0;
  for (int i = 0; i < kWorlds; ++i) {
    first = std::min(first, task.makeConfiguration(i)[0]);
    last = std::max(last, task.makeConfiguration(i)[0]);
    largest = std::max(largest, task.makeVelocity(i)[0]);
  }
  CHECK(last - first > 0.3);  // of 0.48 m
  CHECK(largest > 0.3);
  const BatchSpeed speed = measureBatch(task, kWorlds, 0.2, 1e-3, 1);
  CHECK(speed.broken == 0);
  CHECK((speed.deviation > 0 && speed.deviation < 0.05));  // rad; the legs swing by half a radian
  // The plan goes on, and its torques depend on the state.
  const VectorXd q = task.makeConfiguration(0), v = task.makeVelocity(0);
  CHECK(task.calcDeviation(0, 0, q) < 1e-9);
  CHECK(task.calcDeviation(200, 0, q) > 0.05);
  const VectorXd u = task.calcTorques(0, 0, q, v);
  VectorXd moved = v;
  moved[model.motors()[0].dof] += 1;
  CHECK((task.calcTorques(0, 0, q, moved) - u).norm() > 0.1);
}

TEST_CASE("bench: every work is measured, in both formulations") {
  BenchOptions options;
  options.extent = BenchExtent::Quick;
  std::vector<std::string> told;
  options.progress = [&told](const std::string& what) { told.push_back(what); };
  const BenchReport report = runBench(loadOwn("bipetto").model, options);
  CHECK(told.size() == 14);
  CHECK(report.robot == "bipetto");
  CHECK_FALSE(report.processor.empty());
  CHECK_THAT(report.flags, Catch::Contains("-O"));
  CHECK(report.unit > 0);
  REQUIRE(report.nodes.size() == 2);
  CHECK(report.nodes[0].tangent_size == 108);
  CHECK(report.nodes[1].tangent_size == 36);
  for (const NodeTimes& t : report.nodes)
    for (double seconds : {t.dynamics, t.derivatives, t.linearize, t.sweep, t.rollout})
      CHECK((seconds > 0 && std::isfinite(seconds)));
  REQUIRE(report.iterations.size() == 4);  // two formulations, one and two threads
  for (const IterationTimes& t : report.iterations) {
    const double shares = t.linearize + t.sweep + t.rollout;
    CHECK((t.seconds > 0 && t.rollouts >= 1 && shares > 0 && shares < 1 + 1e-9));
  }
  REQUIRE(report.solves.size() == 8);
  for (const SolveTime& t : report.solves) CHECK((t.seconds > 0 && t.iterations > 0));
  REQUIRE(report.receding.size() == 8);
  for (const RecedingHorizon& t : report.receding) {
    CHECK(t.all.shifts == 20);  // the walk is begun anew on the way
    CHECK(t.up);
    CHECK((t.cones ? t.violation < 0.01 : t.violation == 0));
    for (const ShiftTimes& times : {t.all, t.undisturbed}) {
      if (times.shifts == 0) continue;
      CHECK((times.median > 0 && times.median <= times.percentile_99 && times.percentile_99 <= times.worst));
    }
    CHECK((t.undisturbed.shifts <= t.all.shifts && t.undisturbed.worst <= t.all.worst));
  }
  REQUIRE(report.chains.size() == 6);
  REQUIRE(report.horizons.size() == 4);
}

TEST_CASE("bench: a robot that cannot walk is refused") {
  CHECK_THROWS_AS(runBench(loadOwn("fourbar").model, {}), InputError);
  CHECK_THROWS_WITH(runBench(loadOwn("fourbar").model, {}), Catch::Contains("foot_left"));
}

TEST_CASE("bench: a window has the bounds of the stages that it shows") {
  const Model model = loadOwn("bipetto").model;
  const auto makeLimits = [&](int stage) -> VectorXd {
    return VectorXd::LinSpaced(model.nu(), 10 + stage, 20 + stage);
  };
  std::vector<StageSpec> stages(25);
  for (size_t k = 0; k < stages.size(); ++k) {
    stages[k].constraints = makeConstraintSet(model);
    stages[k].effort_limits = makeLimits(static_cast<int>(k));
  }
  const VectorXd x0 = makeBenchmarkWalk(model, makeShortBenchmark()).problem->initialState();
  RobotProblem whole(model, x0.head(model.nq()), x0.tail(model.nv()), std::move(stages), Formulation::Full);
  Window window(whole, 12);
  window.move(5, whole.initialState());
  for (int k = 0; k < window.numStages(); ++k) {
    REQUIRE(window.controlSize(k) == model.nu());
    VectorXd lower(model.nu()), upper(model.nu());
    window.getControlBounds(k, lower, upper);
    CHECK(lower == -makeLimits(5 + k));
    CHECK(upper == makeLimits(5 + k));
  }
}

TEST_CASE("bench: a window over all of a problem is that problem") {
  const Model model = loadOwn("bipetto").model;
  for (const Formulation formulation : {Formulation::Full, Formulation::Reduced}) {
    FddpOptions options;
    options.max_iterations = 3;
    Motion motion = makeBenchmarkWalk(model, makeShortBenchmark(), formulation);
    ShootingTrajectory whole = motion.guess, seen = motion.guess;
    const FddpSummary expected = test::solveInPlace(*motion.problem, whole, options);
    Window window(*motion.problem, motion.problem->numStages());
    const FddpSummary summary = test::solveInPlace(window, seen, options);
    CHECK(summary.cost == expected.cost);
    CHECK((seen.xs == whole.xs && seen.us == whole.us));
  }
}

TEST_CASE("bench: a horizon that cannot recede is refused") {
  const Model model = loadOwn("bipetto").model;
  ShiftOptions options;
  options.walk = makeShortBenchmark();
  options.nodes = 24;
  CHECK_THROWS_AS(runRecedingHorizon(model, Formulation::Reduced, options), std::invalid_argument);
  options.nodes = 12;
  options.shifts = 0;
  CHECK_THROWS_WITH(runRecedingHorizon(model, Formulation::Reduced, options), Catch::Contains("0 shifts of 12 nodes"));
}
