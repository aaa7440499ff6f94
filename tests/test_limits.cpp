// Limits of motors: motions satisfy them, at a higher cost.
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <functional>
#include <regex>

#include "bielle/model/error.h"
#include "bielle/model/reader.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/walk.h"
#include "robot_directory.h"

using namespace bielle;

namespace {

const Model& getBipetto() {
  static const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto").model;
  return model;
}

FddpSummary solve(Motion& motion, ControlBounds bounds) {
  FddpOptions options;
  options.bounds = bounds;
  return Fddp(options).solve(*motion.problem, motion.guess);
}

double calcPeakTorque(const Motion& motion, const std::string& motor) {
  const int m = getBipetto().findMotor(motor);
  double peak = 0;
  for (const VectorXd& u : motion.guess.us) peak = std::max(peak, std::abs(u[m]));
  return peak;
}

double calcPeakVelocity(const Motion& motion, const std::string& motor) {
  const int i = getBipetto().nq() + getBipetto().motors()[getBipetto().findMotor(motor)].dof;
  double peak = 0;
  for (const VectorXd& x : motion.guess.xs) peak = std::max(peak, std::abs(x[i]));
  return peak;
}

template <typename Make>
void checkKneesAtFourFifths(const Make& make) {
  const char* const knees[] = {"motor_knee_left", "motor_knee_right"};
  Motion free = make(ProblemOptions());
  const FddpSummary without = solve(free, ControlBounds::Ignore);
  REQUIRE(without.termination == FddpTermination::Converged);
  LimitOptions limits;
  limits.barrier = LimitBarrier::Quadratic;
  for (const char* knee : knees) limits.efforts[knee] = 0.8 * calcPeakTorque(free, knee);
  Motion bounded = make(ProblemOptions(Formulation::Reduced, limits));
  const FddpSummary with = solve(bounded, ControlBounds::Enforce);
  CAPTURE(with.message, with.iterations);
  CHECK(with.termination == FddpTermination::Converged);
  CHECK(with.cost > without.cost);
  for (const char* knee : knees) {
    CAPTURE(knee, limits.efforts[knee]);
    CHECK(calcPeakTorque(bounded, knee) <= limits.efforts[knee] + 1e-6);
    CHECK(calcPeakTorque(bounded, knee) > 0.999 * limits.efforts[knee]);  // it is worth using
  }
}

}  // namespace

TEST_CASE("limits: a walk with four fifths of the torque that its knees would like") {
  WalkOptions options;
  options.steps = 3;
  checkKneesAtFourFifths([&](const ProblemOptions& problem) { return makeWalk(getBipetto(), options, problem); });
}

TEST_CASE("limits: a jump with four fifths of the torque that its knees would like") {
  JumpOptions options;
  options.flight = 0.2;
  options.time_step = 0.01;
  checkKneesAtFourFifths([&](const ProblemOptions& problem) { return makeJump(getBipetto(), options, problem); });
}

TEST_CASE("limits: barriers hold motor velocities back") {
  SquatOptions options;
  options.duration = 1.2;
  const std::string motor = "motor_knee_right";
  Motion free = makeSquat(getBipetto(), options);
  REQUIRE(solve(free, ControlBounds::Ignore).termination == FddpTermination::Converged);
  const double peak = calcPeakVelocity(free, motor);
  for (LimitBarrier barrier : {LimitBarrier::Quadratic, LimitBarrier::Logarithmic}) {
    CAPTURE(static_cast<int>(barrier), peak);
    LimitOptions limits;
    limits.barrier = barrier;
    limits.velocities = {{motor, 0.7 * peak}, {"motor_knee_left", 0.7 * peak}};
    Motion slow = makeSquat(getBipetto(), options, {Formulation::Reduced, limits});
    CHECK(solve(slow, ControlBounds::Enforce).termination == FddpTermination::Converged);
    const double reached = calcPeakVelocity(slow, motor);
    CHECK(reached < 0.8 * peak);
    CHECK(reached > 0.3 * peak);
  }
}

TEST_CASE("limits: joint ranges of the model get a barrier at every node, and no limits change nothing") {
  LimitOptions limits;
  limits.barrier = LimitBarrier::Logarithmic;
  const Motion with = makeSquat(getBipetto(), {}, {Formulation::Reduced, limits});
  const Motion without = makeSquat(getBipetto());
  for (int k : {0, with.problem->numStages()}) {
    const std::vector<Cost>&costs = with.problem->spec(k).costs, &fewer = without.problem->spec(k).costs;
    REQUIRE(costs.size() == fewer.size() + 1);
    CHECK(costs.back().name == "joint ranges");
    CHECK(costs.back().residual->size() == 2);  // hipx_left and hipx_right
  }
  VectorXd lower(getBipetto().nu()), upper(getBipetto().nu());
  with.problem->getControlBounds(0, lower, upper);
  CHECK(upper.minCoeff() == std::numeric_limits<double>::infinity());
}

TEST_CASE("limits: impossible ones are refused by name") {
  const auto make = [](const std::string& motor, double effort) {
    LimitOptions limits;
    limits.barrier = LimitBarrier::Quadratic;
    limits.efforts[motor] = effort;
    return makeSquat(getBipetto(), {}, {Formulation::Reduced, limits});
  };
  CHECK_NOTHROW(make("motor_knee_left", 12));
  CHECK_THROWS_WITH(make("motor_knee_middle", 12),
                    Catch::Contains("motor_knee_middle") && Catch::Contains("hipx_left"));
  CHECK_THROWS_WITH(make("motor_knee_left", -1), Catch::Contains("not positive"));
  CHECK_THROWS_WITH(make("motor_knee_left", std::nan("")), Catch::Contains("not positive"));
}

TEST_CASE("limits: a range without width has no scale, and is refused") {
  std::ifstream file(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto/bipetto.urdf");
  std::ifstream parameters(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto/bipetto.yaml");
  const std::string urdf(std::istreambuf_iterator<char>(file), {}),
      yaml(std::istreambuf_iterator<char>(parameters), {});
  const std::regex range("lower=\"-0.523599\" upper=\"0.523599\"");
  REQUIRE(std::regex_search(urdf, range));
  const testing::RobotDirectory directory;
  const Model model =
      loadRobot(directory.writeRobot(std::regex_replace(urdf, range, "lower=\"0.1\" upper=\"0.1\""), yaml)).model;
  for (LimitBarrier barrier : {LimitBarrier::Quadratic, LimitBarrier::Logarithmic}) {
    LimitOptions limits;
    limits.barrier = barrier;
    CHECK_THROWS_WITH(makeSquat(model, {}, ProblemOptions(Formulation::Reduced, limits)),
                      Catch::Contains("joint 'hipx_") && Catch::Contains("has no width"));
  }
  CHECK_NOTHROW(makeSquat(model));
}

TEST_CASE("costs: bounds of a barrier that do not have the size of its residual are refused") {
  const auto expectRefusal = [](const std::function<void(Activation&)>& poison) {
    MotionPlan plan = planSquat(getBipetto(), {}, makeStandingPosture(getBipetto()));
    Activation barrier = Activation::makeBarrier(Vector3d::Ones(), Vector3d::Zero(), Vector3d::Ones());
    poison(barrier);
    plan.stages[3].costs.push_back({"box", 1, barrier, makeComPosition(Vector3d::Zero())});
    CHECK_THROWS_WITH(makeMotion(getBipetto(), std::move(plan), {}),
                      Catch::Contains("stage 3") && Catch::Contains("size of the residual"));
  };
  expectRefusal([](Activation& a) { a.lower.conservativeResize(2); });
  expectRefusal([](Activation& a) { a.upper.resize(0); });
  expectRefusal([](Activation& a) { a.weights.conservativeResize(5); });
  expectRefusal([](Activation& a) { a.kind = ActivationKind::LogBarrier; });  // without its relaxation
}
