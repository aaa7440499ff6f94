// Multiple shooting as IPOPT sees it: derivatives about states that are not those of the guess, and the optimum that it finds.
#include <catch2/catch.hpp>
#include <random>

#include "bielle/model/error.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "ipopt_solver.h"
#include "multiple_shooting.h"
#include "short_squat.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// The variables of the guess, moved.
VectorXd makePoint(const MultipleShooting& program) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> within(-0.05, 0.05);
  VectorXd z = program.start();
  for (double& entry : z) entry += within(random);
  return z;
}

MatrixXd makeJacobian(const MultipleShooting& program) {
  const MultipleShooting::Entries& entries = program.jacobian();
  VectorXd values(entries.size());
  program.getJacobian(values);
  MatrixXd out = MatrixXd::Zero(program.rows().lower.size(), program.variables().lower.size());
  for (int i = 0; i < entries.size(); ++i) out(entries.rows[i], entries.columns[i]) += values[i];
  return out;
}

MatrixXd makeHessian(const MultipleShooting& program) {
  const MultipleShooting::Entries& entries = program.hessian();
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

Motion makeRsuSquat() {
  SquatOptions options;
  options.depth = 0.9;
  options.duration = 0.6;
  options.settle = 0;
  options.time_step = 0.02;
  return makeSquat(loadRobot("rsu_biped").model, options);
}

}  // namespace

TEST_CASE("multiple shooting: gradient and Jacobian against differences, whatever a row depends on") {
  const ShortSquat squat(StepRule::Midpoint);
  MultipleShooting program(*squat.motion.problem, squat.motion.guess);
  const VectorXd at = makePoint(program);
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

TEST_CASE("multiple shooting: an option that IPOPT does not know is named") {
  const ShortSquat squat(StepRule::Midpoint);
  IpoptOptions options;
  options.quiet = true;
  for (const auto& [name, value] : {std::pair("tolerance", "1e-8"), std::pair("tol", "small")}) {
    options.settings = {std::pair<std::string, std::string>(name, value)};
    CHECK_THROWS_WITH(solveByIpopt(squat.motion, squat.motion.guess, options), Catch::Contains(name));
  }
}
