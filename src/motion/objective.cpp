#include "bielle/motion/objective.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/motion/motion_envelope.h"

namespace bielle {

const char* getName(Objective objective) {
  if (objective == Objective::Effort) return "effort";
  return objective == Objective::Energy ? "energy" : "peak-torque";
}

double getDefaultRegularization(Objective objective) { return objective == Objective::Effort ? 1 : 0.2; }

double ObjectiveOptions::getRegularization() const {
  return regularization.value_or(getDefaultRegularization(objective));
}

double calcElectricalPower(double u, double w, double loss, double regeneration) {
  const double power = u * w + loss * u * u;
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
                "give the share of what flows back that is used again");
  requireOption(options.getRegularization() > 0 && std::isfinite(options.getRegularization()), "regularization",
                "it is not positive", "give a share of the other costs, e.g. 0.1");
  if (options.objective == Objective::Effort) return;
  VectorXd losses(model.nu());
  for (int m = 0; m < model.nu(); ++m) losses[m] = model.motors()[m].getTorqueLoss();
  for (StageSpec& stage : stages) {
    weaken(options.getRegularization(), stage);
    const bool step = &stage != &stages.back() && stage.kind == StageKind::Dynamics;
    if (options.objective != Objective::Energy || !step || model.nu() == 0) continue;
    const VectorXd weights = VectorXd::Ones(model.nu());
    stage.costs.push_back({"electrical energy", options.scale,
                           Activation::makeEnergy(weights, losses, options.regeneration, kPowerSmoothing),
                           makeElectricalPower(losses)});
  }
}

VectorXd getPeakLimits(const Model& model, const LimitOptions& limits) {
  VectorXd efforts = getEffortLimits(model, limits);
  if (!efforts.array().isFinite().any()) efforts.setConstant(model.mass() * model.gravity().norm() * kReferenceLever);
  return efforts;
}

namespace {

// J of Eq. (2) at the guess of a motion.
double calcObjective(const Motion& motion, const ObjectiveOptions& options, const VectorXd& peak_limits) {
  const Model& model = motion.problem->model();
  RobotEvaluator evaluator(*motion.problem);
  double energy = 0, peak = 0;
  for (int k = 0; k < motion.problem->numStages(); ++k) {
    const RobotEvaluation& at = evaluator.evaluate(k, motion.guess.xs[k], motion.guess.us[k]);
    for (int m = 0; m < model.nu(); ++m) {
      const Motor& motor = model.motors()[m];
      const double w = at.v_mid.size() > 0 ? at.v_mid[motor.dof] : at.x[model.nq() + motor.dof];
      energy += at.dt * calcElectricalPower(at.u[m], w, motor.getTorqueLoss(), options.regeneration);
      if (at.dt > 0) peak = std::max(peak, std::abs(at.u[m]) / peak_limits[m]);
    }
  }
  return options.objective == Objective::Energy ? energy : peak * peak;
}

}  // namespace

ObjectiveOptions scaleObjective(const Motion& effort, const ObjectiveOptions& options, const LimitOptions& limits) {
  const RobotProblem& problem = *effort.problem;
  RobotEvaluator evaluator(problem);
  double cost = 0;
  for (int k = 0; k <= problem.numStages(); ++k)
    cost += evaluator.evaluate(k, effort.guess.xs[k], k < problem.numStages() ? effort.guess.us[k] : VectorXd()).cost;
  ObjectiveOptions out = options;
  const double scale = cost / calcObjective(effort, options, getPeakLimits(problem.model(), limits));
  if (scale > 0 && std::isfinite(scale)) out.scale = scale;
  return out;
}

std::unique_ptr<PeakProblem> makePeakProblem(const Motion& motion) {
  if (motion.peak_limits.size() == 0) return nullptr;
  const double most = motion.within_limits ? 1 : std::numeric_limits<double>::infinity();
  return std::make_unique<PeakProblem>(*motion.problem, motion.peak_limits, motion.objective.scale, most);
}

FddpSummary solveMotion(Motion& motion, const FddpOptions& options, const FddpObserver& observer,
                        Multipliers* multipliers) {
  FddpOptions solver = options;
  const std::unique_ptr<PeakProblem> peak = makePeakProblem(motion);
  if (motion.bounded || peak) solver.bounds = ControlBounds::Enforce;
  Fddp fddp(solver);
  FddpSummary summary;
  if (peak) {
    ShootingTrajectory trajectory = peak->wrap(motion.guess);
    summary = fddp.solve(*peak, trajectory, observer);
    motion.guess = peak->unwrap(trajectory);
  } else {
    summary = fddp.solve(*motion.problem, motion.guess, observer);
  }
  if (multipliers) *multipliers = fddp.getMultipliers();
  return summary;
}

MotionEnvelope::MotionEnvelope(const Motion& optimum, const Multipliers& multipliers)
    : peak_(makePeakProblem(optimum)),
      trajectory_(peak_ ? peak_->wrap(optimum.guess) : optimum.guess),
      envelope_(optimum.problem->model(), peak_ ? static_cast<const ShootingProblem&>(*peak_) : *optimum.problem,
                trajectory_, multipliers) {}

double MotionEnvelope::calcLagrangian(const Motion& changed) const {
  const std::unique_ptr<PeakProblem> peak = makePeakProblem(changed);
  return peak ? envelope_.calcLagrangian(*peak) : envelope_.calcLagrangian(*changed.problem);
}

std::optional<ShootingTrajectory> followOptimum(const Motion& optimum, const Multipliers& multipliers,
                                                const Motion& changed, int sweeps) {
  const std::unique_ptr<PeakProblem> from = makePeakProblem(optimum), to = makePeakProblem(changed);
  if (!from) return followOptimum(*optimum.problem, optimum.guess, multipliers, *changed.problem, sweeps);
  const std::optional<ShootingTrajectory> out =
      followOptimum(*from, from->wrap(optimum.guess), multipliers, *to, sweeps);
  return out ? std::optional<ShootingTrajectory>(to->unwrap(*out)) : std::nullopt;
}

}  // namespace bielle
