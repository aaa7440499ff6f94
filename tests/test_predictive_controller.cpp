// Predictive control in Bielle's world: the same bytes for every number of threads; on the plan, and when solves fail. When solves
// take time: test_predictive_timing.cpp. Feet that do not do as planned: test_predictive_feet.cpp.
#include <catch2/catch.hpp>
#include <limits>

#include "bielle/control/predictive_controller.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/squat.h"
#include "bielle/worlds/bielle_world.h"
#include "own_robots.h"
#include "predictive_trials.h"
#include "worlds/execution.h"
#include "worlds/make_world.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;
using bielle::testing::getShortSquat;
using bielle::testing::kStage;
using bielle::testing::kStageTicks;
using bielle::testing::makeController;
using bielle::testing::makeShortSquat;
using bielle::testing::makeShortWindow;
using bielle::testing::ShortSquat;

// Waits for the solve that begins at an instant of control, if any: how fast the machine is under what load is not known.
class Patient : public Controller {
 public:
  explicit Patient(PredictiveController& inner) : inner_(inner) {}
  void update(const Measurement& measurement, VectorRef u) override {
    inner_.update(measurement, u);
    inner_.waitForSolve();
  }

 private:
  PredictiveController& inner_;
};

Execution carryOut(Controller& controller, const ExecutionOptions& options, const PerceptionOptions& sensors = {},
                   const ContactSchedule& planned = {}) {
  const auto world = makeWorld("bielle", getBipetto());
  return carryOut(Plan{*getShortSquat().gains, planned}, controller, *world, sensors, options);
}

}  // namespace

TEST_CASE("predictive control: a squat stands to its end and beyond, to the same bytes for every number of threads") {
  ExecutionOptions options;
  options.duration = 60 * kStage;
  const auto one = makeController(makeShortWindow(1)), two = makeController(makeShortWindow(2));
  const Execution a = carryOut(*one, options), b = carryOut(*two, options);
  CHECK(a.outcome == Outcome::Stood);
  CHECK(a.largest_deviation < 5e-3);
  CHECK(one->counts().failed == 0);
  CHECK(one->counts().solves == 60);  // one for every stage
  CHECK(a.record.q == b.record.q);
  CHECK(a.record.u == b.record.u);
}

namespace {

// All numbers of a stage that a window changes or might change.
std::vector<VectorXd> listNumbers(const StageSpec& spec) {
  std::vector<VectorXd> out{Vector3d(spec.dt, spec.state.weight, spec.control.weight), spec.state.q_ref,
                            spec.state.v_ref, spec.state.weights, spec.control.reference};
  for (const Cost& cost : spec.costs)
    out.insert(out.end(), {VectorXd::Constant(1, cost.weight), cost.activation.weights});
  for (const PathConstraint& c : spec.path_constraints) out.insert(out.end(), {c.lower, c.upper, c.scale});
  for (const Closure& closure : spec.constraints.closures) out.push_back(Eigen::Vector2d(closure.kp, closure.kd));
  return out;
}

}  // namespace

TEST_CASE("predictive control: the motion that it is given stays as it is") {
  const Model& model = getBipetto();
  PredictiveOptions options = makeShortWindow(1);
  options.fine_nodes = 10;
  options.own_thread = GENERATE(false, true);
  const Motion motion = makePredictiveMotion(model, planSquat(model, makeShortSquat(), makeStandingRobot(model)),
                                             ProblemOptions(), options);
  std::vector<StageSpec> before;
  for (int k = 0; k <= motion.problem->numStages(); ++k) before.push_back(motion.problem->spec(k));
  PredictiveController controller(motion, getShortSquat().solution.trajectory, options);
  ExecutionOptions execution;
  execution.duration = 20 * kStage;
  Patient patient(controller);
  carryOut(patient, execution);
  CHECK(controller.counts().solves >= 19);  // in a thread of its own the last one is not received
  for (int k = 0; k <= motion.problem->numStages(); ++k) {
    CAPTURE(k);
    const StageSpec& after = motion.problem->spec(k);
    CHECK(listNumbers(after) == listNumbers(before[k]));
    for (size_t i = 0; i < after.costs.size(); ++i) CHECK(after.costs[i].residual == before[k].costs[i].residual);
  }
}

TEST_CASE("predictive control: on the plan its torques are those of the plan") {
  const Model& model = getBipetto();
  const ShortSquat& squat = getShortSquat();
  const auto controller = makeController(makeShortWindow(0));
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
  const ShortSquat& squat = getShortSquat();
  const auto controller = makeController(makeShortWindow(0));
  Measurement at{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  squat.gains->getReference(0, at.q, at.v);
  VectorXd u(model.nu());
  controller->update(at, u);
  const Measurement good = at;
  at.time = kStage;
  at.v.setConstant(std::numeric_limits<double>::quiet_NaN());
  controller->update(at, u);
  CHECK(controller->counts().failed == 1);
  at.v = good.v;
  at.time = kStage + 1e-3;
  controller->update(at, u);
  CHECK(u.allFinite());
  at.time = 2 * kStage;
  controller->update(at, u);
  CHECK(u.allFinite());
  CHECK(controller->counts().failed == 1);
  CHECK(controller->counts().solves == 3);
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
        model, gait, {}, [&](double time) { return findCommand(commands, time); }, makeStandingRobot(model));
  };
  ExecutionOptions options;
  options.duration = 1.5;
  PredictiveOptions predictive = makeShortWindow(1);
  predictive.nodes = 60;
  PredictiveController one(makeWalk(), predictive);
  predictive.threads = 2;
  PredictiveController two(makeWalk(), predictive);
  const Execution a = carryOut(one, options), b = carryOut(two, options);
  CHECK(a.outcome == Outcome::Stood);
  CHECK(a.distance > 0.1);
  CHECK(one.counts().failed == 0);
  CHECK(one.counts().solves == 125);
  CHECK(a.record.q == b.record.q);
  CHECK(a.record.u == b.record.u);
}

namespace {

// Hides the state of a walk from a controller at the instant of one solve in each swing, which therefore fails.
class Blinking : public Controller {
 public:
  explicit Blinking(PredictiveController& inner) : inner_(inner) {}
  void update(const Measurement& measurement, VectorRef u) override {
    const bool solves = static_cast<int>(std::lround(1e3 * measurement.time)) % kStageTicks == 0;
    const auto feet = std::count(measurement.contacts.begin(), measurement.contacts.end(), char(1));
    if (solves) swing_ = feet == 1 ? swing_ + 1 : 0;
    Measurement seen = measurement;
    const bool blinks_now = solves && swing_ == kMiddle;
    if (blinks_now) seen.v.setConstant(std::numeric_limits<double>::quiet_NaN());
    inner_.update(seen, u);
    if (blinks_now) u = last_;
    last_ = u;
    blinks += blinks_now;
  }
  int blinks = 0;

 private:
  static constexpr int kMiddle = 18;  // stages since the foot was in the air
  PredictiveController& inner_;
  int swing_ = 0;
  VectorXd last_;
};

}  // namespace

TEST_CASE("predictive control: after a solve that fails in the middle of a swing the next one succeeds", "[long]") {
  const Model& model = getBipetto();
  LocomotionOptions gait;
  gait.contact_kp = 0;
  gait.foothold_room = 0.4;
  gait.cone_margin = 0.2;
  const CommandSource source = [](double time) { return VelocityCommand{time < 2 ? 0.4 : 0, 0, 0}; };
  PredictiveOptions predictive;
  predictive.threads = 1;
  PredictiveController controller(CommandedWalk(model, gait, {}, source, makeStandingRobot(model)), predictive);
  Blinking blinking(controller);
  ExecutionOptions options;
  options.duration = 3;
  const Execution execution = carryOut(blinking, options);
  CHECK(execution.outcome == Outcome::Stood);
  CHECK(blinking.blinks >= 3);
  CHECK(controller.counts().failed == blinking.blinks);
}

namespace {

// Gains of a squat; a controller that is not beyond an instant of its plan.
class HeldBack : public Controller {
 public:
  explicit HeldBack(double longest) : policy_(*getShortSquat().gains), longest_(longest) {}
  void update(const Measurement& measurement, VectorRef u) override { policy_.update(measurement, u); }
  double getPlanTime(double time) const override { return std::min(time, longest_); }

 private:
  Policy policy_;
  const double longest_;
};

}  // namespace

TEST_CASE("estimator: contacts are expected where the controller is in its plan, whatever the time") {
  ExecutionOptions options;
  options.duration = 0.4;
  PerceptionOptions sensors;
  sensors.sensors = SensorOptions{};
  sensors.estimator.surprising_contact = 2;  // of the weight: only expected feet stand
  ContactSchedule planned;
  planned.phases = {{"double support", 10, 0.01, {{0, {}, 0, 0}, {1, {}, 0, 0}}}, {"flight", 30, 0.01, {}}};
  HeldBack held(0.05), on_time(1);
  CHECK(carryOut(held, options, sensors, planned).estimation.contact_errors < 0.05);
  CHECK(carryOut(on_time, options, sensors, planned).estimation.contact_errors > 0.5);
}

TEST_CASE("carried out: a world that cannot follow a torque names the motor") {
  struct Bursting : Controller {
    void update(const Measurement&, VectorRef u) override {
      u.setZero();
      u[2] = -1e8;
    }
  } bursting;
  const Execution execution = carryOut(bursting, {});
  CHECK(execution.outcome == Outcome::BrokeOff);
  CHECK_THAT(execution.message, Catch::Contains("; motor '" + getBipetto().motors()[2].name + "' was at 1e+08 N m"));
}

TEST_CASE("predictive control: it refuses a plan that is not one of its motion") {
  const Model& model = getBipetto();
  const PredictiveOptions options = makeShortWindow(1);
  ShootingTrajectory shorter = getShortSquat().solution.trajectory;
  shorter.xs.pop_back();
  shorter.us.pop_back();
  CHECK_THROWS_AS(
      PredictiveController(makePredictiveMotion(model, planSquat(model, makeShortSquat(), makeStandingRobot(model)),
                                                ProblemOptions(), options),
                           shorter, options),
      std::invalid_argument);
}

TEST_CASE("predictive control: windows, threads and iterations without sense are refused by name") {
  const Model& model = getBipetto();
  const MotionPlan plan = planSquat(model, makeShortSquat(), makeStandingRobot(model));
  const auto make = [&](const PredictiveOptions& options) {
    PredictiveController(makePredictiveMotion(model, plan, ProblemOptions(), options),
                         getShortSquat().solution.trajectory, options);
  };
  for (int nodes : {-1, 0, 9, 1001, 2000000000}) {
    PredictiveOptions options = makeShortWindow(1);
    options.nodes = nodes;
    CHECK_THROWS_WITH(make(options), Catch::Contains("'nodes'") && Catch::Contains("10 .. 1000"));
  }
  PredictiveOptions coarse = makeShortWindow(1);
  coarse.fine_nodes = 9;
  CHECK_THROWS_WITH(make(coarse), Catch::Contains("'fine_nodes': 9 is outside 10 .. 1000"));
  for (int threads : {-1, 20000}) CHECK_THROWS_WITH(make(makeShortWindow(threads)), Catch::Contains("'threads'"));
  PredictiveOptions options = makeShortWindow(1);
  options.iterations = 0;
  CHECK_THROWS_WITH(make(options), Catch::Contains("'iterations': 0 is outside 1 .. 100"));
  for (double time : {-1e-3, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    PredictiveOptions timed = makeShortWindow(1);
    timed.solve_time = time;
    CHECK_THROWS_WITH(make(timed), Catch::Contains("'solve_time': it is n"));
  }
  CHECK_THROWS_AS(makePredictiveMotion(model, MotionPlan(), ProblemOptions(), makeShortWindow(1)), InputError);
}

}  // namespace bielle::worlds
