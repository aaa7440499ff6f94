// Four-bars through configurations where coordinates break down (dead points), and into one where the linkage itself
// does (a change point). Oracles: the loop equations written out in the plane, and the conservation of energy.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/linkage.h"
#include "bielle/model/error.h"
#include "bielle/ocp/cost.h"
#include "bielle/ocp/robot_problem.h"
#include "bielle/robots/fourbar_chain.h"
#include "bielle/solve/fddp.h"
#include "check_residual.h"
#include "math/constants.h"
#include "problem_probe.h"
#include "solve_in_place.h"

using namespace bielle;
using bielle::testing::TestNode;

namespace {

constexpr int kRocker = 0, kCrank = 1, kCoupler = 2;  // joints of a single four-bar

FourBarChainOptions makeParallelogram() {
  FourBarChainOptions options;
  options.crank = options.rocker = 0.2;
  options.coupler = options.ground = 0.4;
  options.crank_angle = 0.3;
  return options;
}

// Closing error in the plane, by fourbar_chain.h Eq. (1).
double calcGap(const FourBarChainOptions& o, const VectorXd& x) {
  const double t2 = x[kCrank], t3 = x[kCrank] + x[kCoupler], t4 = x[kRocker];
  return std::max(std::abs(o.crank * std::cos(t2) + o.coupler * std::cos(t3) - o.ground - o.rocker * std::cos(t4)),
                  std::abs(o.crank * std::sin(t2) + o.coupler * std::sin(t3) - o.rocker * std::sin(t4)));
}

// Rocker angle at a dead point: crank and coupler are one rod of the given length.
double calcExtremeRocker(const FourBarChainOptions& o, double rod) {
  return kPi - std::acos((o.ground * o.ground + o.rocker * o.rocker - rod * rod) / (2 * o.ground * o.rocker));
}

double calcEnergy(const Model& model, const VectorXd& x) {
  Workspace ws(model);
  updatePositions(model, ws, x.head(model.nq()));
  updateVelocities(model, ws, x.tail(model.nv()));
  return calcKineticEnergy(model, ws) + calcPotentialEnergy(model, ws);
}

double calcKinetic(const Model& model, VectorXd x) {
  const double energy = calcEnergy(model, x);
  x.tail(model.nv()).setZero();
  return energy - calcEnergy(model, x);
}

// The velocity of the linkage whose crank turns at `speed`.
VectorXd makeVelocity(const FourBarChain& chain, double speed) {
  Workspace ws(chain.model);
  const VectorXd v = projectVelocity(chain.model, ws, makeConstraintSet(chain.model), chain.q_closed,
                                     VectorXd::Unit(chain.model.nv(), kCrank));
  return v * (speed / v[kCrank]);
}

struct Task {
  int stages = 100;
  double dt = 0.01;
  double turn = 0;         // of the crank, rad
  double start_speed = 0;  // of the crank, rad/s
  double final_speed = 0;  // rad/s
  double way_weight = 1;   // of the crank's way
  double torque_weight = 0.1;
  double end_weight = 1e4;  // of the crank's angle and speed at the end
};

// The crank follows an even way (smoothed at the ends by nothing but the weights).
RobotProblem makeProblem(const FourBarChain& chain, const Task& task) {
  const Model& model = chain.model;
  std::vector<StageSpec> stages(task.stages + 1);
  for (int k = 0; k <= task.stages; ++k) {
    StageSpec& stage = stages[k];
    stage.dt = task.dt;
    if (k < task.stages) stage.constraints = makeConstraintSet(model);
    VectorXd q_ref = chain.q_closed, v_ref = VectorXd::Zero(model.nv()), weights = VectorXd::Zero(2 * model.nv());
    q_ref[kCrank] += task.turn * k / task.stages;
    weights[kCrank] = task.way_weight;
    if (k == task.stages) {
      v_ref[kCrank] = task.final_speed;
      weights[kCrank] = weights[model.nv() + kCrank] = task.end_weight;
    }
    stage.state = {1, q_ref, v_ref, weights};
    stage.control = {task.torque_weight, VectorXd::Zero(1), VectorXd::Ones(1)};
  }
  return RobotProblem(model, chain.q_closed, makeVelocity(chain, task.start_speed), std::move(stages),
                      Formulation::Reduced);
}

ShootingTrajectory makeGuess(const RobotProblem& problem) {
  return {std::vector<VectorXd>(problem.numStages() + 1, problem.initialState()),
          std::vector<VectorXd>(problem.numStages(), VectorXd::Zero(1))};
}

bool isFinite(const ShootingTrajectory& trajectory) {
  const auto finite = [](const std::vector<VectorXd>& list) {
    return std::all_of(list.begin(), list.end(), [](const VectorXd& x) { return x.allFinite(); });
  };
  return finite(trajectory.xs) && finite(trajectory.us);
}

}  // namespace

TEST_CASE("four-bar chain: closed by its formula, one mobility per linkage") {
  for (int count : {1, 3}) {
    FourBarChainOptions options;
    options.count = count;
    const FourBarChain chain = makeFourBarChain(options);
    Workspace ws(chain.model);
    updatePositions(chain.model, ws, chain.q_closed);
    CHECK(calcLargestGap(ws, makeConstraintSet(chain.model)) < 1e-14);
    CHECK(calcGap(options, chain.q_closed) < 1e-15);
    const Mobility mobility = calcMobility(chain.model, chain.q_closed);
    CHECK(mobility.rows == 5 * count);
    CHECK(mobility.mobility == count);
  }
  FourBarChainOptions impossible;
  impossible.coupler = 1;
  CHECK_THROWS_AS(makeFourBarChain(impossible), InputError);
}

TEST_CASE("dead points of the rocker: the crank drives through a whole turn") {
  const FourBarChainOptions options;
  const FourBarChain chain = makeFourBarChain(options);
  Task task;
  task.turn = 2 * kPi;
  task.way_weight = 10;
  RobotProblem problem = makeProblem(chain, task);
  ShootingTrajectory trajectory = makeGuess(problem);
  const FddpSummary summary = test::solveInPlace(problem, trajectory);
  CAPTURE(summary.message, summary.iterations, summary.cost);
  REQUIRE(summary.termination == FddpTermination::Converged);
  double lowest = 1e9, highest = -1e9;
  for (const VectorXd& x : trajectory.xs) {
    CHECK(calcGap(options, x) <= 1e-10);
    lowest = std::min(lowest, x[kRocker]);
    highest = std::max(highest, x[kRocker]);
  }
  CHECK(trajectory.xs.back()[kCrank] == Approx(options.crank_angle + 2 * kPi).margin(1e-2));
  // Both ends of the rocker's way, to the second order of the crank's step.
  CHECK(lowest == Approx(calcExtremeRocker(options, options.coupler + options.crank)).margin(5e-3));
  CHECK(highest == Approx(calcExtremeRocker(options, options.coupler - options.crank)).margin(5e-3));
}

TEST_CASE("dead points of the motor: inertia carries the linkage through") {
  FourBarChainOptions options;
  options.motor = FourBarMotor::Rocker;
  const FourBarChain chain = makeFourBarChain(options);
  // Free motion over more than a turn: the error of the energy is that of Euler steps, of first order.
  double drift[2];
  for (int i : {0, 1}) {
    Task task;
    task.stages = i == 0 ? 4000 : 8000;
    task.dt = 1.0 / task.stages;
    task.start_speed = 12;
    const RobotProblem whole = makeProblem(chain, task);
    testing::ProblemProbe problem(whole);
    VectorXd x = problem.initialState(), next = x;
    const double energy = calcEnergy(chain.model, x), kinetic = calcKinetic(chain.model, x);
    drift[i] = 0;
    double gap = 0, cost = 0;
    for (int k = 0; k < task.stages; ++k) {
      REQUIRE(problem.step(k, x, VectorXd::Zero(1), next, cost) == NumericalStatus::Ok);
      x = next;
      gap = std::max(gap, calcGap(options, x));
      drift[i] = std::max(drift[i], std::abs(calcEnergy(chain.model, x) - energy) / kinetic);
    }
    CHECK(gap <= 1e-10);
    CHECK(x[kCrank] - options.crank_angle > 2 * kPi);
  }
  CAPTURE(drift[0], drift[1]);
  CHECK(drift[0] < 0.05);
  CHECK(drift[1] < 0.6 * drift[0]);
}

TEST_CASE("dead points of the motor: the bounded transmission goes through them, linearly in its arctangent") {
  FourBarChainOptions options;
  options.motor = FourBarMotor::Rocker;
  const FourBarChain chain = makeFourBarChain(options);
  const Model& model = chain.model;
  const ConstraintSet set = makeConstraintSet(model);
  constexpr double kLargest = 2.5;
  const auto residual =
      makeTransmission(makeLinkage(model, chain.q_closed, {model.joints()[model.dofs()[kCrank].joint].name}), kLargest);
  TestNode node(model, set);
  const VectorXd v = VectorXd::Zero(model.nv()), lambda = VectorXd::Zero(set.rows);
  const auto close = [&](double crank) {
    options.crank_angle = crank;
    return makeFourBarChain(options).q_closed;
  };
  const double slope = 1 + kLargest * kLargest;
  const double at_dead_point = kLargest + slope * (kPi / 2 - std::atan(kLargest));
  const double h = 1e-5;
  double last = 0;
  int crossed = 0, wrapped = 0;
  for (int i = 0; i <= 720; ++i) {
    const double crank = 0.1 + 2 * kPi * i / 720;
    const VectorXd before = close(crank - h), q = close(crank), after = close(crank + h);
    const double change = node.calc(*residual, after, v, lambda)[0] - node.calc(*residual, before, v, lambda)[0];
    const double value = node.calc(*residual, q, v, lambda)[0];
    MatrixXd row = MatrixXd::Zero(1, model.nv()), unused = row;
    VectorXd no_time(1);
    residual->calcJacobian(node.view(), {row, unused, unused, unused, unused, no_time});
    CAPTURE(crank, value, change / (2 * h));
    if (std::abs(change) < 1) {
      CHECK(std::abs(change / (2 * h)) < 10 * slope);
      CHECK((row * model.difference(before, after))(0, 0) == Approx(change).epsilon(1e-6).margin(1e-12));
    }
    if (i > 0) wrapped += std::abs(value - last) > 2;
    if (i > 0) crossed += (value - at_dead_point) * (last - at_dead_point) < 0;
    last = value;
  }
  CHECK(crossed == 2);  // crank and coupler in line, twice a turn
  CHECK(wrapped == 0);
}

TEST_CASE("dead points of the motor: an optimal motion goes through them") {
  FourBarChainOptions options;
  options.motor = FourBarMotor::Rocker;
  const FourBarChain chain = makeFourBarChain(options);
  Task task;
  task.stages = 250;
  task.dt = 0.002;
  task.start_speed = 6;
  task.final_speed = 8;
  task.turn = 3.6;
  RobotProblem problem = makeProblem(chain, task);
  // The guess is the free motion, which takes the linkage through.
  ShootingTrajectory trajectory = makeGuess(problem);
  double cost = 0;
  testing::ProblemProbe probe(problem);
  for (int k = 0; k < task.stages; ++k)
    REQUIRE(probe.step(k, trajectory.xs[k], trajectory.us[k], trajectory.xs[k + 1], cost) == NumericalStatus::Ok);
  const FddpSummary summary = test::solveInPlace(problem, trajectory);
  CAPTURE(summary.message, summary.iterations, summary.cost);
  REQUIRE(summary.termination == FddpTermination::Converged);
  int turns_of_rocker = 0;
  double work = 0, kinetic = 0;
  for (size_t k = 0; k < trajectory.xs.size(); ++k) {
    const VectorXd& x = trajectory.xs[k];
    CHECK(calcGap(options, x) <= 1e-10);
    if (k == 0) continue;
    const double before = trajectory.xs[k - 1][3 + kRocker], after = x[3 + kRocker];
    turns_of_rocker += before * after < 0;
    work += trajectory.us[k - 1][0] * (x[kRocker] - trajectory.xs[k - 1][kRocker]);
    kinetic = std::max(kinetic, calcKinetic(chain.model, x));
  }
  CHECK(turns_of_rocker == 1);
  CHECK(trajectory.xs.back()[kCrank] == Approx(options.crank_angle + task.turn).margin(1e-2));
  CHECK(trajectory.xs.back()[3 + kCrank] == Approx(task.final_speed).margin(1e-2));
  // The work of the motor equals the energy gained by the linkage, up to the discretization.
  const double gained = calcEnergy(chain.model, trajectory.xs.back()) - calcEnergy(chain.model, trajectory.xs.front());
  CAPTURE(work, gained, kinetic);
  CHECK(std::abs(work - gained) < 0.05 * kinetic);
}

TEST_CASE("change point: the folded parallelogram is refused by name") {
  const FourBarChainOptions options = makeParallelogram();
  const FourBarChain chain = makeFourBarChain(options);
  Task task;
  task.stages = 10;
  RobotProblem problem = makeProblem(chain, task);
  VectorXd folded = problem.initialState();
  folded.setZero();

  SECTION("a step that lands on it") {
    // The crank's speed after the step is affine in the torque: the one that lands at angle zero.
    const VectorXd x = problem.initialState();
    VectorXd next = x;
    double cost = 0;
    testing::ProblemProbe probe(problem);
    const auto land = [&](double u) { return probe.step(0, x, VectorXd::Constant(1, u), next, cost); };
    REQUIRE(land(0) == NumericalStatus::Ok);
    const double without = next[kCrank];
    REQUIRE(land(1) == NumericalStatus::Ok);
    double u = -without / (next[kCrank] - without), slope = next[kCrank] - without;
    NumericalStatus status = NumericalStatus::Ok;
    for (int i = 0; i < 50 && status == NumericalStatus::Ok; ++i) {
      status = land(u);
      if (status == NumericalStatus::Ok) u -= next[kCrank] / slope;
    }
    CHECK(status == NumericalStatus::Failed);
    CHECK_THAT(probe.failure(), Catch::Contains("'loop1'"));
    CHECK(next.allFinite());
    // The node is none the worse for it.
    CHECK(land(0) == NumericalStatus::Ok);
    CHECK(probe.failure().empty());
    CHECK(next[kCrank] == without);
  }
  SECTION("a guess that contains it") {
    ShootingTrajectory trajectory = makeGuess(problem);
    trajectory.xs[4] = folded;
    const FddpSummary summary = test::solveInPlace(problem, trajectory);
    CHECK(summary.termination == FddpTermination::Failed);
    CHECK_THAT(summary.message, Catch::Contains("'loop1'") && Catch::Contains("rank") && Catch::Contains("node"));
    CHECK(isFinite(trajectory));
  }
  SECTION("a start in it") {
    RobotProblem from_folded(chain.model, VectorXd::Zero(3), VectorXd::Zero(3), std::vector<StageSpec>(11),
                             Formulation::Reduced);
    ShootingTrajectory trajectory = makeGuess(from_folded);
    trajectory.us.assign(trajectory.us.size(), VectorXd::Constant(1, 5));
    const FddpSummary summary = test::solveInPlace(from_folded, trajectory);
    CAPTURE(summary.message);
    CHECK(summary.termination == FddpTermination::Failed);
    CHECK_THAT(summary.message, Catch::Contains("'loop1'"));
    CHECK(isFinite(trajectory));
  }
}
