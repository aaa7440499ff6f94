// The least peak of the controls. Oracles: central differences; the closed form of the least force that moves a mass from rest
// to rest; bisection over fixed bounds of the controls, each solved for itself.
#include <catch2/catch.hpp>

#include "bielle/solve/shooting_problem.h"
#include "check_derivative.h"
#include "constrained_problem.h"
#include "count_solver_allocations.h"
#include "fddp_oracle.h"
#include "solve/peak_problem.h"

using namespace bielle;
using namespace bielle::test;
using testing::checkDerivative;

namespace {

// Position and velocity; the second force has half the effect of the first.
struct Mass {
  static constexpr int kStates = 2, kControls = 2;
  template <class S>
  static std::array<S, 2> calcRate(const std::array<S, 2>& x, const std::array<S, 2>& u) {
    return {x[1], u[0] + 0.5 * u[1]};
  }
};

constexpr double kDistance = 0.8;

// From rest to rest, exactly.
template <class Plant>
Constrained<PlantProblem<Plant>> makeReach(int stages, double distance) {
  Constrained<PlantProblem<Plant>> p{PlantProblem<Plant>()};
  p.stages = stages;
  p.dt = 0.1;
  p.control_weight = 1e-4;
  for (int i = 0; i < Plant::kStates; ++i) {
    const double end = i == 0 ? distance : 0;
    p.rows.push_back({"end", stages, stages, end, end, [i](const Complex* x, const Complex*) { return x[i]; }});
  }
  return p;
}

FddpOptions makeOptions() {
  FddpOptions options;
  options.threads = 1;
  options.gradient_tolerance = 1e-12;
  options.max_iterations = 500;
  return options;
}

struct Solution {
  FddpSummary summary;
  double share = 0;
  ShootingTrajectory trajectory;  // of the inner problem
};

Solution solvePeak(const ShootingProblem& inner, const PeakProblem& problem) {
  ShootingTrajectory guess = makeGuess(inner);
  for (VectorXd& u : guess.us) u.setConstant(1);
  ShootingTrajectory t = problem.wrap(guess);
  Solution out;
  out.summary = solveInPlace(problem, t, makeOptions());
  out.share = t.us[0].tail(1)[0];
  out.trajectory = problem.unwrap(t);
  return out;
}

// Blocks of the model of a node against differences of steps and costs; the Hessian is that of the inner problem, by the
// map from (w, s, dx) to (u, dx).
template <class Inner>
void checkNode(const Inner& inner, const PeakProblem& problem, int node) {
  CAPTURE(node);
  const int N = problem.numStages();
  const bool running = node < N;
  VectorXd x = VectorXd::Random(problem.stateSize()), next = VectorXd::Random(problem.stateSize());
  VectorXd u = VectorXd::Random(running ? problem.controlSize(node) : 0);
  x.tail(1)[0] = 1.7, next.tail(1)[0] = 1.4;
  if (node == 0) u.tail(1)[0] = 1.3;
  const VectorXd u_next = VectorXd::Random(node + 1 < N ? problem.controlSize(node + 1) : 0);
  NodeEvaluator at(problem), after(problem), moved(problem), inner_at(inner), inner_after(inner);
  if (running) after.evaluate(node + 1, next, u_next);
  at.evaluate(node, x, u);
  StageModel model, inner_model;
  REQUIRE(at.linearize(running ? &after.evaluation() : nullptr, model) == NumericalStatus::Ok);
  const int nu = static_cast<int>(u.size()), ndx = problem.tangentSize(node);
  ShootingTrajectory states{{x, next}, {}};
  const auto getInnerControl = [&](const VectorXd& d) {
    const double share = node == 0 ? u.tail(1)[0] + d[nu - 1] : x.tail(1)[0] + d[nu + ndx - 1];
    VectorXd out = (u + d.head(nu)).head(running ? inner.controlSize(node) : 0);
    if (running) out[0] *= 2 * share;  // the limits are (2, none)
    return out;
  };
  const VectorXd zero = VectorXd::Zero(nu + ndx);
  const auto step = [&](const VectorXd& d) {
    const NodeEvaluation& to = moved.evaluate(node, at.integrate(d.tail(ndx)), u + d.head(nu));
    VectorXd out(1 + (running ? problem.tangentSize(node + 1) : 0));
    out[0] = to.cost;
    if (running) out.tail(out.size() - 1) = after.difference(to.x_next);
    return out;
  };
  const MatrixXd J = testing::differentiate(zero, 1e-4, step);
  VectorXd gradient(nu + ndx);
  gradient << model.lu, model.lx;
  checkDerivative(gradient.transpose(), J.row(0), "gradient");
  if (running) {
    checkDerivative(model.Ft().transpose(), J.bottomRows(J.rows() - 1), "F");
    CHECK((model.gap - step(zero).tail(model.gap.size())).cwiseAbs().maxCoeff() < 1e-12);
  }
  // The inner Hessian, and the map.
  if (running) inner_after.evaluate(node + 1, next.head(inner.stateSize()), VectorXd::Zero(2));
  inner_at.evaluate(node, x.head(inner.stateSize()), getInnerControl(zero));
  REQUIRE(inner_at.linearize(running ? &inner_after.evaluation() : nullptr, inner_model) == NumericalStatus::Ok);
  const int inner_nx = inner.tangentSize(node);
  const MatrixXd map = testing::differentiate(zero, 1e-4, [&](const VectorXd& d) {
    const VectorXd v = getInnerControl(d);
    VectorXd out(v.size() + inner_nx);
    out << v, d.segment(nu, inner_nx);
    return out;
  });
  MatrixXd hessian = map.transpose() * MatrixXd(inner_model.hessian().template selfadjointView<Eigen::Lower>()) * map;
  if (node == 0) hessian(nu - 1, nu - 1) += 2 * 3.0;  // of the weight
  checkDerivative(MatrixXd(model.hessian().selfadjointView<Eigen::Lower>()), hessian, "Hessian");
}

}  // namespace

TEST_CASE("peak: derivatives of first, later and last nodes") {
  std::srand(7);
  const PlantProblem<Linear> inner = makeLinear();
  const PeakProblem problem(inner, Eigen::Vector2d(2, kFree), 3, kFree);
  CHECK(problem.controlSize(0) == 3);
  CHECK(problem.controlSize(1) == 2);
  CHECK(problem.tangentSize(0) == 3);
  CHECK(problem.tangentSize(1) == 4);
  for (int node : {0, 1, 17, inner.stages}) checkNode(inner, problem, node);
}

TEST_CASE("peak: the least force that moves a mass is that of the closed form") {
  // With the position moved by the velocity before each step, x_N = h^2 sum (N - 1 - k) u_k: half of the time forward,
  // half of the time back.
  constexpr int kStages = 20;
  const auto inner = makeReach<Mass>(kStages, kDistance);
  const double force = 4 * kDistance / (kStages * kStages * inner.dt * inner.dt);  // u_0 + u_1 / 2
  for (double limit : {1.0, 0.25}) {
    CAPTURE(limit);
    const Eigen::Vector2d limits(limit, 2 * limit);  // both count, so that each takes its share
    const PeakProblem problem(inner, limits, 10, kFree);
    const Solution solution = solvePeak(inner, problem);
    CAPTURE(solution.summary.message);
    REQUIRE(solution.summary.termination == FddpTermination::Converged);
    CHECK(solution.share == Approx(problem.calcPeak(solution.trajectory)).epsilon(1e-12));
    CHECK(solution.share == Approx(force / (2 * limit)).epsilon(1e-3));
    CHECK(solution.share >= force / (2 * limit) * (1 - 1e-6));
  }
}

TEST_CASE("peak: bisection over fixed bounds finds the same") {
  const auto inner = makeReach<Mass>(20, kDistance);
  const auto canReach = [&](double bound) {
    auto bounded = inner;
    bounded.bound = bound;
    ShootingTrajectory t = makeGuess(bounded);
    const FddpSummary summary = solveInPlace(bounded, t, makeOptions());
    const bool done = summary.termination == FddpTermination::Converged;
    if (!done) CHECK(summary.termination == FddpTermination::Infeasible);
    return done;
  };
  double low = 0.1, high = 2;
  REQUIRE_FALSE(canReach(low));
  REQUIRE(canReach(high));
  while (high - low > 1e-3 * high) (canReach((low + high) / 2) ? high : low) = (low + high) / 2;
  const PeakProblem problem(inner, Eigen::Vector2d(1, 1), 10, kFree);
  const Solution solution = solvePeak(inner, problem);
  REQUIRE(solution.summary.termination == FddpTermination::Converged);
  CAPTURE(low, high, solution.share);
  CHECK(solution.share > low);
  CHECK(solution.share < 1.002 * high);
  CHECK_FALSE(canReach(0.98 * solution.share));
}

TEST_CASE("peak: controls without a limit do not count, and the share stays below its bound") {
  const auto inner = makeReach<Mass>(20, kDistance);
  const PeakProblem one(inner, Eigen::Vector2d(1, kFree), 10, kFree);
  const Solution solution = solvePeak(inner, one);
  REQUIRE(solution.summary.termination == FddpTermination::Converged);
  double other = 0;
  for (const VectorXd& u : solution.trajectory.us) other = std::max(other, std::abs(u[1]));
  CHECK(solution.share < 0.05);
  CHECK(other > 1);
  const PeakProblem tight(inner, Eigen::Vector2d(1, 1), 10, 0.4);
  CHECK(solvePeak(inner, tight).summary.termination == FddpTermination::Infeasible);
}

TEST_CASE("peak: wrapping and unwrapping give the same trajectory") {
  const auto inner = makeReach<Mass>(7, kDistance);
  const PeakProblem problem(inner, Eigen::Vector2d(0.3, kFree), 1, kFree);
  ShootingTrajectory t = makeGuess(inner);
  for (VectorXd& u : t.us) u = VectorXd::Random(2);
  const ShootingTrajectory wrapped = problem.wrap(t), back = problem.unwrap(wrapped);
  double largest = 0;
  for (size_t k = 0; k < t.us.size(); ++k) {
    CHECK((t.us[k] - back.us[k]).norm() < 1e-15);
    CHECK(wrapped.us[k].size() == problem.controlSize(static_cast<int>(k)));
    largest = std::max(largest, std::abs(wrapped.us[k][0]));
  }
  CHECK(largest == Approx(1));
  for (size_t k = 0; k < t.xs.size(); ++k) CHECK(back.xs[k] == t.xs[k]);
}

TEST_CASE("peak: an iteration allocates nothing") {
  const PlantProblem<CartPole> inner = makeCartPole();
  const PeakProblem problem(inner, VectorXd::Constant(1, 20), 3, kFree);
  FddpOptions options = makeOptions();
  options.threads = 2;
  ShootingTrajectory guess = makeGuess(inner);
  for (VectorXd& u : guess.us) u.setConstant(1);
  ShootingTrajectory t = problem.wrap(guess);
  const std::vector<long> counts = countAllocations(options, problem, t);
  REQUIRE(counts.size() > 3);
  CHECK(counts.back() == counts[1]);
}

TEST_CASE("peak: what makes no sense is refused") {
  const PlantProblem<Linear> inner = makeLinear();
  const auto make = [&](double a, double b, double weight, double most) {
    return PeakProblem(inner, Eigen::Vector2d(a, b), weight, most);
  };
  CHECK_NOTHROW(make(1, kFree, 1, 1));
  CHECK_THROWS_AS(make(kFree, kFree, 1, 1), std::invalid_argument);
  CHECK_THROWS_AS(make(0, 1, 1, 1), std::invalid_argument);
  CHECK_THROWS_AS(make(1, 1, 0, 1), std::invalid_argument);
  CHECK_THROWS_AS(make(1, 1, 1, 0), std::invalid_argument);
}
