// Derivatives of optimal costs by the mechanism. Oracle: motions solved again for changed robots, and their costs differenced
// to the fourth order.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <memory>
#include <optional>

#include "bielle/design/cost_gradient.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/walk.h"
#include "design/gradient.h"
#include "design/measures.h"
#include "design/motion_envelope.h"
#include "design/spec.h"

using namespace bielle;

namespace {

constexpr double kTolerance = 1e-5;      // relative
constexpr double kBetweenOptima = 4e-3;  // step, over the width of the bounds

using MakeMotion = std::function<Motion(const Model&, const StandingRobot&)>;

// Costs are then exact to ten digits or more.
FddpOptions makeTightOptions() {
  FddpOptions options;
  options.gradient_tolerance = 1e-13;
  options.cost_tolerance = 0;
  options.constraints.tolerance = 1e-10;
  options.initial_regularization = kGuessRegularization;
  return options;
}

struct Optimum {
  Optimum(Model robot, const MakeMotion& make, const std::optional<StartingPoint>& start = {},
          const FddpOptions& options = makeTightOptions())
      : model(std::move(robot)) {
    SolveOptions how;
    how.solver = options;
    how.start = start;
    solution = solve(make(model, makeStandingRobot(model)), how);
    CAPTURE(solution.summary.message, solution.summary.iterations);
    REQUIRE(solution.converged());
  }
  double cost() const { return solution.summary.cost; }
  StartingPoint asStart() const { return {solution.trajectory, solution.multipliers}; }
  Model model;
  Solution solution;
};

VectorXd calcGradient(const Parametrization& robot, const Optimum& optimum, const MakeMotion& make) {
  return calcCostGradient(robot, robot.start(), optimum.solution, make);
}

// \param start  of the motions solved again: that of the robot they are of is a few iterations away
double differentiateOptima(const Parametrization& robot, const MakeMotion& make, const StartingPoint& start, int i,
                           double step) {
  double out = 0;
  for (const auto& [steps, weight] : {std::pair{-2, 1.0}, {-1, -8.0}, {1, 8.0}, {2, -1.0}}) {
    const VectorXd dx = steps * step * VectorXd::Unit(robot.start().size(), i);
    out += weight * Optimum(robot.make(robot.start() + dx), make, start).cost() / (12 * step);
  }
  return out;
}

// \param start  of the first solve; none: the guess of the motion   \param between  as kBetweenOptima
void check(const std::string& name, const Parametrization& robot, const MakeMotion& make,
           const std::optional<StartingPoint>& start = {}, double between = kBetweenOptima) {
  CAPTURE(name);
  const Optimum optimum(robot.startModel(), make, start);
  CHECK(MotionEnvelope(optimum.solution).cost() == Approx(optimum.cost()).epsilon(1e-12));
  const VectorXd gradient = calcGradient(robot, optimum, make);
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    const double step = between * (robot.upper()[i] - robot.lower()[i]);
    const double expected = differentiateOptima(robot, make, optimum.asStart(), static_cast<int>(i), step);
    // Optimal costs are known to twelve digits, which shows in the derivative by an inertia that hardly counts: the four of a
    // difference are off by (1 + 8 + 8 + 1) / 12 as much at worst.
    // The gradient is a difference as well, over steps much smaller, of costs evaluated once, which are known to 14 digits.
    const double own_step = kDesignStep * (robot.upper()[i] - robot.lower()[i]);
    const double rounding = 1.5e-12 * optimum.cost() / step + 1e-14 * optimum.cost() / own_step;
    CAPTURE(robot.variables()[i].name, gradient[i], expected, rounding);
    std::printf("%-28s %-16s %14.8g %10.1e\n", name.c_str(), robot.variables()[i].name.c_str(), gradient[i],
                gradient[i] / expected - 1);
    CHECK(gradient[i] == Approx(expected).epsilon(kTolerance).scale(0).margin(rounding));
  }
}

DesignVariable makeVariable(const std::string& name, double lower, double upper) {
  DesignVariable out;
  out.name = out.parameter = name;
  out.lower = lower, out.upper = upper;
  return out;
}

// Placements, inertias and rotors of a planar leg.
Parametrization makeFivebar() {
  return {"fivebar_leg",
          {},
          {makeVariable("upper_length", 0.06, 0.14), makeVariable("lower_length", 0.15, 0.25),
           makeVariable("body_mass", 0.5, 2), makeVariable("armature", 0, 2e-3)}};
}

// The four-bar of the knees: placements, frames of closures, inertias. \param count  of its five variables
Parametrization makeBipetto(size_t count = 5) {
  const Parametrization all =
      makeParametrization(readDesignSpec(std::string(BIELLE_SOURCE_DIR) + "/examples/knee_design/knee.yaml"));
  return {all.startModel(), {all.variables().begin(), all.variables().begin() + static_cast<std::ptrdiff_t>(count)}};
}

// Its lower leg and its foot, which moves the frame of the contact.
Parametrization makeCleobot() {
  return {"cleobot",
          {},
          {makeVariable("base_radius", 0.05, 0.11), makeVariable("upper_length", 0.15, 0.23),
           makeVariable("ankle_height", 0.04, 0.08), makeVariable("leg_motor_mass", 0.5, 1)}};
}

MakeMotion makeSquatMaker(const ProblemOptions& problem) {
  return [=](const Model& model, const StandingRobot& standing) {
    SquatOptions options;
    options.depth = 0.8, options.duration = 0.8, options.settle = 0.1, options.time_step = 0.04;
    return makeMotion(model, planSquat(model, options, standing), problem);
  };
}

MakeMotion makeWalkMaker(const ProblemOptions& problem) {
  return [=](const Model& model, const StandingRobot& standing) {
    WalkOptions options;
    options.speed = 0.4, options.steps = 2, options.gait.timing.time_step = 0.024;
    return makeMotion(model, planWalk(model, options, standing), problem);
  };
}

}  // namespace

TEST_CASE("envelope: squats of three robots, in both formulations, against motions solved again") {
  for (Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    const std::string suffix = std::string(", ") + getName(formulation);
    check("five-bar leg" + suffix, makeFivebar(), makeSquatMaker(formulation));
    check("Bipetto" + suffix, makeBipetto(), makeSquatMaker(formulation));
    check("Cleobot" + suffix, makeCleobot(), makeSquatMaker(formulation));
  }
}

TEST_CASE("envelope: walks, and Euler steps") {
  check("Bipetto walks", makeBipetto(1), makeWalkMaker(Formulation::Reduced));
  check("Bipetto walks, full", makeBipetto(1), makeWalkMaker(Formulation::Full));
  check("Bipetto walks, Euler", makeBipetto(1), makeWalkMaker({Formulation::Reduced, StepRule::Euler}));
  check("Cleobot walks", {"cleobot", {}, {makeVariable("hip_crank", 0.04, 0.1)}}, makeWalkMaker(Formulation::Reduced));
}

TEST_CASE("envelope: controls at bounds, free durations, the least peak torque") {
  const Parametrization robot = makeFivebar();
  const Optimum free(robot.startModel(), makeSquatMaker(Formulation::Reduced));
  double most = 0;
  for (const VectorXd& u : free.solution.trajectory.us) most = std::max(most, u.lpNorm<Eigen::Infinity>());

  ProblemOptions bounded(Formulation::Reduced);
  for (const Motor& motor : robot.startModel().motors()) bounded.limits.efforts[motor.name] = 0.95 * most;
  const Optimum at_bounds(robot.startModel(), makeSquatMaker(bounded));
  int touching = 0;
  for (const VectorXd& u : at_bounds.solution.trajectory.us) touching += u.lpNorm<Eigen::Infinity>() == 0.95 * most;
  CHECK(touching > 0);
  // Where a torque reaches its bound the second derivative jumps, so that differences have to stay on one side.
  check("bounded torques", robot, makeSquatMaker(bounded), {}, 1e-4);

  ProblemOptions timed(Formulation::Reduced);
  timed.timings.phases = {{kAllPhases, {}}};
  check("free durations", robot, makeSquatMaker(timed));

  ProblemOptions peak(Formulation::Reduced);
  peak.objective.objective = Objective::PeakTorque;
  peak.objective = scaleObjective(free.solution.motion, free.solution.trajectory, peak.objective);
  check("least peak torque", robot, makeSquatMaker(peak), StartingPoint{free.solution.trajectory});
}

namespace {

// Torques, then speeds, of all motors and stages, and back.
VectorXd readMotors(const std::vector<double>& dt, const Motion& motion, const ShootingTrajectory& trajectory) {
  const MotorTrace trace = makeMotorTrace(motion.problem->model(), dt, trajectory);
  VectorXd out(2 * trace.torque.size());
  out << trace.torque.reshaped(), trace.speed.reshaped();
  return out;
}

// A motion on either side of a variable, solved again, and three derivatives of its torques and speeds: the implicit one
// with the Hessian of the solver, that with second-order terms, and the difference of the optima.
class FollowedMotors {
 public:
  FollowedMotors(const Parametrization& robot, const MakeMotion& make, int variable)
      : step_(1e-3 * (robot.upper()[variable] - robot.lower()[variable])),
        dx_(step_ * VectorXd::Unit(robot.start().size(), variable)),
        here_(robot.startModel(), make),
        ahead_(robot.make(robot.start() + dx_), make, StartingPoint{here_.solution.trajectory}),
        behind_(robot.make(robot.start() - dx_), make, StartingPoint{here_.solution.trajectory}) {
    const RobotProblem& problem = *here_.solution.motion.problem;
    for (int k = 0; k < problem.numStages(); ++k) dt_.push_back(problem.spec(k).dt);
    solved_ = differ(ahead_.solution.trajectory, behind_.solution.trajectory);
  }

  VectorXd sweep(int sweeps) const {
    const auto to = followOptimum(here_.solution, ahead_.solution.motion, sweeps),
               from = followOptimum(here_.solution, behind_.solution.motion, sweeps);
    REQUIRE((to && from));
    return differ(*to, *from);
  }
  OptimumDerivative differentiate() const {
    const auto makeReader = [&](const Motion& motion) {
      return [&](const ShootingTrajectory& t) { return readMotors(dt_, motion, t); };
    };
    FollowedMotion followed(here_.solution, here_.solution.motion, makeReader(here_.solution.motion));
    const auto out = followed.differentiate(ahead_.solution.motion, step_, makeReader(ahead_.solution.motion));
    REQUIRE(out);
    return *out;
  }
  const VectorXd& solved() const { return solved_; }

  // Of torques, as roots of mean squares, relative.
  double getError(const VectorXd& derivative) const {
    const Eigen::Index n = solved_.size() / 2;
    return (derivative - solved_).head(n).norm() / solved_.head(n).norm();
  }

  // That of a measure of one motor, over the measure, for a change of the variable by the width of its bounds.
  double calcSlope(Measure measure, int motor, const VectorXd& derivative) const {
    const MotorTrace trace = makeMotorTrace(here_.model, dt_, here_.solution.trajectory);
    const Eigen::Index nu = trace.torque.rows(), N = trace.torque.cols();
    MotorSlopes slopes;
    slopes.dt = dt_, slopes.u = trace.torque, slopes.v = trace.speed;
    slopes.du = {derivative.head(nu * N).reshaped(nu, N)}, slopes.dv = {derivative.tail(nu * N).reshaped(nu, N)};
    const MeasurePieces pieces = calcMeasurePieces(measure, {motor}, {slopes});
    Eigen::Index active = 0;
    const double value = pieces.values.maxCoeff(&active);
    return pieces.gradients(active, 0) / value * step_ / 1e-3;
  }
  // The same by the measures of the optima themselves.
  double calcSolvedSlope(Measure measure, int motor) const {
    const auto get = [&](const Optimum& optimum) {
      const MotionMeasures measures = calcMotionMeasures(optimum.model, dt_, optimum.solution.trajectory);
      return getMeasure(measure, {motor}, {measures});
    };
    return (get(ahead_) - get(behind_)) / (2e-3 * get(here_));
  }
  const std::string& getMotor(int motor) const { return here_.model.motors()[motor].name; }

 private:
  VectorXd differ(const ShootingTrajectory& to, const ShootingTrajectory& from) const {
    return (readMotors(dt_, ahead_.solution.motion, to) - readMotors(dt_, behind_.solution.motion, from)) / (2 * step_);
  }

  double step_;
  VectorXd dx_;
  Optimum here_, ahead_, behind_;
  std::vector<double> dt_;
  VectorXd solved_;
};

}  // namespace

TEST_CASE("envelope: an optimum followed to first order, against optima of changed robots") {
  const auto check = [](const Parametrization& robot, const MakeMotion& make, int variable) {
    const FollowedMotors motors(robot, make, variable);
    std::printf("%s:", robot.variables()[variable].name.c_str());
    double last = 1;
    for (int sweeps = 1; sweeps <= 4; ++sweeps) {
      const double error = motors.getError(motors.sweep(sweeps));
      std::printf(" %.1e", error);
      CHECK(error < last);
      last = error;
    }
    CHECK(last < 1e-2);
    const OptimumDerivative derivative = motors.differentiate();
    const double error = motors.getError(derivative.value);
    std::printf(", extrapolated %.1e after %d\n", error, derivative.sweeps);
    CHECK(derivative.residual <= kFollowTolerance);
    CHECK(error < 3 * kFollowTolerance);
    VectorXd poisoned = derivative.value;
    Eigen::Index largest = 0;
    motors.solved().head(poisoned.size() / 2).cwiseAbs().maxCoeff(&largest);
    poisoned[largest] *= -1;
    CHECK(motors.getError(poisoned) > 3 * kFollowTolerance);
  };
  check(makeFivebar(), makeSquatMaker(Formulation::Reduced), 0);
  check(makeBipetto(), makeSquatMaker(Formulation::Reduced), 0);
  check(makeBipetto(), makeSquatMaker(Formulation::Full), 2);
  check(makeBipetto(), makeWalkMaker(Formulation::Reduced), 0);
  check(makeCleobot(), makeWalkMaker(Formulation::Reduced), 1);
}

TEST_CASE("envelope: where Gauss-Newton Hessians point the wrong way, second-order terms do not") {
  struct Case {
    std::string name;
    Parametrization robot;
    MakeMotion make;
    int variable;
    Measure measure;
    int motor;
  };
  const MakeMotion jump = [](const Model& model, const StandingRobot& standing) {
    JumpOptions options;
    options.flight = 0.3, options.time_step = 0.01;
    return makeMotion(model, planJump(model, options, standing), ProblemOptions());
  };
  const MakeMotion squat = [](const Model& model, const StandingRobot& standing) {
    SquatOptions options;
    options.depth = 0.5, options.duration = 0.4, options.settle = 0.1, options.time_step = 0.02;
    return makeMotion(model, planSquat(model, options, standing), ProblemOptions());
  };
  const std::vector<Case> cases = {
      {"five-bar leg jumps", makeFivebar(), jump, 2, Measure::RmsTorque, 0},
      {"five-bar leg jumps", makeFivebar(), jump, 2, Measure::Energy, 0},
      {"five-bar leg squats", makeFivebar(), squat, 0, Measure::Energy, 1},
      {"Bipetto squats", makeBipetto(1), makeSquatMaker(Formulation::Reduced), 0, Measure::PeakTorque, 4},
      {"Bipetto walks", makeBipetto(1), makeWalkMaker(Formulation::Reduced), 0, Measure::RmsTorque, 4}};
  for (const Case& c : cases) {
    const FollowedMotors motors(c.robot, c.make, c.variable);
    const OptimumDerivative derivative = motors.differentiate();
    const auto slope = [&](const VectorXd& of) { return motors.calcSlope(c.measure, c.motor, of); };
    const double first = slope(motors.sweep(1)), second = slope(derivative.value);
    const double solved = motors.calcSolvedSlope(c.measure, c.motor);
    std::printf("%-20s %-12s %-12s %-14s %8.4f %8.4f %8.4f %8.4f %8.4f (%d sweeps, left %.1e)\n", c.name.c_str(),
                c.robot.variables()[c.variable].name.c_str(), motors.getMotor(c.motor).c_str(), getName(c.measure),
                first, slope(motors.sweep(2)), slope(motors.sweep(3)), second, solved, derivative.sweeps,
                derivative.residual);
    CAPTURE(c.name, getName(c.measure), first, second, solved);
    CHECK(first * solved < 0);
    CHECK(second == Approx(solved).epsilon(0.02).scale(0));
    CHECK(first != Approx(solved).epsilon(0.02).scale(0));
  }
}

TEST_CASE("envelope: problems that do not fit the optimum are refused") {
  const Parametrization robot = makeFivebar();
  const Optimum optimum(robot.startModel(), makeSquatMaker(Formulation::Reduced));
  const MotionEnvelope envelope(optimum.solution);
  CHECK(envelope.calcLagrangian(optimum.solution.motion) == Approx(optimum.cost()).epsilon(1e-9));
  CHECK_THROWS_AS(envelope.calcLagrangian(makeSquat(optimum.model)), std::invalid_argument);
  Solution other = optimum.solution;
  other.multipliers = {{VectorXd()}, 1};
  CHECK_THROWS_AS(MotionEnvelope(other), std::invalid_argument);
}

TEST_CASE("envelope: time of twenty parameters", "[.table]") {
  const auto getSeconds = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };  // of the processor
  FddpOptions options;
  options.threads = 1;
  options.initial_regularization = kGuessRegularization;
  const auto run = [&](const std::string& name, const Parametrization& robot, const MakeMotion& make) {
    for (int turn = 0; turn < 5; ++turn) {
      const double begin = getSeconds();
      const Optimum optimum(robot.startModel(), make, {}, options);
      const double solved = getSeconds();
      // By those there are, several times over: what a variable costs does not depend on what it is.
      Eigen::Index count = 0;
      while (count < 20) count += calcGradient(robot, optimum, make).size();
      REQUIRE(count == 20);
      const double solve = solved - begin, gradient = getSeconds() - solved;
      std::printf("%s: solve %.3f s, twenty parameters %.3f s, %.2f of it\n", name.c_str(), solve, gradient,
                  gradient / solve);
    }
  };
  const auto make = [&](const Model& model, const StandingRobot& standing) {
    return makeMotion(model, planWalk(model, {}, standing), ProblemOptions());
  };
  run("Bipetto walks", makeBipetto(), make);
  run("Cleobot walks", makeCleobot(), make);
}
