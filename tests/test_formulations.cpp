// The full and the reduced formulation have the same optimum as the time step vanishes: they differ by a discretization
// of first order. docs/results/formulations.md has a larger table; `test_motion "[.table]"` prints
// that of the squat.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "solve_in_place.h"

using namespace bielle;

namespace {

struct SquatSolution {
  FddpSummary summary;
  ShootingTrajectory trajectory;
  double gap = 0;  // largest closing error at any node, m or rad
};

SquatSolution solveSquat(const Model& model, double depth, double dt, Formulation formulation) {
  SquatOptions options;
  options.depth = depth;
  options.time_step = dt;
  options.contact_kp = 400;
  options.contact_kd = 40;  // critical damping; the default is for steps of 15 ms and below
  Motion motion = makeSquat(model, options, {formulation, StepRule::Euler});
  SquatSolution out;
  out.summary = test::solveInPlace(*motion.problem, motion.guess);
  out.trajectory = std::move(motion.guess);
  Workspace ws(model);
  for (const VectorXd& x : out.trajectory.xs) {
    updatePositions(model, ws, x.head(model.nq()));
    out.gap = std::max(out.gap, calcLargestGap(ws, makeConstraintSet(model)));
  }
  return out;
}

double calcLargestTorque(const std::vector<VectorXd>& us) {
  double largest = 0;
  for (const VectorXd& u : us) largest = std::max(largest, u.cwiseAbs().maxCoeff());
  return largest;
}

// At the same nodes.
double calcTorqueDifference(const SquatSolution& a, const SquatSolution& b) {
  REQUIRE(a.trajectory.us.size() == b.trajectory.us.size());
  double largest = 0;
  for (size_t k = 0; k < a.trajectory.us.size(); ++k)
    largest = std::max(largest, (a.trajectory.us[k] - b.trajectory.us[k]).cwiseAbs().maxCoeff());
  return largest;
}

struct Comparison {
  SquatSolution full, reduced;
  double torque = 0, difference = 0;  // N m
};

Comparison compare(const Model& model, double depth, double dt) {
  Comparison out;
  out.full = solveSquat(model, depth, dt, Formulation::Full);
  out.reduced = solveSquat(model, depth, dt, Formulation::Reduced);
  CAPTURE(depth, dt, out.full.summary.message, out.reduced.summary.message);
  CHECK(out.full.summary.termination == FddpTermination::Converged);
  CHECK(out.reduced.summary.termination == FddpTermination::Converged);
  out.torque = calcLargestTorque(out.reduced.trajectory.us);
  out.difference = calcTorqueDifference(out.full, out.reduced);
  return out;
}

Model loadBipetto() { return loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto").model; }

}  // namespace

TEST_CASE("formulations: their squats become one as the time step shrinks") {
  const Model model = loadBipetto();
  const Comparison coarse = compare(model, 0.9, 0.02), fine = compare(model, 0.9, 0.01);
  CAPTURE(coarse.difference, fine.difference, coarse.full.gap, fine.full.gap);
  CHECK(fine.difference < 0.6 * coarse.difference);
  CHECK(fine.difference < 0.1 * fine.torque);
  const auto getCostDifference = [](const Comparison& c) {
    return std::abs(c.full.summary.cost - c.reduced.summary.cost);
  };
  CHECK(getCostDifference(fine) < 0.6 * getCostDifference(coarse));
  // Only one of them drifts off its closures, by an error that shrinks too.
  CHECK(fine.full.gap < 0.6 * coarse.full.gap);
  for (const Comparison& c : {coarse, fine}) {
    CHECK(c.full.gap > 1e-6);
    CHECK(c.reduced.gap < 1e-10);
  }
}

namespace {

// The state after a tenth of a second from rest, under a torque that never changes.
VectorXd simulate(const Model& model, const VectorXd& q0, Formulation formulation, StepRule step, int stages) {
  std::vector<StageSpec> specs(stages + 1);
  for (StageSpec& spec : specs) {
    spec.step = step;
    spec.dt = 0.1 / stages;
    spec.constraints = makeConstraintSet(model);
  }
  const RobotProblem problem(model, q0, VectorXd::Zero(model.nv()), std::move(specs), formulation);
  RobotEvaluator evaluator(problem);
  VectorXd x = problem.initialState();
  for (int k = 0; k < stages; ++k) {
    const RobotEvaluation& at = evaluator.evaluate(k, x, VectorXd::Constant(model.nu(), 0.3));
    REQUIRE(at.status == NumericalStatus::Ok);
    x = at.x_next;
  }
  return x;
}

double calcDistance(const Model& model, const VectorXd& x, const VectorXd& y) {
  const int nq = model.nq();
  return std::max(model.difference(x.head(nq), y.head(nq)).cwiseAbs().maxCoeff(),
                  (x - y).tail(model.nv()).cwiseAbs().maxCoeff());
}

}  // namespace

TEST_CASE("steps: Euler's are of first order, midpoint's of second") {
  const std::vector<std::pair<Formulation, StepRule>> discretizations = {{Formulation::Full, StepRule::Euler},
                                                                         {Formulation::Full, StepRule::Midpoint},
                                                                         {Formulation::Reduced, StepRule::Euler},
                                                                         {Formulation::Reduced, StepRule::Midpoint}};
  for (const char* name : {"fourbar", "fivebar", "fourbar_chain", "delta", "bipetto"}) {
    const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/" + name).model;
    const VectorXd q0 = findClosedConfiguration(model).q;
    const VectorXd limit = simulate(model, q0, Formulation::Full, StepRule::Midpoint, 3200);
    for (const auto& [formulation, step] : discretizations) {
      const double coarse = calcDistance(model, simulate(model, q0, formulation, step, 100), limit);
      const double fine = calcDistance(model, simulate(model, q0, formulation, step, 200), limit);
      CAPTURE(name, getName(formulation), getName(step), coarse, fine);
      const double order = std::log2(coarse / fine);
      CHECK(order == Approx(step == StepRule::Euler ? 1 : 2).margin(0.15));
    }
  }
}

TEST_CASE("formulations: the table of the documentation", "[.table]") {
  const Model model = loadBipetto();
  std::printf(
      "| depth | step [ms] | cost, full | cost, reduced | iterations | largest torque [N m] | "
      "largest difference [N m] | drift, full [m, rad] | drift, reduced |\n|---|---|---|---|---|---|---|---|---|\n");
  for (double depth : {0.9, 0.7})
    for (double dt : {0.02, 0.01, 0.005, 0.0025}) {
      const Comparison c = compare(model, depth, dt);
      std::printf("| %.1f | %.1f | %.6f | %.6f | %d, %d | %.2f | %.3f | %.1e | %.0e |\n", depth, 1e3 * dt,
                  c.full.summary.cost, c.reduced.summary.cost, c.full.summary.iterations, c.reduced.summary.iterations,
                  c.torque, c.difference, c.full.gap, c.reduced.gap);
      std::fflush(stdout);
    }
}
