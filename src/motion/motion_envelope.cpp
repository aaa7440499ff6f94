#include "bielle/motion/motion_envelope.h"

#include <limits>

namespace bielle {

std::unique_ptr<PeakProblem> makePeakProblem(const Motion& motion) {
  const ProblemOptions& options = motion.problem_options;
  if (options.objective.objective != Objective::PeakTorque) return nullptr;
  const double most = motion.within_limits ? 1 : std::numeric_limits<double>::infinity();
  return std::make_unique<PeakProblem>(*motion.problem, getPeakLimits(motion.problem->model(), options.limits),
                                       options.objective.scale.value_or(1), most);
}

MotionEnvelope::MotionEnvelope(const Solution& optimum)
    : motion_(optimum.motion),
      peak_(makePeakProblem(motion_)),
      trajectory_(peak_ ? peak_->wrap(optimum.trajectory) : optimum.trajectory),
      envelope_(motion_.problem->model(), peak_ ? static_cast<const ShootingProblem&>(*peak_) : *motion_.problem,
                trajectory_, optimum.multipliers) {}

double MotionEnvelope::calcLagrangian(const Motion& changed) const {
  const std::unique_ptr<PeakProblem> peak = makePeakProblem(changed);
  return peak ? envelope_.calcLagrangian(*peak) : envelope_.calcLagrangian(*changed.problem);
}

std::optional<ShootingTrajectory> followOptimum(const Solution& optimum, const Motion& changed, int sweeps) {
  const std::unique_ptr<PeakProblem> from = makePeakProblem(optimum.motion), to = makePeakProblem(changed);
  if (!from)
    return followOptimum(*optimum.motion.problem, optimum.trajectory, optimum.multipliers, *changed.problem, sweeps);
  const std::optional<ShootingTrajectory> out =
      followOptimum(*from, from->wrap(optimum.trajectory), optimum.multipliers, *to, sweeps);
  return out ? std::optional<ShootingTrajectory>(to->unwrap(*out)) : std::nullopt;
}

std::optional<OptimumDerivative> differentiateOptimum(
    const Solution& optimum, const Motion& ahead, const Motion& behind, double step,
    const std::function<VectorXd(const Motion&, const ShootingTrajectory&)>& read) {
  const std::unique_ptr<PeakProblem> at = makePeakProblem(optimum.motion), to = makePeakProblem(ahead),
                                     from = makePeakProblem(behind);
  if (!at)
    return differentiateOptimum(*optimum.motion.problem, optimum.trajectory, optimum.multipliers, *ahead.problem,
                                *behind.problem, step,
                                [&](const ShootingProblem& changed, const ShootingTrajectory& trajectory) {
                                  return read(&changed == ahead.problem.get() ? ahead : behind, trajectory);
                                });
  return differentiateOptimum(*at, at->wrap(optimum.trajectory), optimum.multipliers, *to, *from, step,
                              [&](const ShootingProblem& changed, const ShootingTrajectory& trajectory) {
                                return &changed == to.get() ? read(ahead, to->unwrap(trajectory))
                                                            : read(behind, from->unwrap(trajectory));
                              });
}

}  // namespace bielle
