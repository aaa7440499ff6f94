#include "bielle/solve/fddp.h"

#include <cmath>

#include "solve/fddp_checks.h"
#include "solve/fddp_solve.h"

namespace bielle {

namespace {

constexpr double kGoodStep = 0.1;       // alpha after which a foreseen decrease is believed
constexpr int kSettling = 30;           // steps that settle() takes, at most
constexpr double kSettlingFactor = 10;  // of the regularization, between these steps

}  // namespace

FddpResult solve(const ShootingProblem& problem, ShootingTrajectory guess, const FddpOptions& options,
                 const FddpObserver& observer, const Multipliers& start) {
  checkOptions(options);
  FddpMemory memory;
  if (!start.values.empty()) memory.lagrangian.setMultipliers(start);
  FddpResult out;
  out.trajectory = std::move(guess);
  out.summary = FddpSolve(options, problem, out.trajectory, observer, memory).run();
  out.multipliers = memory.lagrangian.multipliers();
  const std::vector<LqSweep::Node>& nodes = memory.backward.sweep().nodes();
  for (size_t k = 0; k + 1 < nodes.size(); ++k) out.gains.push_back(nodes[k]);
  return out;
}

FddpSummary FddpSolve::run() {
  start();
  while (true) {
    if (const End end = linearize()) return finish(*end);
    if (const End end = findStep()) return finish(*end);
    acceptStep();
    if (const End end = checkProgress()) return finish(*end);
    if (settling_ == 0) adaptRegularization();
  }
}

FddpSolve::End FddpSolve::linearize() {
  if (const End end = evaluate()) return end;
  if (!memory_.lagrangian.canSettle()) settling_ = 0;  // what minimizes violations alone may move far
  if (settling_ == 0 && isCreeping()) settling_ = kSettling;
  if (settling_ > 0) settle();
  return updateModels();
}

// Whether the constraints nearly hold and the cost has hardly changed for a while, although models promise more.
bool FddpSolve::isCreeping() const {
  const std::vector<FddpIteration>& log = summary_.log;
  if (acceptable_decrease_ == 0 || !memory_.lagrangian.canSettle() || static_cast<int>(log.size()) < next_settling_)
    return false;
  double least = line_.cost, most = line_.cost;
  for (size_t i = log.size() - kCreeping; i < log.size(); ++i) {
    if (log[i].violation > kClose || log[i].gap > kClose) return false;
    least = std::min(least, log[i].cost);
    most = std::max(most, log[i].cost);
  }
  return most - least <= acceptable_decrease_ * std::abs(line_.cost);
}

// Closes the constraints where the trajectory is: the penalty grows, and the trajectory moves along the constraints the less the
// more that would open them.
void FddpSolve::settle() {
  AugmentedLagrangian& lagrangian = memory_.lagrangian;
  const bool full = last_step_ == 1, falls = lagrangian.settle(getIterate(), full);
  updated_ = true;
  closed_merit_.reset();
  if (--settling_ == 0) {
    lagrangian.endSettling(getIterate());
    resetRegularization();
    next_settling_ = summary_.iterations + kCreeping;
  } else if (!full) {
    regularization_ = std::min(options_.max_regularization, kSettlingFactor * regularization_);
  } else if (!falls) {
    regularization_ = std::max(options_.min_regularization, regularization_ / kSettlingFactor);
  }
}

// Finds an acceptable trial, unless the iterations end at the current iterate.
FddpSolve::End FddpSolve::findStep() {
  while (true) {
    if (const End end = updateStep()) return end;
    if (settling_ > 0 && isClosed() && memory_.lagrangian.isSatisfied()) {
      summary_.message = "the constraints are satisfied and the cost hardly decreases; the iterate is not stationary";
      summary_.acceptable = true;
      return FddpTermination::Converged;
    }
    if (isOptimal()) return FddpTermination::Converged;
    if (mustUpdateMultipliers()) {
      if (const End end = updateMultipliers()) return end;
      continue;
    }
    if (searchLine() && (accepted_->alpha == 1 || !isRounding())) return {};
    if (const End end = raiseRegularizationOrStall()) return end;
  }
}

// New multipliers are due once the cost can hardly fall under the old ones.
bool FddpSolve::mustUpdateMultipliers() const {
  const AugmentedLagrangian& lagrangian = memory_.lagrangian;
  if (lagrangian.isEmpty()) return false;
  if (isStationary()) return true;
  const bool first_sweep = regularization_ == first_regularization_;  // a damped one promises little
  return !updated_ && first_sweep && last_step_ >= kGoodStep && lagrangian.isDue(calcForeseen());
}

// Eq. (12). The next sweep makes new models about the same evaluations.
FddpSolve::End FddpSolve::updateMultipliers() {
  updated_ = true;
  if (!memory_.lagrangian.updateMultipliers(getIterate(), line_.cost)) {
    if (isClosed() || closing_) return endViolated();
    closing_ = true;  // by one more step
    return {};
  }
  closing_ = stalled_ = swept_ = false;
  closed_merit_.reset();
  return {};
}

bool FddpSolve::searchLine() {
  const RolloutInput input = startSearch();
  const int segments = getNumSegments();
  if (segments > 1 && last_step_ == 1 && first_step_ == 1 && tryFullStep(input, segments)) return true;
  return searchInOnePiece(input);
}

// A full step in segments, which start where linear models predict them. If it is rejected, a rollout in one piece may
// still succeed.
bool FddpSolve::tryFullStep(const RolloutInput& input, int segments) {
  if (mustClose()) return tryClosed(input, segments);
  Trial& trial = memory_.rollout.getTrial(0);
  memory_.rollout.cut(input, 1, segments);
  return !isOvershooting(trial) && accept(trial);
}

// Whether the step must close the gaps: the last one allowed, and the one after which the gradient vanishes.
bool FddpSolve::mustClose() const { return closing_ || line_.iteration >= max_iterations_ || vanishesNext(); }

// Whether a full step in segments, after another one, makes too little of what is foreseen. The merit of Eq. (4) counts the
// gaps of both steps differently: before, by what closing them takes of the foreseen decrease, after, by Eq. (8). Here both
// are closed by Eq. (8); otherwise steps that go too far by all of their length would pass, and the iterations could cycle.
bool FddpSolve::isOvershooting(const Trial& trial) const {
  if (!trial.ok || !closed_merit_) return false;
  const double foreseen = calcForeseen() - (calcMerit() - *closed_merit_);
  const double real = *closed_merit_ - trial.merit - trial.closing_cost;
  return real < options_.acceptance * foreseen - calcRounding();
}

}  // namespace bielle
