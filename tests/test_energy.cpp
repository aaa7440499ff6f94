// The electrical energy of motors as a cost. Oracles: central differences in the tangent space; speeds and powers from the
// evaluation's own velocities; the smoothed cost against the exact one.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/builder.h"
#include "bielle/motion/problem_options.h"
#include "bielle/ocp/robot_problem.h"
#include "check_derivative.h"
#include "mechanisms.h"
#include "motion/applied_options.h"
#include "weighted_model.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct TimedDiscretization {
  Formulation formulation;
  StepRule step;
  bool free;  // whether durations are variables
};
std::vector<TimedDiscretization> listTimedDiscretizations() {
  std::vector<TimedDiscretization> out;
  for (Formulation formulation : {Formulation::Full, Formulation::Reduced})
    for (StepRule step : {StepRule::Euler, StepRule::Midpoint})
      for (bool free : {false, true}) out.push_back({formulation, step, free});
  return out;
}
std::ostream& operator<<(std::ostream& out, const TimedDiscretization& d) {
  return out << getName(d.formulation) << ", " << getName(d.step) << (d.free ? ", free" : "");
}

constexpr double kWeight = 0.7, kTimeStep = 0.02;

VectorXd makeLosses(const Model& model) { return VectorXd::LinSpaced(model.nu(), 0.2, 0.5); }

// Three steps with this cost alone, and powers bounded as well.
RobotProblem makeEnergyProblem(const Model& model, const VectorXd& q0, const VectorXd& v0,
                               const std::vector<ContactTarget>& contacts, const TimedDiscretization& how) {
  std::vector<StageSpec> stages(4);
  const VectorXd losses = makeLosses(model), ones = VectorXd::Ones(model.nu()), bounds = VectorXd::Ones(2 * model.nu());
  for (int k = 0; k < 3; ++k) {
    StageSpec& stage = stages[k];
    stage.step = how.step;
    stage.dt = kTimeStep;
    if (how.free) stage.timing = {0, 0.5, 2};
    stage.constraints = makeConstraintSet(model, contacts);
    stage.costs.push_back(
        {"energy", kWeight, Activation::makeEnergy(ones, losses, 0.3, 4), makeElectricalPower(losses)});
    stage.path_constraints.push_back({"power", makeElectricalPower(losses), -bounds, bounds, 3 * bounds});
  }
  return RobotProblem(model, q0, v0, std::move(stages), how.formulation);
}

// Powers and torques from the velocities of an evaluation.
VectorXd calcPowers(const Model& model, const RobotEvaluation& at) {
  VectorXd out(2 * model.nu());
  const VectorXd v = at.v_mid.size() > 0 ? at.v_mid : VectorXd(at.x.segment(model.nq(), model.nv()));
  for (int m = 0; m < model.nu(); ++m) {
    out[m] = at.u[m] * (v[model.motors()[m].dof] + makeLosses(model)[m] * at.u[m]);
    out[model.nu() + m] = at.u[m];
  }
  return out;
}

void checkEnergyStage(const RobotProblem& problem, int k, const VectorXd& x, const VectorXd& u, std::mt19937& rng) {
  RobotEvaluator evaluator(problem), moved(problem), node(problem);
  const Model& model = problem.model();
  const int ndx = problem.tangentSize(k), nu = problem.controlSize(k), rows = problem.constraintSize(k);
  const VectorXd x_next = evaluator.evaluate(k, x, u).x_next;
  REQUIRE(evaluator.evaluation().status == NumericalStatus::Ok);
  node.evaluate(k + 1, x_next, VectorXd::Ones(problem.controlSize(k + 1)));
  INFO(node.evaluation().failure);
  REQUIRE(node.evaluation().status == NumericalStatus::Ok);
  ConstraintWeights weights{randomVector(rng, rows), randomVector(rng, rows).cwiseAbs()};
  const auto at = problem.makeEvaluation();
  const auto scratch = problem.makeScratch();
  EvaluateTask evaluate{k, &x, &u, nullptr, at.get()};
  problem.evaluate(&evaluate, 1, scratch.get());
  StageModel stage;
  stage.resize(ndx, nu, problem.tangentSize(k + 1), rows);
  const std::vector<char> all = listRows(problem, k);
  LinearizeTask task{k, at.get(), &node.evaluation(), &all, &stage, NumericalStatus::Failed, {}};
  problem.linearize(&task, 1, scratch.get());
  REQUIRE(task.status == NumericalStatus::Ok);
  addWeights(weights, stage);
  // Cost, weighted constraints and powers as functions of (du, dx).
  const auto step = [&](const VectorXd& d) {
    const VectorXd x1 = d.tail(ndx).isZero(0) ? x : evaluator.integrate(d.tail(ndx));
    const RobotEvaluation& to = moved.evaluate(k, x1, u + d.head(nu));
    REQUIRE(to.status == NumericalStatus::Ok);
    VectorXd out(1 + 2 * model.nu());
    out << to.cost + weights.gradient.dot(to.constraints), calcPowers(model, to);
    return out;
  };
  const MatrixXd J = differentiate(VectorXd::Zero(nu + ndx), 1e-4, step);
  VectorXd gradient(nu + ndx);
  gradient << stage.lu, stage.lx;
  checkDerivative(gradient.transpose(), J.row(0), "gradient");
  if (problem.hasFreeTimings()) return;
  const Activation& energy = problem.spec(k).costs[0].activation;
  const VectorXd r = calcPowers(model, static_cast<const RobotEvaluation&>(*at));
  VectorXd slope(r.size()), curvature(r.size());
  energy.calcDerivatives(r, slope, curvature);
  const VectorXd diagonal = kTimeStep * kWeight * curvature + weights.hessian / 9;
  const auto by = J.bottomRows(r.size());
  checkDerivative(MatrixXd(stage.hessian().selfadjointView<Eigen::Lower>()),
                  by.transpose() * diagonal.asDiagonal() * by, "Hessian");
}

}  // namespace

TEST_CASE("energy: derivatives by states, torques and durations, every joint kind times every closure kind") {
  const TimedDiscretization how = GENERATE(from_range(listTimedDiscretizations()));
  std::mt19937 rng(20);
  for (const MechanismKind& kind : listMechanismKinds()) {
    CAPTURE(how, kind);
    const Mechanism mechanism = makeRandomMechanism(rng, kind.joint, kind.closure, kind.base, 3, 2);
    const Model& model = mechanism.model;
    REQUIRE(model.nu() > 0);
    std::vector<ContactTarget> contacts;
    if (kind.base == MechanismBase::FreeFlyer) contacts = {{1, randomPlacement(rng), 5, 4}};
    Workspace ws(model);
    const VectorXd& q = mechanism.q_closed;
    const VectorXd v = projectVelocity(model, ws, makeConstraintSet(model), q, randomVector(rng, model.nv()));
    const RobotProblem problem = makeEnergyProblem(model, q, v, contacts, how);
    for (int k : {0, 1}) {
      CAPTURE(k);
      VectorXd x = problem.initialState(), u = randomVector(rng, problem.controlSize(k), 5);
      if (how.free && k == 0) u[model.nu()] = 0.8;
      if (how.free && k == 1) x[x.size() - 1] = 1.3;
      checkEnergyStage(problem, k, x, u, rng);
    }
  }
}

namespace {

// The model with windings behind lossy gears.
Model addDrives(const Model& model) {
  ModelParts parts = takeParts(model);
  for (size_t m = 0; m < parts.motors.size(); ++m) {
    MotorDrive& drive = parts.motors[m].drive;
    drive.ratio = 5 + m;
    drive.torque_constant = 0.1;
    drive.resistance = 0.3 + 0.1 * m;
    drive.voltage = 24;
    drive.efficiency = 0.8;
    drive.back_efficiency = 0.6;
    parts.motors[m].torque_loss = 0.2 + 0.1 * m;
  }
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace

TEST_CASE("energy: derivatives of voltages, and of powers behind lossy gears, in every discretization") {
  const TimedDiscretization how = GENERATE(from_range(listTimedDiscretizations()));
  std::mt19937 rng(18);
  for (JointKind kind : kJointKinds) {
    CAPTURE(how, getName(kind));
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::Fixed, 3, 2);
    const Model model = addDrives(mechanism.model);
    const int nu = model.nu();
    REQUIRE(nu > 0);
    std::vector<int> motors;
    for (int m = nu; m-- > 0;) motors.push_back(m);
    Workspace ws(model);
    const VectorXd& q = mechanism.q_closed;
    const VectorXd v = projectVelocity(model, ws, makeConstraintSet(model), q, randomVector(rng, model.nv()));
    std::vector<StageSpec> stages(2);
    StageSpec& stage = stages[0];
    stage.step = how.step;
    stage.dt = kTimeStep;
    if (how.free) stage.timing = {0, 0.5, 2};
    stage.constraints = makeConstraintSet(model);
    stage.costs.push_back({"energy", kWeight, Activation::makeEnergy(VectorXd::Ones(nu), makeLosses(model), 0.3, 4),
                           makeElectricalPower(model)});
    const VectorXd bounds = VectorXd::Constant(nu, 24);
    stage.path_constraints.push_back({"voltage", makeMotorVoltage(model, motors), -bounds, bounds, bounds});
    const RobotProblem problem(model, q, v, std::move(stages), how.formulation);
    VectorXd u = randomVector(rng, problem.controlSize(0), 5);
    if (how.free) u[nu] = 0.8;
    const VectorXd x = problem.initialState();
    RobotEvaluator evaluator(problem), moved(problem), next(problem);
    next.evaluate(1, evaluator.evaluate(0, x, u).x_next);
    const ConstraintWeights weights{randomVector(rng, nu), VectorXd::Zero(nu)};
    const auto at = problem.makeEvaluation();
    const auto scratch = problem.makeScratch();
    EvaluateTask evaluate{0, &x, &u, nullptr, at.get()};
    problem.evaluate(&evaluate, 1, scratch.get());
    StageModel out;
    out.resize(problem.tangentSize(0), problem.controlSize(0), problem.tangentSize(1), nu);
    const std::vector<char> all = listRows(problem, 0);
    LinearizeTask task{0, at.get(), &next.evaluation(), &all, &out, NumericalStatus::Failed, {}};
    problem.linearize(&task, 1, scratch.get());
    REQUIRE(task.status == NumericalStatus::Ok);
    addWeights(weights, out);
    const Eigen::Index nx = out.lx.size();
    const MatrixXd J = differentiate(VectorXd::Zero(u.size() + nx), 1e-4, [&](const VectorXd& d) {
      const VectorXd x1 = d.tail(nx).isZero(0) ? x : evaluator.integrate(d.tail(nx));
      const RobotEvaluation& to = moved.evaluate(0, x1, u + d.head(u.size()));
      return VectorXd::Constant(1, to.cost + weights.gradient.dot(to.constraints));
    });
    VectorXd gradient(u.size() + nx);
    gradient << out.lu, out.lx;
    checkDerivative(gradient.transpose(), J, "gradient");
    // The voltages are those of the velocities of the evaluation.
    const auto& here = static_cast<const RobotEvaluation&>(evaluator.evaluation());
    const VectorXd w = here.v_mid.size() > 0 ? here.v_mid : VectorXd(x.segment(model.nq(), model.nv()));
    for (int i = 0; i < nu; ++i) {
      const Motor& motor = model.motors()[motors[i]];
      const double volts = motor.drive.resistance * u[motors[i]] / (0.8 * motor.drive.ratio * 0.1) +
                           motor.drive.ratio * 0.1 * w[motor.dof];
      CHECK(24 * here.constraints[i] == Approx(volts));
    }
  }
}

TEST_CASE("energy: the smoothed power behind a gear is that of the motor, but for what it says") {
  Motor motor;
  motor.torque_loss = 0.25;
  motor.drive.efficiency = 0.8;
  motor.drive.back_efficiency = 0.6;
  CHECK(calcElectricalPower(motor, 2, 3, 0) == Approx(6 / 0.8 + 0.25 * 4 / 0.64));
  CHECK(calcElectricalPower(motor, 4, -3, 0.5) == Approx(0.5 * (-12 * 0.6 + 0.25 * 16 * 0.36)));
  const Motor ideal;
  CHECK(calcElectricalPower(ideal, 2, 3, 0) == 6 + kDefaultTorqueLoss * 4);
  const double gap = (1 / 0.8 - 0.6) / 2 * kGearSmoothing;
  const Model model = addDrives(makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7).model);
  const ConstraintSet set;
  const Workspace ws(model);
  const auto power = makeElectricalPower(model);
  for (double u : {-7.0, 0.5, 20.0})
    for (double w = -10; w <= 10; w += 0.37) {
      const VectorXd torque = VectorXd::Constant(1, u), speed = VectorXd::Constant(1, w), none;
      VectorXd r(2);
      power->calc({model, ws, set, torque, none, 1, &speed}, r);
      const double p = u * w, loss = *model.motors()[0].torque_loss, c = model.motors()[0].getEffortFactor(p);
      // Of the sign of p its smoothed one misses at most e^2 / (2 p^2).
      const double heat = loss * u * u * (1 / 0.64 - 0.36) / 2 * std::min(1.0, kGearSmoothing / (2 * p * p));
      CHECK(r[0] <= c * p + loss * c * c * u * u + heat + 1e-12);
      CHECK(r[0] >= c * p + loss * c * c * u * u - gap - heat - 1e-12);
    }
}

TEST_CASE("energy: torques that a motor can give at a speed") {
  Motor motor;
  motor.effort_limit = 10;
  motor.drive.ratio = 9;
  motor.drive.torque_constant = 0.1;
  motor.drive.resistance = 0.2;
  motor.drive.efficiency = 0.8;
  motor.drive.voltage = 24;
  const double stall = 24 * 0.8 * 0.9 / 0.2, fastest = 24 / 0.9;
  for (double w : {-30.0, -24.0, -3.0, 0.0, 1.0, 22.0, 26.0, 27.0, 60.0})
    for (double u : {-200.0, -9.0, 0.0, 3.0, 200.0}) {
      const double given = motor.clampEffort(u, w), upper = std::clamp(stall * (1 - w / fastest), -10.0, 10.0),
                   lower = std::clamp(-stall * (1 + w / fastest), -10.0, 10.0);
      CAPTURE(w, u, lower, upper);
      CHECK(given == Approx(std::clamp(u, lower, upper)));
      if (std::abs(w) < fastest) CHECK(std::abs(motor.voltsPerEffort() * given + 0.9 * w) <= 24 + 1e-12);
    }
  motor.drive = {};
  CHECK(motor.clampEffort(-200, 60) == -10);
  CHECK(motor.clampEffort(3, 60) == 3);
}

TEST_CASE("energy: the smoothed cost exceeds the exact one by no more than it says") {
  const double smoothing = 0.1;
  for (double share : {0.0, 0.4, 1.0}) {
    const Activation energy = Activation::makeEnergy(VectorXd::Ones(1), VectorXd::Constant(1, 0.25), share, smoothing);
    double largest = 0;
    for (double power = -3; power <= 3; power += 1e-3) {
      const Eigen::Vector2d r(power, 7);
      const double excess = energy.calc(r) - (power > 0 ? power : share * power);
      CHECK(excess >= -1e-15);
      largest = std::max(largest, excess);
      if (std::abs(power) > 0.5) CHECK(excess <= (1 - share) * smoothing * smoothing / (4 * std::abs(power)) + 1e-15);
    }
    CHECK(largest <= (1 - share) * smoothing / 2 + 1e-15);
    CHECK(largest >= (1 - share) * smoothing / 2 - 1e-3);
  }
}

TEST_CASE("energy: a midpoint step takes the work of its torque, an Euler step one of first order") {
  // One joint under a constant torque from rest: the work of the torque is its kinetic energy.
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Model& model = mechanism.model;
  const auto calcWork = [&](StepRule rule, int steps) {
    std::vector<StageSpec> stages(steps + 1);
    for (StageSpec& stage : stages) {
      stage.step = rule;
      stage.dt = 0.1 / steps;
      stage.constraints = makeConstraintSet(model);
      if (&stage == &stages.back()) continue;
      stage.costs.push_back({"energy", 1, Activation::makeEnergy(VectorXd::Ones(1), VectorXd::Zero(1), 1, 1),
                             makeElectricalPower(VectorXd::Zero(1))});
    }
    const RobotProblem problem(model, mechanism.q_closed, VectorXd::Zero(model.nv()), std::move(stages),
                               Formulation::Reduced);
    RobotEvaluator evaluator(problem);
    VectorXd x = problem.initialState();
    double work = 0;
    for (int k = 0; k < steps; ++k) {
      const RobotEvaluation& at = evaluator.evaluate(k, x, VectorXd::Constant(1, 1.5));
      work += at.cost;
      x = VectorXd(at.x_next);
    }
    // The torque is constant, so that its exact work is that torque times the angle.
    return std::abs(work - 1.5 * (x[0] - mechanism.q_closed[0]));
  };
  for (int steps : {10, 20}) {
    CAPTURE(steps);
    const double midpoint = calcWork(StepRule::Midpoint, steps), euler = calcWork(StepRule::Euler, steps);
    CHECK(midpoint < 0.02 * euler);
    CHECK(calcWork(StepRule::Midpoint, 2 * steps) < 0.3 * midpoint);
    CHECK(calcWork(StepRule::Euler, 2 * steps) > 0.4 * euler);
  }
}

TEST_CASE("energy: what makes no sense is refused") {
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Model& model = mechanism.model;
  const auto make = [&](const std::function<void(std::vector<StageSpec>&)>& spoil) {
    std::vector<StageSpec> stages(2);
    stages[0].constraints = makeConstraintSet(model);
    spoil(stages);
    RobotProblem(model, mechanism.q_closed, VectorXd::Zero(model.nv()), std::move(stages), Formulation::Full);
  };
  const auto add = [](StageSpec& stage, int losses) {
    stage.costs.push_back({"energy", 1, Activation::makeEnergy(VectorXd::Ones(1), VectorXd::Ones(losses), 0, 1),
                           makeElectricalPower(VectorXd::Ones(1))});
  };
  CHECK_NOTHROW(make([&](auto& stages) { add(stages[0], 1); }));
  using Catch::Contains;
  CHECK_THROWS_WITH(make([&](auto& stages) { add(stages[0], 2); }), Contains("do not have the size"));
  CHECK_THROWS_WITH(make([&](auto& stages) { add(stages[1], 1); }), Contains("terminal"));
  CHECK_THROWS_WITH(make([&](auto& stages) {
                      add(stages[0], 1);
                      stages[0].kind = StageKind::Impact;
                      stages[0].dt = 0;
                    }),
                    Contains("impact"));
  std::vector<StageSpec> stages(2);
  ObjectiveOptions options;
  options.regeneration = 1.1;
  CHECK_THROWS_WITH(setObjective(model, options, stages), Contains("regeneration"));
  options.regeneration = 0;
  options.regularization = 0;
  CHECK_THROWS_WITH(setObjective(model, options, stages), Contains("regularization"));
}
