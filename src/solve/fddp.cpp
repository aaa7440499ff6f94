#include "bielle/solve/fddp.h"

#include <stdexcept>

#include "solve/fddp_checks.h"
#include "solve/fddp_run.h"

namespace bielle {

void Fddp::Workspace::resize(const ShootingProblem& problem, const FddpOptions& options, int threads) {
  const int num_trials = std::min(problem.getBatchSize(), options.num_step_lengths);
  evaluations.resize(problem, num_trials > 1 ? 2 * num_trials : 0, threads);
  lagrangian.resize(problem, options.constraints);
  backward.resize(problem);
  rollout.resize(problem, options.rollout_segments, num_trials);
  bounds.resize(options.bounds == ControlBounds::Enforce ? problem.numStages() : 0);
  for (size_t k = 0; k < bounds.size(); ++k) {
    const int stage = static_cast<int>(k), nu = problem.controlSize(stage);
    bounds[k].lower.resize(nu);
    bounds[k].upper.resize(nu);
    problem.getControlBounds(stage, bounds[k].lower, bounds[k].upper);
    if (!(bounds[k].lower.array() <= bounds[k].upper.array()).all())
      throw std::invalid_argument("Fddp: a lower control bound of stage " + std::to_string(k) + " exceeds the upper");
  }
  boxes = bounds;
  open.assign(problem.numStages(), false);
}

Fddp::Fddp(const FddpOptions& options) : options_(options), work_(std::make_unique<Workspace>()) {
  checkOptions(options_);
}
Fddp::~Fddp() = default;
Fddp::Fddp(Fddp&&) noexcept = default;
Fddp& Fddp::operator=(Fddp&&) noexcept = default;

FddpSummary Fddp::solve(const ShootingProblem& problem, ShootingTrajectory& trajectory, const FddpObserver& observer) {
  return FddpRun(options_, problem, trajectory, observer, *work_).solve();
}

Multipliers Fddp::getMultipliers() const { return work_->lagrangian.getMultipliers(); }
void Fddp::setMultipliers(const Multipliers& multipliers) {
  work_->lagrangian.setMultipliers(multipliers);
  work_->evaluations.outdate();
}

void Fddp::advance(ShootingTrajectory& trajectory) {
  const size_t N = trajectory.us.size();
  if (N < 1 || trajectory.xs.size() != N + 1) throw std::invalid_argument("Fddp: no trajectory to advance");
  for (size_t k = 0; k < N; ++k) trajectory.xs[k].swap(trajectory.xs[k + 1]);
  for (size_t k = 0; k + 1 < N; ++k) trajectory.us[k].swap(trajectory.us[k + 1]);
  trajectory.xs[N] = trajectory.xs[N - 1];
  if (N > 1) trajectory.us[N - 1] = trajectory.us[N - 2];
  work_->evaluations.advance();
  work_->lagrangian.advance();
}

const LqSweep& Fddp::getSweep() const { return work_->backward.getSweep(); }

}  // namespace bielle
