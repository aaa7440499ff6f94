// Whole motions of least electrical energy and of least peak torque: what they save over the motion of least effort, and what
// results say of them, against sums over the trajectory.
#include <catch2/catch.hpp>

#include "bielle/motion/squat.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

struct SolvedSquat {
  Solution solution;
  MotionResult result;
};

SolvedSquat finish(const Motion& motion, const ShootingTrajectory* start) {
  SolveOptions options;
  options.solver = FddpOptions();
  if (start) options.start = StartingPoint{*start};
  SolvedSquat out{solve(motion, options), {}};
  CAPTURE(out.solution.summary.message);
  REQUIRE(out.solution.converged());
  out.result = makeResult({"robot", {}, {}}, out.solution);
  for (const GoalOutcome& outcome : out.result.goals) CHECK(outcome.met());
  return out;
}

// From the motion of least effort.
SolvedSquat solveFromEffort(const SolvedSquat& effort, const Model& model, const SquatOptions& squat,
                            Objective objective, double regeneration = 0) {
  ProblemOptions options;
  options.objective.objective = objective;
  options.objective.regeneration = regeneration;
  options.objective = scaleObjective(effort.solution.motion, effort.solution.trajectory, options.objective);
  return finish(makeSquat(model, squat, options), &effort.solution.trajectory);
}

double getPeak(const SolvedSquat& solved) { return solved.result.peak_torques.front().second; }

}  // namespace

TEST_CASE("objectives: a squat of least energy, with and without what flows back") {
  const Model model = loadRobot("bipetto").model;
  SquatOptions squat;
  squat.depth = 0.8;
  squat.time_step = 0.03;
  const SolvedSquat effort = finish(makeSquat(model, squat), nullptr);
  const SolvedSquat least = solveFromEffort(effort, model, squat, Objective::Energy);
  CAPTURE(effort.result.energy.total, least.result.energy.total);
  CHECK(least.result.energy.total < 0.8 * effort.result.energy.total);
  CHECK(least.result.energy.num_assumed == model.nu());
  CHECK(std::isnan(least.result.energy.cost_of_transport));
  // The energies of the result, and what the cost adds to them by smoothing.
  double total = 0, in_cost = 0;
  const MotionRecord& record = least.result.record;
  RobotEvaluator evaluator(*least.solution.motion.problem);
  for (Eigen::Index k = 0; k < record.u.rows(); ++k) {
    for (int m = 0; m < model.nu(); ++m) {
      const double u = record.u(k, m);
      total += squat.time_step * std::max(0.0, u * record.v_mid(k, model.motors()[m].dof) + kDefaultTorqueLoss * u * u);
    }
    const int node = static_cast<int>(k);
    const RobotEvaluation& at =
        evaluator.evaluate(node, least.solution.trajectory.xs[node], least.solution.trajectory.us[node]);
    for (const CostValue& cost : least.solution.motion.problem->getCosts(node, at))
      if (cost.name == "electrical energy")
        in_cost += at.dt * cost.value / least.solution.motion.problem_options.objective.scale.value();
  }
  CHECK(least.result.energy.total == Approx(total).epsilon(1e-12));
  CHECK(least.result.energy.by_motor.sum() == Approx(total).epsilon(1e-12));
  const double duration = record.time[record.time.size() - 1];
  CHECK(in_cost > total);
  CHECK(in_cost < total + model.nu() * duration * kPowerSmoothing / 2);

  // Half of what flows back used again: less than the first motion takes on the same terms.
  const SolvedSquat half = solveFromEffort(effort, model, squat, Objective::Energy, 0.5);
  CHECK(half.result.energy.total < least.result.energy.total);
  CHECK(calcElectricalEnergy(model, least.result.record, 0.5).total > half.result.energy.total);
}

TEST_CASE("objectives: a squat of least peak torque, in both formulations") {
  const Model model = loadRobot("cleobot").model;
  SquatOptions squat;
  squat.depth = 0.8;
  squat.time_step = 0.03;
  const SolvedSquat effort = finish(makeSquat(model, squat), nullptr);
  const SolvedSquat least = solveFromEffort(effort, model, squat, Objective::PeakTorque);
  CHECK(getPeak(least) < 0.95 * getPeak(effort));
  // At least one motor is at the peak for more than an instant.
  int at_peak = 0;
  for (Eigen::Index k = 0; k < least.result.record.u.rows(); ++k)
    at_peak += least.result.record.u.row(k).cwiseAbs().maxCoeff() > getPeak(least) * (1 - 1e-9);
  CHECK(at_peak > 5);
  // The effort within limits of that peak exists; it is the regularization that keeps the peak above the least one.
  ProblemOptions limited;
  for (const Motor& motor : model.motors()) limited.limits.efforts[motor.name] = getPeak(least);
  const SolvedSquat bounded = finish(makeSquat(model, squat, limited), &effort.solution.trajectory);
  CHECK(getPeak(bounded) <= getPeak(least) * (1 + 1e-12));
  CHECK(bounded.solution.summary.cost > effort.solution.summary.cost);

  ProblemOptions full(Formulation::Full);
  const SolvedSquat effort_full = finish(makeSquat(model, squat, full), nullptr);
  full.objective.objective = Objective::PeakTorque;
  full.objective = scaleObjective(effort_full.solution.motion, effort_full.solution.trajectory, full.objective);
  const SolvedSquat least_full = finish(makeSquat(model, squat, full), &effort_full.solution.trajectory);
  CHECK(getPeak(least_full) == Approx(getPeak(least)).epsilon(0.01));
}
