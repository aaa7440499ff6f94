#include "solve/fddp_run.h"

#include <omp.h>

#include <cmath>

#include "solve/fddp_checks.h"

namespace bielle {

namespace {

constexpr double kGoodStep = 0.1;  // alpha after which a foreseen decrease is believed
// A line search starts at less than 1 only below these gaps and violations and beyond this ratio of curvatures, and at least here.
constexpr double kSmallGap = 1e-6, kClose = 0.03, kSteep = 1.5, kShortestFirst = 0.05;
constexpr int kSettling = 30;           // steps that settle() takes, at most
constexpr double kSettlingFactor = 10;  // of the regularization, between these steps
constexpr const char* kStalled = "the cost no longer decreases";

}  // namespace

FddpSummary FddpRun::solve() {
  start();
  while (true) {
    if (const End end = linearize()) return finish(*end);
    if (const End end = findStep()) return finish(*end);
    acceptStep();
    if (const End end = checkProgress()) return finish(*end);
  }
}

void FddpRun::start() {
  N_ = problem_.numStages();
  checkSizes(problem_, trajectory_);
  // Each has memory of its own, and no more than one a node has work.
  threads_ = std::min(options_.threads > 0 ? options_.threads : omp_get_max_threads(), N_ + 1);
  work_.resize(problem_, options_, threads_);
  trajectory_.xs[0] = problem_.initialState();
  for (size_t k = 0; k < work_.bounds.size(); ++k) {
    trajectory_.us[k] = trajectory_.us[k].cwiseMax(work_.bounds[k].lower).cwiseMin(work_.bounds[k].upper);
  }
  regularization_ = options_.initial_regularization;
  summary_.log.reserve(std::min(options_.max_iterations + 1, 10000));
}

FddpRun::End FddpRun::linearize() {
  if (summary_.iterations > 0) {
    last_gradient_ = line_.gradient;
    last_step_ = line_.step;
  }
  line_ = FddpIteration();
  updated_ = false;
  first_regularization_ = regularization_;
  line_.iteration = summary_.iterations + 1;
  for (size_t k = 0; k < work_.boxes.size(); ++k) {
    work_.boxes[k].lower = work_.bounds[k].lower - trajectory_.us[k];
    work_.boxes[k].upper = work_.bounds[k].upper - trajectory_.us[k];
  }
  if (const End end = evaluate()) return end;
  work_.lagrangian.evaluate(work_.evaluations.getIterate());
  if (recedes() && !work_.lagrangian.isEmpty()) {
    work_.lagrangian.updateMultipliers(work_.evaluations.getIterate(), line_.cost);
    work_.lagrangian.hold(work_.evaluations.getIterate());
    updated_ = true;
  }
  if (!work_.lagrangian.canSettle()) settling_ = 0;  // what minimizes violations alone may move far
  if (settling_ == 0 && isCreeping()) settling_ = kSettling;
  if (settling_ > 0) settle();
  if (const End end = linearizeAndSweep()) return end;
  updateGaps();
  line_.violation = work_.lagrangian.getViolation();
  summary_.cost = line_.cost;
  summary_.gap = line_.gap;
  return {};
}

bool FddpRun::isCreeping() const {
  const double share = options_.acceptable_decrease;
  const std::vector<FddpIteration>& log = summary_.log;
  if (share == 0 || recedes() || !work_.lagrangian.canSettle() || static_cast<int>(log.size()) < next_settling_)
    return false;
  double least = line_.cost, most = line_.cost;
  for (size_t i = log.size() - kCreeping; i < log.size(); ++i) {
    if (log[i].violation > kClose || log[i].gap > kClose) return false;
    least = std::min(least, log[i].cost);
    most = std::max(most, log[i].cost);
  }
  return most - least <= share * std::abs(line_.cost);
}

// Closes the constraints where the trajectory is: the penalty grows, and the trajectory moves along the constraints the less the
// more that would open them.
void FddpRun::settle() {
  AugmentedLagrangian& lagrangian = work_.lagrangian;
  const bool full = last_step_ == 1, falls = lagrangian.settle(work_.evaluations.getIterate(), full);
  updated_ = true;
  closed_merit_.reset();
  if (--settling_ == 0) {
    lagrangian.endSettling(work_.evaluations.getIterate());
    resetRegularization();
    next_settling_ = summary_.iterations + kCreeping;
  } else if (!full) {
    regularization_ = std::min(options_.max_regularization, kSettlingFactor * regularization_);
  } else if (!falls) {
    regularization_ = std::max(options_.min_regularization, regularization_ / kSettlingFactor);
  }
}

FddpRun::End FddpRun::evaluate() {
  const int failed = work_.evaluations.update(problem_, trajectory_, threads_);
  if (failed < 0) {
    for (int k = 0; k <= N_; ++k) line_.cost += work_.evaluations.getIterate()[k]->cost;
    return {};
  }
  const std::string& reason = work_.evaluations.getIterate()[failed]->failure;
  summary_.message = "node " + std::to_string(failed) + ": the problem could not be evaluated";
  if (!reason.empty()) summary_.message += ": " + reason;
  return FddpTermination::Failed;
}

FddpRun::End FddpRun::linearizeAndSweep() {
  const LqRegularization regularization{regularization_, regularization_ * options_.state_regularization_ratio};
  const int failed =
      work_.backward.update({problem_, work_.evaluations, work_.lagrangian, work_.boxes, regularization, threads_});
  swept_ = true;
  if (failed < 0) return {};
  summary_.message = "node " + std::to_string(failed) + ": " + work_.backward.getFailure(failed);
  return FddpTermination::Failed;
}

void FddpRun::updateGaps() {
  const std::vector<StageModel>& models = work_.backward.getModels();
  gap_sum_ = 0;
  for (int k = 0; k <= N_; ++k) {
    if (models[k].gap.size() == 0) continue;
    const double largest = models[k].gap.lpNorm<Eigen::Infinity>();
    line_.gap = std::max(line_.gap, largest);
    work_.open[k] = largest > options_.gap_tolerance;
    if (work_.open[k]) gap_sum_ += models[k].gap.lpNorm<1>();
  }
}

// Finds an acceptable trial, unless the iterations end at the current iterate.
FddpRun::End FddpRun::findStep() {
  while (true) {
    if (isInterrupted()) return FddpTermination::Interrupted;
    if (const End end = updateStep()) return end;
    if (settling_ > 0 && isClosed() && work_.lagrangian.isSatisfied()) {
      summary_.message = "the constraints are satisfied and the cost hardly decreases; the iterate is not stationary";
      summary_.acceptable = true;
      return FddpTermination::Converged;
    }
    if (isStationary() && work_.lagrangian.isSatisfied()) {
      if (line_.gradient > options_.gradient_tolerance) summary_.message = kStalled;
      return FddpTermination::Converged;
    }
    if (mustUpdateMultipliers()) {
      if (const End end = updateMultipliers()) return end;
      continue;
    }
    if (searchLine() && (accepted_->alpha == 1 || !isRounding())) return {};
    if (isRounding()) {
      stalled_ = swept_ = true;
      continue;
    }
    if (const End end = raiseRegularization("no step is acceptable")) return end;
  }
}

// New multipliers are due once the cost can hardly fall under the old ones.
bool FddpRun::mustUpdateMultipliers() const {
  const AugmentedLagrangian& lagrangian = work_.lagrangian;
  if (lagrangian.isEmpty() || (recedes() && !stalled_)) return false;  // (12) came before this linearization
  if (isStationary()) return true;
  const bool first_sweep = regularization_ == first_regularization_;  // a damped one promises little
  return !updated_ && first_sweep && last_step_ >= kGoodStep && lagrangian.isDue(calcForeseen());
}

// Eq. (12). The next sweep makes new models about the same evaluations.
FddpRun::End FddpRun::updateMultipliers() {
  if (!work_.lagrangian.updateMultipliers(work_.evaluations.getIterate(), line_.cost)) {
    if (!isClosed() && !closing_) {  // one more step, which closes the gaps
      closing_ = updated_ = true;
      return {};
    }
    summary_.message =
        "near this iterate the constraints cannot all be satisfied: " + work_.lagrangian.describeWorst(problem_);
    return work_.lagrangian.dominates(line_.cost) ? FddpTermination::Infeasible : FddpTermination::RegularizationMax;
  }
  closing_ = stalled_ = swept_ = false;
  updated_ = true;
  closed_merit_.reset();
  return {};
}

// The sweep, at the smallest regularization from the current one on for which it succeeds. A second sweep needs new
// models, because a sweep overwrites their Hessians; the evaluations are kept.
FddpRun::End FddpRun::updateStep() {
  failure_.clear();
  while (true) {
    if (!swept_)
      if (const End end = linearizeAndSweep()) return end;
    swept_ = false;
    const Clock::time_point start = Clock::now();
    const LqSweep& sweep = work_.backward.getSweep();
    const LqResult result = sweep.getResult();
    if (result.status == LqStatus::NotFinite) {
      summary_.message = "node " + std::to_string(result.node) + ": the quadratic models are not finite";
      return FddpTermination::Failed;
    }
    line_.regularization = regularization_;
    if (result.status == LqStatus::Ok) {
      slope_ = sweep.calcStep(work_.backward.getModels(), work_.dx, work_.du);
      summary_.sweep_seconds += calcSecondsSince(start);
      curvature_ = 2 * (result.expected_change - slope_);  // Eq. (8) of the sweep
      line_.gradient = calcGradient();
      return {};
    }
    if (const End end = raiseRegularization("a control Hessian Quu is indefinite")) return end;
  }
}

// Eq. (6)
double FddpRun::calcGradient() const {
  double gradient = 0;
  for (int k = 0; k < N_; ++k) {
    const VectorXd& Qu = work_.backward.getSweep().getNodes()[k].Qu;
    if (work_.boxes.empty()) {
      gradient += Qu.squaredNorm();
    } else {
      gradient += (-Qu).cwiseMax(work_.boxes[k].lower).cwiseMin(work_.boxes[k].upper).squaredNorm();
    }
  }
  return gradient;
}

// alpha that the next line search starts with, where models are too flat (fddp.h).
void FddpRun::chooseFirstStep() {
  const double alpha = accepted_->alpha;
  first_step_ = 1;
  const bool creeps = alpha < 1 && last_step_ < 1 && line_.violation < kClose;
  if (!creeps || line_.gap > kSmallGap) return;
  const double curvature =
      2 * (accepted_->merit - calcMerit() - alpha * slope_) / (alpha * alpha);  // of Eq. (1), as it is
  if (curvature_ > 0 && curvature > kSteep * curvature_) first_step_ = std::max(kShortestFirst, curvature_ / curvature);
}

void FddpRun::acceptStep() {
  chooseFirstStep();
  std::swap(trajectory_, accepted_->nodes);
  if (work_.rollout.hasEvaluations()) {
    work_.evaluations.swapTrial();
  } else {
    work_.evaluations.outdate();
  }
  line_.step = accepted_->alpha;
  accepted_merit_ = accepted_->merit;
  closed_merit_.reset();
  if (accepted_->alpha == 1) closed_merit_ = accepted_->merit + accepted_->closing_cost;
  summary_.cost = accepted_->cost;
  summary_.gap = accepted_->gap_max;
  ++summary_.iterations;
}

FddpRun::End FddpRun::raiseRegularization(const char* reason) {
  if (isInterrupted()) return FddpTermination::Interrupted;
  regularization_ *= options_.regularization_increase;
  if (regularization_ <= options_.max_regularization) return {};
  AugmentedLagrangian& lagrangian = work_.lagrangian;
  // A larger penalty lifts what is left to gain over the rounding of the merit.
  if (lagrangian.isNear() && lagrangian.updateMultipliers(work_.evaluations.getIterate(), line_.cost)) {
    updated_ = true;
    resetRegularization();
    return {};
  }
  if (!lagrangian.isSatisfied() && lagrangian.restore(work_.evaluations.getIterate(), line_.cost)) {
    resetRegularization();
    return {};
  }
  summary_.message = std::string(reason) + " even at the largest regularization";
  if (!failure_.empty()) summary_.message += "; node " + std::to_string(failed_node_) + ": " + failure_;
  if (lagrangian.isSatisfied()) return FddpTermination::RegularizationMax;
  summary_.message += "; " + lagrangian.describeWorst(problem_);
  return lagrangian.dominates(line_.cost) ? FddpTermination::Infeasible : FddpTermination::RegularizationMax;
}

// For a merit that has changed, about the same evaluations.
void FddpRun::resetRegularization() {
  regularization_ = options_.initial_regularization;
  stalled_ = swept_ = false;
  closed_merit_.reset();
}

// After an accepted step: logs it, adapts the regularization to its length, and decides whether to continue.
FddpRun::End FddpRun::checkProgress() {
  line_.seconds = calcSecondsSince(start_);
  summary_.log.push_back(line_);
  if (observer_.callback && observer_.callback(line_) == FddpAction::Stop) return FddpTermination::Interrupted;

  const bool newton = line_.step == 1 && line_.regularization <= options_.min_regularization;
  const bool closed = isClosed() && summary_.gap <= options_.gap_tolerance;
  stalled_ =
      newton && closed && std::abs(calcMerit() - accepted_merit_) < options_.cost_tolerance * std::abs(line_.cost);
  if (stalled_ && work_.lagrangian.isEmpty()) {
    summary_.message = kStalled;
    return FddpTermination::Converged;
  }
  if (summary_.iterations >= options_.max_iterations) return FddpTermination::MaxIterations;
  if (settling_ > 0) return {};
  if (line_.step > options_.long_step) {
    regularization_ = std::max(options_.min_regularization, regularization_ / options_.regularization_decrease);
  } else if (line_.step <= options_.short_step) {
    regularization_ = std::min(options_.max_regularization, regularization_ * options_.regularization_increase);
  }
  return {};
}

FddpSummary FddpRun::finish(FddpTermination termination) {
  summary_.termination = termination;
  if (!work_.lagrangian.isEmpty()) {
    if (termination == FddpTermination::Converged) work_.lagrangian.adoptMultipliers(work_.evaluations.getIterate());
    summary_.violation = work_.lagrangian.getViolation();
    summary_.complementarity = work_.lagrangian.getComplementarity();
    summary_.multiplier = work_.lagrangian.getLargestMultiplier();
    summary_.penalty = work_.lagrangian.getPenalty();
    summary_.multiplier_updates = work_.lagrangian.getNumUpdates();
  }
  summary_.seconds = calcSecondsSince(start_);
  summary_.linearize_seconds = work_.evaluations.getSeconds() + work_.backward.getLinearizeSeconds();
  summary_.sweep_seconds += work_.backward.getSweepSeconds();
  summary_.rollout_seconds = work_.rollout.getSeconds();
  const bool judged = termination == FddpTermination::Converged || termination == FddpTermination::RegularizationMax ||
                      termination == FddpTermination::Infeasible;
  if (judged && line_.step == 0) {  // the iterate from which no step was taken
    line_.seconds = summary_.seconds;
    summary_.log.push_back(line_);
    if (observer_.callback) observer_.callback(line_);
  }
  if (!summary_.message.empty()) return std::move(summary_);
  switch (termination) {
    case FddpTermination::Converged:
      summary_.message = "the gradient vanishes and the gaps are closed";
      break;
    case FddpTermination::MaxIterations:
      summary_.message = "the iteration limit was reached";
      if (work_.lagrangian.getViolation() > options_.constraints.tolerance)
        summary_.message += "; " + work_.lagrangian.describeWorst(problem_);
      break;
    case FddpTermination::Interrupted:
      summary_.message = "stopped by the caller";
      break;
    case FddpTermination::RegularizationMax:
    case FddpTermination::Infeasible:
    case FddpTermination::Failed:
      break;
  }
  return std::move(summary_);
}

}  // namespace bielle
