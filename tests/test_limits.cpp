// Limits of motors and joints: motions satisfy them, at a higher cost.
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <functional>
#include <regex>

#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/solve.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "own_robots.h"
#include "robot_directory.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

FddpSummary solveWithinLimits(Motion& motion) { return test::solveInPlace(*motion.problem, motion.guess); }

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

double calcPeakPower(const Motion& motion, const std::string& motor) {
  const int m = getBipetto().findMotor(motor), i = getBipetto().nq() + getBipetto().motors()[m].dof;
  double peak = 0;
  for (size_t k = 0; k < motion.guess.us.size(); ++k)
    peak = std::max(peak, std::abs(motion.guess.us[k][m] * motion.guess.xs[k][i]));
  return peak;
}

// A copy of Bipetto with other ranges of the hips.
std::string replaceRange(const testing::RobotDirectory& directory, const std::string& text) {
  const auto read = [](const std::string& name) {
    std::ifstream file(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto/" + name);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string urdf = read("bipetto.urdf");
  const std::regex range("lower=\"-0.523599\" upper=\"0.523599\"");
  REQUIRE(std::regex_search(urdf, range));
  return directory.writeRobot(std::regex_replace(urdf, range, text), read("bipetto.yaml"));
}

template <typename Make>
void checkKneesAtFourFifths(const Make& make) {
  const char* const knees[] = {"motor_knee_left", "motor_knee_right"};
  Motion free = make(ProblemOptions());
  const FddpSummary without = solveWithinLimits(free);
  REQUIRE(without.termination == FddpTermination::Converged);
  LimitOptions limits;
  for (const char* knee : knees) limits.efforts[knee] = 0.8 * calcPeakTorque(free, knee);
  Motion bounded = make(ProblemOptions(Formulation::Reduced, limits));
  CHECK(bounded.problem->hasControlBounds());
  CHECK(!free.problem->hasControlBounds());
  const FddpSummary with = solveWithinLimits(bounded);
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

TEST_CASE("limits: a walk with four fifths of the torque that its knees would like", "[long]") {
  WalkOptions options;
  options.steps = 2;
  checkKneesAtFourFifths([&](const ProblemOptions& problem) { return makeWalk(getBipetto(), options, problem); });
}

TEST_CASE("limits: a jump with four fifths of the torque that its knees would like", "[long]") {
  JumpOptions options;
  options.flight = 0.2;
  options.time_step = 0.01;
  checkKneesAtFourFifths([&](const ProblemOptions& problem) { return makeJump(getBipetto(), options, problem); });
}

TEST_CASE("limits: motors keep to their velocity, and use it", "[long]") {
  SquatOptions options;
  options.duration = 1.2;
  options.settle = 0.1;
  const std::string motor = "motor_knee_right";
  Motion free = makeSquat(getBipetto(), options);
  const FddpSummary without = solveWithinLimits(free);
  REQUIRE(without.termination == FddpTermination::Converged);
  const double limit = 0.7 * calcPeakVelocity(free, motor);
  for (Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    CAPTURE(getName(formulation), limit);
    LimitOptions limits;
    limits.velocities = {{motor, limit}, {"motor_knee_left", limit}};
    Motion slow = makeSquat(getBipetto(), options, {formulation, limits});
    const FddpSummary with = solveWithinLimits(slow);
    CHECK(with.termination == FddpTermination::Converged);
    CHECK(with.cost > without.cost);
    CHECK(calcPeakVelocity(slow, motor) <= (1 + 1e-8) * limit);
    CHECK(calcPeakVelocity(slow, motor) > (1 - 1e-6) * limit);
  }
}

TEST_CASE("limits: motors keep to their power, and use it", "[long]") {
  JumpOptions options;
  options.time_step = 0.01;
  const std::vector<std::string> knees = {"motor_knee_left", "motor_knee_right"};
  Motion free = makeJump(getBipetto(), options);
  const FddpSummary without = solveWithinLimits(free);
  REQUIRE(without.termination == FddpTermination::Converged);
  const double limit = 0.8 * calcPeakPower(free, knees[0]);
  LimitOptions limits;
  for (const std::string& knee : knees) limits.powers[knee] = limit;
  Motion weak = makeJump(getBipetto(), options, {Formulation::Reduced, limits});
  const FddpSummary with = solveWithinLimits(weak);
  CAPTURE(with.message, with.iterations);
  CHECK(with.termination == FddpTermination::Converged);
  CHECK(with.cost > without.cost);
  for (const std::string& knee : knees) {
    CAPTURE(knee, limit);
    CHECK(calcPeakPower(weak, knee) <= (1 + 1e-8) * limit);
    CHECK(calcPeakPower(weak, knee) > (1 - 1e-6) * limit);
  }
}

TEST_CASE("limits: joint ranges hold at every node but the first, and none without limits") {
  const Motion with = makeSquat(getBipetto());
  LimitOptions none;
  none.enforced = false;
  const Motion without = makeSquat(getBipetto(), {}, {Formulation::Reduced, none});
  const auto countRanges = [](const Motion& motion, int node) {
    int count = 0;
    for (const PathConstraint& constraint : motion.problem->spec(node).path_constraints)
      count += constraint.name == "range of hipx_left" || constraint.name == "range of hipx_right";
    return count;
  };
  for (int k : {0, 1, with.problem->numStages()}) {
    CHECK(countRanges(with, k) == (k == 0 ? 0 : 2));
    CHECK(countRanges(without, k) == 0);
  }
  VectorXd lower(getBipetto().nu()), upper(getBipetto().nu());
  with.problem->getControlBounds(0, lower, upper);
  CHECK(upper.minCoeff() == std::numeric_limits<double>::infinity());
}

TEST_CASE("limits: a joint stays within its range, and uses it", "[long]") {
  WalkOptions options;
  options.steps = 2;
  Motion wide = makeWalk(getBipetto(), options);
  REQUIRE(solveWithinLimits(wide).termination == FddpTermination::Converged);
  const int q = getBipetto().joints()[getBipetto().findJoint("hipx_left")].idx_q;
  const auto calcLargest = [q](const Motion& motion) {
    double largest = -1;
    for (const VectorXd& x : motion.guess.xs) largest = std::max(largest, x[q]);
    return largest;
  };
  const double limit = 0.8 * calcLargest(wide);
  REQUIRE(limit > 0.05);
  const testing::RobotDirectory directory;
  const Model model =
      loadRobot(replaceRange(directory, "lower=\"-0.523599\" upper=\"" + std::to_string(limit) + "\"")).model;
  Motion narrow = makeWalk(model, options);
  const FddpSummary summary = solveWithinLimits(narrow);
  CAPTURE(summary.message, summary.iterations, limit);
  CHECK(summary.termination == FddpTermination::Converged);
  CHECK(calcLargest(narrow) <= limit + 1e-6);
  CHECK(calcLargest(narrow) > limit - 1e-5);
}

TEST_CASE(
    "limits: a motion that comes near dead points is solved again with a margin that keeps it 0.1 rad from them") {
  const Model& model = getBipetto();
  const MotionRequest request = findMotion("", "squat").request;
  const auto findNearest = [&](const Solution& solution) {
    double distance = kFarthestDeadPoint;
    for (const DeadPointTrace& linkage : traceDeadPoints(model, makeRecord(solution.motion, solution.trajectory).q))
      distance = std::min(distance, linkage.getNearest().distance);
    return distance;
  };
  const auto getLimits = [](const Solution& solution) { return solution.motion.problem_options.limits; };
  const Solution apart = solve(makeMotion(model, request));
  REQUIRE(apart.converged());
  CHECK(findNearest(apart) > kNearDeadPoint);
  CHECK(findNearest(apart) < 1.3 * kNearDeadPoint);
  CHECK(getLimits(apart).dead_point_margin == LimitOptions().dead_point_margin);
  REQUIRE(!getLimits(apart).dead_point_margins.empty());
  for (const auto& [linkage, margin] : getLimits(apart).dead_point_margins)
    CHECK(margin > LimitOptions().dead_point_margin);
  // Margins that are given from the beginning suffice; those that do not, grow, and one below the general margin changes nothing.
  ProblemOptions given;
  given.limits.dead_point_margins = getLimits(apart).dead_point_margins;
  const Solution same = solve(makeMotion(model, request, given));
  REQUIRE(same.converged());
  CHECK(getLimits(same).dead_point_margins == given.limits.dead_point_margins);
  CHECK(same.summary.cost == Approx(apart.summary.cost).epsilon(1e-6));
  CHECK(same.summary.iterations < apart.summary.iterations);
  const std::string first = given.limits.dead_point_margins.begin()->first;
  given.limits.dead_point_margins = {{first, 0.1}};
  const Solution grown = solve(makeMotion(model, request, given));
  REQUIRE(grown.converged());
  CHECK(getLimits(grown).dead_point_margins == getLimits(apart).dead_point_margins);
  // Who stops the second solve is asked no more.
  int solves = 0;
  bool stopped = false;
  SolveObserver observer;
  observer.motion.callback = [&](const FddpIteration& line, const ShootingTrajectory&) {
    CHECK(!stopped);
    solves += line.iteration == 1;
    stopped = solves == 2;
    return stopped ? FddpAction::Stop : FddpAction::Continue;
  };
  CHECK(solve(makeMotion(model, request), {}, observer).summary.termination == FddpTermination::Interrupted);
  CHECK(stopped);
  // Who asks for less than the default gets it.
  ProblemOptions nearer;
  nearer.limits.dead_point_margin = 0.14;
  const Solution near = solve(makeMotion(model, request, nearer));
  REQUIRE(near.converged());
  CHECK(findNearest(near) < 0.5 * kNearDeadPoint);
  CHECK(getLimits(near).dead_point_margin == 0.14);
  CHECK(getLimits(near).dead_point_margins.empty());
  CHECK(apart.summary.iterations > near.summary.iterations);
  CHECK(apart.summary.cost < 1.02 * near.summary.cost);
}

TEST_CASE("limits: impossible ones are refused by name") {
  const auto make = [](const std::string& motor, double effort) {
    LimitOptions limits;
    limits.efforts[motor] = effort;
    return makeSquat(getBipetto(), {}, {Formulation::Reduced, limits});
  };
  CHECK_NOTHROW(make("motor_knee_left", 12));
  CHECK_THROWS_WITH(make("motor_knee_middle", 12),
                    Catch::Contains("motor_knee_middle") && Catch::Contains("hipx_left"));
  CHECK_THROWS_WITH(make("motor_knee_left", -1), Catch::Contains("not positive"));
  CHECK_THROWS_WITH(make("motor_knee_left", std::nan("")), Catch::Contains("not positive"));
}

TEST_CASE("limits: a range without width, or without the starting posture, is refused") {
  for (const auto& [range, problem] : {std::pair("lower=\"0.1\" upper=\"0.1\"", "has zero width"),
                                       std::pair("lower=\"0.1\" upper=\"0.2\"", "excludes the starting posture")}) {
    const testing::RobotDirectory directory;
    const Model model = loadRobot(replaceRange(directory, range)).model;
    CHECK_THROWS_WITH(makeSquat(model), Catch::Contains("joint 'hipx_") && Catch::Contains(problem));
    LimitOptions none;
    none.enforced = false;
    CHECK_NOTHROW(makeSquat(model, {}, {Formulation::Reduced, none}));
  }
}

TEST_CASE("costs: bounds of a barrier that do not have the size of its residual are refused") {
  const auto expectRefusal = [](const std::function<void(Activation&)>& poison) {
    MotionPlan plan = planSquat(getBipetto(), {}, makeStandingRobot(getBipetto()));
    Activation barrier = Activation::makeBarrier(Vector3d::Ones(), Vector3d::Zero(), Vector3d::Ones());
    poison(barrier);
    plan.stages[3].costs.push_back({"box", 1, barrier, makeComPosition(Vector3d::Zero())});
    CHECK_THROWS_WITH(makeMotion(getBipetto(), std::move(plan), {}),
                      Catch::Contains("stage 3") && Catch::Contains("size of the residual"));
  };
  expectRefusal([](Activation& a) { a.lower.conservativeResize(2); });
  expectRefusal([](Activation& a) { a.upper.resize(0); });
  expectRefusal([](Activation& a) { a.weights.conservativeResize(5); });
}

namespace {

// Bipetto with the same motor at all joints.
Model makeDriven(const MotorDrive& drive) {
  ModelParts parts = takeParts(getBipetto());
  for (Motor& motor : parts.motors) motor.drive = drive;
  return ModelBuilder::restore(std::move(parts));
}

// Largest voltage over that of the supply, exact MotorDrive Eq. (1), from torques and the speeds of the same instant.
double calcVoltageUse(const Motion& motion) {
  const Model& model = motion.problem->model();
  RobotEvaluator evaluator(*motion.problem);
  double largest = 0;
  for (int k = 0; k < motion.problem->numStages(); ++k) {
    const RobotEvaluation& at = evaluator.evaluate(k, motion.guess.xs[k], motion.guess.us[k]);
    for (int m = 0; m < model.nu(); ++m) {
      const MotorDrive& drive = model.motors()[m].drive;
      const double w = at.v_mid.size() > 0 ? at.v_mid[model.motors()[m].dof] : at.x[model.nq() + model.motors()[m].dof];
      const double c = at.u[m] * w < 0 ? drive.back_efficiency : 1 / drive.efficiency,
                   k_t = drive.ratio * drive.torque_constant;
      largest = std::max(largest, std::abs(drive.resistance * c * at.u[m] / k_t + k_t * w) / drive.voltage);
    }
  }
  return largest;
}

}  // namespace

TEST_CASE("limits: motors keep to the voltage of their supply, and use it", "[long]") {
  SquatOptions options;
  options.duration = 1.2;
  options.settle = 0.1;
  MotorDrive drive;
  drive.ratio = 9;
  drive.torque_constant = 0.1;
  drive.resistance = 0.05;  // little, so that what counts is speed: torques that hold the robot cannot be less
  drive.voltage = 1e3;
  drive.efficiency = 0.9;
  drive.back_efficiency = 0.8;
  const Model plenty = makeDriven(drive);
  Motion free = makeSquat(plenty, options);
  const FddpSummary without = solveWithinLimits(free);
  REQUIRE(without.termination == FddpTermination::Converged);
  drive.voltage = 0.8 * 1e3 * calcVoltageUse(free);
  const Model tight = makeDriven(drive);
  for (Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    CAPTURE(getName(formulation), drive.voltage);
    Motion limited = makeSquat(tight, options, {formulation, {}});
    const FddpSummary with = solveWithinLimits(limited);
    CHECK(with.termination == FddpTermination::Converged);
    CHECK(with.cost > without.cost);
    CHECK(calcVoltageUse(limited) <= 1 + 1e-7);
    CHECK(calcVoltageUse(limited) > 0.99);
    LimitOptions none;
    none.enforced = false;
    Motion again = makeSquat(tight, options, {formulation, none});
    CHECK(solveWithinLimits(again).termination == FddpTermination::Converged);
    CHECK(calcVoltageUse(again) > 1.1);
  }
}
