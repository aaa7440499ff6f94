#include "simulation/plan.h"

#include <filesystem>

#include "bielle/model/error.h"
#include "io/motion_registry.h"

namespace bielle::simulation {
namespace {

constexpr int kMaxIterations = 200;  // more than a motion takes from its own solution

// Limits given by motor are recorded with the options of the motion.
LimitOptions readLimits(const MotionSummary& summary) {
  LimitOptions limits;
  const auto read = [&summary](const std::string& prefix, std::map<std::string, double>& to) {
    for (const auto& [name, value] : summary.requested)
      if (name.rfind(prefix, 0) == 0) to[name.substr(prefix.size())] = value;
  };
  read(kEffortLimit, limits.efforts);
  read(kVelocityLimit, limits.velocities);
  read(kPowerLimit, limits.powers);
  for (const auto& [name, value] : summary.requested)
    if (name == kDeadPointMargin) limits.dead_point_margin = value;
  return limits;
}

LoadedRobot loadRobotOf(const MotionSummary& summary) {
  std::error_code error;
  return loadRobot(std::filesystem::is_regular_file(summary.robot_file, error) ? summary.robot_file : summary.robot);
}

}  // namespace

std::unique_ptr<Plan> readPlan(const std::string& directory, PlanControl control) {
  auto plan = std::make_unique<Plan>();
  plan->summary = readSummary(directory);
  const MotionSummary& summary = plan->summary;
  if (summary.model != "closed")
    throw ModelError(summary.file, "model '" + summary.model + "'", "it is not a motion of the closed robot",
                     "transfer it with `bielle lift`, or solve it without --model serial");
  plan->robot = loadRobotOf(summary);
  const Model& model = plan->robot.model;
  MotionPlan request = remakeRequest(summary).plan(model, makeStandingPosture(model));
  fixTimings(summary.timings, summary.step, request.schedule, request.stages);
  ProblemOptions options(summary.formulation, summary.step);
  options.limits = readLimits(summary);
  options.objective = summary.objective;
  Motion motion = makeMotion(model, std::move(request), options);
  plan->ground = motion.ground;
  plan->schedule = motion.schedule;
  setGuess(readResultRecord(directory), motion);
  if (control == PlanControl::Open) {
    plan->policy = std::make_unique<Policy>(makePolicy(motion, motion.guess));
    return plan;
  }
  if (summary.objective.objective == Objective::PeakTorque)
    throw ModelError(summary.file, "objective 'peak-torque'", "the gains of its solver let no torque exceed the peak",
                     "give --control open, or solve the motion for another objective");
  FddpOptions solver_options;
  solver_options.max_iterations = kMaxIterations;
  if (motion.bounded) solver_options.bounds = ControlBounds::Enforce;
  Fddp solver(solver_options);
  const FddpSummary solved = solver.solve(*motion.problem, motion.guess);
  if (solved.termination != FddpTermination::Converged)
    throw ModelError(summary.file, "gains", std::string("the motion solved again is ") + getName(solved.termination),
                     "give a motion that converged, or --control open");
  plan->iterations = solved.iterations;
  // The sweep is about the trajectory unless the last iteration still took a step.
  if (!solved.log.empty() && solved.log.back().step > 0) solver.solve(*motion.problem, motion.guess);
  plan->policy = std::make_unique<Policy>(makePolicy(motion, motion.guess, solver));
  return plan;
}

}  // namespace bielle::simulation
