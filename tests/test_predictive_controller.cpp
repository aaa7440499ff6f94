// Predictive control in Bielle's world: the same bytes for every number of threads; on the plan, and when solves fail.
#include <catch2/catch.hpp>

#include "bielle/control/predictive_controller.h"
#include "bielle/model/reader.h"
#include "bielle/motion/squat.h"
#include "simulation/bielle_world.h"
#include "simulation/execution.h"
#include "simulation/make_world.h"

namespace bielle::simulation {
namespace {

const Model& getBipetto() {
  static const LoadedRobot robot = loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto");
  return robot.model;
}

// A squat, its solution, and the policy of its gains.
struct Solved {
  Motion motion;
  std::unique_ptr<Policy> gains;
};
template <typename Options>
Solved solve(MotionPlan (*plan)(const Model&, const Options&, const VectorXd&), const Options& options) {
  const Model& model = getBipetto();
  Solved out{makeMotion(model, plan(model, options, makeStandingPosture(model)), ProblemOptions()), nullptr};
  FddpOptions solver_options;
  solver_options.initial_regularization = kGuessRegularization;
  solver_options.bounds = ControlBounds::Enforce;
  Fddp solver(solver_options);
  REQUIRE(solver.solve(*out.motion.problem, out.motion.guess).termination == FddpTermination::Converged);
  out.gains = std::make_unique<Policy>(makePolicy(out.motion, out.motion.guess, solver));
  return out;
}

template <typename Options>
std::unique_ptr<PredictiveController> makeController(MotionPlan (*plan)(const Model&, const Options&, const VectorXd&),
                                                     const Options& options, const Solved& solved,
                                                     const PredictiveOptions& predictive) {
  const Model& model = getBipetto();
  return std::make_unique<PredictiveController>(
      makePredictiveMotion(model, plan(model, options, makeStandingPosture(model)), ProblemOptions(), predictive),
      solved.motion.guess, predictive);
}

constexpr double kStage = 0.015;  // s

SquatOptions makeShortSquat() {
  SquatOptions options;
  options.depth = 0.93;
  options.duration = 0.5;
  options.time_step = kStage;
  return options;
}

PredictiveOptions makeShortWindow(int threads) {
  PredictiveOptions options;
  options.nodes = 30;
  options.threads = threads;
  return options;
}

Execution carryOut(const Solved& solved, Controller& controller, const ExecutionOptions& options) {
  const auto world = makeWorld("bielle", getBipetto(), {options.ground, 0});
  return execute(getBipetto(), *solved.gains, controller, *world, options);
}

const Solved& getSquat() {
  static const Solved squat = solve(planSquat, makeShortSquat());
  return squat;
}

}  // namespace

TEST_CASE("predictive control: a squat stands to its end and beyond, to the same bytes for every number of threads") {
  ExecutionOptions options;
  options.duration = 60 * kStage;
  const auto one = makeController(planSquat, makeShortSquat(), getSquat(), makeShortWindow(1)),
             two = makeController(planSquat, makeShortSquat(), getSquat(), makeShortWindow(2));
  const Execution a = carryOut(getSquat(), *one, options), b = carryOut(getSquat(), *two, options);
  CHECK(a.outcome == Outcome::Stood);
  CHECK(a.largest_deviation < 5e-3);
  CHECK(one->getCounts().failed == 0);
  CHECK(one->getCounts().solves == 60);  // one for every stage
  CHECK(a.record.q == b.record.q);
  CHECK(a.record.u == b.record.u);
}

TEST_CASE("predictive control: on the plan its torques are those of the plan") {
  const Model& model = getBipetto();
  const Solved& squat = getSquat();
  const auto controller = makeController(planSquat, makeShortSquat(), squat, makeShortWindow(0));
  Measurement at{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  VectorXd u(model.nu()), planned(model.nu());
  for (int tick = 0; tick < 300; ++tick) {
    at.time = 1e-3 * tick;
    squat.gains->getReference(at.time, at.q, at.v);
    controller->update(at, u);
    squat.gains->update(at, planned);
    CHECK((u - planned).norm() < 0.05 * planned.norm());
  }
  at.q[0] += 0.01;  // off it they are others
  controller->update(at, u);
  CHECK((u - planned).norm() > 0.05 * planned.norm());
}

TEST_CASE("predictive control: states that cannot be solved from leave the last policy in force, and are counted") {
  const Model& model = getBipetto();
  const Solved& squat = getSquat();
  const auto controller = makeController(planSquat, makeShortSquat(), squat, makeShortWindow(0));
  Measurement at{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  squat.gains->getReference(0, at.q, at.v);
  VectorXd u(model.nu());
  controller->update(at, u);
  const Measurement good = at;
  at.time = kStage;
  at.v.setConstant(std::numeric_limits<double>::quiet_NaN());
  controller->update(at, u);
  CHECK(controller->getCounts().failed == 1);
  at.v = good.v;
  at.time = kStage + 1e-3;
  controller->update(at, u);
  CHECK(u.allFinite());
  at.time = 2 * kStage;
  controller->update(at, u);
  CHECK(u.allFinite());
  CHECK(controller->getCounts().failed == 1);
  CHECK(controller->getCounts().solves == 3);
}

TEST_CASE("predictive control: a walk by command is made on the way, to the same bytes for every number of threads") {
  const Model& model = getBipetto();
  const std::vector<TimedCommand> commands{{0, {0.4, 0, 0}}, {0.8, {}}};
  LocomotionOptions gait;
  gait.contact_kp = 0;
  gait.foothold_room = 0.4;
  gait.cone_margin = 0.2;
  const auto makeWalk = [&] {
    return CommandedWalk(
        model, gait, {}, [&](double time) { return findCommand(commands, time); }, makeStandingPosture(model));
  };
  ExecutionOptions options;
  options.duration = 1.5;
  PredictiveOptions predictive = makeShortWindow(1);
  predictive.nodes = 60;
  PredictiveController one(makeWalk(), predictive);
  predictive.threads = 2;
  PredictiveController two(makeWalk(), predictive);
  const Execution a = carryOut(getSquat(), one, options), b = carryOut(getSquat(), two, options);
  CHECK(a.outcome == Outcome::Stood);
  CHECK(a.distance > 0.1);
  CHECK(one.getCounts().failed == 0);
  CHECK(one.getCounts().solves == 125);
  CHECK(a.record.q == b.record.q);
  CHECK(a.record.u == b.record.u);
}

TEST_CASE("predictive control: it refuses a plan that is not one of its motion") {
  const Model& model = getBipetto();
  const PredictiveOptions options = makeShortWindow(1);
  ShootingTrajectory shorter = getSquat().motion.guess;
  shorter.xs.pop_back();
  shorter.us.pop_back();
  CHECK_THROWS_AS(
      PredictiveController(makePredictiveMotion(model, planSquat(model, makeShortSquat(), makeStandingPosture(model)),
                                                ProblemOptions(), options),
                           shorter, options),
      std::invalid_argument);
}

}  // namespace bielle::simulation
