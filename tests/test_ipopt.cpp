// Multiple shooting and collocation as IPOPT sees them: derivatives about states that are not those of the guess, and
// the optima that it finds.
#include <catch2/catch.hpp>
#include <functional>
#include <random>

#include "bielle/model/error.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "collocation.h"
#include "ipopt_solver.h"
#include "multiple_shooting.h"
#include "random_problem.h"
#include "short_squat.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// The variables of the guess, moved.
VectorXd makePoint(const NonlinearProgram& program) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> within(-0.05, 0.05);
  VectorXd z = program.start();
  for (double& entry : z) entry += within(random);
  return z;
}

MatrixXd makeJacobian(const NonlinearProgram& program) {
  const NonlinearProgram::Entries& entries = program.jacobian();
  VectorXd values(entries.size());
  program.getJacobian(values);
  MatrixXd out = MatrixXd::Zero(program.rows().lower.size(), program.variables().lower.size());
  for (int i = 0; i < entries.size(); ++i) out(entries.rows[i], entries.columns[i]) += values[i];
  return out;
}

MatrixXd makeHessian(const NonlinearProgram& program) {
  const NonlinearProgram::Entries& entries = program.hessian();
  VectorXd values(entries.size());
  program.getHessian(values);
  const Eigen::Index n = program.variables().lower.size();
  MatrixXd out = MatrixXd::Zero(n, n);
  for (int i = 0; i < entries.size(); ++i) {
    REQUIRE(entries.rows[i] >= entries.columns[i]);
    out(entries.rows[i], entries.columns[i]) += values[i];
  }
  return out.selfadjointView<Eigen::Lower>();
}

Motion makeRsuSquat(double time_step = 0.02) {
  SquatOptions options;
  options.depth = 0.9;
  options.duration = 0.6;
  options.settle = 0;
  options.time_step = time_step;
  return makeSquat(loadRobot("rsu_biped").model, options);
}

void checkProgram(NonlinearProgram& program, const VectorXd& at) {
  REQUIRE(program.linearize(at));
  const MatrixXd jacobian = makeJacobian(program);
  VectorXd gradient(at.size());
  program.getGradient(gradient);
  constexpr double kStep = 1e-5;
  MatrixXd rows(jacobian.rows(), at.size());
  Eigen::RowVectorXd costs(at.size());
  VectorXd ahead(rows.rows()), behind(rows.rows());
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    VectorXd z = at;
    z[i] = at[i] + kStep;
    REQUIRE(program.evaluate(z));
    program.getRows(ahead);
    costs[i] = program.calcCost();
    z[i] = at[i] - kStep;
    REQUIRE(program.evaluate(z));
    program.getRows(behind);
    costs[i] = (costs[i] - program.calcCost()) / (2 * kStep);
    rows.col(i) = (ahead - behind) / (2 * kStep);
  }
  checkDerivative(gradient.transpose(), costs, "gradient");
  checkDerivative(jacobian, rows, "Jacobian");
}

// A stage with every cost of random_problem.h and one of the speeds of the motors, and with constraints of places,
// forces, torques and speeds.
StageSpec makeFullStage(std::mt19937& rng, const Mechanism& mechanism, bool with_speeds) {
  const Model& model = mechanism.model;
  StageSpec stage = makeStage(rng, model, mechanism.q_closed, {{0, randomPlacement(rng), 5, 4}}, StepRule::Midpoint);
  if (with_speeds && model.nu() > 0)
    stage.costs.push_back(
        {"energy", 1, Activation::makeEnergy(VectorXd::Ones(model.nu()), VectorXd::Constant(model.nu(), 0.1), 0.3, 1),
         makeElectricalPower(VectorXd::Constant(model.nu(), 0.1))});
  const auto add = [&stage](std::unique_ptr<Residual> residual) {
    const VectorXd ones = VectorXd::Ones(residual->size());
    stage.path_constraints.push_back({"rows", std::move(residual), -ones, ones, 2 * ones});
  };
  add(makeComVelocity(randomVector(rng, 3)));
  add(makeFramePlacement({model.numBodies() - 1, randomPlacement(rng)}, randomPlacement(rng)));
  add(makeWrenchCone(stage.constraints, stage.constraints.num_loops, 0.1, 0.04, 0.5, ForceAxes::World));
  if (with_speeds && model.nu() > 0) add(makeElectricalPower(VectorXd::Constant(model.nu(), 0.1)));
  return stage;
}

// A step, an impact, a step and the end.
RobotProblem makeRandomProblem(std::mt19937& rng, const Mechanism& mechanism) {
  std::vector<StageSpec> stages;
  for (const StageKind kind : {StageKind::Dynamics, StageKind::Impact, StageKind::Dynamics}) {
    stages.push_back(makeFullStage(rng, mechanism, kind == StageKind::Dynamics));
    stages.back().kind = kind;
    if (kind == StageKind::Impact) stages.back().dt = 0;
  }
  stages.push_back(makeTerminal(rng, mechanism.model, mechanism.q_closed));
  return RobotProblem(mechanism.model, mechanism.q_closed, VectorXd::Zero(mechanism.model.nv()), std::move(stages),
                      Formulation::Full);
}

ShootingTrajectory makeRandomGuess(std::mt19937& rng, const Mechanism& mechanism, int stages) {
  const Model& model = mechanism.model;
  ShootingTrajectory guess;
  for (int k = 0; k <= stages; ++k) {
    VectorXd x(model.nq() + model.nv());
    x << model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.05)), randomVector(rng, model.nv(), 0.3);
    guess.xs.push_back(x);
    if (k < stages) guess.us.push_back(randomVector(rng, model.nu()));
  }
  return guess;
}

}  // namespace

TEST_CASE("multiple shooting: gradient and Jacobian against differences, whatever a row depends on") {
  const ShortSquat squat(StepRule::Midpoint);
  MultipleShooting program(*squat.motion.problem, squat.motion.guess);
  checkProgram(program, makePoint(program));
}

TEST_CASE("collocation: gradient and Jacobian against differences, of a squat") {
  const ShortSquat squat(StepRule::Midpoint);
  Collocation program(*squat.motion.problem, squat.motion.guess);
  CHECK(program.listDropped().empty());
  checkProgram(program, makePoint(program));
}

TEST_CASE("collocation: the same of steps and impacts of random mechanisms, with forces and speeds in costs") {
  std::mt19937 rng(31);
  for (const JointKind kind : {JointKind::Spherical, JointKind::Universal, JointKind::Planar, JointKind::Prismatic})
    for (const ClosureKind closure :
         {ClosureKind::Weld6D, ClosureKind::Ball3D, ClosureKind::Hinge5D, ClosureKind::Slider, ClosureKind::Distance}) {
      CAPTURE(getName(kind), getName(closure));
      const Mechanism mechanism = makeCammedMechanism(rng, kind, closure, MechanismBase::FreeFlyer);
      const RobotProblem problem = makeRandomProblem(rng, mechanism);
      Collocation program(problem, makeRandomGuess(rng, mechanism, problem.numStages()));
      checkProgram(program, makePoint(program));
    }
}

TEST_CASE("multiple shooting: about another guess, the program and its Hessian are the same in other coordinates") {
  const ShortSquat squat(StepRule::Midpoint);
  const RobotProblem& problem = *squat.motion.problem;
  MultipleShooting far(problem, squat.motion.guess);
  const VectorXd at = makePoint(far);
  REQUIRE(far.linearize(at));
  MultipleShooting near(problem, far.trajectory());
  REQUIRE(near.linearize(near.start()));
  CHECK(near.calcCost() == Approx(far.calcCost()).epsilon(1e-10));
  // dz of `near` by dz of `far`, by differences.
  constexpr double kStep = 1e-5;
  MatrixXd T = MatrixXd::Identity(at.size(), at.size());
  ProblemProbe probe(problem);
  int first = problem.controlSize(0);
  for (int k = 1; k <= problem.numStages(); ++k) {
    const int n = problem.tangentSize(k);
    const VectorXd &guess = squat.motion.guess.xs[k], &x = far.trajectory().xs[k], d = at.segment(first, n);
    for (int j = 0; j < n; ++j) {
      const VectorXd step = kStep * VectorXd::Unit(n, j);
      T.block(first, first + j, n, 1) = (probe.difference(x, probe.integrate(guess, d + step)) -
                                         probe.difference(x, probe.integrate(guess, d - step))) /
                                        (2 * kStep);
    }
    first += n + (k < problem.numStages() ? problem.controlSize(k) : 0);
  }
  REQUIRE((T - MatrixXd::Identity(at.size(), at.size())).cwiseAbs().maxCoeff() > 1e-3);  // or nothing would be tested
  checkDerivative(makeHessian(far), T.transpose() * makeHessian(near) * T, "Hessian");
}

TEST_CASE("multiple shooting: IPOPT finds the optimum that Bielle finds") {
  const Motion motion = makeRsuSquat();
  SolveOptions ours;
  ours.solver = FddpOptions();  // to a stationary point
  const Solution known = solve(motion, ours);
  REQUIRE(known.converged());
  IpoptOptions options;
  options.quiet = true;
  options.settings = {{"tol", "1e-9"}, {"acceptable_iter", "0"}};
  const IpoptSolution found = solveByIpopt(motion, motion.guess, options);
  INFO(found.solution.summary.message);
  REQUIRE(found.end == "converged");
  CHECK(found.solution.summary.cost == Approx(known.summary.cost).epsilon(1e-6));
  CHECK(found.solution.summary.violation < 1e-8);
  CHECK(found.solution.summary.gap < 1e-8);
  // Its multipliers are ours: from there no step is left.
  SolveOptions again;
  again.solver = FddpOptions();
  again.start = {found.solution.trajectory, found.solution.multipliers};
  CHECK(solve(motion, again).summary.iterations <= 3);
}

// Our node knows forces as functions of state and torques, by differences here.
TEST_CASE("collocation: the Hessian is that of the full formulation, once forces follow from state and torques") {
  std::mt19937 rng(32);
  const Mechanism mechanism =
      makeCammedMechanism(rng, JointKind::Spherical, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
  const Model& model = mechanism.model;
  const int nv = model.nv(), nu = model.nu();
  StageSpec stage = makeFullStage(rng, mechanism, true), before = stage, end;
  stage.step = StepRule::Euler;  // whose forces and speeds are those of the state
  before.state = end.state = {};
  before.control = end.control = {};
  before.costs.clear();
  const RobotProblem problem(model, mechanism.q_closed, VectorXd::Zero(nv), {before, stage, end}, Formulation::Full);
  const ShootingTrajectory guess = makeRandomGuess(rng, mechanism, 2);
  Collocation program(problem, guess);
  REQUIRE(program.listDropped().empty());
  const int forces = stage.constraints.rows, loops = stage.constraints.offsets[stage.constraints.num_loops];
  const int d = nu + forces + loops, u = d + 2 * nv, lambda = u + nu, v_next = lambda + forces + loops + nv;
  REQUIRE(program.variables().lower.size() == v_next + nv);
  RobotEvaluator node(problem), next(problem);
  next.evaluate(2, guess.xs[2]);
  const VectorXd &x = guess.xs[1], torques = guess.us[1];
  VectorXd z = program.start();
  z.segment(v_next, nv) = x.tail(nv);
  const double weight = model.mass() * model.gravity().norm();
  REQUIRE(z.segment(lambda, forces).isApprox(node.evaluate(1, x, torques).lambda / weight, 1e-9));
  REQUIRE(program.linearize(z));
  StageModel known;
  known.resize(2 * nv, nu, 2 * nv);
  REQUIRE(node.linearize(&next.evaluation(), known) == NumericalStatus::Ok);
  // dz by (du, dx)
  MatrixXd T = MatrixXd::Zero(z.size(), nu + 2 * nv);
  T.block(u, 0, nu, nu).setIdentity();
  T.block(d, nu, 2 * nv, 2 * nv).setIdentity();
  T.block(v_next, nu + nv, nv, nv).setIdentity();
  const auto calcForces = [&](const VectorXd& by) -> VectorXd {
    VectorXd moved(x.size());
    moved << model.integrate(x.head(model.nq()), by.segment(nu, nv)), x.tail(nv) + by.tail(nv);
    return node.evaluate(1, moved, torques + by.head(nu)).lambda / weight;
  };
  T.middleRows(lambda, forces) = differentiate(VectorXd::Zero(nu + 2 * nv), 1e-4, calcForces);
  const MatrixXd expected = known.hessian().selfadjointView<Eigen::Lower>();
  checkDerivative(T.transpose() * makeHessian(program) * T, expected, "Hessian");
}

TEST_CASE("collocation: redundant rows of closures are left out, and named") {
  std::mt19937 rng(33);
  const Mechanism mechanism =
      makeBeltedMechanism(rng, JointKind::Universal, ClosureKind::Ball3D, MechanismBase::FreeFlyer, true);
  const RobotProblem problem = makeRandomProblem(rng, mechanism);
  Collocation program(problem, makeRandomGuess(rng, mechanism, problem.numStages()));
  CHECK(program.listDropped().size() == 1);
  checkProgram(program, makePoint(program));
}

namespace {

// The four-bar from one crank angle towards another, in 0.4 s.
Motion makeFourBarMotion(int stages) {
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Model& model = mechanism.model;
  StageSpec stage;
  stage.step = StepRule::Midpoint;
  stage.dt = 0.4 / stages;
  stage.constraints = makeConstraintSet(model);
  stage.control = {1, VectorXd::Zero(1), VectorXd::Ones(1)};
  StageSpec terminal;
  terminal.state = {100, makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 1.2).q_closed, VectorXd::Zero(4), VectorXd::Ones(8)};
  std::vector<StageSpec> specs(stages, stage);
  specs.push_back(terminal);
  Motion motion;
  motion.problem = std::make_shared<RobotProblem>(model, mechanism.q_closed, VectorXd::Zero(4), specs);
  motion.guess.xs.assign(stages + 1, motion.problem->initialState());
  motion.guess.us.assign(stages, VectorXd::Zero(1));
  return motion;
}

IpoptSolution collocate(const Motion& motion) {
  IpoptOptions options;
  options.transcription = IpoptTranscription::Collocation;
  options.quiet = true;
  options.settings = {{"tol", "1e-9"}, {"acceptable_iter", "0"}};
  IpoptSolution found = solveByIpopt(motion, motion.guess, options);
  INFO(found.solution.summary.message);
  REQUIRE(found.end == "converged");
  CHECK(found.solution.summary.violation < 1e-8);
  CHECK(found.solution.summary.gap < 1e-8);
  return found;
}

// Costs of optima, ours and that of the collocation, of steps of which the second is half of the first: their
// difference falls with the square of the step.
void checkSecondOrder(const std::function<Motion(int)>& make) {
  std::vector<double> differences;
  for (const int refinement : {1, 2}) {
    const Motion motion = make(refinement);
    const FddpSummary known = solve(*motion.problem, motion.guess).summary;  // to a stationary point
    REQUIRE(known.termination == FddpTermination::Converged);
    differences.push_back(collocate(motion).solution.summary.cost / known.cost - 1);
  }
  CAPTURE(differences);
  CHECK(std::abs(differences[0]) < 0.01);
  CHECK(differences[0] / differences[1] > 3.5);
  CHECK(differences[0] / differences[1] < 4.5);
}

}  // namespace

TEST_CASE("collocation: its optimum of a redundant four-bar tends to ours with the square of the step") {
  CHECK(collocate(makeFourBarMotion(10)).dropped.size() == 3);
  checkSecondOrder([](int refinement) { return makeFourBarMotion(20 * refinement); });
}

TEST_CASE("collocation: its optimum of a squat tends to ours, and is where ours begins") {
  checkSecondOrder([](int refinement) { return makeRsuSquat(0.02 / refinement); });
  const Motion motion = makeRsuSquat();
  const Solution found = collocate(motion).solution;
  SolveOptions again;
  again.solver = FddpOptions();
  const Solution known = solve(motion, again);
  again.start = {found.trajectory, found.multipliers};
  const Solution from_there = solve(motion, again);
  REQUIRE(from_there.converged());
  CHECK(from_there.summary.cost == Approx(known.summary.cost).epsilon(1e-7));
  CHECK(from_there.summary.iterations < known.summary.iterations);
}

TEST_CASE("multiple shooting: an option that IPOPT does not know is named") {
  const ShortSquat squat(StepRule::Midpoint);
  IpoptOptions options;
  options.quiet = true;
  for (const auto& [name, value] : {std::pair("tolerance", "1e-8"), std::pair("tol", "small")}) {
    options.settings = {std::pair<std::string, std::string>(name, value)};
    CHECK_THROWS_WITH(solveByIpopt(squat.motion, squat.motion.guess, options), Catch::Contains(name));
  }
}
