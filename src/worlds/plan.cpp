#include "worlds/plan.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "bielle/motion/solve.h"
#include "bielle/robots/robot_loader.h"
#include "motion/applied_options.h"
#include "motion/robot_size.h"
#include "results/interrupt.h"
#include "results/remade_motion.h"

namespace bielle::worlds {
namespace {

constexpr int kMaxIterations = 200;                                 // more than a motion takes from its own solution
constexpr double kFootholdRoom = 0.4, kFootholdRoomOnSteps = 0.02;  // of the reference robot, m
constexpr double kFeedbackMargin = 0.2;

// Sets an option of a motion, or of the parts of a sequence, where it has one.
void setWherePresent(const std::string& name, double value, OptionSet& options) {
  for (const auto& [option, before] : options.listValues()) {
    const bool ends = option.size() > name.size() &&
                      option.compare(option.size() - name.size() - 1, std::string::npos, "." + name) == 0;
    if (option == name || ends) options.set(option, value);
  }
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

// The serial model of a summary that believes in it, which names its armature.
std::optional<SerialModel> makeSerial(const Model& closed, const MotionSummary& summary, Belief belief) {
  if (belief == Belief::Closed) return {};
  return makeSerialModel(closed, makeStandingPosture(closed), parseSerialArmature(summary.run.serial_armature));
}

// A motion that repeats is carried out ten times, or for as long as is asked, and goes on while it is seen whether the robot stands.
void repeat(const Motion& motion, double duration, Plan& plan) {
  constexpr int kCycles = 10;
  const Model& model = motion.problem->model();
  const std::vector<Policy::Stage> cycle = plan.policy.stages();
  const std::vector<ContactPhase> phases = plan.schedule.phases;
  const double period = plan.policy.duration();
  plan.end = duration > 0 ? duration : kCycles * period;
  std::vector<Policy::Stage> stages;
  plan.schedule.phases.clear();
  plan.cycles = static_cast<int>(std::ceil((*plan.end + kMostExtension) / period));
  SE3 X;
  for (int i = 0; i < plan.cycles; ++i, X = *motion.cycle * X) {
    for (Policy::Stage stage : cycle) {
      stage.q = carryPosture(model, stage.q, X);
      stage.start += i * period;
      stage.phase += i * static_cast<int>(phases.size());
      stages.push_back(std::move(stage));
    }
    for (ContactPhase phase : phases) {
      for (ContactTarget& target : phase.contacts) target.X_WT = X * target.X_WT;
      plan.schedule.phases.push_back(std::move(phase));
    }
  }
  const VectorXd u = stages.back().u;
  plan.policy = Policy(model, std::move(stages), u);
}

// A plan from its request. `guess`: directory of a solution, or empty.
Plan finishPlan(const LoadedRobot& robot, MotionSummary summary, Belief belief, const MotionRequest& request,
                const std::string& guess, const ControlOptions& options) {
  const PlanControl control = options.control;
  std::optional<SerialModel> serial = makeSerial(robot.model, summary, belief);
  if (serial && options.generated_maps) requireCompiler();
  ProblemOptions problem(summary.formulation, summary.step);
  problem.limits = readLimits(summary);
  problem.objective = summary.objective;
  const Motion motion = makeMotion(serial ? serial->model : robot.model, fixDurations(summary, request), problem);
  Solution solution{motion, {}, {}};
  if (!guess.empty()) solution.trajectory = makeStart(readResultRecord(guess), motion).trajectory;
  // A solution in the files is only solved again for its gains; predictive control has its own.
  const bool is_open = control == PlanControl::Open;
  const bool is_known = !guess.empty() && (is_open || (control == PlanControl::Predictive && summary.converged));
  if (!is_open || !is_known) checkControl(summary, control);
  if (guess.empty()) {
    solution = solveUnlessInterrupted(motion, {});
    summary.options = solution.motion.options;  // maybe in shorter stages
  }
  int iterations = 0;
  if (!is_known) solution = solveForGains(summary.file, solution.motion, solution.trajectory, iterations);
  Plan plan{control == PlanControl::Gains ? makePolicy(solution) : makePolicy(solution.motion, solution.trajectory)};
  plan.schedule = solution.motion.schedule;
  if (solution.motion.cycle) repeat(solution.motion, options.duration, plan);
  plan.policy.setLookAhead(options.predictive.look_ahead);
  plan.ground = solution.motion.ground;
  plan.goals = solution.motion.goals;
  plan.robot = robot;
  plan.summary = std::move(summary);
  plan.belief = belief;
  if (serial && options.generated_maps) {
    std::vector<VectorXd> planned;
    for (const Policy::Stage& stage : plan.policy.stages()) planned.push_back(stage.q);
    plan.maps.emplace(robot.model, *serial, belief, formatMaps(robot.model, *serial, planned));
  }
  if (serial) plan.lifted = makeReference(robot.model, *serial, plan.policy, belief, plan.maps);
  plan.serial = std::move(serial);
  plan.solution = std::move(solution);
  plan.iterations = iterations;
  return plan;
}

void setModel(Belief belief, MotionSummary& summary) {
  summary.run.model = belief == Belief::Closed ? Belief::Closed : Belief::Serial;
  summary.run.serial_armature = belief == Belief::Ratio ? "reflected" : "";
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

void freeFeet(const Model& model, const StandingRobot& standing, const Ground& ground, OptionSet& options) {
  const double room = ground.steps.empty() ? kFootholdRoom : kFootholdRoomOnSteps;
  setWherePresent("contact_kp", 0, options);
  setWherePresent("foothold_room", room * calcRobotSize(model, standing).length, options);
  setWherePresent("cone_margin", kFeedbackMargin, options);
}

void requireNoInterrupt() {
  if (isInterrupted()) throw InterruptedPlan();
}

Plan readPlan(const std::string& directory, const ControlOptions& control, std::optional<Belief> belief) {
  MotionSummary summary = readSummary(directory);
  const bool is_serial = summary.run.model != Belief::Closed;
  const Belief believed = belief.value_or(summary.run.model);
  const bool is_other = is_serial != (believed != Belief::Closed);
  if (is_other) setModel(believed, summary);
  return finishPlan(loadRobotOf(directory), summary, believed, remakeRequest(summary), is_other ? "" : directory,
                    control);
}

Plan makePlan(const PlanRequest& request, const ControlOptions& control) {
  MotionRequest motion = findMotion("", request.motion).request;
  if (motion.options.find("steps")) chooseSteps(request.duration, motion.options);
  for (const auto& [name, value] : request.settings) motion.options.set(name, value);
  const LoadedRobot robot = loadRobot(request.robot);
  MotionSummary summary;
  summary.motion = request.motion;
  summary.run = makeRunInfo(request.robot, robot);
  setModel(request.belief, summary);
  summary.formulation = Formulation::Reduced;
  summary.step = StepRule::Midpoint;
  summary.options = motion.options.listValues();
  return finishPlan(robot, summary, request.belief, motion, "", control);
}

}  // namespace bielle::worlds
