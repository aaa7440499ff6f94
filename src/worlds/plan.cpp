#include "worlds/plan.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/dynamics/ball_cuts.h"
#include "bielle/model/error.h"
#include "bielle/motion/solve.h"
#include "bielle/robots/robot_loader.h"
#include "control/restricted_controller.h"
#include "motion/applied_options.h"
#include "results/interrupt.h"
#include "results/remade_motion.h"

namespace bielle::worlds {
namespace {

// Of predictive control. Feet may land elsewhere than planned, on steps a little; wrenches keep away from the edges of the
// cones, since feedback and errors of the model add to what is planned.
constexpr double kFootholdRoom = 0.4, kFootholdRoomOnSteps = 0.02;  // m
constexpr double kFeedbackMargin = 0.2;
constexpr double kStopShare = 0.5;   // of the margin to dead points that the plan keeps
constexpr int kMaxIterations = 200;  // more than a motion takes from its own solution

// Sets an option of a motion, or of the parts of a sequence, where it has one.
void setWherePresent(const std::string& name, double value, OptionSet& options) {
  for (const auto& [option, before] : options.listValues()) {
    const bool ends = option.size() > name.size() &&
                      option.compare(option.size() - name.size() - 1, std::string::npos, "." + name) == 0;
    if (option == name || ends) options.set(option, value);
  }
}

// Feet stand where they landed, wherever that is, and land where they must.
MotionRequest freeFeet(const Ground& ground, MotionRequest request) {
  setWherePresent("contact_kp", 0, request.options);
  setWherePresent("foothold_room", ground.steps.empty() ? kFootholdRoom : kFootholdRoomOnSteps, request.options);
  setWherePresent("cone_margin", kFeedbackMargin, request.options);
  return request;
}

LoadedRobot loadRobotOf(const MotionSummary& summary) {
  std::error_code error;
  return loadRobot(std::filesystem::is_regular_file(summary.run.robot_file, error) ? summary.run.robot_file
                                                                                   : summary.run.robot);
}

Solution solveUnlessInterrupted(const Motion& motion, const SolveOptions& options) {
  SolveObserver observer;
  observer.motion.interrupt = observer.part.interrupt = &isInterrupted();
  Solution solution = solve(motion, options, observer);
  requireNoInterrupt();
  return solution;
}

// The same motion from a solution, with gains about it: penalties stay small from there, and gains with them.
Solution solveForGains(const std::string& source, const Motion& motion, const ShootingTrajectory& start,
                       int& iterations) {
  SolveOptions options;
  options.solver = FddpOptions();
  options.solver.max_iterations = kMaxIterations;
  options.start = StartingPoint{start};
  options.refine = false;
  Solution solution = solveUnlessInterrupted(motion, options);
  if (!solution.converged())
    throw InputError(source, "motion '" + motion.name + "'",
                     std::string("the solve for its gains ended as: ") + getName(solution.summary.termination),
                     "give a motion that converges, or --control open");
  iterations = solution.summary.iterations;
  // The sweep is about the trajectory unless the last iteration still took a step.
  if (!solution.summary.log.empty() && solution.summary.log.back().step > 0) {
    options.start = StartingPoint{solution.trajectory};
    solution = solveUnlessInterrupted(motion, options);
  }
  return solution;
}

void checkControl(const MotionSummary& summary, PlanControl control) {
  if (summary.objective.objective == Objective::PeakTorque)
    throw InputError(summary.file, "objective 'peak-torque'", "its gains never let a torque exceed the peak",
                     "give --control open, or solve the motion for another objective");
  if (control == PlanControl::Predictive && summary.formulation != Formulation::Reduced)
    throw InputError(summary.file, "formulation 'full'", "predictive control needs states with closed loops",
                     "solve the motion without --formulation full, or give --control gains");
}

// The request with the durations that a solve has chosen.
MotionRequest fixDurations(const MotionSummary& summary, MotionRequest request) {
  request.planner = [planner = request.planner, timings = summary.timings, step = summary.step](
                        const Model& model, const StandingRobot& standing, const OptionSet& options) {
    MotionPlan plan = planner(model, standing, options);
    fixTimings(timings, step, plan.schedule, plan.stages);
    return plan;
  };
  return request;
}

// In states of a model that has fewer joints.
ShootingTrajectory restrictTrajectory(const Model& from, const Model& model, ShootingTrajectory trajectory) {
  for (VectorXd& x : trajectory.xs) {
    const VectorXd all = x;
    x.resize(model.nq() + model.nv());
    x << restrictConfiguration(from, model, all.head(from.nq())), restrictVelocity(from, model, all.tail(from.nv()));
  }
  return trajectory;
}

// A plan with robot and summary, from its request. `guess`: directory of a solution, or empty.
void finishPlan(const MotionRequest& request, const std::string& guess, PlanControl control,
                const PredictiveOptions& predictive, Plan& plan) {
  const MotionSummary& summary = plan.summary;
  const Model& model = plan.model();
  ProblemOptions problem(summary.formulation, summary.step);
  problem.limits = readLimits(summary);
  problem.objective = summary.objective;
  const Motion motion = makeMotion(model, fixDurations(summary, request), problem);
  Solution solution{motion, {}, {}};
  if (!guess.empty()) solution.trajectory = makeStart(readResultRecord(guess), motion).trajectory;
  // A solution in the files is only solved again for its gains; predictive control has its own.
  const bool is_open = control == PlanControl::Open;
  const bool is_known = !guess.empty() && (is_open || (control == PlanControl::Predictive && summary.converged));
  if (!is_open || !is_known) checkControl(summary, control);
  if (guess.empty()) {
    solution = solveUnlessInterrupted(motion, {});
    plan.summary.options = solution.motion.options;  // maybe in shorter stages
  }
  if (!is_known) solution = solveForGains(summary.file, solution.motion, solution.trajectory, plan.iterations);
  plan.ground = solution.motion.ground;
  plan.schedule = solution.motion.schedule;
  plan.goals = solution.motion.goals;
  plan.policy = std::make_unique<Policy>(
      control == PlanControl::Gains ? makePolicy(solution) : makePolicy(solution.motion, solution.trajectory));
  if (control != PlanControl::Predictive) return;
  problem = solution.motion.problem_options;
  const MotionRequest freed = freeFeet(plan.ground, *solution.motion.request);
  // A plan may be closer to a dead point than motors would let it come, or start from one: without a margin there is no stop.
  PredictiveOptions stopping = predictive;
  stopping.dead_point_stop = std::min(stopping.dead_point_stop, kStopShare * problem.limits.dead_point_margin);
  const Model cut = plan.serial ? model : cutAtBalls(model);
  const VectorXd q0 = restrictConfiguration(model, cut, motion.problem->initialState().head(model.nq()));
  plan.predictive = std::make_unique<PredictiveController>(
      makePredictiveMotion(cut, freed.plan(cut, makeStandingRobot(cut, q0)), problem, stopping),
      restrictTrajectory(model, cut, solution.trajectory), stopping);
  adaptPredictive(cut, plan);
}

void setModel(Belief belief, MotionSummary& summary) {
  summary.run.model = belief == Belief::Closed ? "closed" : "serial";
  summary.run.serial_armature = belief == Belief::Ratio ? "reflected" : "";
}

// The serial model of a plan that believes in it. Summaries name its armature.
void makeBelief(Belief belief, Plan& plan) {
  plan.belief = belief;
  if (belief == Belief::Closed) return;
  const Model& closed = plan.robot.model;
  const std::string& armature = plan.summary.run.serial_armature;
  plan.serial = std::make_unique<SerialModel>(
      makeSerialModel(closed, makeStandingPosture(closed), parseSerialArmature(armature)));
}

// The controller of the serial model made one of the closed robot.
void finishBelief(Plan& plan) {
  if (!plan.serial) return;
  Controller& inner = plan.predictive ? static_cast<Controller&>(*plan.predictive) : *plan.policy;
  plan.reference = makeReference(plan.robot.model, *plan.serial, *plan.policy, plan.belief);
  plan.adapter = std::make_unique<SerialController>(plan.robot.model, *plan.serial, inner, plan.belief);
}

// As many steps as there is time for.
void chooseSteps(double duration, OptionSet& options) {
  const auto get = [&options](const char* name) { return options.find(name) ? options.get<double>(name) : 0; };
  const double step = get("single_support") + get("double_support");
  const double rest = get("start_support") + get("end_support");
  if (duration <= 0 || step <= 0) return;
  options.set("steps", std::max(2.0, std::floor((duration - rest) / step)));
}

}  // namespace

void adaptPredictive(const Model& cut, Plan& plan) {
  if (!cut.isCopyOf(plan.model()))
    plan.adapter = std::make_unique<RestrictedController>(plan.model(), cut, *plan.predictive);
}

void requireNoInterrupt() {
  if (isInterrupted()) throw InterruptedPlan();
}

std::unique_ptr<Plan> readPlan(const std::string& directory, PlanControl control, const PredictiveOptions& predictive,
                               std::optional<Belief> belief) {
  auto plan = std::make_unique<Plan>();
  plan->summary = readSummary(directory);
  const MotionSummary& summary = plan->summary;
  const bool serial = summary.run.model == "serial";
  const Belief believed = belief.value_or(serial ? Belief::Serial : Belief::Closed);
  const bool other = serial != (believed != Belief::Closed);
  if (other) setModel(believed, plan->summary);
  plan->robot = loadRobotOf(summary);
  makeBelief(believed, *plan);
  finishPlan(remakeRequest(summary), other ? "" : directory, control, predictive, *plan);
  finishBelief(*plan);
  return plan;
}

std::unique_ptr<Plan> makePlan(const PlanRequest& request, PlanControl control, const PredictiveOptions& predictive) {
  auto plan = std::make_unique<Plan>();
  MotionRequest motion = findMotion("", request.motion).request;
  if (motion.options.find("steps")) chooseSteps(request.duration, motion.options);
  for (const auto& [name, value] : request.settings) motion.options.set(name, value);
  plan->robot = loadRobot(request.robot);
  MotionSummary& summary = plan->summary;
  summary.motion = request.motion;
  summary.run = {request.robot, plan->robot.file, {}};
  setModel(request.belief, summary);
  summary.formulation = Formulation::Reduced;
  summary.step = StepRule::Midpoint;
  summary.options = motion.options.listValues();
  makeBelief(request.belief, *plan);
  finishPlan(motion, "", control, predictive, *plan);
  finishBelief(*plan);
  return plan;
}

void freeFeet(LocomotionOptions& options) {
  options.contact_kp = 0;
  options.foothold_room = kFootholdRoom;
  options.cone_margin = kFeedbackMargin;
}

}  // namespace bielle::worlds
