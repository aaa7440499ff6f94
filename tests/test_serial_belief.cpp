// Controllers that take a closed robot for its serial model.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/reader.h"
#include "bielle/motion/motion.h"
#include "motion/posture_lift.h"
#include "own_robots.h"
#include "worlds/serial_belief.h"

namespace bielle::worlds {
namespace {

using bielle::testing::loadOwn;

constexpr double kSingular = 1e-3;

// Always asks for the same torques.
class Constant : public Controller {
 public:
  explicit Constant(VectorXd tau) : tau_(std::move(tau)) {}
  void update(const Measurement& measurement, VectorRef u) override {
    u = tau_;
    told = measurement;
  }
  Measurement told;

 private:
  VectorXd tau_;
};

struct Trial {
  explicit Trial(double bend)
      : robot(loadOwn("bipetto")), q0(makeStandingPosture(robot.model)), serial(makeSerialModel(robot.model, q0)) {
    const Model &closed = robot.model, &model = serial.model;
    q_s = restrictConfiguration(closed, model, q0);
    v_s = VectorXd::LinSpaced(model.nv(), -1, 1);
    for (int j : model.serialJoints()) q_s[model.joints()[j].idx_q] += bend * (j % 3 - 1);
    PostureLift posture(closed, serial);
    REQUIRE(posture.setConfiguration(q_s, kSingular) == NumericalStatus::Ok);
    q = posture.q();
    v = posture.liftVelocity(v_s);
    tau = VectorXd::LinSpaced(model.nu(), 3, -5);
  }

  // Power of the motors less that of the torques that were requested, over the latter.
  double calcPowerError(Belief belief) {
    auto constant = std::make_unique<Constant>(tau);
    const Constant& inner = *constant;
    SerialController controller(robot.model, serial, std::move(constant), belief);
    VectorXd u(robot.model.nu());
    controller.update({0.5, q, v}, u);
    CHECK(inner.told.time == 0.5);
    CHECK((inner.told.q - q_s).norm() < 1e-9);
    CHECK((inner.told.v - v_s).norm() < 1e-9);
    double given = 0, wanted = 0;
    for (int m = 0; m < robot.model.nu(); ++m) given += u[m] * v[robot.model.motors()[m].dof];
    for (int m = 0; m < serial.model.nu(); ++m) wanted += tau[m] * v_s[serial.model.motors()[m].dof];
    REQUIRE(std::abs(wanted) > 0.1);
    return std::abs(given - wanted) / std::abs(wanted);
  }

  LoadedRobot robot;
  VectorXd q0;
  SerialModel serial;
  VectorXd q_s, v_s, q, v, tau;
};

// A plan that bends the knees at constant speed, without torques.
Policy makeBend(const SerialModel& serial, const VectorXd& q0, double angle) {
  const Model& model = serial.model;
  VectorXd change = VectorXd::Zero(model.nv());
  for (const char* joint : {"knee_left", "knee_right"})
    change[model.joints()[model.findJoint(joint)].idx_v] = angle / 10;
  std::vector<Policy::Stage> stages;
  VectorXd q = q0, next(model.nq());
  for (int k = 0; k < 10; ++k) {
    model.integrate(q, change, next);
    stages.push_back({0.1 * k, 0.1, 0, q, 10 * change, change, 10 * change, VectorXd::Zero(model.nu()), {}});
    q = next;
  }
  return {model, stages, VectorXd::Zero(model.nu())};
}

}  // namespace

TEST_CASE("serial belief: the motors give the power that was requested, by the ratio of the posture") {
  Trial standing(0), bent(0.3);
  CHECK(standing.calcPowerError(Belief::Serial) < 1e-10);
  CHECK(bent.calcPowerError(Belief::Serial) < 1e-10);
  // A ratio that is the same everywhere is right where it was taken, and there alone.
  CHECK(standing.calcPowerError(Belief::Ratio) < 1e-10);
  CHECK(bent.calcPowerError(Belief::Ratio) > 0.01);
}

TEST_CASE("serial belief: the plan is one of the closed robot") {
  const Trial trial(0);
  const Model& closed = trial.robot.model;
  const Policy plan = makeBend(trial.serial, trial.q_s, 0.2);
  const SerialReference reference = makeReference(closed, trial.serial, plan, Belief::Serial);
  CHECK(reference.first_missed < 0);
  CHECK(reference.message.empty());
  CHECK(reference.policy->duration() == plan.duration());
  VectorXd q = closed.makeNeutral(), v(closed.nv()), q_s = trial.q_s, v_s(trial.serial.model.nv());
  Workspace ws(closed);
  for (const Policy::Stage& stage : plan.stages()) {
    reference.policy->getReference(stage.start, q, v);
    plan.getReference(stage.start, q_s, v_s);
    CHECK((restrictConfiguration(closed, trial.serial.model, q) - q_s).norm() < 1e-9);
    CHECK((restrictVelocity(closed, trial.serial.model, v) - v_s).norm() < 1e-9);
    updatePositions(closed, ws, q);
    for (const Closure& closure : closed.closures()) CHECK(calcClosureResidual(ws, closure).norm() < 1e-9);
  }
}

TEST_CASE("serial belief: places where linkages cannot follow are reported") {
  const Trial trial(0);
  const Policy plan = makeBend(trial.serial, trial.q_s, 3);
  const SerialReference reference = makeReference(trial.robot.model, trial.serial, plan, Belief::Serial);
  CHECK(reference.first_missed > 0);
  CHECK(reference.first_missed < plan.duration());
  CHECK_THAT(reference.message, Catch::Contains("knee"));
  for (const Policy::Stage& stage : reference.policy->stages()) CHECK(stage.q.allFinite());
}

}  // namespace bielle::worlds
