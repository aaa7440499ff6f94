#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/motion/motion.h"
#include "motion/applied_options.h"
#include "solve/peak_problem.h"

namespace bielle {

const char* getName(Objective objective) {
  if (objective == Objective::Effort) return "effort";
  return objective == Objective::Energy ? "energy" : "peak-torque";
}

double getDefaultRegularization(Objective objective) { return objective == Objective::Effort ? 1 : 0.2; }

double ObjectiveOptions::getRegularization() const {
  return regularization.value_or(getDefaultRegularization(objective));
}

double calcElectricalPower(const Motor& motor, double u, double w, double regeneration) {
  const double c = motor.getEffortFactor(u * w), power = c * (u * w) + motor.torqueLoss() * (c * u) * (c * u);
  return power > 0 ? power : regeneration * power;
}

namespace {

void weaken(double share, StageSpec& stage) {
  stage.state.weight *= share;
  stage.control.weight *= share;
  for (Cost& cost : stage.costs)
    if (!cost.defines) cost.weight *= share;
}

}  // namespace

void setObjective(const Model& model, const ObjectiveOptions& options, std::vector<StageSpec>& stages) {
  requireOption(options.regeneration >= 0 && options.regeneration <= 1, "regeneration", "it is outside 0 .. 1",
                "give the share of the regenerated energy that is reused");
  requireOption(options.getRegularization() > 0 && std::isfinite(options.getRegularization()), "regularization",
                "it is not positive", "give a share of the other costs, e.g. 0.1");
  if (options.objective == Objective::Effort) return;
  VectorXd losses(model.nu());
  for (int m = 0; m < model.nu(); ++m) {  // c^2 half way between driving and being driven
    const Motor& motor = model.motors()[m];
    const double c_1 = 1 / motor.drive.efficiency, c_2 = motor.drive.back_efficiency;
    losses[m] = motor.torqueLoss() * ((c_1 * c_1 + c_2 * c_2) / 2);
  }
  for (StageSpec& stage : stages) {
    weaken(options.getRegularization(), stage);
    const bool step = &stage != &stages.back() && stage.kind == StageKind::Dynamics;
    if (options.objective != Objective::Energy || !step || model.nu() == 0) continue;
    const VectorXd weights = VectorXd::Ones(model.nu());
    stage.costs.push_back({"electrical energy", options.scale.value_or(1),
                           Activation::makeEnergy(weights, losses, options.regeneration, kPowerSmoothing),
                           makeElectricalPower(model)});
  }
}

VectorXd getPeakLimits(const Model& model, const LimitOptions& limits) {
  VectorXd efforts = getEffortLimits(model, limits);
  if (!efforts.array().isFinite().any()) efforts.setConstant(model.mass() * model.gravity().norm() * kReferenceLever);
  return efforts;
}

std::unique_ptr<PeakProblem> makePeakProblem(const Motion& motion) {
  const ProblemOptions& options = motion.problem_options;
  if (options.objective.objective != Objective::PeakTorque) return nullptr;
  const double most = motion.within_limits ? 1 : std::numeric_limits<double>::infinity();
  return std::make_unique<PeakProblem>(*motion.problem, getPeakLimits(motion.problem->model(), options.limits),
                                       options.objective.scale.value_or(1), most);
}

namespace {

// J of Eq. (2) of a trajectory.
double calcObjective(const RobotProblem& problem, const ShootingTrajectory& trajectory, const ObjectiveOptions& options,
                     const VectorXd& peak_limits) {
  const Model& model = problem.model();
  RobotEvaluator evaluator(problem);
  double energy = 0, peak = 0;
  for (int k = 0; k < problem.numStages(); ++k) {
    const RobotEvaluation& at = evaluator.evaluate(k, trajectory.xs[k], trajectory.us[k]);
    for (int m = 0; m < model.nu(); ++m) {
      const Motor& motor = model.motors()[m];
      const double w = at.v_mid.size() > 0 ? at.v_mid[motor.dof] : at.x[model.nq() + motor.dof];
      energy += at.dt * calcElectricalPower(motor, at.u[m], w, options.regeneration);
      if (at.dt > 0) peak = std::max(peak, std::abs(at.u[m]) / peak_limits[m]);
    }
  }
  return options.objective == Objective::Energy ? energy : peak * peak;
}

}  // namespace

ObjectiveOptions scaleObjective(const Motion& effort, const ShootingTrajectory& trajectory,
                                const ObjectiveOptions& options, const LimitOptions& limits) {
  const RobotProblem& problem = *effort.problem;
  RobotEvaluator evaluator(problem);
  double cost = 0;
  for (int k = 0; k <= problem.numStages(); ++k)
    cost += evaluator.evaluate(k, trajectory.xs[k], k < problem.numStages() ? trajectory.us[k] : VectorXd()).cost;
  ObjectiveOptions out = options;
  const double scale = cost / calcObjective(problem, trajectory, options, getPeakLimits(problem.model(), limits));
  out.scale = scale > 0 && std::isfinite(scale) ? scale : options.scale.value_or(1);
  return out;
}

}  // namespace bielle
