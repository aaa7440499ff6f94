#include "motion/attempts.h"

#include <algorithm>
#include <utility>

#include "motion/applied_options.h"
#include "motion/half_cycle.h"
#include "motion/mended_guess.h"
#include "motion/periodic_motion.h"
#include "solve/peak_problem.h"

namespace bielle {
namespace {

constexpr double kCautious = 1e-2;  // regularization of a second attempt
// A first attempt by multiple shooting is given up if after this many iterations constraints or gaps are open by more than kFar.
constexpr int kPatience = 80;
constexpr double kFar = 0.03;

// Whether a problem has these rows of constraints at its nodes.
bool haveRows(const ShootingProblem& problem, const Multipliers& multipliers) {
  if (!(multipliers.penalty > 0) || static_cast<int>(multipliers.values.size()) != problem.numStages() + 1)
    return false;
  for (int k = 0; k <= problem.numStages(); ++k)
    if (multipliers.values[k].size() != problem.constraintSize(k)) return false;
  return true;
}

// The half of a cycle that is solved, and the observer that sees the costs of the whole.
FddpObserver makeWholeObserver(const FddpObserver& observer) {
  FddpObserver whole = observer;
  if (observer.callback)
    whole.callback = [&observer](FddpIteration line, const ShootingTrajectory& iterate) {
      line.cost *= 2;
      return observer.callback(line, iterate);
    };
  return whole;
}

FddpResult solveCycle(const PeriodicProblem& problem, const StartingPoint& start, const FddpOptions& solver,
                      const FddpObserver& observer) {
  Multipliers first = problem.wrap(start.multipliers);
  first = haveRows(problem, first) ? Multipliers{first.values, solver.constraints.initial_penalty} : Multipliers();
  FddpResult result = bielle::solve(problem, problem.wrap(start.trajectory), solver, observer, first);
  result.trajectory = problem.unwrap(result.trajectory);
  result.multipliers = problem.unwrap(std::move(result.multipliers));
  return result;
}

Solution attemptCycle(const Motion& motion, const FddpOptions& solver, const FddpObserver& observer,
                      const StartingPoint& start) {
  std::string why;
  Solution out{motion, {}, {}};
  if (const std::optional<HalfCycle> half = HalfCycle::find(motion, why)) {
    const PeriodicProblem problem(half->problem(), [&half](const VectorXd& x) { return half->mapState(x); });
    FddpResult result = solveCycle(problem, half->take(start), solver, makeWholeObserver(observer));
    out.trajectory = half->unfold(result.trajectory);
    out.multipliers = half->unfold(result.trajectory, result.multipliers);
    out.summary = std::move(result.summary);
    out.summary.cost *= 2;
    for (FddpIteration& line : out.summary.log) line.cost *= 2;
  } else {
    FddpResult result = solveCycle(*makePeriodicProblem(motion), start, solver, observer);
    out.trajectory = std::move(result.trajectory);
    out.multipliers = std::move(result.multipliers);
    out.summary = std::move(result.summary);
  }
  if (out.converged()) setCyclicFeedback(out);
  return out;
}

}  // namespace

Solution attempt(const Motion& motion, const FddpOptions& solver, const FddpObserver& observer,
                 const StartingPoint& start) {
  if (motion.cycle) return attemptCycle(motion, solver, observer, start);
  const std::unique_ptr<PeakProblem> peak = makePeakProblem(motion);
  const ShootingProblem& problem = peak ? static_cast<const ShootingProblem&>(*peak) : *motion.problem;
  // The penalty that a solve ended with is too stiff for another motion.
  Multipliers first;
  if (haveRows(problem, start.multipliers)) first = {start.multipliers.values, solver.constraints.initial_penalty};
  FddpResult result =
      bielle::solve(problem, peak ? peak->wrap(start.trajectory) : start.trajectory, solver, observer, first);
  Solution out{motion, peak ? peak->unwrap(result.trajectory) : std::move(result.trajectory), std::move(result.summary),
               std::move(result.multipliers)};
  if (!peak) out.gains = std::move(result.gains);
  return out;
}

void addWork(const FddpSummary& before, FddpSummary& summary) {
  for (const auto count : {&FddpSummary::iterations, &FddpSummary::linearizations, &FddpSummary::sweeps,
                           &FddpSummary::rollouts, &FddpSummary::searches})
    summary.*count += before.*count;
  for (const auto seconds : {&FddpSummary::seconds, &FddpSummary::evaluate_seconds, &FddpSummary::linearize_seconds,
                             &FddpSummary::sweep_seconds, &FddpSummary::rollout_seconds, &FddpSummary::search_seconds})
    summary.*seconds += before.*seconds;
}

namespace {

// The better of two attempts, with what both took.
Solution join(Solution first, Solution second) {
  const bool both = first.summary.termination == FddpTermination::Infeasible &&
                    second.summary.termination == FddpTermination::Infeasible;
  const bool is_first = both && first.summary.violation < second.summary.violation;
  Solution &better = is_first ? first : second, &other = is_first ? second : first;
  std::vector<FddpIteration> log = first.summary.log;
  log.insert(log.end(), second.summary.log.begin(), second.summary.log.end());
  better.summary.log = std::move(log);
  better.summary.multiplier_updates += other.summary.multiplier_updates;
  addWork(other.summary, better.summary);
  if (both) better.summary.message += "; the better of two attempts";
  return std::move(better);
}

}  // namespace

Solution solveAlone(const Motion& motion, const FddpOptions& options, const FddpObserver& observer,
                    StartingPoint start) {
  bool lost = false;
  FddpObserver patient = observer;
  patient.callback = [&](const FddpIteration& line, const ShootingTrajectory& nodes) {
    if (observer.callback && observer.callback(line, nodes) == FddpAction::Stop) return FddpAction::Stop;
    lost = line.iteration >= kPatience && std::max(line.violation, line.gap) > kFar;
    return lost ? FddpAction::Stop : FddpAction::Continue;
  };
  Solution result = attempt(motion, options, options.multiple_shooting ? patient : observer, start);
  if (result.summary.termination == FddpTermination::Failed && result.summary.iterations == 0) {
    restNodes(*motion.problem, start.trajectory);
    start.multipliers = {};
    result = attempt(motion, options, observer, start);
  }
  lost = lost && result.summary.termination == FddpTermination::Interrupted;
  const bool has_other = options.multiple_shooting || options.initial_regularization < kCautious;
  if (lost || (has_other && result.summary.termination == FddpTermination::Infeasible)) {
    FddpOptions other = options;
    other.multiple_shooting = false;
    other.max_iterations = std::max(1, options.max_iterations - (lost ? result.summary.iterations : 0));
    if (!options.multiple_shooting) other.initial_regularization = kCautious;
    start.multipliers = {};
    result = join(std::move(result), attempt(motion, other, observer, start));
  }
  return result;
}

}  // namespace bielle
