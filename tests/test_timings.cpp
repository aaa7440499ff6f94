// Phases of free duration. Oracles: central differences in the tangent space of steps, costs and of the residuals whose
// squares the Gauss-Newton Hessian sums; problems solved again with fixed durations.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/motion/motion.h"
#include "bielle/ocp/robot_problem.h"
#include "bielle/robots/robot_loader.h"
#include "bielle/solve/fddp.h"
#include "check_derivative.h"
#include "count_allocations.h"
#include "discretizations.h"
#include "mechanisms.h"
#include "solve_in_place.h"
#include "weighted_model.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

StageSpec makeStage(const Model& model, const VectorXd& q_ref, const std::vector<ContactTarget>& contacts, bool running,
                    StepRule rule, std::mt19937& rng) {
  StageSpec stage;
  stage.step = rule;
  stage.dt = 0.02;
  stage.time_weight = 0.4;
  stage.constraints = running ? makeConstraintSet(model, contacts) : ConstraintSet();
  stage.state = {0.7, q_ref, randomVector(rng, model.nv()), randomVector(rng, 2 * model.nv()).cwiseAbs()};
  stage.control = {0.3, randomVector(rng, model.nu()), VectorXd::Ones(model.nu())};
  const BodyFrame frame{model.numBodies() - 1, randomPlacement(rng)};
  stage.costs.push_back(
      {"velocity", 0.5, Activation::makeQuadratic(VectorXd::Ones(6)), makeFrameVelocity(frame, randomVector(rng, 6))});
  const auto constrain = [&](std::unique_ptr<Residual> residual) {
    const VectorXd ones = VectorXd::Ones(residual->size());
    stage.path_constraints.push_back({"bound", std::move(residual), -ones, ones, 3 * ones});
  };
  constrain(makeComPosition(Vector3d(1, 0, 2)));
  if (!running) return stage;
  for (int c = stage.constraints.num_loops; c < static_cast<int>(stage.constraints.closures.size()); ++c) {
    const VectorXd ones = VectorXd::Ones(getRows(stage.constraints.closures[c].kind));
    stage.costs.push_back(
        {"force", 1e-2, Activation::makeQuadratic(ones), makeContactForce(stage.constraints, c, ones)});
    constrain(makeContactForce(stage.constraints, c, ones));
  }
  return stage;
}

// A phase of three steps of free duration, the second of another length, and a fixed step.
RobotProblem makeTimedProblem(const Model& model, const VectorXd& q0, const VectorXd& v0,
                              const std::vector<ContactTarget>& contacts, const Discretization& how,
                              std::mt19937& rng) {
  std::vector<StageSpec> stages;
  for (int k = 0; k <= 4; ++k) {
    stages.push_back(makeStage(model, q0, contacts, k < 4, how.step, rng));
    if (k < 3) stages.back().timing = {0, 0.5, 2};
  }
  stages[1].dt = 0.013;
  return RobotProblem(model, q0, v0, std::move(stages), how.formulation);
}

// What the Hessian sums the squares of: each row times the root of its weight.
VectorXd calcRoots(const RobotProblem& problem, int node, const RobotEvaluation& at, const ConstraintWeights& weights) {
  const Model& model = problem.model();
  const StageSpec& spec = problem.spec(node);
  Workspace ws(model);
  updatePositions(model, ws, at.x.head(model.nq()));
  updateVelocities(model, ws, at.x.segment(model.nq(), model.nv()));
  updateMassMatrix(model, ws);
  std::vector<double> rows;
  const auto add = [&](double r, double weight) { rows.push_back(std::sqrt(weight) * r); };
  const VectorXd dq = model.difference(spec.state.q_ref, ws.q), dv = ws.v - spec.state.v_ref;
  const double h = at.dt;
  add(std::sqrt(2.0), h * spec.time_weight);
  for (int i = 0; i < model.nv(); ++i) add(dq[i], h * spec.state.weight * spec.state.weights[i]);
  for (int i = 0; i < model.nv(); ++i) add(dv[i], h * spec.state.weight * spec.state.weights[model.nv() + i]);
  for (int m = 0; m < model.nu(); ++m)
    add(at.u[m] - spec.control.reference[m], h * spec.control.weight * spec.control.weights[m]);
  for (const Cost& cost : spec.costs) {
    VectorXd r(cost.residual->size());
    cost.residual->calc({model, ws, spec.constraints, at.u, at.lambda, at.time_scale}, r);
    for (Eigen::Index i = 0; i < r.size(); ++i) add(r[i], h * cost.weight * cost.activation.weights[i]);
  }
  for (Eigen::Index i = 0; i < at.constraints.size(); ++i) add(at.constraints[i], weights.hessian[i]);
  return Eigen::Map<VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

// Every block of the linearization of a stage about (x, u), with the next node at x_node.
void checkTimedStage(const RobotProblem& problem, int k, const VectorXd& x, const VectorXd& u, const VectorXd& x_node,
                     std::mt19937& rng) {
  RobotEvaluator evaluator(problem), node(problem), moved(problem);
  const int ndx = problem.tangentSize(k), nu = problem.controlSize(k), next = problem.tangentSize(k + 1);
  node.evaluate(k + 1, x_node, k + 1 < problem.numStages() ? VectorXd::Ones(problem.controlSize(k + 1)) : VectorXd());
  REQUIRE(node.evaluation().status == NumericalStatus::Ok);
  REQUIRE(evaluator.evaluate(k, x, u).status == NumericalStatus::Ok);
  ConstraintWeights weights{randomVector(rng, problem.constraintSize(k)),
                            randomVector(rng, problem.constraintSize(k)).cwiseAbs()};
  const auto at = problem.makeEvaluation();
  const auto scratch = problem.makeScratch();
  EvaluateTask evaluate{k, &x, &u, nullptr, at.get()};
  problem.evaluate(&evaluate, 1, scratch.get());
  StageModel model;
  model.resize(ndx, nu, next, problem.constraintSize(k));
  const std::vector<char> all = listRows(problem, k);
  LinearizeTask task{k, at.get(), &node.evaluation(), &all, &model, NumericalStatus::Failed, {}};
  problem.linearize(&task, 1, scratch.get());
  REQUIRE(task.status == NumericalStatus::Ok);
  addWeights(weights, model);
  // Next state, weighted cost and roots as functions of (du, dx).
  const auto step = [&](const VectorXd& d) {
    const VectorXd x1 = d.tail(ndx).isZero(0) ? x : evaluator.integrate(d.tail(ndx));
    const RobotEvaluation& to = moved.evaluate(k, x1, u + d.head(nu));
    REQUIRE(to.status == NumericalStatus::Ok);
    const VectorXd gap = node.difference(to.x_next), roots = calcRoots(problem, k, to, weights);
    VectorXd out(gap.size() + 1 + roots.size());
    out << gap, to.cost + weights.gradient.dot(to.constraints), roots;
    return out;
  };
  const VectorXd zero = VectorXd::Zero(nu + ndx);
  const MatrixXd numeric = differentiate(zero, 1e-4, step);
  const auto J = numeric.topRows(next), roots = numeric.bottomRows(numeric.rows() - next - 1);
  checkDerivative(model.Ft().transpose(), J, "F");
  VectorXd gradient(nu + ndx);
  gradient << model.lu, model.lx;
  checkDerivative(gradient.transpose(), numeric.row(next), "gradient");
  const MatrixXd hessian = model.hessian().selfadjointView<Eigen::Lower>();
  checkDerivative(hessian, roots.transpose() * roots, "Hessian");
  CHECK((model.gap - step(zero).head(next)).cwiseAbs().maxCoeff() < 1e-10);
  if (problem.getTimeScale(k, x, u) == 1) return;
  const int row = problem.model().nu();
  CHECK(J.col(row).norm() > 1e-3);
  checkDerivative(model.Ft().row(row), J.col(row).transpose(), "F by the time scale");
}

}  // namespace

TEST_CASE("free timings: derivatives by the length of a step, every joint kind times every closure kind") {
  const int which = GENERATE(range(0, 4));
  const Discretization how = kDiscretizations[which];
  std::mt19937 rng(31);
  int count = 0;
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds) {
      const MechanismBase base = ++count % 2 == 0 ? MechanismBase::Fixed : MechanismBase::FreeFlyer;
      // Every other discretization for each pair, on either base.
      if ((count / 2 + which) % 2 == 0) continue;
      CAPTURE(how, getName(kind), getName(closure), base == MechanismBase::Fixed);
      const Mechanism mechanism = makeRandomMechanism(rng, kind, closure, base, 3, 2);
      const Model& model = mechanism.model;
      std::vector<ContactTarget> contacts;
      if (base == MechanismBase::FreeFlyer) contacts = {{1, randomPlacement(rng), 5, 4}};
      Workspace ws(model);
      const auto makeVelocity = [&](const VectorXd& q) {
        return projectVelocity(model, ws, makeConstraintSet(model), q, randomVector(rng, model.nv()));
      };
      const VectorXd& q = mechanism.q_closed;
      const RobotProblem problem = makeTimedProblem(model, q, makeVelocity(q), contacts, how, rng);
      REQUIRE(problem.hasFreeTimings());
      CHECK(problem.controlSize(0) == model.nu() + 1);
      CHECK(problem.tangentSize(1) == problem.tangentSize(0) + 1);
      CHECK(problem.tangentSize(3) == problem.tangentSize(0));
      RobotEvaluator evaluator(problem);
      for (int k = 0; k < 4; ++k) {
        CAPTURE(k);
        VectorXd x = problem.initialState(), u = randomVector(rng, problem.controlSize(k), 5);
        if (k == 1 || k == 2) x[x.size() - 1] = 1.3;
        if (k == 0) u[model.nu()] = 0.8;
        const RobotEvaluation& at = evaluator.evaluate(k, x, u);
        REQUIRE(at.status == NumericalStatus::Ok);
        CHECK(at.dt == Approx(problem.spec(k).dt * (k == 0 ? 0.8 : k < 3 ? 1.3 : 1)));
        const VectorXd x_next = at.x_next;
        CHECK(x_next[x_next.size() - 1] == (k == 0 ? 0.8 : k == 1 ? 1.3 : 1));
        checkTimedStage(problem, k, x, u, x_next, rng);
        VectorXd open = x_next;
        const AssemblyResult closed =
            closeConfiguration(model, model.integrate(x_next.head(model.nq()), randomVector(rng, model.nv(), 0.05)));
        REQUIRE(closed.status == NumericalStatus::Ok);
        open.head(model.nq()) = closed.q;
        open.segment(model.nq(), model.nv()) = makeVelocity(closed.q);
        if (k < 2) open[open.size() - 1] += 0.1;
        checkTimedStage(problem, k, x, u, open, rng);
      }
    }
}

namespace {

constexpr int kStages = 24;  // two phases of twelve steps

struct Bounds {
  double lower = 0.3, upper = 3;
};

// A four-bar whose crank is led to one place and then to another, at rest there: late arrival costs, and so do torques.
RobotProblem makeReach(const Mechanism& mechanism, const Discretization& how, const std::vector<double>& scales,
                       bool free, const Bounds& bounds = {}) {
  const Model& model = mechanism.model;
  std::vector<StageSpec> stages(kStages + 1);
  for (int k = 0; k <= kStages; ++k) {
    StageSpec& stage = stages[k];
    const int phase = k < kStages / 2 ? 0 : 1;
    stage.step = how.step;
    stage.dt = 0.02 * scales[phase];
    if (free && k < kStages) stage.timing = {phase, bounds.lower, bounds.upper};
    if (k < kStages) stage.constraints = makeConstraintSet(model);
    setClosureGains({100, 20}, stage.constraints);
    VectorXd target = mechanism.q_closed, weights = VectorXd::Zero(2 * model.nv());
    target[0] += phase == 0 ? 0.5 : -0.2;
    weights[0] = 0.2;
    if (k == kStages / 2 || k == kStages) weights[0] = weights[model.nv()] = 1e4;
    stage.state = {1, target, VectorXd::Zero(model.nv()), weights};
    if (k == kStages / 2) stage.state.q_ref[0] = mechanism.q_closed[0] + 0.5;
    stage.control = {0.2, VectorXd::Zero(1), VectorXd::Ones(1)};
  }
  return RobotProblem(model, mechanism.q_closed, VectorXd::Zero(model.nv()), std::move(stages), how.formulation);
}

struct Solution {
  FddpSummary summary;
  ShootingTrajectory trajectory;
};

Solution solve(const RobotProblem& problem, int threads = 1) {
  Solution out;
  out.trajectory.xs.assign(problem.numStages() + 1, problem.initialState());
  for (int k = 0; k < problem.numStages(); ++k) {
    out.trajectory.us.push_back(VectorXd::Zero(problem.controlSize(k)));
    if (problem.controlSize(k) > problem.model().nu()) out.trajectory.us.back()[problem.model().nu()] = 1;
  }
  FddpOptions options;
  options.gradient_tolerance = 1e-16;
  options.cost_tolerance = 0;
  options.threads = threads;
  out.summary = test::solveInPlace(problem, out.trajectory, options);
  return out;
}

double getScale(const Solution& solution, int stage) { return solution.trajectory.us[stage].tail(1)[0]; }

}  // namespace

TEST_CASE("free timings: each duration is the best one") {
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Solution free = solve(makeReach(mechanism, how, {1, 1}, true));
  REQUIRE(free.summary.termination == FddpTermination::Converged);
  const std::vector<double> best = {getScale(free, 0), getScale(free, kStages / 2)};
  CAPTURE(best[0], best[1], free.summary.iterations);
  const auto calcCost = [&](const std::vector<double>& scales) {
    const Solution fixed = solve(makeReach(mechanism, how, scales, false));
    REQUIRE(fixed.summary.termination == FddpTermination::Converged);
    return fixed.summary.cost;
  };
  CHECK(calcCost(best) == Approx(free.summary.cost).epsilon(1e-9));
  CHECK(calcCost({1, 1}) > 1.01 * free.summary.cost);
  for (int phase : {0, 1}) {
    CAPTURE(phase);
    CHECK(best[phase] > 0.35);
    CHECK(best[phase] < 2.9);
    constexpr double kStep = 0.01;
    std::vector<double> shorter = best, longer = best;
    shorter[phase] *= 1 - kStep;
    longer[phase] *= 1 + kStep;
    const double less = calcCost(shorter), more = calcCost(longer);
    CHECK(less > free.summary.cost);
    CHECK(more > free.summary.cost);
    // The minimum of the parabola through the three.
    const double slope = (more - less) / (2 * kStep),
                 curvature = (more - 2 * free.summary.cost + less) / (kStep * kStep);
    CHECK(std::abs(slope / curvature) < 1e-3);
  }
}

TEST_CASE("free timings: at a bound the cost falls beyond it") {
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Solution free = solve(makeReach(mechanism, how, {1, 1}, true));
  const double best = getScale(free, 0);
  for (const Bounds& bounds : {Bounds{1.1 * best, 4}, Bounds{0.2, 0.9 * best}}) {
    CAPTURE(bounds.lower, bounds.upper);
    const Solution bounded = solve(makeReach(mechanism, how, {1, 1}, true, bounds));
    REQUIRE(bounded.summary.termination == FddpTermination::Converged);
    const double at = getScale(bounded, 0), other = getScale(bounded, kStages / 2);
    CHECK(at == (bounds.upper < best ? bounds.upper : bounds.lower));
    CHECK(bounded.summary.cost > free.summary.cost);
    const double beyond = bounds.upper < best ? 1.01 : 0.99;
    CHECK(solve(makeReach(mechanism, how, {at * beyond, other}, false)).summary.cost < bounded.summary.cost);
    CHECK(solve(makeReach(mechanism, how, {at / beyond, other}, false)).summary.cost > bounded.summary.cost);
  }
}

TEST_CASE("free timings: the same bits whatever the number of threads") {
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const RobotProblem problem = makeReach(mechanism, {Formulation::Reduced, StepRule::Midpoint}, {1, 1}, true);
  const Solution one = solve(problem, 1), three = solve(problem, 3);
  CHECK(one.trajectory.us == three.trajectory.us);
  CHECK(one.trajectory.xs == three.trajectory.xs);
}

TEST_CASE("free timings: steps and linearizations allocate nothing after the first") {
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  std::mt19937 rng(34);
  const Model model = loadRobot("bipetto").model;
  const VectorXd q = makeStandingPosture(model);
  const RobotProblem problem =
      makeTimedProblem(model, q, VectorXd::Zero(model.nv()), makeContactTargets(model, q, {0, 1}, 0, 100), how, rng);
  std::vector<std::unique_ptr<NodeEvaluation>> nodes;
  std::vector<EvaluateTask> evaluations;
  std::vector<StageModel> models(5);
  std::vector<std::vector<char>> rows(5);
  std::vector<LinearizeTask> linearizations;
  const VectorXd &x0 = problem.initialState(), u0 = VectorXd::Ones(model.nu() + 1), u = VectorXd::Ones(model.nu());
  for (int k = 0; k < 5; ++k) {
    nodes.push_back(problem.makeEvaluation());
    evaluations.push_back({k, &x0, k == 0 ? &u0 : &u, nullptr, nodes[k].get()});
    models[k].resize(problem.tangentSize(k), k < 4 ? problem.controlSize(k) : 0, k < 4 ? problem.tangentSize(k + 1) : 0,
                     problem.constraintSize(k));
    rows[k] = listRows(problem, k);
  }
  for (int k = 0; k < 5; ++k)
    linearizations.push_back(
        {k, nodes[k].get(), k < 4 ? nodes[k + 1].get() : nullptr, &rows[k], &models[k], NumericalStatus::Failed, {}});
  const auto scratch = problem.makeScratch();
  const auto run = [&] {
    problem.evaluate(evaluations.data(), 5, scratch.get());
    problem.linearize(linearizations.data(), 5, scratch.get());
    for (const LinearizeTask& task : linearizations) REQUIRE(task.status == NumericalStatus::Ok);
  };
  run();
  const long before = num_allocations;
  problem.evaluate(evaluations.data(), 5, scratch.get());
  problem.linearize(linearizations.data(), 5, scratch.get());
  CHECK(num_allocations == before);
}

TEST_CASE("free timings: what makes no sense is refused") {
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Model& model = mechanism.model;
  const auto make = [&](const std::function<void(std::vector<StageSpec>&)>& spoil) {
    std::vector<StageSpec> stages(5);
    for (int k = 0; k < 4; ++k) {
      stages[k].constraints = makeConstraintSet(model);
      stages[k].timing = {k / 2, 0.5, 2};
    }
    spoil(stages);
    return RobotProblem(model, mechanism.q_closed, VectorXd::Zero(model.nv()), std::move(stages), Formulation::Full);
  };
  CHECK_NOTHROW(make([](std::vector<StageSpec>&) {}));
  CHECK_THROWS_AS(make([](std::vector<StageSpec>& s) { s[1].timing.lower = 0; }), InputError);
  CHECK_THROWS_AS(make([](std::vector<StageSpec>& s) { s[1].timing.upper = 1.5; }), InputError);
  CHECK_THROWS_AS(make([](std::vector<StageSpec>& s) { s[0].timing = {0, 2, 0.5}; }), InputError);
  CHECK_THROWS_AS(make([](std::vector<StageSpec>& s) { s[3].timing.phase = 0; }), InputError);
  CHECK_THROWS_AS(make([](std::vector<StageSpec>& s) { s[4].timing = {3, 0.5, 2}; }), InputError);
  const auto makeImpact = [](std::vector<StageSpec>& s) { s[1].kind = StageKind::Impact, s[1].dt = 0; };
  CHECK_THROWS_AS(make(makeImpact), InputError);
  // A time that runs backwards fails, and says so.
  const RobotProblem problem = make([](std::vector<StageSpec>&) {});
  RobotEvaluator evaluator(problem);
  VectorXd u = VectorXd::Zero(2);
  CHECK(evaluator.evaluate(0, problem.initialState(), u).status == NumericalStatus::Failed);
  CHECK(evaluator.evaluation().failure == "the time scale is not positive");
}
