#include "cli/simulate/prepare.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/registry.h"
#include "bielle/robots/robot_loader.h"
#include "cli/simulate/free.h"
#include "cli/simulate/output.h"
#include "control/clock.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/interrupt.h"
#include "results/setting.h"
#include "worlds/make_world.h"

namespace bielle::worlds {
namespace {

// Predictive control needs states with closed loops, which other formulations do not have. Returns why another one is chosen.
std::string chooseControl(SimulateArguments& arguments) {
  PlanControl& control = arguments.control.control;
  control = arguments.wanted_control.value_or(PlanControl::Predictive);
  if (arguments.wanted_control || !arguments.robot.empty() || arguments.execution.real_time ||
      readSummary(arguments.directory).formulation == Formulation::Reduced)
    return "";
  control = PlanControl::Gains;
  return "mpc cannot carry out motions solved with --formulation full";
}

bool isMotion(const std::string& name) {
  const std::vector<MotionEntry>& motions = getMotions();
  return std::any_of(motions.begin(), motions.end(), [&](const MotionEntry& motion) { return motion.name == name; });
}

// Maps between joints and motors are for controllers that believe in a serial chain.
void requireSerial(const SimulateArguments& arguments) {
  if (!arguments.control.generated_maps) return;
  const Belief of_motion = arguments.robot.empty() ? readSummary(arguments.directory).run.model : Belief::Closed;
  if (arguments.belief.value_or(of_motion) == Belief::Closed) refuseMaps();
}

// Rows are recorded at instants of control.
void roundPeriods(SimulateArguments& arguments) {
  ExecutionOptions& execution = arguments.execution;
  const double ticks = std::max(1.0, std::round(execution.record_period / execution.control_period));
  const double period = ticks * execution.control_period;
  if (arguments.has_record_period && std::abs(period - execution.record_period) > 1e-9 * period)
    tell({"--record-period " + formatNumber(execution.record_period) + ": rows are recorded every " +
          formatNumber(period) + " s, a multiple of --control-period"});
  execution.record_period = period;
}

// What a robot does that is still pushed at the end is decided by how long it is looked at.
void requirePushesToEnd(const Plan& plan, const ExecutionOptions& o) {
  const double end = getEnd(plan, o);
  for (const Push& push : o.pushes) {
    const double over = push.time + push.duration;
    if (over <= end + kClockTolerance) continue;
    const std::string longer = o.duration > 0 || plan.end ? "--duration " + formatNumber(over + o.hold)
                                                          : "--hold " + formatNumber(over - end + 2 * o.hold);
    throw InputError(
        "", "--push at " + formatNumber(push.time) + " s",
        "it is over at " + formatNumber(over) + " s, but the simulation ends at " + formatNumber(end) + " s",
        "give an earlier time, or " + longer);
  }
}

// A robot for a solved motion is that of the world. What is the name of a motion is that motion, whatever lies there.
void chooseRobot(SimulateArguments& arguments) {
  const bool is_motion = isMotion(arguments.directory);
  const bool is_solved = std::filesystem::exists(std::filesystem::path(arguments.directory) / "summary.json");
  if (arguments.robot.empty() || !is_solved) return;
  if (is_motion) {
    tell({"motion '" + arguments.directory + "' is solved for " + arguments.robot + "; give ./" + arguments.directory +
          " to carry out the one in that directory"});
    return;
  }
  arguments.world_robot = std::exchange(arguments.robot, {});
}

// Of the joints, motors and contacts of a plan's robot, in their order.
void requireSameParts(const Model& planned, const LoadedRobot& robot) {
  const auto compare = [&robot](const char* what, const std::vector<std::string>& wanted,
                                const std::vector<std::string>& there) {
    if (wanted == there) return;
    throw InputError(robot.path(), what,
                     "they are " + listItems(there) + ", but those of the plan's robot " + listItems(wanted),
                     "give a robot of the same joints, motors and contacts");
  };
  compare("joints", makeVelocityNames(planned), makeVelocityNames(robot.model));
  compare("motors", getNames(planned.motors()), getNames(robot.model.motors()));
  compare("contacts", getNames(planned.contacts()), getNames(robot.model.contacts()));
}

// The robot of the world, which its controller may not know.
LoadedRobot loadWorldRobot(const Plan& plan, const SimulateArguments& arguments) {
  LoadedRobot robot = plan.robot;
  if (!arguments.world_robot.empty()) {
    robot = loadRobot(arguments.world_robot);
    tell(robot.warnings);
    requireSameParts(plan.robot.model, robot);
  }
  requireParts(arguments, robot);
  robot.model = addPayload(robot.model, makePayload(arguments));
  return robot;
}

// Soles that do not stand on the ground of the world, and terrain that is out of their way.
std::vector<std::string> listOddGround(const Plan& plan, const Ground& ground, const StandingPlace& place,
                                       double start) {
  const Model& model = plan.robot.model;
  const std::vector<ContactPhase>& phases = plan.schedule.phases;
  std::vector<std::string> odd = describeSoles(model, ground, phases.front().contacts);
  const bool is_reached = std::any_of(phases.begin(), phases.end(), [&](const ContactPhase& phase) {
    return reachesBoxes(model, ground, phase.contacts, place.X_WP, start);
  });
  constexpr double kAhead = 0.01;  // m
  const auto calcFarthest = [&](const ContactPhase& phase) {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const ContactTarget& foot : phase.contacts)
      farthest = std::max(farthest, place.X_WP.inverse().act(foot.X_WT.p).x());
    return farthest;
  };
  const bool walks_ahead = std::any_of(phases.begin(), phases.end(), [&](const ContactPhase& phase) {
    return calcFarthest(phase) > calcFarthest(phases.front()) + kAhead;
  });
  if (start > 0 && !is_reached)
    odd.push_back("--terrain begins " + formatNumber(start) +
                  " m ahead of where the robot stands, and no planned foothold is on it: " +
                  (walks_ahead ? "let it walk farther" : "give a motion that walks ahead"));
  return odd;
}

// With random errors.
Model addErrors(const Plan& plan, const Model& model, const RobotErrors& errors) {
  if (errors.isZero()) return model;
  Model machine = makeMachine(model, errors);
  VectorXd q = model.makeNeutral(), v = VectorXd::Zero(model.nv());
  plan.reference().getReference(0, q, v);
  try {
    if (!machine.references().empty()) makeStandingPosture(machine);
    assembleMachine(model, machine, q);
  } catch (const InputError& error) {  // which names the robot's file, where nothing is wrong
    if (errors.rod == 0) throw;
    throw InputError("", "--rod-error " + formatNumber(errors.rod),
                     std::string("the loops of such a robot do not close: ") + error.what(), "give a smaller error");
  }
  return machine;
}

}  // namespace

// What has no effect on this motion, robot and world.
std::vector<std::string> listIdleInPlan(const SimulateArguments& arguments, const Plan& plan, const World& world) {
  const ExecutionOptions& o = arguments.execution;
  std::vector<std::string> idle;
  const double steps = std::ceil(o.control_period / arguments.time_step - 1e-9), step = o.control_period / steps;
  const bool has_fixed_steps = !(world.integration().tolerance > 0);
  if (has_fixed_steps && arguments.time_step > 0 && step < 0.99 * arguments.time_step)
    idle.push_back("--time-step " + formatNumber(arguments.time_step) + ": steps are of " + formatNumber(step) +
                   " s at most, an even part of --control-period");
  if (arguments.errors.rod > 0 && plan.robot.model.closures().empty())
    idle.push_back("--rod-error has no effect: the robot has no closures");
  double longest = 0;  // s
  for (const Policy::Stage& stage : plan.policy.stages()) longest = std::max(longest, stage.duration);
  if (!plan.walk && arguments.lead && *arguments.lead > 0 && 1e-3 * *arguments.lead >= longest)
    idle.push_back("--lead has no effect: stages last " + formatNumber(1e3 * longest) + " ms at most");
  return idle;
}

int getStatus(Outcome outcome) {
  return outcome == Outcome::Stood ? kStood : outcome == Outcome::Undecided ? kNotDecided : kFell;
}

void requirePlan(const SimulateArguments& arguments) {
  if (arguments.robot.empty() || (arguments.dry_run && !isMotion(arguments.directory)))
    if (const auto flag = findGiven(arguments, {"speed", "set", "command"}))
      throw InputError("", *flag, "a solved motion has its own", "give --robot and the name of a motion");
  if (const auto flag = findGiven(arguments, {"posture", "state", "torques", "push_body", "spring"}))
    throw InputError("", *flag, "a motion has its own start and torques", "leave it out, or give a robot alone");
  if (arguments.world.find(',') != std::string::npos)
    throw InputError("", "--world", "a motion is carried out in one world at a time", "give one");
}

void requireParts(const SimulateArguments& arguments, const LoadedRobot& robot) {
  const auto blame = [](const std::string& flag, const auto& make) {
    try {
      make();
    } catch (const InputError& error) {
      throw InputError("", flag, error.element() + ": " + error.problem(), error.remedy());
    }
  };
  blame("--payload-at " + arguments.payload_at, [&] { addPayload(robot.model, makePayload(arguments)); });
  blame("--play", [&] { addPlay(robot.model, makeWear(arguments, robot).plays); });
}

bool isOfPlan(SimulateArguments& arguments) {
  chooseRobot(arguments);
  return !isFree(arguments);
}

std::string adaptToPlan(SimulateArguments& arguments) {
  requirePlan(arguments);
  requireSerial(arguments);
  const std::string reason = chooseControl(arguments);
  roundPeriods(arguments);
  arguments.control.duration = arguments.execution.duration;
  return reason;
}

Plan obtainPlan(const SimulateArguments& arguments) {
  if (arguments.robot.empty()) return readPlan(arguments.directory, arguments.control, arguments.belief);
  PlanRequest request{arguments.directory,
                      arguments.robot,
                      {},
                      arguments.execution.duration,
                      arguments.belief.value_or(Belief::Closed)};
  if (arguments.speed) request.settings.emplace_back("speed", *arguments.speed);
  for (const std::string& setting : arguments.settings) {
    const auto [name, value] = splitSetting("--set", setting, "com_weight=1e5");
    request.settings.emplace_back(name, parseOption(value));
  }
  if (!arguments.commands.empty()) return makeCommandedPlan(request, arguments.commands);
  return makePlan(request, arguments.control);
}

Scene makeScene(const Plan& plan, SimulateArguments& arguments) {
  std::vector<std::string> warnings = arguments.robot.empty() ? plan.robot.warnings : std::vector<std::string>();
  for (const std::string& each : listIdleOptions(arguments)) warnings.push_back(each);
  requirePushesToEnd(plan, arguments.execution);
  const StandingPlace place = findPlace(plan.robot.model, plan.schedule.phases.front().contacts);
  const auto [ground, start] = makeGround(arguments, plan.ground, place);
  for (const std::string& each : listOddGround(plan, ground, place, start)) warnings.push_back(each);
  LoadedRobot robot = loadWorldRobot(plan, arguments);
  Model machine = addErrors(plan, robot.model, arguments.errors);
  arguments.execution.interrupt = &isInterrupted();
  return {std::move(robot), std::move(machine), ground, std::move(warnings)};
}

}  // namespace bielle::worlds
