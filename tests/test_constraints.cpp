// Constraints of a shooting problem: the conditions of an optimum by an oracle that knows neither models nor sweeps, dense ones
// on a quadratic program, and constraints that contradict each other.
#include <Eigen/LU>
#include <atomic>
#include <catch2/catch.hpp>

#include "constrained_problem.h"
#include "count_solver_allocations.h"
#include "fddp_oracle.h"

using namespace bielle;
using namespace bielle::test;

namespace {

// Values of all constraints along the rollout of us, node after node.
std::vector<VectorXd> calcConstraints(const ShootingProblem& problem, const std::vector<VectorXd>& us) {
  std::vector<VectorXd> out;
  VectorXd x = problem.initialState();
  for (size_t k = 0; k <= us.size(); ++k) {
    const auto node = evaluate(problem, static_cast<int>(k), x, k < us.size() ? &us[k] : nullptr);
    out.push_back(node->constraints);
    if (k < us.size()) x = node->x_next;
  }
  return out;
}

// Eq. (13) of fddp.h along the rollout.
double calcLagrangian(const ShootingProblem& problem, const std::vector<VectorXd>& us,
                      const std::vector<VectorXd>& multipliers) {
  double sum = calcCost(problem, us);
  const std::vector<VectorXd> c = calcConstraints(problem, us);
  for (size_t k = 0; k < c.size(); ++k) sum += multipliers[k].dot(c[k]);
  return sum;
}

// Half the squares of all violations along the rollout.
double calcViolations(const ShootingProblem& problem, const std::vector<VectorXd>& us) {
  double sum = 0;
  const std::vector<VectorXd> c = calcConstraints(problem, us);
  for (size_t k = 0; k < c.size(); ++k) {
    VectorXd lower(c[k].size()), upper(c[k].size());
    problem.getConstraintBounds(static_cast<int>(k), lower, upper);
    sum += 0.5 * (c[k] - c[k].cwiseMax(lower).cwiseMin(upper)).squaredNorm();
  }
  return sum;
}

// Multipliers above this are those of rows that bind.
constexpr double kBinding = 1e-5;

struct Conditions {
  double gradient = 0, violation = 0, complementarity = 0, wrong_sign = 0;
  int active = 0;
};

// Values at the node states: along a rollout the pole would fall farther and farther from them.
Conditions calcConditions(const ShootingProblem& problem, const ShootingTrajectory& t,
                          const std::vector<VectorXd>& multipliers) {
  Conditions out;
  const auto lagrangian = [&](const std::vector<VectorXd>& us) { return calcLagrangian(problem, us, multipliers); };
  out.gradient = calcControlGradient(t.us, lagrangian).lpNorm<Eigen::Infinity>();
  for (size_t k = 0; k < t.xs.size(); ++k) {
    const auto node = evaluate(problem, static_cast<int>(k), t.xs[k], k < t.us.size() ? &t.us[k] : nullptr);
    const VectorXd &c = node->constraints, &y = multipliers[k];
    VectorXd lower(c.size()), upper(c.size());
    problem.getConstraintBounds(static_cast<int>(k), lower, upper);
    for (Eigen::Index i = 0; i < c.size(); ++i) {
      out.violation = std::max({out.violation, lower[i] - c[i], c[i] - upper[i]});
      out.active += std::abs(y[i]) > kBinding;
      if (y[i] > 0) out.complementarity = std::max(out.complementarity, std::abs(y[i] * (upper[i] - c[i])));
      if (y[i] < 0) out.complementarity = std::max(out.complementarity, std::abs(y[i] * (lower[i] - c[i])));
      if ((y[i] > 0 && upper[i] == kFree) || (y[i] < 0 && lower[i] == -kFree))
        out.wrong_sign = std::max(out.wrong_sign, std::abs(y[i]));
    }
  }
  return out;
}

}  // namespace

TEST_CASE("constraints: a cart catches its pole within bounds, and the conditions of an optimum hold") {
  auto problem = makeBoundedCartPole();
  FddpOptions options;
  options.gradient_tolerance = 1e-14;
  const FddpResult result = solve(problem, makeGuess(problem), options);
  const ShootingTrajectory& t = result.trajectory;
  const FddpSummary& summary = result.summary;
  CAPTURE(summary.message, summary.iterations, summary.violation, summary.penalty, summary.multiplier_updates);
  REQUIRE(summary.termination == FddpTermination::Converged);
  CHECK(summary.violation <= 1e-8);
  CHECK(summary.complementarity < 1e-5);
  CHECK(summary.multiplier > 0.1);
  CHECK(calcLargestGap(problem, t) < 1e-10);
  std::vector<VectorXd> multipliers = result.multipliers.values;
  const Conditions conditions = calcConditions(problem, t, multipliers);
  CHECK(conditions.gradient < 1e-4);
  CHECK(conditions.violation <= 1e-8);
  CHECK(conditions.complementarity < 1e-5);
  CHECK(conditions.wrong_sign == 0);
  CHECK(conditions.active > 6);  // tip and push too, not only the four at the end

  // With those at the end alone the tip goes farther and the push is harder; and a wrong multiplier is noticed.
  auto free = problem;
  free.rows.erase(free.rows.begin(), free.rows.begin() + 2);
  ShootingTrajectory wide = makeGuess(free);
  REQUIRE(solveInPlace(free, wide).termination == FddpTermination::Converged);
  double tip = 0, push = 0;
  for (const VectorXd& x : wide.xs) tip = std::max(tip, x[0] + 0.5 * std::sin(x[1]));
  for (size_t k = 0; k < wide.us.size(); ++k) push = std::min(push, wide.us[k][0] - wide.xs[k][2]);
  CHECK(tip > kFarthest + 0.01);
  CHECK(push < -kPush - 0.3);
  Eigen::Index largest = 0;
  multipliers.back().cwiseAbs().maxCoeff(&largest);
  multipliers.back()[largest] *= 1.01;
  CHECK(calcConditions(problem, t, multipliers).gradient > 3e-4);
}

TEST_CASE("constraints: new multipliers, penalties, regularizations and held rows sweep over the same models") {
  const auto problem = makeBoundedCartPole();
  const FddpSummary summary = solve(problem, makeGuess(problem)).summary;
  REQUIRE(summary.termination == FddpTermination::Converged);
  const int iterates = static_cast<int>(summary.log.size());
  CAPTURE(iterates, summary.sweeps, summary.multiplier_updates);
  CHECK(summary.sweeps >= iterates + 3);
  const int nodes = problem.stages + 1;  // some again, where rows are held that had no weight
  CHECK(summary.linearizations >= iterates * nodes);
  CHECK(summary.linearizations <= (iterates + 1) * nodes);
}

TEST_CASE("constraints: a penalty alone violates them by the multipliers over it, to first order") {
  auto problem = makeBoundedCartPole();
  FddpOptions options;
  const FddpResult exact = solve(problem, makeGuess(problem), options);
  options.constraints.multipliers = false;
  options.constraints.tolerance = 0.01;
  options.constraints.penalty_increase = 1;
  double last = 0;
  for (const double penalty : {1e3, 1e4}) {
    options.constraints.initial_penalty = penalty;
    const FddpResult result = solve(problem, makeGuess(problem), options);
    CAPTURE(penalty, result.summary.message, result.summary.violation, exact.summary.multiplier);
    CHECK(result.summary.termination == FddpTermination::Converged);
    CHECK(result.summary.penalty == penalty);
    for (const VectorXd& y : result.multipliers.values) CHECK(y.isZero(0));
    CHECK(result.summary.violation == Approx(exact.summary.multiplier / penalty).epsilon(0.05));
    const double deficit = exact.summary.cost - result.summary.cost;  // of a point outside
    CHECK(deficit > 0);
    if (last > 0) CHECK(deficit == Approx(last / 10).epsilon(0.05));
    last = deficit;
  }
  // Where the penalty may grow, it does so until the constraints hold.
  options.constraints = {};
  options.constraints.multipliers = false;
  options.constraints.max_penalty = 1e14;
  const FddpResult result = solve(problem, makeGuess(problem), options);
  CHECK(result.summary.termination == FddpTermination::Converged);
  CHECK(result.summary.violation <= 1e-8);
  CHECK(result.summary.penalty > 1e7);
}

TEST_CASE("constraints: a quadratic program has the solution of its dense conditions") {
  Constrained<PlantProblem<Linear>> problem(makeLinear());
  const int N = problem.stages, n = 2 * N;
  problem.rows.push_back({"speed", 1, N, -0.4, kFree, [](const Complex* x, const Complex*) { return x[1] + x[2]; }});
  problem.rows.push_back({"end", N, N, 0.25, 0.25, [](const Complex* x, const Complex*) { return x[0]; }});
  problem.rows.push_back({"mix", 3, 9, -kFree, 0.8, [](const Complex* x, const Complex* u) { return u[1] - x[2]; }});
  const FddpResult result = solve(problem, makeGuess(problem), makeTightOptions());
  const ShootingTrajectory& t = result.trajectory;
  const FddpSummary& summary = result.summary;
  CAPTURE(summary.message, summary.iterations);
  REQUIRE(summary.termination == FddpTermination::Converged);

  // Cost and constraints as functions of all controls, by differences that are exact but for rounding; the rows that bind
  // are those that have a multiplier.
  const auto unpack = [&](const VectorXd& all) {
    std::vector<VectorXd> us;
    for (int k = 0; k < N; ++k) us.push_back(all.segment(2 * k, 2));
    return us;
  };
  const std::vector<VectorXd> multipliers = result.multipliers.values;
  std::vector<std::pair<int, int>> binding;
  VectorXd y_solver(0);
  for (int k = 0; k <= N; ++k)
    for (int i = 0; i < multipliers[k].size(); ++i)
      if (std::abs(multipliers[k][i]) > kBinding) {
        binding.push_back({k, i});
        y_solver.conservativeResize(y_solver.size() + 1);
        y_solver[y_solver.size() - 1] = multipliers[k][i];
      }
  const int m = static_cast<int>(binding.size());
  REQUIRE(m > 5);
  const auto calcBinding = [&](const VectorXd& all) {
    const std::vector<VectorXd> c = calcConstraints(problem, unpack(all));
    VectorXd out(m);
    for (int i = 0; i < m; ++i) {
      const auto [k, row] = binding[i];
      VectorXd lower(c[k].size()), upper(c[k].size());
      problem.getConstraintBounds(k, lower, upper);
      out[i] = c[k][row] - (y_solver[i] > 0 ? upper[row] : lower[row]);
    }
    return out;
  };
  const VectorXd zero = VectorXd::Zero(n);
  const double c0 = calcCost(problem, unpack(zero));
  VectorXd singles(n), gradient(n);
  for (int i = 0; i < n; ++i) singles[i] = calcCost(problem, unpack(VectorXd::Unit(n, i)));
  MatrixXd kkt = MatrixXd::Zero(n + m, n + m);
  const VectorXd d0 = calcBinding(zero);
  for (int i = 0; i < n; ++i) {
    const double twice = calcCost(problem, unpack(2 * VectorXd::Unit(n, i)));
    kkt(i, i) = twice - 2 * singles[i] + c0;
    gradient[i] = singles[i] - c0 - 0.5 * kkt(i, i);
    for (int j = 0; j < i; ++j) {
      const double both = calcCost(problem, unpack(VectorXd::Unit(n, i) + VectorXd::Unit(n, j)));
      kkt(i, j) = kkt(j, i) = both - singles[i] - singles[j] + c0;
    }
    kkt.block(n, i, m, 1) = calcBinding(VectorXd::Unit(n, i)) - d0;
    kkt.block(i, n, 1, m) = kkt.block(n, i, m, 1).transpose();
  }
  VectorXd right(n + m), u_solver(n);
  right << -gradient, -d0;
  const VectorXd dense = kkt.fullPivLu().solve(right);
  for (int k = 0; k < N; ++k) u_solver.segment(2 * k, 2) = t.us[k];
  CHECK((dense.head(n) - u_solver).lpNorm<Eigen::Infinity>() < 1e-5);
  CHECK((dense.tail(m) - y_solver).lpNorm<Eigen::Infinity>() < 1e-5 * (1 + y_solver.lpNorm<Eigen::Infinity>()));
  const Conditions conditions = calcConditions(problem, t, multipliers);
  CHECK(conditions.violation <= 1e-8);
  CHECK(conditions.wrong_sign == 0);
  kkt(0, 0) *= 1.01;
  const VectorXd poisoned = kkt.fullPivLu().solve(right);
  CHECK((poisoned.head(n) - u_solver).lpNorm<Eigen::Infinity>() > 1e-4);
}

TEST_CASE("constraints: near the solution, no step on a quadratic program is short") {
  const auto makeProblem = [](double inside) {
    Constrained<PlantProblem<Linear>> problem(makeLinear());
    const auto getSpeed = [](const Complex* x, const Complex*) { return x[1] + x[2]; };
    problem.rows.push_back({"speed", 1, problem.stages, -0.4 + inside, kFree, getSpeed});
    problem.rows.push_back(
        {"mix", 3, 9, -kFree, 0.8 - inside, [](const Complex* x, const Complex* u) { return u[1] - x[2]; }});
    return problem;
  };
  FddpOptions options = makeTightOptions();
  options.constraints.initial_penalty = 1e3;
  const auto tighter = makeProblem(0.02), problem = makeProblem(0);
  const ShootingTrajectory start = solve(tighter, makeGuess(tighter), options).trajectory;
  double cost = 0;
  for (const int segments : {16, 1}) {  // rows are held after steps in segments alone
    options.rollout_segments = segments;
    const FddpSummary summary = solve(problem, start, options).summary;
    double shortest = 1;
    for (const FddpIteration& line : summary.log)
      if (line.step > 0) shortest = std::min(shortest, line.step);
    CAPTURE(segments, summary.message, summary.iterations);
    REQUIRE(summary.termination == FddpTermination::Converged);
    CHECK((shortest == 1) == (segments > 1));
    CHECK(summary.iterations < (segments > 1 ? 8 : 40));
    if (segments > 1) cost = summary.cost;
    CHECK(summary.cost == Approx(cost).epsilon(1e-9));
  }
}

TEST_CASE("constraints: with bounds on the control they hold together") {
  auto problem = makeBoundedCartPole();
  problem.rows.erase(problem.rows.begin() + 1);  // the push
  ShootingTrajectory unbounded = makeGuess(problem);
  solveInPlace(problem, unbounded);
  double most = 0;
  for (const VectorXd& u : unbounded.us) most = std::max(most, std::abs(u[0]));
  problem.bound = 0.8 * most;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = solveInPlace(problem, t);
  CAPTURE(summary.message, summary.iterations, summary.violation, most);
  REQUIRE(summary.termination == FddpTermination::Converged);
  double largest = 0;
  for (const VectorXd& u : t.us) largest = std::max(largest, std::abs(u[0]));
  CHECK(largest == problem.bound);
  for (const VectorXd& x : t.xs) CHECK(x[0] + 0.5 * std::sin(x[1]) <= kFarthest + 1e-8);
  CHECK(t.xs.back().lpNorm<Eigen::Infinity>() <= 1e-8);
}

TEST_CASE("constraints that never bind change no bit of a solve") {
  const auto free = makeCartPole();
  Constrained<PlantProblem<CartPole>> loose(free);
  loose.rows.push_back({"track", 0, 100, -500, 500, [](const Complex* x, const Complex*) { return x[0]; }});
  ShootingTrajectory a = makeLine(free), b = a;
  const FddpSummary of_free = solveInPlace(free, a), of_loose = solveInPlace(loose, b);
  CHECK(of_free.iterations == of_loose.iterations);
  CHECK(a.xs == b.xs);
  CHECK(a.us == b.us);
  CHECK(of_loose.multiplier == 0);
}

TEST_CASE("constraints that contradict each other are named, with what is left of them") {
  auto problem = makeBoundedCartPole();
  problem.rows.erase(problem.rows.begin() + 1);  // the push
  problem.rows.push_back({"wall", 60, 60, kFarthest + 0.1, kFree, getTip});
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = solveInPlace(problem, t);
  CAPTURE(summary.message, summary.iterations);
  const auto namesOne = [](const FddpSummary& of) {
    return of.message.find("tip at node 60") != std::string::npos ||
           of.message.find("wall at node 60") != std::string::npos;
  };
  CHECK(summary.termination == FddpTermination::Infeasible);
  CHECK(namesOne(summary));
  FddpOptions few;  // a solve that is cut off before names them too
  few.max_iterations = summary.iterations - 1;
  ShootingTrajectory unfinished = makeGuess(problem);
  const FddpSummary cut_off = solveInPlace(problem, unfinished, few);
  CHECK(cut_off.termination == FddpTermination::MaxIterations);
  CHECK(namesOne(cut_off));
  // One of the two is violated by half of what lies between them at least. The sum of squares cannot be less, to first order.
  CHECK(summary.violation > 0.05 - 1e-6);
  CHECK(summary.violation < 0.1);
  const auto violations = [&](const std::vector<VectorXd>& us) { return calcViolations(problem, us); };
  CHECK(calcControlGradient(t.us, violations).norm() < 1e-4);
  CHECK(calcControlGradient(makeGuess(problem).us, violations).norm() > 1e-2);
}

namespace {

// A point in the plane that moves by u in each stage.
struct Point {
  static constexpr int kStates = 2, kControls = 2;
  template <class S>
  static std::array<S, 2> calcRate(const std::array<S, 2>&, const std::array<S, 2>& u) {
    return u;
  }
};

// The point must end on a winding road, and hardly gains by going along it.
Complex getHeight(const Complex* x, const Complex*) { return x[1] - std::sin(20.0 * x[0]); }
Constrained<PlantProblem<Point>> makeWindingRoad(double goal, double other_road) {
  PlantProblem<Point> point;
  point.stages = 1;
  point.dt = 1;
  point.control_weight = 1e-6;
  point.goal << goal, 0;
  point.terminal_weight << 1e-3, 0;
  Constrained<PlantProblem<Point>> p(point);
  p.rows.push_back({"road", 1, 1, 0, 0, getHeight});
  if (other_road != 0) p.rows.push_back({"other road", 1, 1, other_road, other_road, getHeight});
  return p;
}

}  // namespace

TEST_CASE("constraints that are not a number are named at the start, and make a trial too long") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const bool late : {false, true}) {  // a worse violation is met before, or after
    auto problem = makeBoundedCartPole();
    for (Row& row : problem.rows) row.lower -= 1e3, row.upper += 1e3;
    problem.rows.push_back({"far", late ? 3 : 50, late ? 3 : 50, 1e3, kFree, getTip});
    problem.rows.push_back({"root", 40, 41, 0, kFree, [nan](const Complex*, const Complex*) { return Complex(nan); }});
    ShootingTrajectory t = makeGuess(problem);
    const FddpSummary summary = solveInPlace(problem, t);
    CHECK(summary.termination == FddpTermination::Failed);
    CHECK(summary.message == "root at node 40 is not a number");
    CHECK(std::isnan(summary.violation));
  }
  // Not along the way, but in trials beyond it.
  Constrained<PlantProblem<CartPole>> problem(makeCartPole());
  std::atomic<int> beyond{0};
  problem.rows.push_back({"root", 1, problem.numStages(), -kFree, kFree, [&](const Complex* x, const Complex*) {
                            for (int i = 0; i < 4; ++i)
                              if (std::abs(x[i].real()) > 14) return ++beyond, Complex(nan);
                            return x[0];
                          }});
  ShootingTrajectory t = makeGuess(problem);
  CHECK(solveInPlace(problem, t, makeTightOptions()).termination == FddpTermination::Converged);
  CHECK(beyond > 0);
}

TEST_CASE("where the cost creeps along curved constraints, it is accepted within them") {
  const auto solve = [](double acceptable_decrease, double other_road) {
    auto problem = makeWindingRoad(10, other_road);
    ShootingTrajectory t = makeGuess(problem);
    FddpOptions options;
    options.max_iterations = 100;
    options.acceptable_decrease = acceptable_decrease;
    options.constraints.initial_penalty = 10;
    const FddpSummary summary = solveInPlace(problem, t, options);
    const std::vector<VectorXd> c = calcConstraints(problem, t.us);
    if (summary.termination == FddpTermination::Converged) CHECK(std::abs(c[1][0]) <= options.constraints.tolerance);
    CHECK(summary.cost == Approx(calcCost(problem, t.us)).epsilon(1e-9));
    return summary;
  };
  const FddpSummary creeping = solve(0, 0);
  CAPTURE(creeping.iterations, creeping.cost, creeping.message);
  CHECK(creeping.termination == FddpTermination::MaxIterations);

  const FddpSummary accepted = solve(0.2, 0);
  CAPTURE(accepted.iterations, accepted.cost, accepted.message);
  CHECK(accepted.termination == FddpTermination::Converged);
  CHECK(accepted.acceptable);
  CHECK(accepted.message.find("not stationary") != std::string::npos);
  CHECK(accepted.log.back().gradient > FddpOptions().gradient_tolerance);
  CHECK(accepted.violation <= 1e-8);
  // The last twenty costs before the constraints were closed differ by a fifth at most; they fall no faster if less is requested.
  CHECK(accepted.iterations < creeping.iterations);
  CHECK(accepted.cost < 1.5 * creeping.cost);

  // What cannot hold is never accepted.
  const FddpSummary impossible = solve(0.2, 0.02);
  CAPTURE(impossible.message);
  CHECK(impossible.termination != FddpTermination::Converged);
  CHECK_FALSE(impossible.acceptable);
  CHECK(impossible.violation > 5e-3);
}

TEST_CASE("an iteration with constraints allocates nothing after the first, and threads change no bit") {
  auto problem = makeBoundedCartPole();
  std::vector<ShootingTrajectory> results;
  for (int threads : {1, 2, 7}) {
    ShootingTrajectory t = makeGuess(problem);
    FddpOptions options;
    options.threads = threads;
    const std::vector<long> counts = countAllocations(options, problem, t);
    REQUIRE(counts.size() > 5);
    CHECK(counts.back() == counts.front());
    results.push_back(t);
  }
  for (const ShootingTrajectory& t : results) CHECK((t.xs == results[0].xs && t.us == results[0].us));
}

TEST_CASE("bounds of constraints that exclude each other are refused") {
  auto problem = makeBoundedCartPole();
  problem.rows[0].lower = kFarthest + 1;
  ShootingTrajectory t = makeGuess(problem);
  CHECK_THROWS_WITH(solveInPlace(problem, t), Catch::Contains("node 1"));
}
