#pragma once
// Motions to be checked: a solved squat, a pendulum from its equation of motion, a swinging four-bar.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/builder.h"
#include "bielle/model/names.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "check.h"
#include "robot_directory.h"
#include "solve_in_place.h"

namespace bielle::testing {

using namespace bielle::validation;

using Names = std::set<std::string>;

inline std::string print(const CheckReport& report) {
  std::ostringstream text;
  printReport(text, report);
  return text.str();
}

inline Names getFailures(const CheckReport& report) {
  Names names;
  for (const CheckRow& row : report.rows)
    if (!row.passed()) names.insert(row.name);
  return names;
}

inline double getValue(const CheckReport& report, const std::string& name) {
  const CheckRow* row = report.findRow(name);
  REQUIRE(row != nullptr);
  REQUIRE(row->value);
  return *row->value;
}

inline std::string findBipetto() { return std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto"; }

// A squat solved once, written and read back.
struct SolvedSquat {
  explicit SolvedSquat(Formulation formulation, StepRule step = StepRule::Euler) {
    const LoadedRobot robot = loadRobot(findBipetto());
    ProblemOptions options(formulation);
    options.step = step;
    SquatOptions squat;
    squat.time_step = 0.03;  // Simbody takes milliseconds for a node
    Motion motion = makeSquat(robot.model, squat, options);
    summary = test::solveInPlace(*motion.problem, motion.guess);
    writeResult(directory.path(), makeResult({"bipetto", robot.file, {}}, {motion, motion.guess, summary}));
    checked = readMotion(directory.path());
  }
  RobotDirectory directory;
  FddpSummary summary;
  CheckedMotion checked;
};

inline const SolvedSquat& getSquat(Formulation formulation = Formulation::Reduced, StepRule step = StepRule::Euler) {
  static std::map<std::pair<Formulation, StepRule>, SolvedSquat> solved;
  return solved.try_emplace({formulation, step}, formulation, step).first->second;
}

inline const SolvedSquat& getMidpointSquat() { return getSquat(Formulation::Reduced, StepRule::Midpoint); }

// A motion without contacts, from its states and torques.
inline CheckedMotion makeFreeMotion(const Model& model, double h, Formulation formulation, int stages) {
  CheckedMotion motion;
  motion.model = model;
  motion.summary.file = "memory";
  motion.summary.motion = "free motion";
  motion.summary.run.robot = model.name();
  motion.summary.formulation = formulation;
  motion.summary.phases = {{"free", 0, stages, h, {}}};
  MotionRecord& record = motion.record;
  record.q_names = makePositionNames(model);
  record.v_names = makeVelocityNames(model);
  record.u_names = getNames(model.motors());
  record.closure_names = getNames(model.closures());
  record.time = VectorXd::LinSpaced(stages + 1, 0, stages * h);
  record.q.setZero(stages + 1, model.nq());
  record.v.setZero(stages + 1, model.nv());
  record.a.setZero(stages, model.nv());
  record.u.setZero(stages, model.nu());
  record.closure_wrenches.setZero(stages, 6 * model.closures().size());
  record.contact_wrenches.setZero(stages, 0);
  record.com.setZero(stages + 1, 3);
  record.gap.setZero(stages + 1, 2);
  return motion;
}

// A rod of length l and mass m on a hinge: (m l^2 / 3) q'' = -m g (l / 2) sin q, q from hanging down.
constexpr double kLength = 0.7, kGravity = 9.81;
inline double calcPendulumAcceleration(double q) { return -1.5 * kGravity / kLength * std::sin(q); }

inline Model makePendulum() {
  ModelBuilder builder("pendulum");
  Joint joint;
  joint.name = "hinge";
  joint.kind = JointKind::Revolute;
  joint.axis = Vector3d::UnitY();
  Inertia inertia;
  inertia.mass = 1.3;
  inertia.com = Vector3d(0, 0, -kLength / 2);
  inertia.I_com = 1.3 * kLength * kLength / 12 * Eigen::Vector3d(1, 1, 1e-3).asDiagonal();
  builder.addLink("rod", "world", joint, inertia);
  builder.addMotor("hinge");
  return builder.build();
}

// A pendulum's motion by Euler steps of h, or exactly (classical Runge-Kutta steps of h / 100).
inline CheckedMotion makePendulumMotion(double h, bool exact) {
  const int stages = static_cast<int>(std::lround(1 / h));
  CheckedMotion motion = makeFreeMotion(makePendulum(), h, Formulation::Full, stages);
  Eigen::Vector2d x(1.2, 0);
  const auto rate = [](const Eigen::Vector2d& y) { return Eigen::Vector2d(y[1], calcPendulumAcceleration(y[0])); };
  for (int k = 0; k <= stages; ++k) {
    motion.record.q(k, 0) = x[0];
    motion.record.v(k, 0) = x[1];
    motion.record.com.row(k) = -kLength / 2 * Eigen::RowVector3d(std::sin(x[0]), 0, std::cos(x[0]));
    if (k == stages) break;
    motion.record.a(k, 0) = calcPendulumAcceleration(x[0]);
    if (!exact) {
      x[1] += h * motion.record.a(k, 0);
      x[0] += h * x[1];
    }
    for (int i = 0; exact && i < 100; ++i) {
      const double s = h / 100;
      const Eigen::Vector2d k1 = rate(x), k2 = rate(x + s / 2 * k1), k3 = rate(x + s / 2 * k2), k4 = rate(x + s * k3);
      x += s / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
  }
  return motion;
}

// The four-bar swinging from rest, by the steps of a formulation and a rule. `change` modifies the loop.
inline CheckedMotion makeFourBarMotion(double h, Formulation formulation,
                                       const std::function<void(Closure&)>& change = nullptr,
                                       StepRule rule = StepRule::Euler) {
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/fourbar").model;
  const VectorXd q0 = findClosedConfiguration(model).q;
  const int stages = static_cast<int>(std::lround(0.5 / h));
  const auto makeStage = [&] {
    StageSpec stage;
    stage.step = rule;
    stage.dt = h;
    stage.constraints = makeConstraintSet(model);
    if (change) change(stage.constraints.closures[0]);
    stage.state = {0, q0, VectorXd::Zero(model.nv()), VectorXd::Zero(2 * model.nv())};
    stage.control = {0, VectorXd::Zero(model.nu()), VectorXd::Zero(model.nu())};
    return stage;
  };
  std::vector<StageSpec> specs;
  for (int k = 0; k <= stages; ++k) specs.push_back(makeStage());
  Motion motion;
  motion.schedule = {{{"free", stages, h, {}}}};
  motion.problem = std::make_unique<RobotProblem>(model, q0, VectorXd::Zero(model.nv()), std::move(specs), formulation);
  ShootingTrajectory trajectory;
  trajectory.xs = {motion.problem->initialState()};
  RobotEvaluator evaluator(*motion.problem);
  for (int k = 0; k < stages; ++k) {
    trajectory.us.push_back(VectorXd::Constant(model.nu(), 0.3));
    const RobotEvaluation& step = evaluator.evaluate(k, trajectory.xs[k], trajectory.us[k]);
    REQUIRE(step.status == NumericalStatus::Ok);
    trajectory.xs.push_back(step.x_next);
  }
  CheckedMotion checked = makeFreeMotion(model, h, formulation, stages);
  checked.summary.step = rule;
  checked.record = makeRecord(motion, trajectory);
  return checked;
}

}  // namespace bielle::testing
