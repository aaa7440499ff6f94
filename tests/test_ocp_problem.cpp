// Oracles: central differences of step() and of its cost through the public interface; the Gauss-Newton Hessian from
// residuals that the test evaluates and differentiates itself. Every derivative test also sees a poisoned entry.
#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "problem_probe.h"
#include "random_problem.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct Point {
  VectorXd x, u, x_node;  ///< state, controls, state of the next node
};

VectorXd join(const VectorXd& q, const VectorXd& v) {
  VectorXd x(q.size() + v.size());
  x << q, v;
  return x;
}

struct Step {
  VectorXd gap;
  double cost;
};
Step calcStep(ProblemProbe& problem, int stage, const Point& point, const VectorXd& dx, const VectorXd& du) {
  VectorXd next(problem.stateSize());
  double cost = 0;
  REQUIRE(problem.step(stage, problem.integrate(point.x, dx), point.u + du, next, cost) == NumericalStatus::Ok);
  return {problem.difference(point.x_node, next), cost};
}

// Everything that is weighted and squared, each row times the root of its weight as it is at (x, u).
VectorXd calcWeightedResiduals(ProblemProbe& problem, int node, const VectorXd& x, const VectorXd& u,
                               const VectorXd& curvature) {
  const Model& model = problem.model();
  const StageSpec& spec = problem.spec(node);
  const bool running = node < problem.numStages();
  VectorXd a, lambda;
  if (running) REQUIRE(problem.calcDynamics(node, x, u, a, lambda) == NumericalStatus::Ok);
  Workspace ws(model);
  updatePositions(model, ws, x.head(model.nq()));
  updateVelocities(model, ws, x.tail(model.nv()));
  updateMassMatrix(model, ws);
  std::vector<double> rows;
  VectorXd dq = model.difference(spec.state.q_ref, x.head(model.nq())),
           dv = x.segment(model.nq(), model.nv()) - spec.state.v_ref;
  if (model.hasFreeFlyer())
    for (VectorXd* d : {&dq, &dv})
      for (const int i : {0, 3}) d->segment<3>(i) = (spec.state.axes * d->segment<3>(i)).eval();
  for (const VectorXd* d : {&dq, &dv})
    for (int i = 0; i < model.nv(); ++i) rows.push_back((*d)[i]);
  for (int i = 0; running && i < model.nu(); ++i) rows.push_back(u[i] - spec.control.reference[i]);
  for (const Cost& cost : spec.costs) {
    VectorXd r(cost.residual->size());
    cost.residual->calc({model, ws, spec.constraints, u, lambda}, r);
    rows.insert(rows.end(), r.data(), r.data() + r.size());
  }
  VectorXd out = Eigen::Map<VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
  return curvature.size() ? VectorXd(out.cwiseProduct(curvature.cwiseSqrt())) : out;
}

// Second derivative of every row's activation at the residuals r, with all its weights.
VectorXd calcCurvature(const ProblemProbe& problem, int node, const VectorXd& r) {
  const Model& model = problem.model();
  const StageSpec& spec = problem.spec(node);
  const bool running = node < problem.numStages();
  VectorXd out(r.size());
  int row = 2 * model.nv();
  out.head(row) = spec.state.weight * spec.state.weights;
  if (running) {
    out.segment(row, model.nu()) = spec.control.weight * spec.control.weights;
    row += model.nu();
  }
  for (const Cost& cost : spec.costs)
    for (int i = 0; i < cost.residual->size(); ++i, ++row) {
      const Activation& activation = cost.activation;
      const bool active =
          activation.kind == ActivationKind::Quadratic || r[row] < activation.lower[i] || r[row] > activation.upper[i];
      out[row] = active ? cost.weight * activation.weights[i] : 0;
    }
  REQUIRE(row == r.size());
  return (running ? spec.dt : 1) * out;
}

void checkGaussNewton(ProblemProbe& problem, int node, const Point& point, const StageModel& model, double h) {
  const int ndx = problem.tangentSize(node), nu = static_cast<int>(point.u.size());
  const VectorXd curvature = calcCurvature(problem, node, calcWeightedResiduals(problem, node, point.x, point.u, {}));
  MatrixXd J(curvature.size(), ndx + nu);
  J.leftCols(ndx) = differentiate(VectorXd::Zero(ndx), h, [&](const VectorXd& dx) {
    return calcWeightedResiduals(problem, node, problem.integrate(point.x, dx), point.u, curvature);
  });
  if (nu > 0)
    J.rightCols(nu) = differentiate(
        point.u, 0.05, [&](const VectorXd& u) { return calcWeightedResiduals(problem, node, point.x, u, curvature); });
  const MatrixXd H = J.transpose() * J;
  const MatrixXd lxx = model.lxx().selfadjointView<Eigen::Lower>(), luu = model.luu().selfadjointView<Eigen::Lower>();
  checkDerivative(lxx, H.topLeftCorner(ndx, ndx), "lxx");
  if (nu == 0) return;
  checkDerivative(model.lux(), H.bottomLeftCorner(nu, ndx), "lux");
  checkDerivative(luu, H.bottomRightCorner(nu, nu), "luu");
}

// h: step in x; the one in u can be longer, as forces are linear in it.
void checkProbedStage(ProblemProbe& problem, const Point& point, double h) {
  StageModel model;
  REQUIRE(problem.linearize(0, point.x, point.u, point.x_node, model) == NumericalStatus::Ok);
  const VectorXd no_dx = VectorXd::Zero(problem.tangentSize(0)), no_du = VectorXd::Zero(point.u.size());
  Step here;  // not through integrate(), which closes reduced states anew, to rounding
  VectorXd next(problem.stateSize());
  REQUIRE(problem.step(0, point.x, point.u, next, here.cost) == NumericalStatus::Ok);
  here.gap = problem.difference(point.x_node, next);
  CHECK(model.cost == Approx(here.cost).epsilon(1e-13));
  CHECK((model.gap - here.gap).cwiseAbs().maxCoeff() <= 1e-13 * (1 + here.gap.cwiseAbs().maxCoeff()));
  const auto both = [](const Step& step) { return join(step.gap, VectorXd::Constant(1, step.cost)); };
  const int n = problem.tangentSize(1);
  const MatrixXd dx =
      differentiate(no_dx, h, [&](const VectorXd& d) { return both(calcStep(problem, 0, point, d, no_du)); });
  const MatrixXd du =
      differentiate(no_du, 0.1, [&](const VectorXd& d) { return both(calcStep(problem, 0, point, no_dx, d)); });
  checkDerivative(model.Fx().topRows(n / 2), dx.topRows(n / 2), "Fx, q");
  checkDerivative(model.Fx().bottomRows(n / 2), dx.middleRows(n / 2, n / 2), "Fx, v");
  checkDerivative(model.Fu().topRows(n / 2), du.topRows(n / 2), "Fu, q");
  checkDerivative(model.Fu().bottomRows(n / 2), du.middleRows(n / 2, n / 2), "Fu, v");
  checkDerivative(model.lx.transpose(), dx.bottomRows(1), "lx");
  checkDerivative(model.lu.transpose(), du.bottomRows(1), "lu");
  checkGaussNewton(problem, 0, point, model, h);
}

void checkTerminal(ProblemProbe& problem, const VectorXd& x, double h) {
  StageModel model;
  const int node = problem.numStages();
  REQUIRE(problem.linearizeTerminal(x, model) == NumericalStatus::Ok);
  checkDerivative(model.lx.transpose(),
                  differentiate(VectorXd::Zero(problem.tangentSize(node)), h, [&](const VectorXd& dx) {
                    double cost = 0;
                    REQUIRE(problem.calcTerminalCost(problem.integrate(x, dx), cost) == NumericalStatus::Ok);
                    return VectorXd::Constant(1, cost);
                  }));
  checkGaussNewton(problem, node, {x, {}, {}}, model, h);
}

// The next node's state: where the step leads, moved away by `gap` in every coordinate.
VectorXd makeNextNode(std::mt19937& rng, ProblemProbe& problem, const VectorXd& x, const VectorXd& u, double gap) {
  VectorXd next(problem.stateSize());
  double cost = 0;
  REQUIRE(problem.step(0, x, u, next, cost) == NumericalStatus::Ok);
  return problem.integrate(next, randomVector(rng, problem.tangentSize(1), gap));
}

}  // namespace

TEST_CASE("shooting problem: random mechanisms of every joint kind, gaps closed, small and large", "[sweep]") {
  const StepRule step = GENERATE(StepRule::Euler, StepRule::Midpoint);
  std::mt19937 rng(21);
  Selection selection(2);
  for (JointKind kind : kJointKinds) {
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer, 3, 2);
    const Model& model = mechanism.model;
    const RobotProblem whole =
        makeProblem(rng, model, mechanism.q_closed, {{0, randomPlacement(rng), 5, 4}}, {Formulation::Full, step});
    ProblemProbe problem(whole);
    const VectorXd q = model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.1));
    const VectorXd x = join(q, randomVector(rng, model.nv())), u = randomVector(rng, model.nu(), 5);
    for (double gap : {0.0, 1e-3, 0.6}) {
      if (selection.isLeftOut()) continue;
      CAPTURE(getName(step), getName(kind), gap);
      checkProbedStage(problem, {x, u, makeNextNode(rng, problem, x, u, gap)}, 2e-4);
    }
    CAPTURE(getName(kind));
    checkTerminal(problem, x, 5e-4);
  }
}

TEST_CASE("shooting problem: a redundant planar four-bar") {
  const StepRule step = GENERATE(StepRule::Euler, StepRule::Midpoint);
  CAPTURE(getName(step));
  std::mt19937 rng(22);
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Model& model = mechanism.model;
  StageSpec stage;
  stage.step = step;
  stage.constraints = makeConstraintSet(model);
  stage.state = makeRandomStateCost(rng, model, mechanism.q_closed);
  stage.control = {0.3, VectorXd::Zero(1), VectorXd::Ones(1)};
  StageSpec terminal = makeTerminal(rng, model, mechanism.q_closed);
  std::vector<StageSpec> stages;
  stages.push_back(std::move(stage));
  stages.push_back(std::move(terminal));
  const RobotProblem whole(model, mechanism.q_closed, VectorXd::Zero(4), std::move(stages), Formulation::Full);
  ProblemProbe problem(whole);
  Workspace ws(model);
  // Off the closures too: the four angles keep the loop planar, so the redundant rows never contradict one another.
  const VectorXd v = randomVector(rng, 4), u = VectorXd::Constant(1, 0.4);
  const VectorXd x = join(mechanism.q_closed, v);
  checkProbedStage(problem, {x, u, makeNextNode(rng, problem, x, u, 0.3)}, 2e-4);
  checkTerminal(problem, x, 5e-4);
}

TEST_CASE("shooting problem: a midpoint step is what the dynamics at its points make of it") {
  std::mt19937 rng(27);
  for (JointKind kind : kJointKinds) {
    CAPTURE(getName(kind));
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer, 3, 2);
    const Model& model = mechanism.model;
    const RobotProblem problem = makeProblem(rng, model, mechanism.q_closed, {{0, randomPlacement(rng), 5, 4}},
                                             {Formulation::Full, StepRule::Midpoint});
    const VectorXd &q = mechanism.q_closed, v = randomVector(rng, model.nv()), u = randomVector(rng, model.nu(), 5);
    RobotEvaluator evaluator(problem);
    const RobotEvaluation& at = evaluator.evaluate(0, join(q, v), u);
    REQUIRE(at.status == NumericalStatus::Ok);
    const StageSpec& spec = problem.spec(0);
    const double h = spec.dt;
    Workspace ws(model);
    ConstrainedWorkspace cws;
    const VectorXd tau = calcMotorForces(model, u), q_mid = model.integrate(q, h / 2 * v);
    // The rows that stabilise are those of the state, on the system half way.
    ConstraintSet plain = spec.constraints;
    for (Closure& closure : plain.closures) closure.kp = closure.kd = 0;
    updatePositions(model, ws, q);
    updateVelocities(model, ws, v);
    VectorXd stabilization(plain.rows);
    for (size_t c = 0; c < plain.closures.size(); ++c)
      stabilization.segment(plain.offsets[c], getRows(plain.closures[c].kind)) =
          calcClosureStabilization(ws, spec.constraints.closures[c]);
    CHECK(stabilization.norm() > 1);
    REQUIRE(updateConstrainedDynamics(model, ws, cws, plain, q_mid, v, tau) == NumericalStatus::Ok);
    const VectorXd v_mid = v + h / 2 * cws.a;
    REQUIRE(updateConstrainedDynamics(model, ws, cws, plain, q_mid, v_mid, tau) == NumericalStatus::Ok);
    const int nv = model.nv(), rows = plain.rows;
    MatrixXd system = MatrixXd::Zero(nv + rows, nv + rows);
    system << ws.M, -cws.J.transpose(), cws.J, MatrixXd::Zero(rows, rows);
    const VectorXd solution = system.fullPivLu().solve(join(tau - ws.b, -cws.gamma - stabilization));
    const VectorXd a = solution.head(nv), v_next = v + h * a;
    CHECK(calcRelativeError(at.q_mid, q_mid) < 1e-13);
    CHECK(calcRelativeError(at.v_mid, v_mid) < 1e-12);
    CHECK(calcRelativeError(at.a, a) < 1e-12);
    CHECK(calcRelativeError(at.lambda, solution.tail(rows)) < 1e-12);
    CHECK(calcRelativeError(at.x_next, join(model.integrate(q_mid, h / 2 * v_next), v_next)) < 1e-12);
    // The terminal node has no step.
    const RobotEvaluation& terminal = evaluator.evaluate(1, join(q, v));
    CHECK(terminal.q_mid.size() + terminal.v_mid.size() == 0);
  }
}

TEST_CASE("shooting problem: forces alone, at the midpoint of a step") {
  std::mt19937 rng(28);
  for (JointKind kind : kJointKinds) {
    CAPTURE(getName(kind));
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer, 3, 2);
    const Model& model = mechanism.model;
    std::vector<StageSpec> stages;
    stages.push_back(makeStage(rng, model, mechanism.q_closed, {{0, randomPlacement(rng), 5, 4}}, StepRule::Midpoint));
    stages.push_back(makeTerminal(rng, model, mechanism.q_closed));
    StageSpec& stage = stages[0];
    stage.state.weight = stage.control.weight = 0;
    stage.costs.erase(
        std::remove_if(stage.costs.begin(), stage.costs.end(), [](const Cost& cost) { return cost.name != "force"; }),
        stage.costs.end());
    const RobotProblem whole(model, mechanism.q_closed, VectorXd::Zero(model.nv()), std::move(stages),
                             Formulation::Full);
    ProblemProbe problem(whole);
    const VectorXd q = model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.1));
    const VectorXd x = join(q, randomVector(rng, model.nv())), u = randomVector(rng, model.nu(), 5);
    checkProbedStage(problem, {x, u, makeNextNode(rng, problem, x, u, 0)}, 2e-4);
  }
}

TEST_CASE("shooting problem: the squat of Bipetto, half sitting with velocities on the closures", "[sweep]") {
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  std::mt19937 rng(23);
  const Model model = loadRobot("bipetto").model;
  SquatOptions options;
  options.duration = 0.3;
  const Motion motion = makeSquat(model, options, {how.formulation, how.step});
  ProblemProbe problem(*motion.problem);
  const VectorXd q = problem.initialState().head(model.nq());
  Workspace ws(model);
  const VectorXd v = projectVelocity(model, ws, problem.spec(0).constraints, q, randomVector(rng, model.nv(), 0.5));
  CHECK(v.norm() > 0.1);
  const VectorXd x = join(q, v), u = motion.guess.us[0] + randomVector(rng, model.nu(), 1);
  Selection selection(2);
  for (double gap : {0.2, 0.0}) {
    if (selection.isLeftOut()) continue;
    CAPTURE(gap);
    checkProbedStage(problem, {x, u, makeNextNode(rng, problem, x, u, gap)}, 2e-4);
  }
  checkTerminal(problem, x, 5e-4);
}
