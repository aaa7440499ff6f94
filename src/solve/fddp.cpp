#include "bielle/solve/fddp.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "solve/backward_pass.h"
#include "solve/fddp_checks.h"
#include "solve/node_evaluations.h"
#include "solve/rollout.h"
#include "solve/stopwatch.h"

namespace bielle {

namespace {

constexpr double kPenaltyMargin = 0.5;  // rho of Eq. (5)
// Differences of costs below this share of the cost are rounding: they neither accept nor reject a step.
constexpr double kCostRounding = 1e-14;
constexpr double kClosingShare = 0.5;  // of Eq. (4): the most that Eq. (8) may be
constexpr double kGoodStep = 0.1;      // alpha after which a foreseen decrease is believed
constexpr int kShortestSegment = 6;    // stages

}  // namespace

struct Fddp::Workspace {
  NodeEvaluations evaluations;
  AugmentedLagrangian lagrangian;
  BackwardPass backward;
  std::vector<VectorXd> dx, du;  // the models' full step
  Rollout rollout;
  std::vector<ControlBox> bounds;  // of u, N or none
  std::vector<ControlBox> boxes;   // of du, N or none
  std::vector<char> open;          // N: whether the gap after a stage counts as open

  void resize(const ShootingProblem& problem, const FddpOptions& options, int threads);
};

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

namespace {

/// One call of solve(): the numbers of the current iterate and of the step searched from it.
class Run {
 public:
  Run(const FddpOptions& options, const ShootingProblem& problem, ShootingTrajectory& trajectory,
      const FddpObserver& observer, Fddp::Workspace& work)
      : options_(options), problem_(problem), trajectory_(trajectory), observer_(observer), work_(work) {}

  FddpSummary solve();

 private:
  /// Reason for ending the iterations, if they end.
  using End = std::optional<FddpTermination>;

  void start();
  End linearize();
  End evaluate();
  End linearizeAndSweep();
  void updateGaps();
  End findStep();
  End updateStep();
  End updateMultipliers();
  bool searchLine();
  bool tryFullStep(const RolloutInput& input, int segments, double nu);
  bool searchInSegments(const RolloutInput& input, int segments, double nu);
  bool accept(Trial& trial, double nu);
  bool mustUpdateMultipliers() const;
  bool mustClose() const;
  bool closesTwice(int segments) const;
  bool isAcceptable(const Trial& trial, double nu) const;
  void acceptStep();
  End raiseRegularization(const char* reason);
  End checkProgress();
  FddpSummary finish(FddpTermination termination);

  bool isInterrupted() const { return observer_.interrupt && observer_.interrupt->load(); }
  int getNumSegments() const { return std::max(1, std::min(options_.rollout_segments, N_ / kShortestSegment)); }
  bool isClosed() const { return line_.gap <= options_.gap_tolerance; }
  bool isStationary() const { return isClosed() && (stalled_ || line_.gradient <= options_.gradient_tolerance); }
  double calcForeseen() const { return -slope_ - 0.5 * curvature_; }  // decrease by a full step
  double calcMerit() const { return line_.cost + work_.lagrangian.getValue(); }
  double calcGradient() const;

  const FddpOptions& options_;
  const ShootingProblem& problem_;
  ShootingTrajectory& trajectory_;
  const FddpObserver& observer_;
  Fddp::Workspace& work_;

  int N_ = 0;
  Clock::time_point start_ = Clock::now();
  FddpIteration line_;                                    // the iteration under way
  double gap_sum_ = 0;                                    // c, of the gaps that count as open
  double slope_ = 0, curvature_ = 0;                      // Eq. (1)
  double regularization_ = 0, first_regularization_ = 0;  // the latter of the first sweep of an iteration
  int threads_ = 1;
  bool swept_ = false;         // a sweep is still to be looked at
  bool raised_ = false;        // multipliers are new in this iteration
  bool closing_ = false;       // the next step is the last
  bool stalled_ = false;       // the last step left the merit as it was, to rounding
  Trial* accepted_ = nullptr;  // the trial that ends a line search
  int failed_node_ = -1;       // where the first failed trial of a line search failed, and why
  std::string failure_;
  double accepted_merit_ = 0;
  double last_gradient_ = 0, last_step_ = 1;  // of the iteration before
  FddpSummary summary_;
};

FddpSummary Run::solve() {
  start();
  while (true) {
    if (const End end = linearize()) return finish(*end);
    if (const End end = findStep()) return finish(*end);
    acceptStep();
    if (const End end = checkProgress()) return finish(*end);
  }
}

void Run::start() {
  N_ = problem_.numStages();
  checkSizes(problem_, trajectory_);
  threads_ = options_.threads > 0 ? options_.threads : omp_get_max_threads();
  work_.resize(problem_, options_, threads_);
  trajectory_.xs[0] = problem_.initialState();
  for (size_t k = 0; k < work_.bounds.size(); ++k) {
    trajectory_.us[k] = trajectory_.us[k].cwiseMax(work_.bounds[k].lower).cwiseMin(work_.bounds[k].upper);
  }
  regularization_ = options_.initial_regularization;
  summary_.log.reserve(std::min(options_.max_iterations + 1, 10000));
}

Run::End Run::linearize() {
  if (summary_.iterations > 0) {
    last_gradient_ = line_.gradient;
    last_step_ = line_.step;
  }
  line_ = FddpIteration();
  raised_ = false;
  first_regularization_ = regularization_;
  line_.iteration = summary_.iterations + 1;
  for (size_t k = 0; k < work_.boxes.size(); ++k) {
    work_.boxes[k].lower = work_.bounds[k].lower - trajectory_.us[k];
    work_.boxes[k].upper = work_.bounds[k].upper - trajectory_.us[k];
  }
  if (const End end = evaluate()) return end;
  work_.lagrangian.update(work_.evaluations.getIterate());
  if (const End end = linearizeAndSweep()) return end;
  updateGaps();
  line_.violation = work_.lagrangian.getViolation();
  summary_.cost = line_.cost;
  summary_.gap = line_.gap;
  return {};
}

Run::End Run::evaluate() {
  const int failed = work_.evaluations.update(problem_, trajectory_, threads_);
  if (failed < 0) return {};
  const std::string& reason = work_.evaluations.getIterate()[failed]->failure;
  summary_.message = "node " + std::to_string(failed) + ": the problem could not be evaluated";
  if (!reason.empty()) summary_.message += ": " + reason;
  return FddpTermination::Failed;
}

Run::End Run::linearizeAndSweep() {
  const LqRegularization regularization{regularization_, regularization_ * options_.state_regularization_ratio};
  const int failed =
      work_.backward.update({problem_, work_.evaluations, work_.lagrangian, work_.boxes, regularization, threads_});
  swept_ = true;
  if (failed < 0) return {};
  summary_.message = "node " + std::to_string(failed) + ": " + work_.backward.getFailure(failed);
  return FddpTermination::Failed;
}

void Run::updateGaps() {
  const std::vector<StageModel>& models = work_.backward.getModels();
  gap_sum_ = 0;
  for (int k = 0; k <= N_; ++k) {
    line_.cost += models[k].cost;
    if (models[k].gap.size() == 0) continue;
    const double largest = models[k].gap.lpNorm<Eigen::Infinity>();
    line_.gap = std::max(line_.gap, largest);
    work_.open[k] = largest > options_.gap_tolerance;
    if (work_.open[k]) gap_sum_ += models[k].gap.lpNorm<1>();
  }
}

// Finds an acceptable trial, unless the iterations end at the current iterate.
Run::End Run::findStep() {
  while (true) {
    if (isInterrupted()) return FddpTermination::Interrupted;
    if (const End end = updateStep()) return end;
    if (isStationary() && work_.lagrangian.isSatisfied()) return FddpTermination::Converged;
    if (mustUpdateMultipliers()) {
      if (const End end = updateMultipliers()) return end;
      continue;
    }
    if (searchLine()) return {};
    if (const End end = raiseRegularization("no step is acceptable")) return end;
  }
}

// New multipliers are due once the cost can hardly fall under the old ones.
bool Run::mustUpdateMultipliers() const {
  const AugmentedLagrangian& lagrangian = work_.lagrangian;
  if (lagrangian.isEmpty()) return false;
  if (isStationary()) return true;
  const bool first_sweep = regularization_ == first_regularization_;
  return !raised_ && first_sweep && last_step_ >= kGoodStep &&
         calcForeseen() <= lagrangian.getShare() * lagrangian.getGain();
}

// Eq. (12). The next sweep makes new models about the same evaluations.
Run::End Run::updateMultipliers() {
  if (!work_.lagrangian.raise(work_.evaluations.getIterate(), line_.cost)) {
    if (!isClosed() && !closing_) {  // one more step, which closes the gaps
      closing_ = raised_ = true;
      return {};
    }
    summary_.message = "the constraints cannot all be kept: " + work_.lagrangian.describeWorst(problem_);
    return FddpTermination::Infeasible;
  }
  stalled_ = swept_ = false;
  raised_ = true;
  return {};
}

// The sweep, at the smallest regularization from the current one on for which it succeeds. A second sweep needs new
// models, because a sweep overwrites their Hessians; the evaluations are kept.
Run::End Run::updateStep() {
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
double Run::calcGradient() const {
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

// Whether the step must close the gaps: the last one allowed, and the one after which the gradient vanishes if it keeps
// falling at the same rate.
bool Run::mustClose() const {
  const bool last = options_.last_rollout == LastRollout::Closed && line_.iteration >= options_.max_iterations;
  return last || closing_ ||
         line_.gradient * line_.gradient <= options_.gradient_tolerance * std::max(line_.gradient, last_gradient_);
}

// Whether the gaps that Eq. (9) leaves are likely to count as closed.
bool Run::closesTwice(int segments) const {
  double step = 0;
  for (int s = 1; s < segments; ++s) step = std::max(step, work_.dx[s * N_ / segments].lpNorm<Eigen::Infinity>());
  return std::pow(step, 3) <= options_.gap_tolerance;
}

bool Run::searchLine() {
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
  if (segments > 1 && last_step_ == 1 && tryFullStep(input, segments, nu)) return true;
  Rollout& rollout = work_.rollout;
  const int num_trials = rollout.getNumTrials();
  double alpha = 1;
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
bool Run::tryFullStep(const RolloutInput& input, int segments, double nu) {
  Rollout& rollout = work_.rollout;
  Trial& trial = rollout.getTrial(0);
  if (!mustClose()) {
    rollout.cut(input, 1, segments);
    return accept(trial, nu);
  }
  if (!closesTwice(segments)) return false;
  const auto isClosed = [&] { return trial.gap_max <= options_.gap_tolerance; };
  rollout.cut(input, 1, segments);
  if (trial.ok && !isClosed()) rollout.close(input);
  return isClosed() && accept(trial, nu);
}

// All step lengths in turn: a receding horizon has no time for rollouts in one piece.
bool Run::searchInSegments(const RolloutInput& input, int segments, double nu) {
  double alpha = 1;
  for (int i = 0; i < options_.num_step_lengths; ++i, alpha *= 0.5) {
    if (isInterrupted()) return false;
    work_.rollout.cut(input, alpha, segments);
    if (accept(work_.rollout.getTrial(0), nu)) return true;
  }
  return false;
}

bool Run::accept(Trial& trial, double nu) {
  if (!trial.ok && failure_.empty() && trial.failed_node >= 0) {
    failed_node_ = trial.failed_node;
    failure_ = trial.failure;
  }
  accepted_ = trial.ok && isAcceptable(trial, nu) ? &trial : nullptr;
  return accepted_ != nullptr;
}

// Whether the merit of a trial has fallen enough, Eqs. (4) and (8).
bool Run::isAcceptable(const Trial& trial, double nu) const {
  const double alpha = trial.alpha;
  const double foreseen = -alpha * slope_ - 0.5 * alpha * alpha * curvature_ + nu * alpha * gap_sum_;
  const double real = calcMerit() - trial.merit - trial.closing_cost + nu * (gap_sum_ - trial.gap_sum);
  const double rounding = kCostRounding * (std::abs(line_.cost) + std::abs(work_.lagrangian.getValue()));
  const double decrease = std::max(0.0, foreseen);  // boxes make Eq. (4) an approximation
  return real >= options_.acceptance * decrease - rounding &&
         std::abs(trial.closing_cost) <= kClosingShare * decrease + rounding;
}

void Run::acceptStep() {
  std::swap(trajectory_, accepted_->nodes);
  if (work_.rollout.hasEvaluations()) {
    work_.evaluations.swapTrial();
  } else {
    work_.evaluations.outdate();
  }
  line_.step = accepted_->alpha;
  accepted_merit_ = accepted_->merit;
  summary_.cost = accepted_->cost;
  summary_.gap = accepted_->gap_max;
  ++summary_.iterations;
}

Run::End Run::raiseRegularization(const char* reason) {
  if (isInterrupted()) return FddpTermination::Interrupted;
  regularization_ *= options_.regularization_increase;
  if (regularization_ <= options_.max_regularization) return {};
  summary_.message = std::string(reason) + " even at the largest regularization";
  if (!failure_.empty()) summary_.message += "; node " + std::to_string(failed_node_) + ": " + failure_;
  return FddpTermination::RegularizationMax;
}

// After an accepted step: logs it, adapts the regularization to its length, and decides whether to continue.
Run::End Run::checkProgress() {
  line_.seconds = calcSecondsSince(start_);
  summary_.log.push_back(line_);
  if (observer_.callback && observer_.callback(line_) == FddpAction::Stop) return FddpTermination::Interrupted;

  const bool newton = line_.step == 1 && line_.regularization <= options_.min_regularization;
  const bool closed = isClosed() && summary_.gap <= options_.gap_tolerance;
  stalled_ =
      newton && closed && std::abs(calcMerit() - accepted_merit_) < options_.cost_tolerance * std::abs(line_.cost);
  if (stalled_ && work_.lagrangian.isEmpty()) {
    summary_.message = "the cost no longer decreases";
    return FddpTermination::Converged;
  }
  if (summary_.iterations >= options_.max_iterations) return FddpTermination::MaxIterations;
  if (line_.step > options_.long_step) {
    regularization_ = std::max(options_.min_regularization, regularization_ / options_.regularization_decrease);
  } else if (line_.step <= options_.short_step) {
    regularization_ = std::min(options_.max_regularization, regularization_ * options_.regularization_increase);
  }
  return {};
}

FddpSummary Run::finish(FddpTermination termination) {
  summary_.termination = termination;
  if (!work_.lagrangian.isEmpty()) {
    if (termination == FddpTermination::Converged) work_.lagrangian.settle();
    summary_.violation = work_.lagrangian.getViolation();
    summary_.complementarity = work_.lagrangian.getComplementarity();
    summary_.multiplier = work_.lagrangian.getLargestMultiplier();
    summary_.penalty = work_.lagrangian.getPenalty();
    summary_.multiplier_updates = work_.lagrangian.getNumRaises();
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
      summary_.message = "the largest number of iterations is reached";
      break;
    case FddpTermination::Interrupted:
      summary_.message = "stopped from outside";
      break;
    case FddpTermination::RegularizationMax:
    case FddpTermination::Infeasible:
    case FddpTermination::Failed:
      break;
  }
  return std::move(summary_);
}

}  // namespace

Fddp::Fddp(const FddpOptions& options) : options_(options), work_(std::make_unique<Workspace>()) {
  checkOptions(options_);
}
Fddp::~Fddp() = default;
Fddp::Fddp(Fddp&&) noexcept = default;
Fddp& Fddp::operator=(Fddp&&) noexcept = default;

FddpSummary Fddp::solve(const ShootingProblem& problem, ShootingTrajectory& trajectory, const FddpObserver& observer) {
  return Run(options_, problem, trajectory, observer, *work_).solve();
}

Multipliers Fddp::getMultipliers() const { return work_->lagrangian.getMultipliers(); }
void Fddp::setMultipliers(const Multipliers& multipliers) { work_->lagrangian.setMultipliers(multipliers); }

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
