#include "bielle/solve/fddp.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "solve/fddp_checks.h"
#include "solve/fddp_solve.h"

namespace bielle {

namespace {

constexpr double kGoodStep = 0.1;   // alpha after which a foreseen decrease is believed
constexpr int kHoldings = 5;        // times that rows are held, at most, after a full step has violated them
constexpr int kDampedHoldings = 2;  // the same with a raised regularization
constexpr double kMuch = 0.1;    // regularization up to which full steps are tried that hold rows, before shorter ones
constexpr double kBetter = 0.5;  // ratio to which each should reduce the errors of models
constexpr double kShortest = 0.4;       // alpha of a step in segments after a full one that went too far
constexpr int kShorter = 5;             // steps tried in segments after a full one
constexpr int kShooting = 20;           // iterations of multiple shooting, at most
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
  for (size_t k = 0; k + 1 < nodes.size(); ++k) {
    out.gains.push_back(nodes[k]);
    out.gains.back().x = memory.evaluations.getUpdated()[k]->x;
  }
  return out;
}

FddpSummary FddpSolve::run() {
  start(shoots_ ? problem_.numStages() : options_.rollout_segments);
  finish(iterate());
  const AugmentedLagrangian& lagrangian = memory_.lagrangian;
  if (summary_.termination == FddpTermination::MaxIterations && lagrangian.violation() > options_.constraints.tolerance)
    summary_.message += "; " + lagrangian.describeWorst(problem_);
  return std::move(summary_);
}

FddpTermination FddpSolve::iterate() {
  while (true) {
    if (const End end = linearize()) return *end;
    if (const End end = findStep()) return *end;
    acceptStep();
    if (const End end = checkProgress()) return *end;
    if (settling_ == 0) adaptRegularization();
  }
}

FddpSolve::End FddpSolve::linearize() {
  if (const End end = evaluate()) return end;
  if (!memory_.lagrangian.canSettle()) settling_ = 0;  // what minimizes violations alone may move far
  if (settling_ == 0 && isCreeping()) settling_ = kSettling;
  if (settling_ > 0) {
    settle();
  } else if (hasSettledMerit()) {
    updateMultipliers();  // now, so that one sweep is enough
  }
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
    if (const End end = searchLine()) return end;
    if (renewed_) continue;
    if (accepted_ && (accepted_->alpha == 1 || !isRounding())) return {};
    if (const End end = raiseRegularizationOrStall()) return end;
  }
}

// Whether the next full step will hardly decrease the merit: models were wrong about the last one by so little. That one must have
// ended at their minimum, which with bounds of controls or regularization it does not.
bool FddpSolve::hasSettledMerit() const {
  const AugmentedLagrangian& lagrangian = memory_.lagrangian;
  const bool newton = memory_.boxes.empty() && !isDamped();
  return model_error_ && newton && lagrangian.canSettle() && !lagrangian.isSatisfied() &&
         lagrangian.isDue(*model_error_);
}

// New multipliers are due once the cost can hardly fall under the old ones.
bool FddpSolve::mustUpdateMultipliers() const {
  const AugmentedLagrangian& lagrangian = memory_.lagrangian;
  if (lagrangian.isEmpty()) return false;
  if (isStationary()) return true;
  const bool first_sweep = regularization_ == first_regularization_;  // a damped one promises little
  return !updated_ && first_sweep && last_step_ >= kGoodStep && lagrangian.isDue(calcForeseen());
}

// Eq. (12), about the same models.
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

// Leaves the accepted trial in accepted_, or renewed_ set. Where constraints and gaps are small, full steps that violate rows are
// cheaper by holding these rows or by more regularization than a shorter one. Far from there, steps that follow a shortened one are
// rolled out in one piece, but for multiple shooting: in segments some motions end where no step is acceptable.
FddpSolve::End FddpSolve::searchLine() {
  shoots_ = shoots_ && line_.gap > kClose && line_.iteration <= kShooting;
  const int segments = shoots_ ? N_ : getNumSegments();
  const bool near = line_.violation < kClose && line_.gap <= kClose;
  const bool settles = near && calcForeseen() <= kClose * std::abs(line_.cost);
  renewed_ = false;
  if (segments > 1 && first_step_ == 1 && (near || shoots_ || last_step_ == 1)) {
    if (tryFullStep(segments)) return {};
    if (settles && tryShorterStep(segments)) return {};
    if (near && hasViolatedFreeRows()) {
      if (const End end = tryHolding(segments)) return end;
      if (accepted_ || renewed_ || regularization_ < kMuch) return {};
    }
  }
  const bool cuts = (near || shoots_) && !mustClose();
  if (!cuts || !tryShorterSteps(segments)) searchInOnePiece(startSearch());
  return {};
}

// A full step in segments, which start where linear models predict them. If it is rejected, a rollout in one piece may
// still succeed.
bool FddpSolve::tryFullStep(int segments) {
  const RolloutInput input = startSearch();
  if (mustClose()) return tryClosed(input, segments);
  Trial& trial = rollOut(input, 1, segments);
  return !isOvershooting(trial) && accept(trial);
}

// A step in segments to the least merit on a parabola through the full one, if that has gone too far because models are too flat.
// (Rows that it has violated tell of far shorter ones.)
bool FddpSolve::tryShorterStep(int segments) {
  Trial& trial = memory_.rollout.getTrial(0);
  if (mustClose() || !trial.ok) return false;
  const double alpha = findMinimum(trial);
  if (alpha < kShortest || alpha >= 1) return false;
  return accept(rollOut(startSearch(), alpha, segments));
}

// Steps in segments, each half as long as the last one, from the full one on that has been rejected. They are far cheaper than
// those in one piece, but leave gaps, by which they may be rejected.
bool FddpSolve::tryShorterSteps(int segments) {
  const RolloutInput input = startSearch();
  double alpha = first_step_ < 1 ? first_step_ : 0.5;
  for (int i = 0; i < kShorter && segments > 1 && !isInterrupted(); ++i, alpha *= 0.5)
    if (accept(rollOut(input, alpha, segments))) return true;
  return false;
}

// Whether the models are wrong about the last trial because of the rows that it violates although they are free in them.
bool FddpSolve::hasViolatedFreeRows() {
  const Trial& trial = memory_.rollout.getTrial(0);
  if (!trial.ok || !memory_.lagrangian.canSettle()) return false;
  const double error = calcModelError(trial);
  return error > 0 && memory_.lagrangian.calcKinks(getIterate(), memory_.evaluations.trial()) > kBetter * error;
}

// Full steps by models in which the rows that the rejected one has violated are held at their bounds, Eq. (15). Rows that such a step
// leaves inside are released again, unless that has led astray.
FddpSolve::End FddpSolve::tryHolding(int segments) {
  AugmentedLagrangian& lagrangian = memory_.lagrangian;
  const Trial& trial = memory_.rollout.getTrial(0);
  const Foreseen plain = foreseen_;
  const double gradient = line_.gradient;
  const int holdings = regularization_ > first_regularization_ ? kDampedHoldings : kHoldings;
  double last_error = calcModelError(trial), last_foreseen = calcForeseen();
  bool keep = false;
  for (int i = 0; i < holdings && trial.ok; ++i) {
    if (!lagrangian.holdViolated(getIterate(), memory_.evaluations.trial(), keep)) {
      // These are the rows that a step to the minimum violates. If it promises little, then the merit is at its minimum.
      renewed_ = i > 0 && !updated_ && lagrangian.isDue(last_foreseen);
      break;
    }
    if (const End end = sweepAgain()) return end;
    line_.gradient = gradient;  // that of the merit
    foreseen_.excess = lagrangian.excess();
    const double foreseen = calcForeseen();
    if (foreseen <= 0) foreseen_ = plain;  // a step that promises nothing must do what the plain one did not
    if (tryFullStep(segments)) return {};
    const double error = foreseen - calcReal(trial);
    const bool worse = error > kBetter * last_error;
    if (worse && keep) break;
    keep = worse;
    last_error = error;
    last_foreseen = foreseen;
  }
  lagrangian.evaluate(getIterate());  // Eq. (12) is of the d of Eq. (10)
  return renewed_ ? updateMultipliers() : sweepAgain();
}

// Over the same models, with new weights of constraints.
FddpSolve::End FddpSolve::sweepAgain() {
  swept_ = false;
  return updateStep();
}

// Whether the step must close the gaps: the last one allowed, and the one after which the gradient vanishes, unless it is so long that
// only a rollout in one piece would close them; then the next one does.
bool FddpSolve::mustClose() const {
  return closing_ || line_.iteration >= max_iterations_ || (vanishesNext() && closesTwice(getNumSegments()));
}

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
