// When joints that are far from their plan are a fall, on a four-bar linkage.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"
#include "worlds/fall_detector.h"
#include "worlds/robot_errors.h"

namespace bielle::worlds {
namespace {

constexpr double kCrank = 1.047198;  // of the plan, rad

struct Linkage {
  Linkage() : model(loadRobot(BIELLE_SOURCE_DIR "/robots/fourbar").model), planned(4) {
    planned << kCrank, -0.541627, 1.633456, 2.013707;  // crank, crank to coupler, rocker, rocker to coupler
    // Reflected it closes as well, with its crank below: the other assembly.
    reflected = close(-planned);
    planned = close(planned);
    Policy::Stage stage;
    stage.duration = 1;
    stage.q = planned;
    stage.v = stage.q_change = stage.v_next = VectorXd::Zero(model.nv());
    stage.u = VectorXd::Zero(model.nu());
    plan = std::make_unique<Policy>(model, std::vector<Policy::Stage>{stage}, stage.u);
  }
  VectorXd close(const VectorXd& near) const {
    AssemblyProblem problem;
    problem.q_ref = near;
    const AssemblyResult result = assemble(model, problem);
    REQUIRE(result.status == NumericalStatus::Ok);
    return result.q;
  }
  // As the linkage follows its crank.
  VectorXd turn(const VectorXd& from, double crank) const {
    PassiveJoints joints(model, from);
    VectorXd q = from;
    const double start = from[0];
    constexpr int kSteps = 100;
    for (int i = 1; i <= kSteps; ++i) {
      const VectorXd at = VectorXd::Constant(1, start + (crank - start) * i / kSteps);
      REQUIRE(joints.update(at, q) == NumericalStatus::Ok);
    }
    return q;
  }
  bool isFallen(const VectorXd& q, bool only_whirling) const {
    FallCriterion criterion;
    criterion.only_whirling = only_whirling;
    return !FallDetector(model, *plan, planned, criterion, {}, {}).find(0, 0, q).empty();
  }

  Model model;
  VectorXd planned, reflected;
  std::unique_ptr<Policy> plan;
};

}  // namespace

TEST_CASE("falls: joints far from their plan are one unless their linkage follows its motors back") {
  const Linkage linkage;
  CHECK_FALSE(linkage.isFallen(linkage.turn(linkage.planned, kCrank + 0.7), false));
  for (double turn : {-1.6, 1.6, 3.1}) {
    const VectorXd turned = linkage.turn(linkage.planned, kCrank + turn);
    CHECK(linkage.isFallen(turned, false));
    CHECK_FALSE(linkage.isFallen(turned, true));
  }
  CHECK(linkage.isFallen(linkage.turn(linkage.planned, kCrank + 3.2), true));
}

TEST_CASE("falls: a linkage that has passed a dead point is one, even with its motor where it is planned") {
  const Linkage linkage;
  for (double turn : {0.0, 0.7, 1.6}) {
    const VectorXd crossed = linkage.turn(linkage.reflected, kCrank + turn);
    CHECK(std::abs(crossed[2] - linkage.planned[2]) > 1.5);
    CHECK(linkage.isFallen(crossed, false));
    CHECK(linkage.isFallen(crossed, true));
  }
}

TEST_CASE("falls: what is not a number is one") {
  const Linkage linkage;
  CHECK_FALSE(linkage.isFallen(linkage.planned, false));
  for (const int k : {0, 2}) {
    VectorXd q = linkage.planned;
    q[k] = std::numeric_limits<double>::quiet_NaN();
    CHECK(linkage.isFallen(q, false));
  }
}

// Motors of an ankle turned by 1.6 rad from the plan, on a robot whose rods are not those of its model.
TEST_CASE("falls: linkages of a robot that differs from its model are followed back as well") {
  const Model model = loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto").model;
  const Model machine = makeMachine(model, {0, 5e-4, 1});
  const VectorXd q0 = makeStandingPosture(model);
  const int first = model.findMotor("motor_ankle1_right"), second = model.findMotor("motor_ankle2_right");
  const auto turn = [&](const Model& of, const VectorXd& from, double to_first, double to_second) {
    PassiveJoints joints(of, from);
    VectorXd q = from, start(of.nu());
    for (int m = 0; m < of.nu(); ++m) start[m] = from[of.joints()[of.motors()[m].joint].idx_q];
    VectorXd end = start;
    end[first] = to_first;
    end[second] = to_second;
    constexpr int kSteps = 40;
    for (int i = 1; i <= kSteps; ++i)
      REQUIRE(joints.update(start + (end - start) * i / kSteps, q) == NumericalStatus::Ok);
    return q;
  };
  Policy::Stage stage;
  stage.duration = 1;
  stage.q = turn(model, q0, -1.0, 0.5);
  stage.v = stage.q_change = stage.v_next = VectorXd::Zero(model.nv());
  stage.u = VectorXd::Zero(model.nu());
  const Policy plan(model, {stage}, stage.u);
  const VectorXd q_start = assembleMachine(model, machine, stage.q);
  const VectorXd q = turn(machine, q_start, 0.58, -1.2);
  FallCriterion criterion;
  CHECK_FALSE(FallDetector(machine, plan, q_start, criterion, {}, {}).find(0, 0, q).empty());
  criterion.only_whirling = true;
  CHECK(FallDetector(machine, plan, q_start, criterion, {}, {}).find(0, 0, q).empty());
}

}  // namespace bielle::worlds
