#include "design/motion_envelope.h"

namespace bielle {

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

namespace {

const ShootingProblem& getProblem(const Motion& motion, const PeakProblem* peak) {
  return peak ? static_cast<const ShootingProblem&>(*peak) : *motion.problem;
}

// A reader of the problem of a peak, if there is one, by that of its motion.
OptimumReader unwrap(const PeakProblem* peak, const OptimumReader& read) {
  if (!peak) return read;
  return [peak, read](const ShootingTrajectory& trajectory) { return read(peak->unwrap(trajectory)); };
}

}  // namespace

FollowedMotion::FollowedMotion(const Solution& optimum, const Motion& here, const OptimumReader& read)
    : peak_(makePeakProblem(optimum.motion)),
      peak_here_(makePeakProblem(here)),
      followed_(getProblem(optimum.motion, peak_.get()), peak_ ? peak_->wrap(optimum.trajectory) : optimum.trajectory,
                optimum.multipliers, getProblem(here, peak_here_.get()), unwrap(peak_here_.get(), read)) {}

std::optional<OptimumDerivative> FollowedMotion::differentiate(const Motion& changed, double step,
                                                               const OptimumReader& read) {
  const std::unique_ptr<PeakProblem> peak = makePeakProblem(changed);
  return followed_.differentiate(getProblem(changed, peak.get()), step, unwrap(peak.get(), read));
}

}  // namespace bielle
