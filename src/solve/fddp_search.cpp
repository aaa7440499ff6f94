#include <cmath>
#include <limits>

#include "solve/fddp_iterations.h"

namespace bielle {

namespace {

constexpr double kPenaltyMargin = 0.5;  // rho of Eq. (5)
// Differences of costs below this share of the cost are rounding: they neither accept nor reject a step.
constexpr double kCostRounding = 1e-14;
constexpr double kClosingShare = 0.5;  // of Eq. (4): the most that Eq. (8) may be
constexpr double kHardly = 1e3;        // over the least regularization: up to there a step is as good as undamped

}  // namespace

// Whether the gradient vanishes after this step if it keeps falling at the same rate.
bool FddpIterations::vanishesNext() const {
  return line_.gradient * line_.gradient <= options_.gradient_tolerance * std::max(line_.gradient, last_gradient_);
}

// Whether the gaps that Eq. (9) leaves are likely to count as closed.
bool FddpIterations::closesTwice(int segments) const {
  double step = 0;
  for (int s = 1; s < segments; ++s) step = std::max(step, memory_.dx[s * N_ / segments].lpNorm<Eigen::Infinity>());
  return std::pow(step, 3) <= options_.gap_tolerance;
}

// Whether a full step can decrease the merit only by less than the rounding errors of all nodes may hide.
bool FddpIterations::isRounding() const {
  return regularization_ <= kHardly * options_.min_regularization && isClosed() &&
         calcForeseen() <= N_ * calcRounding();
}

// Largest difference of merits that is taken for rounding.
double FddpIterations::calcRounding() const {
  return kCostRounding * (std::abs(line_.cost) + std::abs(memory_.lagrangian.getValue()));
}

RolloutInput FddpIterations::startSearch() {
  accepted_ = nullptr;
  const double penalized = std::max(0.0, foreseen_.slope + 0.5 * std::max(0.0, foreseen_.curvature) + foreseen_.excess);
  gap_weight_ =
      std::max(least_gap_weight_, gap_sum_ > 0 ? penalized / ((1 - kPenaltyMargin) * gap_sum_) : 0);  // Eq. (5)
  return {problem_,
          trajectory_,
          memory_.evaluations,
          memory_.backward.models(),
          memory_.backward.sweep(),
          memory_.lagrangian,
          memory_.dx,
          memory_.bounds,
          memory_.open,
          memory_.team,
          threads_};
}

// A step in segments: the first trial.
Trial& FddpIterations::rollOut(const RolloutInput& input, double alpha, int segments) {
  ++summary_.rollouts;
  memory_.rollout.cut(input, alpha, segments);
  return memory_.rollout.getTrial(0);
}

// Steps of all lengths, each in one piece.
bool FddpIterations::searchInOnePiece(const RolloutInput& input) {
  Rollout& rollout = memory_.rollout;
  const int num_trials = rollout.numTrials();
  double alpha = first_step_;
  for (int i = 0; i < options_.num_step_lengths; i += num_trials) {
    if (isInterrupted()) return false;
    const int num = std::min(num_trials, options_.num_step_lengths - i);
    rollout.search(input, alpha, num);
    ++summary_.searches;
    for (int j = 0; j < num; ++j, alpha *= 0.5)
      if (accept(rollout.getTrial(j))) return true;
  }
  return false;
}

// A full step in segments that closes the gaps, by a second rollout if need be. If it is rejected, one in one piece may
// still succeed.
bool FddpIterations::tryClosed(const RolloutInput& input, int segments) {
  Rollout& rollout = memory_.rollout;
  Trial& trial = rollout.getTrial(0);
  trial.ok = closesTwice(segments);
  if (!trial.ok) return false;
  const auto closes = [&] { return trial.gap_max <= options_.gap_tolerance; };
  rollOut(input, 1, segments);
  if (trial.ok && !closes()) {
    rollout.close(input);
    ++summary_.rollouts;
  }
  return closes() && accept(trial);
}

// alpha of the least merit on the parabola that has the slope of Eq. (1) and meets the trial.
double FddpIterations::findMinimum(const Trial& trial) const {
  const double alpha = trial.alpha, bend = -2 * (calcReal(trial) + alpha * foreseen_.slope);
  return bend > 0 ? -foreseen_.slope * alpha * alpha / bend : std::numeric_limits<double>::infinity();
}

bool FddpIterations::accept(Trial& trial) {
  if (!trial.ok && failure_.empty() && trial.failed_node >= 0) {
    failed_node_ = trial.failed_node;
    failure_ = trial.failure;
  }
  accepted_ = trial.ok && isAcceptable(trial) ? &trial : nullptr;
  return accepted_ != nullptr;
}

// Whether the merit of a trial has fallen enough, Eqs. (4) and (8).
bool FddpIterations::isAcceptable(const Trial& trial) const {
  const double alpha = trial.alpha;
  const double foreseen = -foreseen_.calcChange(alpha) + gap_weight_ * alpha * gap_sum_;
  const double real = calcReal(trial) + gap_weight_ * (gap_sum_ - trial.gap_sum);
  const double rounding = calcRounding();
  const double decrease = std::max(0.0, foreseen);  // boxes make Eq. (4) an approximation
  return real >= options_.acceptance * decrease - rounding &&
         std::abs(trial.closing_cost) <= kClosingShare * decrease + rounding;
}

}  // namespace bielle
