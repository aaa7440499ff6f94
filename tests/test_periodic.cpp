// Cycles: a last state that is the first one, moved. Oracles: the dense optimality (KKT) system of a linear cycle; a mass that coasts;
// central differences; a plain Riccati recursion over many cycles, and rollouts of a cycle under the gains.
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include "check_derivative.h"
#include "fddp_oracle.h"
#include "solve/periodic_problem.h"
#include "weighted_model.h"

using namespace bielle;
using namespace bielle::test;
using testing::checkDerivative;

namespace {

struct Coaster {
  static constexpr int kStates = 2, kControls = 1;
  template <class S>
  static std::array<S, 2> calcRate(const std::array<S, 2>& x, const std::array<S, 1>& u) {
    return {x[1], u[0]};
  }
};

FddpResult solvePeriodic(const ShootingProblem& inner, const PeriodicProblem& problem) {
  FddpOptions options = makeTightOptions();
  options.threads = 1;
  options.constraints.tolerance = 1e-10;
  return solve(problem, problem.wrap(makeGuess(inner)), options);
}

// Moves and turns the state of the linear plant.
const MatrixXd kTurn = (MatrixXd(3, 3) << 0.8, -0.6, 0, 0.6, 0.8, 0.1, 0, 0, 1).finished();
const Vector3d kShift(0.4, -0.2, 0.3);

// States x_0 .. x_N, then controls, that minimize the cost of a linear plant from a free x_0 to x_N = turn x_0 + shift.
VectorXd solveDense(const PlantProblem<Linear>& plant, const MatrixXd& turn) {
  const int N = plant.stages, nx = 3, nu = 2, size = (N + 1) * nx + N * nu, rows = (N + 1) * nx;
  MatrixXd kkt = MatrixXd::Zero(size + rows, size + rows);
  VectorXd right = VectorXd::Zero(size + rows);
  MatrixXd A = MatrixXd::Zero(rows, size);
  const VectorXd x = VectorXd::Zero(nx), u = VectorXd::Zero(nu);
  for (int k = 0; k <= N; ++k) {
    NodeEvaluator at(plant), next(plant);
    at.evaluate(k, x, u);
    if (k < N) next.evaluate(k + 1, x, u);
    StageModel model;
    at.linearize(k < N ? &next.evaluation() : nullptr, model);
    kkt.block(k * nx, k * nx, nx, nx) = MatrixXd(model.lxx().selfadjointView<Eigen::Lower>());
    right.segment(k * nx, nx) = -model.lx;
    if (k == N) break;
    const int control = (N + 1) * nx + k * nu;
    kkt.block(control, control, nu, nu) = MatrixXd(model.luu().selfadjointView<Eigen::Lower>());
    right.segment(control, nu) = -model.lu;
    A.block(k * nx, k * nx, nx, nx) = -model.Fx();
    A.block(k * nx, control, nx, nu) = -model.Fu();
    A.block(k * nx, (k + 1) * nx, nx, nx).setIdentity();
  }
  A.block(N * nx, N * nx, nx, nx).setIdentity();
  A.block(N * nx, 0, nx, nx) = -turn;
  right.tail(nx) = kShift;
  kkt.topRightCorner(size, rows) = A.transpose();
  kkt.bottomLeftCorner(rows, size) = A;
  return kkt.fullPivLu().solve(right).head(size);
}

VectorXd stackTrajectory(const ShootingTrajectory& t) {
  std::vector<double> all;
  for (const std::vector<VectorXd>* list : {&t.xs, &t.us})
    for (const VectorXd& x : *list) all.insert(all.end(), x.begin(), x.end());
  return Eigen::Map<VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

PlantProblem<Linear> makeLinearCycle() {
  PlantProblem<Linear> plant = makeLinear();
  plant.terminal_weight.setZero();
  return plant;
}

// The body turned about the vertical.
VectorXd turn(const VectorXd& x, double angle) {
  VectorXd out = x;
  out.head<4>() = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ())) *
                   Eigen::Quaterniond(Eigen::Vector4d(x.head<4>())))
                      .coeffs();
  return out;
}
VectorXd turnBody(const VectorXd& x) { return turn(x, 0.7); }

TurningBody makeTurningCycle() {
  TurningBody body;
  body.stages = 30;
  body.terminal_weight = 0;
  body.goal = Eigen::Vector4d(0.1, -0.2, 0.05, 0.9).normalized();
  return body;
}

}  // namespace

TEST_CASE("periodic: a linear cycle is the solution of its dense optimality system") {
  const PlantProblem<Linear> plant = makeLinearCycle();
  const PeriodicProblem problem(plant, [](const VectorXd& x) { return (kTurn * x + kShift).eval(); });
  const FddpResult result = solvePeriodic(plant, problem);
  CAPTURE(result.summary.message, result.summary.iterations);
  REQUIRE(result.summary.termination == FddpTermination::Converged);
  const ShootingTrajectory cycle = problem.unwrap(result.trajectory);
  CHECK((kTurn * cycle.xs.front() + kShift - cycle.xs.back()).lpNorm<Eigen::Infinity>() < 1e-9);
  const VectorXd found = stackTrajectory(cycle), dense = solveDense(plant, kTurn);
  CHECK((found - dense).lpNorm<Eigen::Infinity>() < 1e-7);
  for (int i = 0; i < 9; ++i) {  // a thousandth in the map is noticed
    MatrixXd poisoned = kTurn;
    poisoned(i / 3, i % 3) += 1e-3;
    CHECK((found - solveDense(plant, poisoned)).lpNorm<Eigen::Infinity>() > 1e-6);
  }
}

TEST_CASE("periodic: a mass that nothing slows coasts") {
  PlantProblem<Coaster> mass;
  mass.stages = 25;
  const double distance = 1.5;
  const PeriodicProblem problem(mass, [=](const VectorXd& x) { return (x + distance * VectorXd::Unit(2, 0)).eval(); });
  const FddpResult result = solvePeriodic(mass, problem);
  REQUIRE(result.summary.termination == FddpTermination::Converged);
  const ShootingTrajectory cycle = problem.unwrap(result.trajectory);
  for (const VectorXd& x : cycle.xs) CHECK(x[1] == Approx(distance / (mass.stages * mass.dt)).epsilon(1e-7));
  for (const VectorXd& u : cycle.us) CHECK(std::abs(u[0]) < 1e-7);
}

TEST_CASE("periodic: derivatives at the beginning and the end, on a manifold") {
  const TurningBody body = makeTurningCycle();
  const PeriodicProblem problem(body, turnBody);
  std::srand(5);
  const VectorXd theta = 0.4 * VectorXd::Random(6);
  ShootingTrajectory t = problem.wrap(makeGuess(body));
  const auto makeState = [&](int node) {
    VectorXd x = t.xs[1];
    x.segment(0, 4) = Eigen::Vector4d(0.1 * node, 0.3, -0.1, 0.9).normalized();
    x.segment(4, 3) << 0.2, -0.1, 0.3;
    x.tail(6) = theta;
    return x;
  };
  {  // x_0 by theta, about another node state
    NodeEvaluator at(problem), after(problem), moved(problem);
    after.evaluate(1, makeState(1), VectorXd::Zero(3));
    at.evaluate(0, t.xs[0], theta);
    StageModel model;
    REQUIRE(at.linearize(&after.evaluation(), model) == NumericalStatus::Ok);
    const MatrixXd J = testing::differentiate(VectorXd::Zero(6), 1e-4, [&](const VectorXd& d) {
      return after.difference(moved.evaluate(0, t.xs[0], theta + d).x_next);
    });
    checkDerivative(model.Fu(), J, "beginning");
    CHECK((model.gap - after.difference(at.evaluation().x_next)).lpNorm<Eigen::Infinity>() < 1e-12);
  }
  // The end near the moved beginning, where the derivative by x_N is exact.
  const int N = problem.numStages();
  NodeEvaluator start(problem), at(problem), moved(problem);
  VectorXd x(13);
  x << turnBody(start.evaluate(0, t.xs[0], theta).x_next.head(7)), theta;
  at.evaluate(N, x);
  CHECK(at.evaluation().constraints.lpNorm<Eigen::Infinity>() < 1e-12);
  const MatrixXd C = testing::differentiate(VectorXd::Zero(12), 1e-4, [&](const VectorXd& d) {
    return VectorXd(moved.evaluate(N, at.integrate(d)).constraints);
  });
  ConstraintWeights weights{VectorXd::Random(6), VectorXd::Random(6).cwiseAbs()};
  const std::vector<char> rows = testing::listRows(problem, N);
  StageModel plain, with;
  for (StageModel* model : {&plain, &with}) {
    model->resize(12, 0, 0, 6);
    LinearizeTask task;
    task.node = N;
    auto evaluation = problem.makeEvaluation();
    const auto scratch = problem.makeScratch();
    EvaluateTask evaluate{N, &x, nullptr, nullptr, evaluation.get()};
    problem.evaluate(&evaluate, 1, scratch.get());
    task.at = evaluation.get();
    task.rows = &rows;
    task.out = model;
    problem.linearize(&task, 1, scratch.get());
    REQUIRE(task.status == NumericalStatus::Ok);
  }
  testing::addWeights(weights, with);
  checkDerivative((with.lx - plain.lx).transpose(), weights.gradient.transpose() * C, "gradient of the end");
  const MatrixXd hessian =
      MatrixXd(with.lxx().selfadjointView<Eigen::Lower>()) - MatrixXd(plain.lxx().selfadjointView<Eigen::Lower>());
  checkDerivative(hessian, C.transpose() * weights.hessian.asDiagonal() * C, "Hessian of the end");
}

TEST_CASE("periodic: gains of the endless cycle are those of a Riccati recursion over many") {
  const PlantProblem<Linear> plant = makeLinearCycle();
  const StateMap map = [](const VectorXd& x) { return (kTurn * x + kShift).eval(); };
  const PeriodicProblem problem(plant, map);
  const FddpResult result = solvePeriodic(plant, problem);
  const CyclicFeedback feedback =
      calcCyclicFeedback(plant, map, problem.unwrap(result.trajectory), problem.unwrap(result.multipliers));
  REQUIRE(feedback.status == NumericalStatus::Ok);
  StageModel m;
  NodeEvaluator at(plant), next(plant);
  at.evaluate(0, VectorXd::Zero(3), VectorXd::Zero(2));
  next.evaluate(1, VectorXd::Zero(3), VectorXd::Zero(2));
  at.linearize(&next.evaluation(), m);
  const MatrixXd A = m.Fx(), B = m.Fu(), Q = MatrixXd(m.lxx()).diagonal().asDiagonal(),
                 R = MatrixXd(m.luu()).diagonal().asDiagonal(), E = kTurn.inverse();
  MatrixXd P = MatrixXd::Zero(3, 3), closed;
  std::vector<MatrixXd> gains(plant.stages);
  for (int cycle = 0; cycle < 40; ++cycle) {
    P = (E.transpose() * P * E).eval();
    closed = E;
    for (int k = plant.stages - 1; k >= 0; --k) {
      gains[k] = -(R + B.transpose() * P * B).inverse() * B.transpose() * P * A;
      P = (Q + A.transpose() * P * (A + B * gains[k])).eval();
      closed = (closed * (A + B * gains[k])).eval();
    }
  }
  for (int k = 0; k < plant.stages; ++k) {
    CHECK((MatrixXd(feedback.gains[k].K) - gains[k]).lpNorm<Eigen::Infinity>() < 1e-6);
    CHECK(feedback.gains[k].k.lpNorm<Eigen::Infinity>() < 1e-5);  // the solution is stationary
  }
  CHECK(std::abs(feedback.multipliers[0]) == Approx(closed.eigenvalues().cwiseAbs().maxCoeff()).epsilon(1e-6));
}

TEST_CASE("periodic: Floquet multipliers are those of rollouts under the gains") {
  const TurningBody body = makeTurningCycle();
  const PeriodicProblem problem(body, turnBody);
  const FddpResult result = solvePeriodic(body, problem);
  CAPTURE(result.summary.message);
  REQUIRE(result.summary.termination == FddpTermination::Converged);
  const ShootingTrajectory cycle = problem.unwrap(result.trajectory);
  const CyclicFeedback feedback = calcCyclicFeedback(body, turnBody, cycle, problem.unwrap(result.multipliers));
  REQUIRE(feedback.status == NumericalStatus::Ok);
  NodeEvaluator about(body), step(body);
  const MatrixXd returned = testing::differentiate(VectorXd::Zero(6), 1e-5, [&](const VectorXd& d) {
    about.evaluate(0, cycle.xs[0], cycle.us[0]);
    VectorXd x = about.integrate(d);
    for (int k = 0; k < body.stages; ++k) {
      about.evaluate(k, cycle.xs[k], cycle.us[k]);
      x = step.evaluate(k, x, cycle.us[k] + feedback.gains[k].K * about.difference(x)).x_next;
    }
    about.evaluate(0, cycle.xs[0], cycle.us[0]);
    return about.difference(turn(x, -0.7));
  });
  VectorXd wanted = returned.eigenvalues().cwiseAbs(), found = feedback.multipliers.cwiseAbs();
  std::sort(wanted.begin(), wanted.end(), std::greater<>());
  CHECK((found - wanted).lpNorm<Eigen::Infinity>() < 1e-6);
  CHECK(found[0] < 1);
  CHECK(found[0] > 1e-3);  // there is something to compare
}

TEST_CASE("periodic: what is no cycle is refused") {
  struct Odd : PlantProblem<Linear> {
    int tangentSize(int node) const override { return node == stages ? 2 : 3; }
  };
  const Odd odd;
  CHECK_THROWS_AS(PeriodicProblem(odd, [](const VectorXd& x) { return x; }), std::invalid_argument);
}
