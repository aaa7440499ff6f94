#include "bielle/io/request_solver.h"

#include <utility>

#include "bielle/io/refinement.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// "converged, 12 iterations, 0.21 s"
std::string format(const FddpSummary& summary) {
  return getName(summary.termination) + std::string(", ") + std::to_string(summary.iterations) + " iterations, " +
         formatNumber(summary.seconds, "%.2f") + " s";
}

bool areKeptFromDeadPoints(const LimitOptions& limits) { return limits.enforced && limits.dead_point_margin > 0; }

std::string formatDistance(const LinkageDistance& of) {
  const bool far = of.distance > kFarthestDeadPoint;
  return far ? "over " + formatNumber(kFarthestDeadPoint, "%.2g") : formatNumber(of.distance, "%.2g");
}

// The second solve, with the iterations and the time of both.
FddpSummary addUp(const FddpSummary& first, FddpSummary second) {
  second.iterations += first.iterations;
  second.seconds += first.seconds;
  return second;
}

}  // namespace

RequestSolver::RequestSolver(const MotionRequest& request, const Model& model, RequestOptions options,
                             RequestObserver observer)
    : request_(request), model_(model), options_(std::move(options)), observer_(std::move(observer)) {
  objective_ = std::exchange(options_.problem.objective, {});
  options_.problem.objective.regeneration = objective_.regeneration;  // of reported energies
  motion_ = makeRequested(request_, model_, options_.problem);
  if (options_.warm_start) setGuess(*options_.warm_start, motion_);
}

MotionResult RequestSolver::solve(const RunInfo& run) {
  tellDeadPoints();
  FddpOptions from_plan = options_.solver;
  from_plan.initial_regularization = kGuessRegularization;
  FddpOptions solver = !options_.warm_start && request_.parts.empty() ? from_plan : options_.solver;
  FddpOptions again = options_.solver;
  if (!options_.warm_start && !request_.parts.empty()) startFromParts();
  if (objective_.objective != Objective::Effort) {
    startFromEffort(solver);
    again.acceptable_decrease = 0;  // costs of other objectives fall slowly all the way
    solver = again;
  }
  Multipliers multipliers;
  if (options_.warm_start) multipliers = options_.warm_start->multipliers;
  const FddpSummary summary = solveMotion(motion_, solver, observer_.motion, &multipliers);
  MotionResult result = makeResult(run, motion_, motion_.guess, summary);
  result.record.multipliers = std::move(multipliers);
  if (!result.converged()) {
    if (result.solver.termination != FddpTermination::Interrupted)
      result.solver.message += describeDeadPoints(result.record);
    return result;
  }
  std::optional<RefinedMotion> refined = refineStages(request_, model_, options_.problem, motion_, result);
  if (refined) improve(refined->motion, again, "with stages half as long", run, result);
  std::optional<Motion> apart =
      avoidDeadPoints(refined ? refined->request : request_, model_, options_.problem, result.record);
  if (apart) improve(*apart, from_plan, "with linkages farther from dead points", run, result);
  refuseLongStages(result);
  return result;
}

void RequestSolver::tellDeadPoints() const {
  if (!areKeptFromDeadPoints(options_.problem.limits)) return;
  std::string list, near;
  for (const LinkageDistance& start : findDeadPoints(model_, motion_.problem->initialState().head(model_.nq()))) {
    list += (list.empty() ? "" : "; ") + start.output + " " + formatDistance(start);
    if (start.distance < kNearDeadPoint)
      near += (near.empty() ? "" : "; ") + start.output + " " + formatDistance(start);
  }
  if (!list.empty()) tell("distance from dead points at the start (rad or m): " + list);
  const double margin = options_.problem.limits.dead_point_margin;
  if (!near.empty() && observer_.warn)
    observer_.warn("warning: this motion starts near a dead point, where motor and joint hardly move each other (" +
                   near + "): the transmission ratio is kept within " + formatNumber(margin, "%.2g") + " to " +
                   formatNumber(1 / margin, "%.2g") + " times that at the start; give a reference farther from it");
}

// What a failure may come from: linkages that are near a dead point where the motion is nearest to one; empty for none.
std::string RequestSolver::describeDeadPoints(const MotionRecord& record) const {
  if (!areKeptFromDeadPoints(options_.problem.limits) || !record.q.allFinite()) return "";
  const std::vector<LinkageDistance> start = findDeadPoints(model_, record, 0, 0),
                                     nearest = findDeadPoints(model_, record, 0, record.q.rows() - 1);
  std::string near;
  for (size_t i = 0; i < start.size(); ++i)
    if (nearest[i].distance < kNearDeadPoint)
      near += (near.empty() ? "" : ", ") + nearest[i].output + " " + formatDistance(nearest[i]) + " at " +
              formatNumber(nearest[i].time, "%.3g") + " s, " + formatDistance(start[i]) + " at the start";
  return near.empty()
             ? ""
             : "; linkages come near dead points, where motor and joint hardly move each other (rad or m): " + near +
                   "; start farther from them, or request less motion towards them";
}

// An optimum whose stages are still too long is one of equations that the robot does not obey: it has not converged to a motion.
void RequestSolver::refuseLongStages(MotionResult& result) const {
  const double error = calcStepError(model_, result.record);
  if (!(error > kAllowedStepError)) return;
  const std::string near = describeDeadPoints(result.record);
  result.solver.termination = FddpTermination::Failed;
  result.solver.message =
      "the time step is too coarse for this motion: across a stage, velocities differ from the integrated "
      "accelerations by up to " +
      formatNumber(100 * error, "%.2g") + " % of the largest acceleration" +
      (near.empty() ? "; request a slower or shorter motion, or set a shorter time_step" : near);
}

// Solves a motion in place of one whose stages are too long, and takes it if its own are less so.
void RequestSolver::improve(Motion& motion, const FddpOptions& solver, const std::string& how, const RunInfo& run,
                            MotionResult& result) const {
  tell("the time step is too coarse for this motion: solving again " + how);
  Multipliers multipliers;
  const FddpSummary summary = solveMotion(motion, solver, observer_.motion, &multipliers);
  MotionResult improved = makeResult(run, motion, motion.guess, addUp(result.solver, summary));
  improved.record.multipliers = std::move(multipliers);
  if (improved.converged() && calcStageExcess(model_, improved) < calcStageExcess(model_, result)) {
    result = std::move(improved);
    return;
  }
  result.solver = addUp(summary, result.solver);
  if (observer_.warn)
    observer_.warn(how + ": " + getName(summary.termination) + (improved.converged() ? ", but not better" : "") +
                   "; the previous motion is kept");
}

// Solves each motion of a sequence by itself.
void RequestSolver::startFromParts() {
  PartsOptions parts;
  parts.problem = options_.problem;
  parts.solver = options_.solver;
  parts.observer = observer_.part;
  parts.report = [this](const std::string& part, const FddpSummary& summary) {
    tell(part + " alone: " + format(summary));
  };
  motion_.guess = solveParts(model_, listParts(request_), makeStandingPosture(model_), parts);
  fitTimings(*motion_.problem, motion_.guess);
}

// Replaces the motion of least effort by that of the objective, which starts from there, or from a given result.
void RequestSolver::startFromEffort(const FddpOptions& solver) {
  if (!options_.warm_start) {
    tell("starting with the motion of least effort:");
    const FddpSummary summary = solveMotion(motion_, solver, observer_.motion);
    tell("least effort: " + format(summary));
    tell(std::string("continuing with ") + getName(objective_.objective) + ":");
  }
  options_.problem.objective = scaleObjective(motion_, objective_, options_.problem.limits);
  Motion motion = makeRequested(request_, model_, options_.problem);
  motion.guess = std::move(motion_.guess);
  motion_ = std::move(motion);
}

void RequestSolver::tell(const std::string& line) const {
  if (observer_.tell) observer_.tell(line);
}

}  // namespace bielle
