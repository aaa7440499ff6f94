#include "solve/fddp_iterations.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "solve/fddp_checks.h"

namespace bielle {

namespace {

// A line search starts at less than 1 only below these gaps, beyond this ratio of curvatures, and at least here.
constexpr double kSmallGap = 1e-6, kSteep = 1.5, kShortestFirst = 0.05;
constexpr const char* kStalled = "the cost no longer decreases";

}  // namespace

void FddpMemory::resize(const ShootingProblem& problem, const IterationOptions& options, int most_segments,
                        int threads) {
  const int num_trials = std::min(problem.batchSize(), options.num_step_lengths);
  evaluations.resize(problem, num_trials > 1 ? 2 * num_trials : 0, threads);
  lagrangian.resize(problem, options.constraints);
  backward.resize(problem);
  rollout.resize(problem, most_segments, num_trials);
  bounds.resize(problem.hasControlBounds() ? problem.numStages() : 0);
  for (size_t k = 0; k < bounds.size(); ++k) {
    const int stage = static_cast<int>(k), nu = problem.controlSize(stage);
    bounds[k].lower.resize(nu);
    bounds[k].upper.resize(nu);
    problem.getControlBounds(stage, bounds[k].lower, bounds[k].upper);
    if (!(bounds[k].lower.array() <= bounds[k].upper.array()).all())
      throw std::invalid_argument("FDDP: a lower control bound of stage " + std::to_string(k) + " exceeds the upper");
  }
  boxes = bounds;
  open.assign(problem.numStages(), false);
}

void FddpIterations::start(int most_segments) {
  begin();
  memory_.resize(problem_, options_, most_segments, threads_);
  for (size_t k = 0; k < memory_.bounds.size(); ++k) {
    trajectory_.us[k] = trajectory_.us[k].cwiseMax(memory_.bounds[k].lower).cwiseMin(memory_.bounds[k].upper);
  }
}

void FddpIterations::resume() {
  begin();
  prepared_ = true;
}

void FddpIterations::begin() {
  N_ = problem_.numStages();
  checkSizes(problem_, trajectory_);
  // Each has memory of its own, and no more than one a batch of nodes has work.
  const int batches = N_ / problem_.batchSize() + 1;
  threads_ = std::min(options_.threads > 0 ? options_.threads : getDefaultThreads(), batches);
  shift_.emplace(memory_.team, threads_);
  trajectory_.xs[0] = problem_.initialState();
  regularization_ = options_.initial_regularization;
  summary_.log.reserve(std::min(max_iterations_ + 1, 10000));
}

// Begins an iteration about the current iterate.
FddpIterations::End FddpIterations::evaluate() {
  if (summary_.iterations > 0) {
    last_gradient_ = line_.gradient;
    last_step_ = line_.step;
  }
  line_ = FddpIteration();
  updated_ = false;
  first_regularization_ = regularization_;
  line_.iteration = summary_.iterations + 1;
  updateBoxes();
  const int failed = memory_.evaluations.update(problem_, trajectory_, 0, memory_.team, threads_);
  if (failed < 0) {
    for (int k = 0; k <= N_; ++k) line_.cost += getIterate()[k]->cost;
    memory_.lagrangian.evaluate(getIterate());
    if (std::isfinite(memory_.lagrangian.violation())) return {};
    summary_.message = memory_.lagrangian.describeWorst(problem_);
    return FddpTermination::Failed;
  }
  const std::string& reason = getIterate()[failed]->failure;
  summary_.message = "node " + std::to_string(failed) + ": the problem could not be evaluated";
  if (!reason.empty()) summary_.message += ": " + reason;
  return FddpTermination::Failed;
}

// A node that cannot be evaluated or linearized is found again by what follows resume().
void FddpIterations::prepare() {
  updateBoxes();
  if (memory_.evaluations.update(problem_, trajectory_, 1, memory_.team, threads_) >= 0) return;
  if (!memory_.lagrangian.isEmpty()) memory_.lagrangian.renewAhead(getIterate());
  memory_.backward.prepare(getBackwardInput());
}

void FddpIterations::updateBoxes() {
  for (size_t k = 0; k < memory_.boxes.size(); ++k) {
    memory_.boxes[k].lower = memory_.bounds[k].lower - trajectory_.us[k];
    memory_.boxes[k].upper = memory_.bounds[k].upper - trajectory_.us[k];
  }
}

FddpIterations::End FddpIterations::updateModels() {
  if (const End end = linearize()) return end;
  updateGaps();
  line_.violation = memory_.lagrangian.violation();
  summary_.cost = line_.cost;
  summary_.gap = line_.gap;
  return {};
}

BackwardInput FddpIterations::getBackwardInput() const {
  return {problem_,
          memory_.evaluations,
          memory_.lagrangian,
          memory_.boxes,
          {regularization_, regularization_ * options_.state_regularization_ratio},
          memory_.team,
          threads_};
}

FddpIterations::End FddpIterations::linearize() {
  BackwardPass& backward = memory_.backward;
  return checkModels(std::exchange(prepared_, false) ? backward.finish(getBackwardInput())
                                                     : backward.update(getBackwardInput()));
}

FddpIterations::End FddpIterations::checkModels(int failed) {
  swept_ = true;
  ++summary_.sweeps;
  if (failed < 0) return {};
  summary_.message = "node " + std::to_string(failed) + ": " + memory_.backward.getFailure(failed);
  return FddpTermination::Failed;
}

void FddpIterations::updateGaps() {
  const std::vector<StageModel>& models = memory_.backward.models();
  gap_sum_ = 0;
  for (int k = 0; k <= N_; ++k) {
    if (models[k].gap.size() == 0) continue;
    const double largest = models[k].gap.norm();
    line_.gap = std::max(line_.gap, largest);
    memory_.open[k] = largest > options_.gap_tolerance;
    if (memory_.open[k]) gap_sum_ += largest;
  }
}

// The sweep, at the smallest regularization from the current one on for which it succeeds. Models are kept.
FddpIterations::End FddpIterations::updateStep() {
  if (isInterrupted()) return FddpTermination::Interrupted;
  failure_.clear();
  while (true) {
    if (!swept_)
      if (const End end = checkModels(memory_.backward.sweepAgain(getBackwardInput()))) return end;
    swept_ = false;
    const Clock::time_point start = Clock::now();
    const LqSweep& sweep = memory_.backward.sweep();
    const LqResult result = sweep.result();
    if (result.status == NumericalStatus::NotFinite) {
      summary_.message = "node " + std::to_string(result.node) + ": the quadratic models are not finite";
      for (const int k : {result.node, std::min(result.node + 1, N_)})  // LqSweep finds it there or one node earlier
        if (const int row = memory_.backward.findInfiniteRow(k); row >= 0) {
          summary_.message +=
              ": the derivatives of " + problem_.getConstraintName(k, row) + " at node " + std::to_string(k);
          break;
        }
      return FddpTermination::Failed;
    }
    line_.regularization = regularization_;
    if (result.status == NumericalStatus::Ok) {
      foreseen_ = {sweep.calcStep(memory_.backward.models(), memory_.dx, memory_.du)};
      summary_.sweep_seconds += calcSecondsSince(start);
      foreseen_.curvature = 2 * (result.expected_change - foreseen_.slope);  // Eq. (8) of the sweep
      line_.gradient = calcGradient();
      return {};
    }
    if (const End end = raiseRegularization("a control Hessian Quu is indefinite")) return end;
  }
}

// Eq. (6)
double FddpIterations::calcGradient() const {
  double gradient = 0;
  for (int k = 0; k < N_; ++k) {
    const VectorXd& Qu = memory_.backward.sweep().nodes()[k].Qu;
    if (memory_.boxes.empty()) {
      gradient += Qu.squaredNorm();
    } else {
      gradient += (-Qu).cwiseMax(memory_.boxes[k].lower).cwiseMin(memory_.boxes[k].upper).squaredNorm();
    }
  }
  return gradient;
}

bool FddpIterations::isOptimal() {
  if (!isStationary() || !memory_.lagrangian.isSatisfied()) return false;
  if (line_.gradient > options_.gradient_tolerance) summary_.message = kStalled;
  return true;
}

// alpha that the next line search starts with, where models are too flat (docs/solver.md).
void FddpIterations::chooseFirstStep() {
  const double alpha = accepted_->alpha;
  first_step_ = 1;
  const bool creeps = alpha < 1 && last_step_ < 1 && line_.violation < kClose;
  if (!creeps || line_.gap > kSmallGap) return;
  const double curvature =
      2 * (accepted_->merit - calcMerit() - alpha * foreseen_.slope) / (alpha * alpha);  // of Eq. (1), as it is
  const double foreseen = foreseen_.curvature;
  if (foreseen > 0 && curvature > kSteep * foreseen) first_step_ = std::max(kShortestFirst, foreseen / curvature);
}

void FddpIterations::acceptStep() {
  chooseFirstStep();
  std::swap(trajectory_, accepted_->nodes);
  if (memory_.rollout.hasEvaluations()) {
    memory_.evaluations.swapTrial();
  } else {
    memory_.evaluations.outdate();
  }
  line_.step = accepted_->alpha;
  accepted_merit_ = accepted_->merit;
  closed_merit_.reset();
  model_error_.reset();
  if (accepted_->alpha == 1) {
    closed_merit_ = accepted_->merit + accepted_->closing_cost;
    model_error_ = std::abs(calcMerit() - *closed_merit_ - calcForeseen());
  }
  summary_.cost = accepted_->cost;
  summary_.gap = accepted_->gap_max;
  ++summary_.iterations;
}

FddpIterations::End FddpIterations::raiseRegularizationOrStall() {
  if (!isRounding()) return raiseRegularization("no step is acceptable");
  stalled_ = swept_ = true;
  return {};
}

FddpIterations::End FddpIterations::raiseRegularization(const char* reason) {
  if (isInterrupted()) return FddpTermination::Interrupted;
  regularization_ *= options_.regularization_increase;
  if (regularization_ <= options_.max_regularization) return {};
  AugmentedLagrangian& lagrangian = memory_.lagrangian;
  // A larger penalty lifts what is left to gain over the rounding of the merit.
  if (lagrangian.isNear() && lagrangian.updateMultipliers(getIterate(), line_.cost)) {
    updated_ = true;
    resetRegularization();
    return {};
  }
  if (!lagrangian.isSatisfied() && lagrangian.restore(getIterate(), line_.cost)) {
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
void FddpIterations::resetRegularization() {
  regularization_ = options_.initial_regularization;
  stalled_ = swept_ = false;
  closed_merit_.reset();
}

FddpTermination FddpIterations::endViolated() {
  summary_.message =
      "near this iterate the constraints cannot all be satisfied: " + memory_.lagrangian.describeWorst(problem_);
  return memory_.lagrangian.dominates(line_.cost) ? FddpTermination::Infeasible : FddpTermination::RegularizationMax;
}

// Logs an accepted step, and decides whether to continue.
FddpIterations::End FddpIterations::checkProgress() {
  line_.seconds = calcSecondsSince(start_);
  summary_.log.push_back(line_);
  if (observer_.callback && observer_.callback(line_, trajectory_) == FddpAction::Stop)
    return FddpTermination::Interrupted;

  const bool newton = line_.step == 1 && line_.regularization <= options_.min_regularization;
  const bool closed = isClosed() && summary_.gap <= options_.gap_tolerance;
  stalled_ =
      newton && closed && std::abs(calcMerit() - accepted_merit_) < options_.cost_tolerance * std::abs(line_.cost);
  if (stalled_ && memory_.lagrangian.isEmpty()) {
    summary_.message = kStalled;
    return FddpTermination::Converged;
  }
  if (summary_.iterations >= max_iterations_) return FddpTermination::MaxIterations;
  return {};
}

// To the length of the accepted step.
void FddpIterations::adaptRegularization() {
  if (line_.step > options_.long_step) {
    regularization_ = std::max(options_.min_regularization, regularization_ / options_.regularization_decrease);
  } else if (line_.step <= options_.short_step) {
    regularization_ = std::min(options_.max_regularization, regularization_ * options_.regularization_increase);
  }
}

void FddpIterations::finish(FddpTermination termination) {
  summary_.termination = termination;
  if (!memory_.lagrangian.isEmpty()) {
    if (termination == FddpTermination::Converged) memory_.lagrangian.adoptMultipliers(getIterate());
    summary_.violation = memory_.lagrangian.violation();
    summary_.complementarity = memory_.lagrangian.complementarity();
    summary_.multiplier = memory_.lagrangian.largestMultiplier();
    summary_.penalty = memory_.lagrangian.penalty();
    summary_.multiplier_updates = memory_.lagrangian.numUpdates();
  }
  summary_.seconds = calcSecondsSince(start_);
  summary_.evaluate_seconds = memory_.evaluations.getSeconds();
  summary_.linearizations = memory_.backward.numLinearized();
  summary_.linearize_seconds = memory_.backward.linearizeSeconds();
  summary_.sweep_seconds += memory_.backward.sweepSeconds();
  summary_.rollout_seconds = memory_.rollout.getSeconds();
  summary_.search_seconds = memory_.rollout.getSearchSeconds();
  const bool judged = termination == FddpTermination::Converged || termination == FddpTermination::RegularizationMax ||
                      termination == FddpTermination::Infeasible;
  if (judged && line_.step == 0) {  // the iterate from which no step was taken
    line_.seconds = summary_.seconds;
    summary_.log.push_back(line_);
    if (observer_.callback) observer_.callback(line_, trajectory_);
  }
  if (!summary_.message.empty()) return;
  switch (termination) {
    case FddpTermination::Converged:
      summary_.message = "the gradient vanishes and the gaps are closed";
      break;
    case FddpTermination::MaxIterations:
      summary_.message = "the iteration limit was reached";
      break;
    case FddpTermination::Interrupted:
      summary_.message = "stopped by the caller";
      break;
    case FddpTermination::RegularizationMax:
    case FddpTermination::Infeasible:
    case FddpTermination::Failed:
      break;
  }
}

}  // namespace bielle
