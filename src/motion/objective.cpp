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

double calcElectricalPower(const Motor& motor, double u, double w, double regeneration) {
  const double c = motor.getEffortFactor(u * w), power = c * (u * w) + motor.getTorqueLoss() * (c * u) * (c * u);
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
    losses[m] = motor.getTorqueLoss() * ((c_1 * c_1 + c_2 * c_2) / 2);
  }
  for (StageSpec& stage : stages) {
    weaken(options.getRegularization(), stage);
    const bool step = &stage != &stages.back() && stage.kind == StageKind::Dynamics;
    if (options.objective != Objective::Energy || !step || model.nu() == 0) continue;
    const VectorXd weights = VectorXd::Ones(model.nu());
    stage.costs.push_back({"electrical energy", options.scale,
                           Activation::makeEnergy(weights, losses, options.regeneration, kPowerSmoothing),
                           makeElectricalPower(model)});
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
      energy += at.dt * calcElectricalPower(motor, at.u[m], w, options.regeneration);
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

namespace {

// Whether a problem has these rows of constraints at its nodes.
bool haveRows(const ShootingProblem& problem, const Multipliers& multipliers) {
  if (!(multipliers.penalty > 0) || static_cast<int>(multipliers.values.size()) != problem.numStages() + 1)
    return false;
  for (int k = 0; k <= problem.numStages(); ++k)
    if (multipliers.values[k].size() != problem.constraintSize(k)) return false;
  return true;
}

// \param start  multipliers to start from if the problem has their rows, else from zero
FddpResult attempt(const Motion& motion, const FddpOptions& solver, const FddpObserver& observer,
                   const Multipliers& start = {}) {
  const std::unique_ptr<PeakProblem> peak = makePeakProblem(motion);
  const ShootingProblem& problem = peak ? static_cast<const ShootingProblem&>(*peak) : *motion.problem;
  // The penalty that a solve ended with is too stiff for another motion.
  Multipliers first;
  if (haveRows(problem, start)) first = {start.values, solver.constraints.initial_penalty};
  FddpResult out = solve(problem, peak ? peak->wrap(motion.guess) : motion.guess, solver, observer, first);
  if (peak) out.trajectory = peak->unwrap(out.trajectory);
  return out;
}

// The better of two attempts, with the iterations and times of both.
FddpResult join(FddpResult first, FddpResult second) {
  const bool both = second.summary.termination == FddpTermination::Infeasible;
  const FddpSummary &before = first.summary, &after = second.summary;
  FddpResult& better = both && before.violation < after.violation ? first : second;
  FddpSummary out = better.summary;
  out.iterations = before.iterations + after.iterations;
  out.multiplier_updates = before.multiplier_updates + after.multiplier_updates;
  out.seconds = before.seconds + after.seconds;
  out.evaluate_seconds = before.evaluate_seconds + after.evaluate_seconds;
  out.linearize_seconds = before.linearize_seconds + after.linearize_seconds;
  out.sweep_seconds = before.sweep_seconds + after.sweep_seconds;
  out.rollout_seconds = before.rollout_seconds + after.rollout_seconds;
  out.log = before.log;
  out.log.insert(out.log.end(), after.log.begin(), after.log.end());
  if (both) out.message += "; the better of two attempts";
  better.summary = std::move(out);
  return std::move(better);
}

// The posture at the start, carried along with the base of the guess.
void holdPosture(Motion& motion) {
  const Model& model = motion.problem->model();
  const int base = model.hasFreeFlyer() ? 7 : 0, joints = model.nq() - base;
  const VectorXd posture = motion.problem->initialState().segment(base, joints);
  for (VectorXd& x : motion.guess.xs) x.segment(base, joints) = posture;
}

}  // namespace

FddpOptions makeMotionSolverOptions() {
  FddpOptions out;
  out.acceptable_decrease = 1e-4;
  return out;
}

FddpSummary solveMotion(Motion& motion, const FddpOptions& options, const FddpObserver& observer,
                        Multipliers* multipliers) {
  constexpr double kCautious = 1e-2;  // regularization of the second attempt
  FddpResult result = attempt(motion, options, observer, multipliers ? *multipliers : Multipliers());
  if (result.summary.termination == FddpTermination::Failed && result.summary.iterations == 0) {
    holdPosture(motion);
    result = attempt(motion, options, observer);
  }
  if (result.summary.termination == FddpTermination::Infeasible && options.initial_regularization < kCautious) {
    FddpOptions cautious = options;
    cautious.initial_regularization = kCautious;
    result = join(std::move(result), attempt(motion, cautious, observer));
  }
  motion.guess = std::move(result.trajectory);
  if (multipliers) *multipliers = std::move(result.multipliers);
  return std::move(result.summary);
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

std::optional<OptimumDerivative> differentiateOptimum(
    const Motion& optimum, const Multipliers& multipliers, const Motion& ahead, const Motion& behind, double step,
    const std::function<VectorXd(const Motion&, const ShootingTrajectory&)>& read) {
  const std::unique_ptr<PeakProblem> at = makePeakProblem(optimum), to = makePeakProblem(ahead),
                                     from = makePeakProblem(behind);
  if (!at)
    return differentiateOptimum(*optimum.problem, optimum.guess, multipliers, *ahead.problem, *behind.problem, step,
                                [&](const ShootingProblem& changed, const ShootingTrajectory& trajectory) {
                                  return read(&changed == ahead.problem.get() ? ahead : behind, trajectory);
                                });
  return differentiateOptimum(*at, at->wrap(optimum.guess), multipliers, *to, *from, step,
                              [&](const ShootingProblem& changed, const ShootingTrajectory& trajectory) {
                                return &changed == to.get() ? read(ahead, to->unwrap(trajectory))
                                                            : read(behind, from->unwrap(trajectory));
                              });
}

}  // namespace bielle
