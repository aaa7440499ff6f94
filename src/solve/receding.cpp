#include "solve/receding.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "solve/fddp_checks.h"
#include "solve/fddp_iterations.h"

namespace bielle {

namespace {

/// One call of step().
class RecedingStep : private FddpIterations {
 public:
  /// \param last  a summary that is over: its memory is used, and belongs to the new one in the end
  RecedingStep(const RecedingOptions& options, const ShootingProblem& problem, ShootingTrajectory& trajectory,
               const FddpObserver& observer, FddpMemory& memory, FddpSummary& last)
      : FddpIterations(options, options.iterations, problem, trajectory, observer, memory), last_(last) {
    summary_.log.swap(last.log);
    summary_.log.clear();
    summary_.message.swap(last.message);
    summary_.message.clear();
  }
  ~RecedingStep() { last_ = std::move(summary_); }

  void prepare(double regularization) {
    start(options_.rollout_segments);
    regularization_ = std::max(regularization_, regularization);
    FddpIterations::prepare();
  }

  /// \param regularization  of the first sweep, if the initial one is less; then what the next step starts with: more after a
  /// search in vain, else less   \param gap_weight  of the last search, then of this one's
  void run(bool prepared, double& regularization, double& gap_weight, Foresight* foresight) {
    foresight_ = foresight;
    gap_weight_ = gap_weight;
    if (prepared)
      resume();
    else
      start(options_.rollout_segments);
    regularization_ = std::max(regularization_, regularization);
    finish(iterate());
    regularization = rejected_ > 0 ? regularization_ : regularization / options_.regularization_decrease;
    gap_weight = gap_weight_;
  }

 private:
  FddpTermination iterate() {
    while (true) {
      if (const End end = linearize()) return *end;
      if (const End end = findStep()) return *end;
      acceptStep();
      if (const End end = checkProgress()) return *end;
      adaptRegularization();
    }
  }

  // New multipliers come before, so that no iteration linearizes twice.
  End linearize() {
    if (const End end = evaluate()) return end;
    AugmentedLagrangian& lagrangian = memory_.lagrangian;
    if (!lagrangian.isEmpty()) {
      if (prepared_)
        lagrangian.renewFirst(getIterate());
      else
        lagrangian.updateMultipliers(getIterate(), line_.cost);
      lagrangian.hold(getIterate());
    }
    return updateModels();
  }

  // Finds an acceptable trial, unless the iterations end at the current iterate.
  End findStep() {
    while (true) {
      if (const End end = updateStep()) return end;
      if (foresight_ && summary_.iterations + rejected_ + 1 >= max_iterations_)
        foresee(*std::exchange(foresight_, nullptr));
      if (isOptimal()) return FddpTermination::Converged;
      if (stalled_ && isClosed() && !memory_.lagrangian.isEmpty()) {
        if (!memory_.lagrangian.updateMultipliers(getIterate(), line_.cost)) return endViolated();
        stalled_ = swept_ = false;
        continue;
      }
      if (searchLine() && (accepted_->alpha == 1 || !isRounding())) return {};
      const bool rounding = isRounding();
      if (const End end = raiseRegularizationOrStall()) return end;
      // The search took the time of an iteration.
      if (!rounding && summary_.iterations + ++rejected_ >= max_iterations_) {
        memory_.lagrangian.takeBack();
        summary_.log.push_back(line_);
        summary_.message = "no step is acceptable: the iterate is kept";
        return FddpTermination::MaxIterations;
      }
    }
  }

  void foresee(Foresight& foresight) {
    auto& [xs, us] = foresight.nodes;
    xs.resize(foresight.stages + 1, VectorXd(problem_.stateSize()));
    xs[0] = trajectory_.xs[0];
    us.resize(foresight.stages);
    std::vector<IntegrateTask>& tasks = memory_.integrations;
    tasks.clear();
    for (int k = 1; k <= foresight.stages; ++k) tasks.push_back({k, getIterate()[k].get(), &memory_.dx[k], &xs[k]});
    problem_.integrate(tasks.data(), static_cast<int>(tasks.size()), memory_.evaluations.getScratch(0));
    for (int k = 0; k < foresight.stages; ++k) {
      us[k] = trajectory_.us[k] + memory_.du[k];
      if (!memory_.bounds.empty()) us[k] = us[k].cwiseMax(memory_.bounds[k].lower).cwiseMin(memory_.bounds[k].upper);
    }
    if (std::all_of(xs.begin(), xs.end(), [](const VectorXd& x) { return x.allFinite(); })) foresight.use();
  }

  // There is no time for rollouts in one piece, except at the end.
  bool searchLine() {
    least_gap_weight_ = kGapWeightKept * gap_weight_;
    const RolloutInput input = startSearch();
    const int segments = getNumSegments(kShortestSegment);
    if (segments == 1) return searchInOnePiece(input);
    if (!vanishesNext()) return searchInSegments(input, segments);
    return (last_step_ == 1 && first_step_ == 1 && tryClosed(input, segments)) || searchInOnePiece(input);
  }

  // Steps of length 1, 1/4, 1/16, ...
  bool searchInSegments(const RolloutInput& input, int segments) {
    double alpha = 1;
    for (int i = 0; i < options_.num_step_lengths; ++i, alpha *= 0.25) {
      if (isInterrupted()) return false;
      if (accept(rollOut(input, alpha, segments))) return true;
    }
    return false;
  }

  static constexpr int kShortestSegment = 3;     // stages; 48 then make two full batches of segments
  static constexpr double kGapWeightKept = 0.9;  // Eq. (15)

  FddpSummary& last_;
  Foresight* foresight_ = nullptr;  // still to be filled
  int rejected_ = 0;                // searches without an acceptable step
};

}  // namespace

Receding::Receding(const ShootingProblem& problem, const RecedingOptions& options)
    : problem_(&problem), options_(options), memory_(std::make_unique<FddpMemory>()) {
  checkOptions(options_);
}
Receding::~Receding() = default;
Receding::Receding(Receding&&) noexcept = default;
Receding& Receding::operator=(Receding&&) noexcept = default;

const FddpSummary& Receding::step(ShootingTrajectory& trajectory, const FddpObserver& observer, Foresight* foresight) {
  if (!std::exchange(advanced_, false)) regularization_ = gap_weight_ = 0;
  const bool prepared = std::exchange(prepared_, false);
  RecedingStep(options_, *problem_, trajectory, observer, *memory_, summary_)
      .run(prepared, regularization_, gap_weight_, foresight);
  return summary_;
}

void Receding::prepare(ShootingTrajectory& trajectory) {
  if (options_.constraints.penalty_increase != 1)
    throw std::invalid_argument("Receding: only a step with a constant penalty can be prepared");
  prepared_ = false;
  const FddpObserver none;
  RecedingStep(options_, *problem_, trajectory, none, *memory_, summary_).prepare(advanced_ ? regularization_ : 0);
  prepared_ = true;
}

void Receding::advance(ShootingTrajectory& trajectory) {
  const size_t N = trajectory.us.size();
  if (N < 1 || trajectory.xs.size() != N + 1) throw std::invalid_argument("Receding: no trajectory to advance");
  for (size_t k = 0; k < N; ++k) trajectory.xs[k].swap(trajectory.xs[k + 1]);
  for (size_t k = 0; k + 1 < N; ++k) trajectory.us[k].swap(trajectory.us[k + 1]);
  trajectory.xs[N] = trajectory.xs[N - 1];
  if (N > 1) trajectory.us[N - 1] = trajectory.us[N - 2];
  sources_.resize(N + 1);
  for (size_t k = 0; k + 1 < N; ++k) sources_[k] = {static_cast<int>(k) + 1, 1, k > 0};
  for (size_t k : {N - 1, N}) sources_[k] = {static_cast<int>(k), 1, false};
  move(sources_);
}

void Receding::move(const std::vector<NodeSource>& sources) {
  advanced_ = true;
  prepared_ = false;
  memory_->evaluations.move(sources);
  memory_->lagrangian.move(sources);
}

Multipliers Receding::multipliers() const { return memory_->lagrangian.multipliers(); }
void Receding::setMultipliers(const Multipliers& multipliers) {
  prepared_ = false;
  memory_->lagrangian.setMultipliers(multipliers);
  memory_->evaluations.outdate();
}

const Gains& Receding::getGains(int stage) const { return memory_->backward.sweep().nodes()[stage]; }
const NodeEvaluation& Receding::getLinearized(int node) const {
  return *memory_->evaluations.getUpdated().at(static_cast<size_t>(node));
}
void Receding::exchangeEvaluation(int node, std::unique_ptr<NodeEvaluation>& other) {
  if (getEvaluation(node)) memory_->evaluations.exchange(static_cast<size_t>(node), other);
}
const NodeEvaluation* Receding::getEvaluation(int node) const {
  return memory_->evaluations.getFresh(static_cast<size_t>(node));
}

}  // namespace bielle
