// Motions that choose their durations. Oracle: the same problem solved again with one duration fixed on either side.
#include <catch2/catch.hpp>
#include <filesystem>

#include "bielle/model/error.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/walk.h"
#include "bielle/results/result.h"
#include "motion/applied_options.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;
namespace fs = std::filesystem;

namespace {

const TimingOptions kAll{{{kAllPhases, {}}}, 0};

struct TimedSolution {
  Motion motion;
  FddpSummary summary;
  std::vector<PhaseTiming> timings;
};

TimedSolution solveTimed(Motion motion, int threads = 0) {
  FddpOptions options;
  options.threads = threads;
  TimedSolution out{std::move(motion), {}, {}};
  out.summary = test::solveInPlace(*out.motion.problem, out.motion.guess, options);
  REQUIRE(out.summary.termination == FddpTermination::Converged);
  out.timings = listTimings(*out.motion.problem, out.motion.schedule, out.motion.guess);
  return out;
}

WalkOptions makeTwoSteps() {
  WalkOptions options;
  options.steps = 2;
  options.gait.timing.time_step = 0.018;
  return options;
}

// A walk with all durations free or, given a solution, one of them at a multiple of what was chosen, from that solution.
Motion makeTimedWalk(const Model& model, const TimedSolution* solution = nullptr, size_t fixed = 0, double factor = 1) {
  MotionPlan plan = planWalk(model, makeTwoSteps(), makeStandingRobot(model));
  const ContactSchedule schedule = plan.schedule;
  freeTimings(kAll, schedule, plan.stages);
  double scale = 1;
  int begin = 0, end = 0;
  if (solution) {
    const PhaseTiming& timing = solution->timings[fixed];
    scale = factor * timing.chosen / timing.nominal;
    begin = timing.start_node;
    end = begin + schedule.phases[fixed].nodes;
    for (int k = begin; k < end; ++k) plan.stages[k].timing.lower = plan.stages[k].timing.upper = scale;
  }
  Motion motion = makeMotion(model, std::move(plan), {Formulation::Reduced, StepRule::Midpoint});
  if (!solution) return motion;
  motion.guess = solution->motion.guess;
  motion.guess.us[begin].tail(1)[0] = scale;
  for (int k = begin + 1; k < end; ++k) motion.guess.xs[k].tail(1)[0] = scale;
  return motion;
}

// The walk with all durations free, solved once.
const TimedSolution& getTimedWalk() {
  static const TimedSolution walk = solveTimed(makeTimedWalk(getBipetto()), 1);
  return walk;
}

}  // namespace

TEST_CASE("a walk chooses the best duration of each phase") {
  const Model& model = getBipetto();
  const TimedSolution& best = getTimedWalk();
  REQUIRE(best.timings.size() == 5);
  int inside = 0;
  for (size_t i = 0; i < best.timings.size(); ++i) {
    const PhaseTiming& timing = best.timings[i];
    CAPTURE(timing.phase, timing.nominal, timing.chosen, timing.lower, timing.upper);
    CHECK(timing.nominal == Approx(best.motion.schedule.phases[i].nodes * best.motion.schedule.phases[i].dt));
    CHECK(timing.lower == Approx(0.6 * timing.nominal));
    CHECK(timing.upper == Approx(1.6 * timing.nominal));
    REQUIRE(timing.chosen >= timing.lower);
    REQUIRE(timing.chosen <= timing.upper);
    constexpr double kStep = 0.02;
    const double cost = best.summary.cost, less = solveTimed(makeTimedWalk(model, &best, i, 1 - kStep)).summary.cost,
                 more = solveTimed(makeTimedWalk(model, &best, i, 1 + kStep)).summary.cost;
    const bool at_lower = timing.chosen<1.001 * timing.lower, at_upper = timing.chosen> 0.999 * timing.upper;
    CHECK((less > cost) == !at_lower);
    CHECK((more > cost) == !at_upper);
    if (at_lower || at_upper) continue;
    ++inside;
    const double slope = (more - less) / (2 * kStep), curvature = (more - 2 * cost + less) / (kStep * kStep);
    CHECK(std::abs(slope / curvature) < 2e-3);
  }
  CHECK(inside >= 2);
}

TEST_CASE("a result has the final durations, and a warm start goes on from them") {
  const Model& model = getBipetto();
  const TimedSolution& walk = getTimedWalk();
  const MotionResult result = makeResult({"bipetto", "", {}}, {walk.motion, walk.motion.guess, walk.summary});
  REQUIRE(result.timings.size() == 5);
  int node = 0;
  for (size_t i = 0; i < result.timings.size(); ++i) {
    const PhaseTiming& timing = result.timings[i];
    CHECK(timing.start_node == node);
    const int nodes = walk.motion.schedule.phases[i].nodes;
    CHECK(result.record.time[node + nodes] - result.record.time[node] == Approx(timing.chosen).epsilon(1e-12));
    CHECK(result.schedule.phases[i].dt * nodes == Approx(timing.chosen).epsilon(1e-12));
    node += nodes;
  }
  CHECK(std::abs(result.timings[1].chosen - result.timings[1].nominal) > 1e-3);
  CHECK(result.record.q.cols() == model.nq());
  CHECK(result.record.v.cols() == model.nv());
  CHECK(result.record.u.cols() == model.nu());

  const fs::path directory = fs::temp_directory_path() / "bielle_test_timed_motions";
  writeResult(directory.string(), result);
  const MotionSummary summary = readSummary(directory.string());
  CHECK(summary.phases[1].time_step == result.schedule.phases[1].dt);
  REQUIRE(summary.timings.size() == result.timings.size());
  CHECK(summary.timings[1].phase == result.timings[1].phase);
  CHECK(summary.timings[1].chosen == result.timings[1].chosen);
  Motion again = makeTimedWalk(model);
  again.guess = makeStart(readResultRecord(directory.string()), again).trajectory;
  fs::remove_all(directory);
  for (size_t i = 0; i < result.timings.size(); ++i) {
    const std::vector<PhaseTiming> guessed = listTimings(*again.problem, again.schedule, again.guess);
    CHECK(guessed[i].chosen == Approx(result.timings[i].chosen));
  }
  CHECK(solveTimed(std::move(again)).summary.cost == Approx(walk.summary.cost).epsilon(1e-7));
}

TEST_CASE("a plan with the final durations makes the same steps") {
  const Model& model = getBipetto();
  const TimedSolution& walk = getTimedWalk();
  MotionPlan plan = planWalk(model, makeTwoSteps(), makeStandingRobot(model));
  fixTimings(walk.timings, StepRule::Midpoint, plan.schedule, plan.stages);
  const Motion fixed = makeMotion(model, std::move(plan), {Formulation::Reduced, StepRule::Midpoint});
  CHECK(!fixed.problem->hasFreeTimings());
  RobotEvaluator evaluator(*fixed.problem);
  const int size = model.nq() + model.nv();
  for (int k = 0; k < fixed.problem->numStages(); ++k) {
    const ShootingTrajectory& t = walk.motion.guess;
    const RobotEvaluation& at = evaluator.evaluate(k, t.xs[k].head(size), t.us[k].head(model.nu()));
    REQUIRE(at.status == NumericalStatus::Ok);
    CHECK((at.x_next - t.xs[k + 1].head(size)).cwiseAbs().maxCoeff() < 1e-8);
  }
}

TEST_CASE("the same motion for every number of threads") {
  const TimedSolution &one = getTimedWalk(), three = solveTimed(makeTimedWalk(getBipetto()), 3);
  CHECK(one.motion.guess.xs == three.motion.guess.xs);
  CHECK(one.motion.guess.us == three.motion.guess.us);
}

TEST_CASE("which phases are free") {
  const Model& model = getBipetto();
  const auto list = [&](const TimingOptions& timings) {
    ProblemOptions options;
    options.timings = timings;
    const Motion motion = makeJump(model, {}, options);
    std::vector<std::string> names;
    for (const PhaseTiming& timing : listTimings(*motion.problem, motion.schedule, motion.guess)) {
      names.push_back(timing.phase);
      CHECK(timing.chosen == Approx(timing.nominal));
    }
    return names;
  };
  using Names = std::vector<std::string>;
  CHECK(list({}).empty());
  CHECK(list(kAll) == Names{"stand", "push", "land", "settle"});
  CHECK(list({{{"push", {0.8, 1.2}}}, 0}) == Names{"push"});
  CHECK(list({{{kAllPhases, {}}, {"flight", {0.9, 1.1}}}, 0}) == Names{"stand", "push", "flight", "land", "settle"});
  CHECK_THROWS_AS(list({{{"swing", {}}}, 0}), InputError);
  CHECK_THROWS_AS(list({{{"push", {1.2, 0.8}}}, 0}), InputError);
  CHECK_THROWS_AS(list({{{"push", {0, 0.8}}}, 0}), InputError);
  CHECK_THROWS_AS(list({{{"push", {}}}, -1}), InputError);
  CHECK_THROWS_AS(list({{}, 1}), InputError);

  // The gains suit the longest step.
  ProblemOptions options;
  options.timings = {{{"push", {0.5, 2}}}, 0};
  const Motion motion = makeJump(model, {}, options);
  for (int k = 0; k < motion.problem->numStages(); ++k) {
    const StageSpec& spec = motion.problem->spec(k);
    const double longest = spec.dt * (spec.timing.phase >= 0 ? 2 : 1);
    for (const Closure& closure : spec.constraints.closures) {
      CHECK(closure.kp == Approx(std::min(JumpOptions().contact_kp, 1 / (3 * longest * longest))));
      CHECK(closure.kd == Approx(std::min(JumpOptions().contact_kd, 1 / longest)));
    }
  }
}
