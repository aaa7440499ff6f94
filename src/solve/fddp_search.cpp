#include <cmath>

#include "solve/fddp_run.h"

namespace bielle {

namespace {

constexpr double kPenaltyMargin = 0.5;  // rho of Eq. (5)
// Differences of costs below this share of the cost are rounding: they neither accept nor reject a step.
constexpr double kCostRounding = 1e-14;
constexpr double kClosingShare = 0.5;  // of Eq. (4): the most that Eq. (8) may be

}  // namespace

// Whether the step must close the gaps: the last one allowed, and the one after which the gradient vanishes if it keeps
// falling at the same rate.
bool FddpRun::mustClose() const {
  const bool last = options_.last_rollout == LastRollout::Closed && line_.iteration >= options_.max_iterations;
  return last || closing_ ||
         line_.gradient * line_.gradient <= options_.gradient_tolerance * std::max(line_.gradient, last_gradient_);
}

// Whether the gaps that Eq. (9) leaves are likely to count as closed.
bool FddpRun::closesTwice(int segments) const {
  double step = 0;
  for (int s = 1; s < segments; ++s) step = std::max(step, work_.dx[s * N_ / segments].lpNorm<Eigen::Infinity>());
  return std::pow(step, 3) <= options_.gap_tolerance;
}

// Whether a full step can decrease the merit only by less than the rounding errors of all nodes may hide.
bool FddpRun::isRounding() const {
  return regularization_ <= options_.min_regularization && isClosed() && calcForeseen() <= N_ * calcRounding();
}

// Largest difference of merits that is taken for rounding.
double FddpRun::calcRounding() const {
  return kCostRounding * (std::abs(line_.cost) + std::abs(work_.lagrangian.getValue()));
}

bool FddpRun::searchLine() {
  const double penalized = std::max(0.0, slope_ + 0.5 * std::max(0.0, curvature_));
  const double nu = gap_sum_ > 0 ? penalized / ((1 - kPenaltyMargin) * gap_sum_) : 0;  // Eq. (5)
  const RolloutInput input{problem_,
                           trajectory_,
                           work_.evaluations,
                           work_.backward.getModels(),
                           work_.backward.getSweep(),
                           work_.lagrangian,
                           work_.dx,
                           work_.bounds,
                           work_.open,
                           threads_};
  const int segments = getNumSegments();
  if (segments > 1 && options_.last_rollout == LastRollout::Segments && !mustClose())
    return searchInSegments(input, segments, nu);
  if (segments > 1 && last_step_ == 1 && first_step_ == 1 && tryFullStep(input, segments, nu)) return true;
  Rollout& rollout = work_.rollout;
  const int num_trials = rollout.getNumTrials();
  double alpha = first_step_;
  for (int i = 0; i < options_.num_step_lengths; i += num_trials) {
    if (isInterrupted()) return false;
    const int num = std::min(num_trials, options_.num_step_lengths - i);
    rollout.search(input, alpha, num);
    for (int j = 0; j < num; ++j, alpha *= 0.5)
      if (accept(rollout.getTrial(j), nu)) return true;
  }
  return false;
}

// A full step in segments, which start where linear models predict them. If it is rejected, a rollout in one piece may
// still succeed.
bool FddpRun::tryFullStep(const RolloutInput& input, int segments, double nu) {
  Rollout& rollout = work_.rollout;
  Trial& trial = rollout.getTrial(0);
  if (!mustClose()) {
    rollout.cut(input, 1, segments);
    return !isOvershooting(trial) && accept(trial, nu);
  }
  if (!closesTwice(segments)) return false;
  const auto isClosed = [&] { return trial.gap_max <= options_.gap_tolerance; };
  rollout.cut(input, 1, segments);
  if (trial.ok && !isClosed()) rollout.close(input);
  return isClosed() && accept(trial, nu);
}

// Whether a full step in segments, after another one, makes too little of what is foreseen. The merit of Eq. (4) counts the
// gaps of both steps differently: before, by what closing them takes of the foreseen decrease, after, by Eq. (8). Here both
// are closed by Eq. (8); otherwise steps that go too far by all of their length would pass, and the iterations could cycle.
bool FddpRun::isOvershooting(const Trial& trial) const {
  if (!trial.ok || !closed_merit_) return false;
  const double foreseen = calcForeseen() - (calcMerit() - *closed_merit_);
  const double real = *closed_merit_ - trial.merit - trial.closing_cost;
  return real < options_.acceptance * foreseen - calcRounding();
}

// All step lengths in turn: a receding horizon has no time for rollouts in one piece.
bool FddpRun::searchInSegments(const RolloutInput& input, int segments, double nu) {
  double alpha = 1;
  for (int i = 0; i < options_.num_step_lengths; ++i, alpha *= 0.5) {
    if (isInterrupted()) return false;
    work_.rollout.cut(input, alpha, segments);
    if (accept(work_.rollout.getTrial(0), nu)) return true;
  }
  return false;
}

bool FddpRun::accept(Trial& trial, double nu) {
  if (!trial.ok && failure_.empty() && trial.failed_node >= 0) {
    failed_node_ = trial.failed_node;
    failure_ = trial.failure;
  }
  accepted_ = trial.ok && isAcceptable(trial, nu) ? &trial : nullptr;
  return accepted_ != nullptr;
}

// Whether the merit of a trial has fallen enough, Eqs. (4) and (8).
bool FddpRun::isAcceptable(const Trial& trial, double nu) const {
  const double alpha = trial.alpha;
  const double foreseen = -alpha * slope_ - 0.5 * alpha * alpha * curvature_ + nu * alpha * gap_sum_;
  const double real = calcMerit() - trial.merit - trial.closing_cost + nu * (gap_sum_ - trial.gap_sum);
  const double rounding = calcRounding();
  const double decrease = std::max(0.0, foreseen);  // boxes make Eq. (4) an approximation
  return real >= options_.acceptance * decrease - rounding &&
         std::abs(trial.closing_cost) <= kClosingShare * decrease + rounding;
}

}  // namespace bielle
