#include "bielle/motion/solve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "bielle/dynamics/linkage.h"
#include "model/number_text.h"
#include "motion/applied_options.h"
#include "motion/attempts.h"
#include "motion/feasibility.h"
#include "motion/half_cycle.h"
#include "motion/join.h"
#include "motion/refinement.h"

namespace bielle {
namespace {

constexpr int kMostMargins = 3;  // times that margins grow: another linkage may then come near a dead point

FddpOptions dampGuess(FddpOptions options) {
  options.initial_regularization = std::max(options.initial_regularization, kGuessRegularization);
  return options;
}

// "converged, 12 iterations, 0.21 s"
std::string format(const FddpSummary& summary) {
  return getName(summary.termination) + std::string(", ") + std::to_string(summary.iterations) + " iterations, " +
         formatNumber(summary.seconds, "%.2f") + " s";
}

bool areKeptFromDeadPoints(const LimitOptions& limits) { return limits.enforced && limits.dead_point_margin > 0; }

// The second solve, with what both took.
FddpSummary addUp(const FddpSummary& first, FddpSummary second) {
  addWork(first, second);
  return second;
}

// What a failure may come from: linkages that are near a dead point where the motion is nearest to one; empty for none.
std::string describeDeadPoints(const Motion& motion, const MotionRecord& record) {
  if (!areKeptFromDeadPoints(motion.problem_options.limits)) return "";
  std::string near;
  for (const DeadPointTrace& linkage : traceDeadPoints(motion.problem->model(), record.q))
    if (linkage.getNearest().distance < kNearDeadPoint)
      near += (near.empty() ? "" : ", ") + linkage.output + " " + formatDistance(linkage.getNearest()) + " at " +
              formatNumber(record.time[linkage.getNearestNode()], "%.3g") + " s, " +
              formatDistance(linkage.points.front()) + " at the start";
  return near.empty()
             ? ""
             : "; linkages come near dead points, where motor and joint hardly move each other (rad or m): " + near +
                   "; start farther from them, or request less motion towards them";
}

// An optimum whose stages are still too long is one of equations that the robot does not obey: it has not converged to a motion.
void refuseLongStages(const MotionRecord& record, Solution& solution) {
  const double error = calcStepError(solution.motion.problem->model(), record);
  if (!(error > kAllowedStepError)) return;
  const std::string near = describeDeadPoints(solution.motion, record);
  solution.summary.termination = FddpTermination::Failed;
  solution.summary.message =
      "the time step is too coarse for this motion: across a stage, velocities differ from the integrated "
      "accelerations by up to " +
      formatNumber(100 * error, "%.2g") + " % of the largest acceleration" +
      (near.empty() ? "; request a slower or shorter motion, or set a shorter time_step" : near);
}

// Of a motion that was made of a request.
class RequestSolver {
 public:
  RequestSolver(const Motion& motion, const SolveOptions& options, const SolveObserver& observer)
      : motion_(motion), options_(options), observer_(observer) {
    // Who stops one solve stops those after it.
    observer_.motion.callback = [this, &observer](const FddpIteration& line, const ShootingTrajectory& nodes) {
      const auto& callback = observer.motion.callback;
      stopped_ = stopped_ || (callback && callback(line, nodes) == FddpAction::Stop);
      return stopped_ ? FddpAction::Stop : FddpAction::Continue;
    };
  }

  Solution solve() {
    tellDeadPoints();
    tellHalf();
    const bool from_parts = !options_.start && !motion_.request->parts.empty();
    const FddpOptions from_guess = dampGuess(options_.solver);
    FddpOptions again = options_.solver;
    StartingPoint start = options_.start.value_or(StartingPoint{motion_.guess});
    if (from_parts) start.trajectory = startFromParts();
    FddpOptions solver = options_.start || from_parts ? options_.solver : from_guess;
    solver.multiple_shooting = solver.multiple_shooting || options_.start.has_value();  // its nodes may jump about
    const ObjectiveOptions& objective = motion_.problem_options.objective;
    if (objective.objective != Objective::Effort) {
      if (!objective.scale) {
        startFromEffort(solver, start);
        solver = again;
      }
      solver.acceptable_decrease = again.acceptable_decrease = 0;  // costs of other objectives fall slowly all the way
    }
    Solution solution = solveApart(solver, again, std::move(start));
    MotionRecord record = makeRecord(solution.motion, solution.trajectory);
    if (!solution.converged()) {
      if (solution.summary.termination != FddpTermination::Interrupted)
        solution.summary.message += describeDeadPoints(solution.motion, record);
      return solution;
    }
    const std::optional<RefinedMotion> refined = refineStages(solution.motion, record);
    if (refined) improve(refined->motion, refined->start, again, "with stages half as long", solution, record);
    if (const auto apart = avoidDeadPoints(refined ? refined->motion : solution.motion, record))
      improve(*apart, {apart->guess}, from_guess, "with linkages farther from dead points", solution, record);
    const bool in_vain = apart_ && solution.motion.problem_options.limits.dead_point_margins ==
                                       motion_.problem_options.limits.dead_point_margins;
    for (int i = apart_ ? 1 : 0; i < kMostMargins && options_.keep_apart && !in_vain; ++i) {
      const auto apart = keepFromDeadPoints(solution.motion, record);
      if (!apart || !keepApart(*apart, again, solution, record)) break;
    }
    refuseLongStages(record, solution);
    if (!refined && solution.converged()) warnOfMovingSoles(solution, record);
    return solution;
  }

 private:
  // Looks at dead points as soon as the course of the motion is clear: a motion that is solved again needs no end.
  Solution solveApart(const FddpOptions& solver, const FddpOptions& again, StartingPoint start) {
    constexpr double kClear = 0.01;  // violation, gaps, and change of the cost by a full step, relative to it
    double last_cost = std::numeric_limits<double>::infinity(), last_step = 0;
    bool looks =
        options_.keep_apart && !motion_.cycle && motion_.problem_options.objective.objective != Objective::PeakTorque;
    FddpObserver observer = observer_.motion;
    observer.callback = [&](const FddpIteration& line, const ShootingTrajectory& nodes) {
      if (observer_.motion.callback(line, nodes) == FddpAction::Stop) return FddpAction::Stop;
      const double change = line.cost - std::exchange(last_cost, line.cost);
      const bool rests = last_step == 1 && std::abs(change) <= kClear * std::abs(line.cost);
      last_step = line.step;
      if (!looks || !rests || line.violation > kClear || line.gap > kClear) return FddpAction::Continue;
      looks = false;
      apart_ = keepFromDeadPoints(motion_, makeRecord(motion_, nodes));
      return apart_ ? FddpAction::Stop : FddpAction::Continue;
    };
    Solution solution = solveAlone(motion_, solver, observer, std::move(start));
    if (!apart_) return solution;
    MotionRecord record = makeRecord(motion_, solution.trajectory);
    keepApart(*apart_, again, solution, record);
    if (solution.converged()) return solution;
    tell("going on without");
    Solution rest = solveAlone(motion_, again, observer_.motion, {solution.trajectory, solution.multipliers});
    rest.summary = addUp(solution.summary, std::move(rest.summary));
    return rest;
  }

  // Of stages that are not halved: those of a given length, of sequences, free durations and the least peak torque.
  void warnOfMovingSoles(const Solution& solution, const MotionRecord& record) const {
    const double moved = observer_.warn && record.has_midpoints ? calcSoleMotion(solution.motion, record) : 0;
    if (!(moved > kLargestSlip)) return;
    const Option* option = motion_.request->options.find("time_step");
    const bool is_given = option && std::get<double>(option->value) != 0;
    const double step = solution.motion.schedule.phases.front().dt;
    // Soles move by the square of the step; a swing may come lower than they do.
    const double shorter = step * std::min(0.5, 0.75 * std::sqrt(kLargestSlip / moved));
    observer_.warn(
        "warning: corners of standing soles move by up to " + formatNumber(1e3 * moved, "%.2g") +
        " mm between nodes, in stages of " + formatNumber(step) + " s" + (is_given ? ", as given" : "") + "; " +
        (is_given ? "leave time_step out, or " : "") +
        (option ? "set time_step=" + formatNumber(shorter, "%.2g") : "set a shorter time_step of its motions"));
  }

  void tellHalf() const {
    if (!motion_.cycle || !observer_.tell) return;
    std::string why;
    tell(HalfCycle::find(motion_, why) ? "solving one step of the cycle, whose other step is its mirror image"
                                       : "solving both steps of the cycle, which is not its own mirror image: " + why);
  }

  void tellDeadPoints() const {
    const LimitOptions& limits = motion_.problem_options.limits;
    const Model& model = motion_.problem->model();
    if (!areKeptFromDeadPoints(limits) || !(observer_.tell || observer_.warn)) return;
    std::string list, near;
    for (const DeadPointTrace& linkage :
         traceDeadPoints(model, motion_.problem->initialState().head(model.nq()).transpose())) {
      const std::string distance = linkage.output + " " + formatDistance(linkage.getNearest());
      list += (list.empty() ? "" : "; ") + distance;
      if (linkage.getNearest().distance < kNearDeadPoint) near += (near.empty() ? "" : "; ") + distance;
    }
    if (!list.empty()) tell("distance from dead points at the start (rad or m): " + list);
    for (const LinkageLeftOut& linkage : listLinkagesLeftOut(model, motion_.problem->initialState().head(model.nq())))
      if (linkage.has_motors && observer_.warn)
        observer_.warn("warning: nothing keeps the linkage of " + linkage.name +
                       " from its dead points, since it has " + linkage.why);
    const double margin = limits.dead_point_margin;
    if (!near.empty() && observer_.warn)
      observer_.warn("warning: this motion starts near a dead point, where motor and joint hardly move each other (" +
                     near + "): the transmission ratio is kept within " + formatNumber(margin, "%.2g") + " to " +
                     formatNumber(1 / margin, "%.2g") + " times that at the start; give a reference farther from it");
  }

  // Solves a motion in place of one whose stages are too long, and takes it if its own are less so.
  void improve(const Motion& motion, const StartingPoint& start, const FddpOptions& solver, const std::string& how,
               Solution& solution, MotionRecord& record) const {
    tell("the time step is too coarse for this motion: solving again " + how);
    Solution improved = solveAlone(motion, solver, observer_.motion, start);
    MotionRecord improved_record = makeRecord(improved.motion, improved.trajectory);
    if (improved.converged() &&
        calcStageExcess(improved.motion, improved_record) < calcStageExcess(solution.motion, record)) {
      improved.summary = addUp(solution.summary, std::move(improved.summary));
      solution = std::move(improved);
      record = std::move(improved_record);
      return;
    }
    solution.summary = addUp(improved.summary, std::move(solution.summary));
    if (observer_.warn)
      observer_.warn(how + ": " + getName(improved.summary.termination) +
                     (improved.converged() ? ", but not better" : "") + "; the previous motion is kept");
  }

  // Solves a motion in place of one that comes near dead points, and takes it if it converges and its stages are no worse.
  bool keepApart(const RefinedMotion& apart, FddpOptions solver, Solution& solution, MotionRecord& record) const {
    constexpr int kMostIterations = 60;  // it begins at a solution
    std::string margins;
    for (const auto& [linkage, margin] : apart.motion.problem_options.limits.dead_point_margins)
      margins += (margins.empty() ? "" : "; ") + linkage + " " + formatNumber(margin, "%.2g");
    tell("linkages come near dead points: solving again with margins: " + margins);
    solver.max_iterations = std::min(solver.max_iterations, kMostIterations);
    Solution kept = attempt(apart.motion, solver, observer_.motion, apart.start);
    MotionRecord kept_record = makeRecord(kept.motion, kept.trajectory);
    if (kept.converged() &&
        calcStageExcess(kept.motion, kept_record) <= std::max(1.0, calcStageExcess(solution.motion, record))) {
      kept.summary = addUp(solution.summary, std::move(kept.summary));
      solution = std::move(kept);
      record = std::move(kept_record);
      return true;
    }
    solution.summary = addUp(kept.summary, std::move(solution.summary));
    return false;
  }

  ShootingTrajectory startFromParts() const {
    const Model& model = motion_.problem->model();
    const auto report = [this](const std::string& part, const FddpSummary& summary) {
      tell(part + " alone: " + format(summary));
    };
    SolveOptions options;
    options.solver = options_.solver;
    ShootingTrajectory whole = solveParts(model, listParts(*motion_.request),
                                          makeStandingRobot(model, motion_.problem->initialState().head(model.nq())),
                                          makeEffort(), options, observer_.part, report);
    fitTimings(*motion_.problem, whole);
    return whole;
  }

  // The same problem of least effort.
  ProblemOptions makeEffort() const {
    ProblemOptions problem = motion_.problem_options;
    problem.objective = {};
    problem.objective.regeneration = motion_.problem_options.objective.regeneration;  // of reported energies
    return problem;
  }

  // Scales the motion by that of least effort, from which it starts.
  void startFromEffort(const FddpOptions& solver, StartingPoint& start) {
    const Model& model = motion_.problem->model();
    ProblemOptions problem = motion_.problem_options;
    const Motion effort = makeMotion(model, *motion_.request, makeEffort());
    if (!options_.start) {
      tell("starting with the motion of least effort:");
      const Solution least = solveAlone(effort, solver, observer_.motion, std::move(start));
      tell("least effort: " + format(least.summary));
      tell(std::string("continuing with ") + getName(problem.objective.objective) + ":");
      start = {least.trajectory};
    }
    problem.objective = scaleObjective(effort, start.trajectory, problem.objective, problem.limits);
    motion_ = makeMotion(model, *motion_.request, problem);
  }

  void tell(const std::string& line) const {
    if (observer_.tell) observer_.tell(line);
  }

  Motion motion_;
  std::optional<RefinedMotion> apart_;  // what solveApart() has tried
  const SolveOptions& options_;
  SolveObserver observer_;
  bool stopped_ = false;
};

}  // namespace

FddpOptions makeMotionSolverOptions() {
  FddpOptions out;
  out.acceptable_decrease = 1e-4;
  return out;
}

Solution solve(const Motion& motion, const SolveOptions& options, const SolveObserver& observer) {
  if (options.keep_apart) checkFeasibility(motion, options.start ? &*options.start : nullptr, observer.warn);
  if (motion.request && options.refine) return RequestSolver(motion, options, observer).solve();
  FddpOptions solver = options.start ? options.solver : dampGuess(options.solver);
  if (motion.problem_options.objective.objective != Objective::Effort) solver.acceptable_decrease = 0;
  return solveAlone(motion, solver, observer.motion, options.start.value_or(StartingPoint{motion.guess}));
}

ShootingTrajectory solveParts(const Model& model, const std::vector<SequencePart>& parts, StandingRobot standing,
                              const ProblemOptions& problem, const SolveOptions& options, const FddpObserver& observer,
                              const std::function<void(const std::string& part, const FddpSummary&)>& report) {
  ShootingTrajectory whole;
  for (const SequencePart& part : parts) {
    MotionPlan plan = part.plan(model, standing);
    standing = makeStandingRobot(model, plan.q_end);
    ProblemOptions own = problem;
    own.timings = selectTimings(problem.timings, plan.schedule);
    Solution solution = bielle::solve(makeMotion(model, std::move(plan), own), options, {observer, {}, {}, {}});
    if (report) report(part.name, solution.summary);
    joinTrajectories(solution.trajectory, whole);
  }
  return whole;
}

}  // namespace bielle
