// Oracles: central differences of step() and of its cost through the public interface; the Gauss-Newton Hessian from
// residuals that the test evaluates and differentiates itself. Every derivative test also sees a poisoned entry.
#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/reader.h"
#include "bielle/motion/squat.h"
#include "check_derivative.h"
#include "count_allocations.h"
#include "discretizations.h"
#include "problem_probe.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct Point {
  VectorXd x, u, x_node;  ///< state, controls, state of the next node
};

StateCost makeRandomStateCost(std::mt19937& rng, const Model& model, const VectorXd& q) {
  return {0.7, model.integrate(q, randomVector(rng, model.nv(), 0.6)), randomVector(rng, model.nv()),
          randomVector(rng, 2 * model.nv()).cwiseAbs()};
}

// A stage with a cost of every sort that looks at q, v, u and the forces; the barrier is crossed by some rows only.
StageSpec makeStage(std::mt19937& rng, const Model& model, const VectorXd& q,
                    const std::vector<ContactTarget>& contacts, StepRule step = StepRule::Euler) {
  StageSpec stage;
  stage.step = step;
  stage.dt = 0.02;
  stage.constraints = makeConstraintSet(model, contacts);
  stage.state = makeRandomStateCost(rng, model, q);
  stage.control = {0.3, randomVector(rng, model.nu()), randomVector(rng, model.nu()).cwiseAbs()};
  const auto quadratic = [&](int n) { return Activation::makeQuadratic(randomVector(rng, n).cwiseAbs()); };
  stage.costs.push_back({"com", 2, quadratic(3), makeComPosition(randomVector(rng, 3))});
  stage.costs.push_back({"com velocity", 2, quadratic(3), makeComVelocity(randomVector(rng, 3))});
  const BodyFrame frame{model.numBodies() - 1, randomPlacement(rng)};
  stage.costs.push_back({"velocity", 1, quadratic(6), makeFrameVelocity(frame, randomVector(rng, 6))});
  for (int c = 0; c < static_cast<int>(stage.constraints.closures.size()); ++c) {
    const int rows = getRows(stage.constraints.closures[c].kind);
    stage.costs.push_back(
        {"force", 1e-2, quadratic(rows), makeContactForce(stage.constraints, c, randomVector(rng, rows, 5))});
    if (c < stage.constraints.num_loops) continue;
    std::unique_ptr<Residual> cone = makeWrenchCone(stage.constraints, c, 0.1, 0.04, 0.5);
    const int n = cone->size();
    stage.costs.push_back({"cone", 1e-2,
                           Activation::makeBarrier(VectorXd::Ones(n), VectorXd::Zero(n), VectorXd::Constant(n, 1e12)),
                           std::move(cone)});
  }
  for (const Transmission& linkage : listTransmissions(model, q))
    stage.costs.push_back({"transmission", 1, quadratic(1), makeTransmission(linkage)});
  return stage;
}

StageSpec makeTerminal(std::mt19937& rng, const Model& model, const VectorXd& q) {
  StageSpec stage = makeStage(rng, model, q, {});
  stage.constraints = {};
  stage.costs.resize(3);
  return stage;
}

RobotProblem makeProblem(std::mt19937& rng, const Model& model, const VectorXd& q,
                         const std::vector<ContactTarget>& contacts, const Discretization& how) {
  std::vector<StageSpec> stages;
  stages.push_back(makeStage(rng, model, q, contacts, how.step));
  stages.push_back(makeTerminal(rng, model, q));
  return RobotProblem(model, q, VectorXd::Zero(model.nv()), std::move(stages), how.formulation);
}

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
  REQUIRE(problem.step(stage, problem.integrate(point.x, dx), point.u + du, next, cost) == StepStatus::Ok);
  return {problem.difference(point.x_node, next), cost};
}

// Everything that is weighted and squared, each row times the root of its weight as it is at (x, u).
VectorXd calcWeightedResiduals(ProblemProbe& problem, int node, const VectorXd& x, const VectorXd& u,
                               const VectorXd& curvature) {
  const Model& model = problem.model();
  const StageSpec& spec = problem.spec(node);
  const bool running = node < problem.numStages();
  VectorXd a, lambda;
  if (running) REQUIRE(problem.calcDynamics(node, x, u, a, lambda) == StepStatus::Ok);
  Workspace ws(model);
  updatePositions(model, ws, x.head(model.nq()));
  updateVelocities(model, ws, x.tail(model.nv()));
  updateMassMatrix(model, ws);
  std::vector<double> rows;
  const VectorXd dq = model.difference(spec.state.q_ref, x.head(model.nq()));
  for (int i = 0; i < model.nv(); ++i) rows.push_back(dq[i]);
  for (int i = 0; i < model.nv(); ++i) rows.push_back(x[model.nq() + i] - spec.state.v_ref[i]);
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
void checkStage(ProblemProbe& problem, const Point& point, double h) {
  StageModel model;
  REQUIRE(problem.linearize(0, point.x, point.u, point.x_node, model) == StepStatus::Ok);
  const VectorXd no_dx = VectorXd::Zero(problem.tangentSize(0)), no_du = VectorXd::Zero(point.u.size());
  Step here;  // not through integrate(), which closes reduced states anew, to rounding
  VectorXd next(problem.stateSize());
  REQUIRE(problem.step(0, point.x, point.u, next, here.cost) == StepStatus::Ok);
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
  REQUIRE(problem.linearizeTerminal(x, model) == StepStatus::Ok);
  checkDerivative(model.lx.transpose(),
                  differentiate(VectorXd::Zero(problem.tangentSize(node)), h, [&](const VectorXd& dx) {
                    double cost = 0;
                    REQUIRE(problem.calcTerminalCost(problem.integrate(x, dx), cost) == StepStatus::Ok);
                    return VectorXd::Constant(1, cost);
                  }));
  checkGaussNewton(problem, node, {x, {}, {}}, model, h);
}

// The next node's state: where the step leads, moved away by `gap` in every coordinate.
VectorXd makeNextNode(std::mt19937& rng, ProblemProbe& problem, const VectorXd& x, const VectorXd& u, double gap) {
  VectorXd next(problem.stateSize());
  double cost = 0;
  REQUIRE(problem.step(0, x, u, next, cost) == StepStatus::Ok);
  return problem.integrate(next, randomVector(rng, problem.tangentSize(1), gap));
}

}  // namespace

TEST_CASE("shooting problem: random mechanisms of every joint kind, gaps closed, small and large") {
  const StepRule step = GENERATE(StepRule::Euler, StepRule::Midpoint);
  std::mt19937 rng(21);
  for (JointKind kind : kJointKinds) {
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer, 3, 2);
    const Model& model = mechanism.model;
    const RobotProblem whole =
        makeProblem(rng, model, mechanism.q_closed, {{0, randomPlacement(rng), 5, 4}}, {Formulation::Full, step});
    ProblemProbe problem(whole);
    const VectorXd q = model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.1));
    const VectorXd x = join(q, randomVector(rng, model.nv())), u = randomVector(rng, model.nu(), 5);
    for (double gap : {0.0, 1e-3, 0.6}) {
      CAPTURE(getName(step), getName(kind), gap);
      checkStage(problem, {x, u, makeNextNode(rng, problem, x, u, gap)}, 2e-4);
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
  const RobotProblem whole(model, mechanism.q_closed, VectorXd::Zero(4), std::move(stages));
  ProblemProbe problem(whole);
  Workspace ws(model);
  // Off the closures too: the four angles keep the loop planar, so the redundant rows never contradict one another.
  const VectorXd v = randomVector(rng, 4), u = VectorXd::Constant(1, 0.4);
  const VectorXd x = join(mechanism.q_closed, v);
  checkStage(problem, {x, u, makeNextNode(rng, problem, x, u, 0.3)}, 2e-4);
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
    REQUIRE(at.status == StepStatus::Ok);
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
    REQUIRE(updateConstrainedDynamics(model, ws, cws, plain, q_mid, v, tau) == DynamicsStatus::Ok);
    const VectorXd v_mid = v + h / 2 * cws.a;
    REQUIRE(updateConstrainedDynamics(model, ws, cws, plain, q_mid, v_mid, tau) == DynamicsStatus::Ok);
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
    const RobotProblem whole(model, mechanism.q_closed, VectorXd::Zero(model.nv()), std::move(stages));
    ProblemProbe problem(whole);
    const VectorXd q = model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.1));
    const VectorXd x = join(q, randomVector(rng, model.nv())), u = randomVector(rng, model.nu(), 5);
    checkStage(problem, {x, u, makeNextNode(rng, problem, x, u, 0)}, 2e-4);
  }
}

TEST_CASE("shooting problem: the squat of Bipetto, half sitting with velocities on the closures") {
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
  for (double gap : {0.0, 0.2}) {
    CAPTURE(gap);
    checkStage(problem, {x, u, makeNextNode(rng, problem, x, u, gap)}, 2e-4);
  }
  checkTerminal(problem, x, 5e-4);
}

TEST_CASE("shooting problem: a linearization does not depend on what was computed before") {
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  std::mt19937 rng(26);
  const Model model = loadRobot("bipetto").model;
  const auto make = [&] { return makeSquat(model, {}, {how.formulation, how.step}); };
  const Motion used = make(), fresh = make();
  ProblemProbe problem(*used.problem), untouched(*fresh.problem);
  const VectorXd x0 = problem.initialState(), u = used.guess.us[0];
  const VectorXd x = problem.integrate(x0, randomVector(rng, problem.tangentSize(0), 0.05));
  StageModel once, again, other;
  REQUIRE(untouched.linearize(0, x, u, x0, once) == StepStatus::Ok);
  for (int i = 0; i < 3; ++i) {  // elsewhere, with other forces and velocities
    const VectorXd away = problem.integrate(x0, randomVector(rng, problem.tangentSize(0), 0.1));
    REQUIRE(problem.linearize(0, away, u + randomVector(rng, model.nu(), 20), x0, other) == StepStatus::Ok);
  }
  for (int i = 0; i < 2; ++i) {  // the second time nothing is new
    REQUIRE(problem.linearize(0, x, u, x0, again) == StepStatus::Ok);
    CHECK(calcRelativeError(again.Fx(), once.Fx()) < 1e-9);
    CHECK(calcRelativeError(again.Fu(), once.Fu()) < 1e-9);
    CHECK(calcRelativeError(again.lx, once.lx) < 1e-9);
    CHECK(calcRelativeError(again.lxx().triangularView<Eigen::Lower>(), once.lxx().triangularView<Eigen::Lower>()) <
          1e-9);
    CHECK(calcRelativeError(again.lux(), once.lux()) < 1e-9);
  }
  CHECK(calcRelativeError(other.Fx(), once.Fx()) > 1e-3);
}

TEST_CASE("shooting problem: steps and linearizations allocate nothing after the first") {
  std::mt19937 rng(24);
  const Model model = loadRobot("bipetto").model;
  const VectorXd q = makeStandingPosture(model);
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  const RobotProblem problem = makeProblem(rng, model, q, makeContactTargets(model, q, {0, 1}, 0, 100), how);
  const VectorXd x = problem.initialState();
  const VectorXd u = randomVector(rng, model.nu(), 1);
  const VectorXd small = randomVector(rng, problem.tangentSize(0), 1e-3);
  const VectorXd x2 = ProblemProbe(problem).integrate(x, small);
  const auto stage = problem.makeEvaluation(), terminal = problem.makeEvaluation();
  const auto scratch = problem.makeScratch();
  StageModel models[2];
  models[0].resize(problem.tangentSize(0), model.nu(), problem.tangentSize(1));
  models[1].resize(problem.tangentSize(1), 0, 0);
  VectorXd moved = x, dx(problem.tangentSize(0));
  const auto runAll = [&](const VectorXd& at) {
    std::vector<long> counts(4, 0);
    const auto measure = [&](int i, auto&& f) {
      const long before = num_allocations;
      f();
      counts[i] = num_allocations - before;
    };
    EvaluateTask steps[] = {{0, &at, &u, nullptr, stage.get()}, {1, &x, nullptr, nullptr, terminal.get()}};
    LinearizeTask linearizations[2];
    linearizations[0] = {0, stage.get(), terminal.get(), nullptr, &models[0], StepStatus::Failed, {}};
    linearizations[1] = {1, terminal.get(), nullptr, nullptr, &models[1], StepStatus::Failed, {}};
    const IntegrateTask move{0, stage.get(), &small, &moved};
    const DifferenceTask difference{0, stage.get(), &x, &dx};
    measure(0, [&] { problem.evaluate(steps, 2, scratch.get()); });
    measure(1, [&] { problem.linearize(linearizations, 2, scratch.get()); });
    measure(2, [&] { problem.integrate(&move, 1, scratch.get()); });
    measure(3, [&] { problem.difference(&difference, 1, scratch.get()); });
    for (const LinearizeTask& task : linearizations) CHECK(task.status == StepStatus::Ok);
    return counts;
  };
  const long before = num_allocations;
  const VectorXd counted(100);
  REQUIRE(num_allocations == before + 1);
  runAll(x);
  CHECK(runAll(x2) == std::vector<long>(4, 0));
}

TEST_CASE("shooting problem: what does not fit is refused, what is not finite fails") {
  std::mt19937 rng(25);
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Model& model = mechanism.model;
  const VectorXd v = VectorXd::Zero(4);
  const auto make = [&](const std::function<void(StageSpec&)>& spoil, Formulation formulation = Formulation::Full) {
    std::vector<StageSpec> stages;
    stages.push_back(makeTerminal(rng, model, mechanism.q_closed));
    stages.push_back(makeTerminal(rng, model, mechanism.q_closed));
    spoil(stages[0]);
    return RobotProblem(model, mechanism.q_closed, v, std::move(stages), formulation);
  };
  CHECK_NOTHROW(make([](StageSpec&) {}));
  CHECK_THROWS_AS(make([](StageSpec& s) { s.dt = 0; }), ModelError);
  CHECK_THROWS_AS(make([](StageSpec& s) { s.state.weights.resize(3); }), ModelError);
  CHECK_THROWS_AS(make([](StageSpec& s) { s.control.reference.resize(0); }), ModelError);
  CHECK_THROWS_AS(make([](StageSpec& s) { s.costs[0].activation.weights.resize(2); }), ModelError);
  CHECK_THROWS_AS(RobotProblem(model, mechanism.q_closed, VectorXd::Zero(3), {}), ModelError);
  CHECK_THROWS_AS(RobotProblem(model, mechanism.q_closed, v, {}), ModelError);
  const RobotProblem whole = make([](StageSpec&) {});
  ProblemProbe problem(whole);
  VectorXd x = problem.initialState(), next = x;
  const VectorXd u = VectorXd::Zero(1);
  double cost = 0;
  CHECK(problem.step(0, x, u, next, cost) == StepStatus::Ok);
  x[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK(problem.step(0, x, u, next, cost) == StepStatus::Failed);
  StageModel out;
  CHECK(problem.linearize(0, x, u, next, out) == StepStatus::Failed);
  CHECK(problem.calcTerminalCost(x, cost) == StepStatus::Failed);
  CHECK(problem.linearizeTerminal(x, out) == StepStatus::Failed);

  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const std::function<void(StageSpec&)> spoils[] = {
      [&](StageSpec& s) { s.state.weight = nan; }, [&](StageSpec& s) { s.state.q_ref[0] = nan; },
      [&](StageSpec& s) { s.state.v_ref[1] = nan; }, [&](StageSpec& s) { s.state.weights[2] = nan; }};
  for (Formulation formulation : {Formulation::Full, Formulation::Reduced})
    for (const auto& spoil : spoils) {
      const RobotProblem whole_spoilt = make(spoil, formulation);
      ProblemProbe spoilt(whole_spoilt);
      CHECK(spoilt.step(0, spoilt.initialState(), u, next, cost) == StepStatus::Failed);
    }
}
