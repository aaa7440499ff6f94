// bielle-simulate: carries a motion out in a world.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <utility>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/registry.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "cli/simulate/free.h"
#include "cli/simulate/output.h"
#include "cli/simulate/watch.h"
#include "control/clock.h"
#include "formats/yaml_entry.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/failure_message.h"
#include "results/interrupt.h"
#include "results/output_place.h"
#include "results/setting.h"
#include "results/standard_output.h"
#include "worlds/make_world.h"

using namespace bielle;
using namespace bielle::worlds;

namespace {

constexpr int kStood = 0, kFell = 1, kBadInput = 2, kNotDecided = 3;

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

// Options of free motions, and of motions that are solved first, alone.
void requirePlan(const SimulateArguments& arguments) {
  if (arguments.robot.empty() || (arguments.dry_run && !isMotion(arguments.directory)))
    if (const auto flag = findGiven(arguments, {"speed", "set", "command"}))
      throw InputError("", *flag, "a solved motion has its own", "give --robot and the name of a motion");
  if (const auto flag = findGiven(arguments, {"posture", "state", "torques", "push_body", "spring"}))
    throw InputError("", *flag, "a motion has its own start and torques", "leave it out, or give a robot alone");
  if (arguments.world.find(',') != std::string::npos)
    throw InputError("", "--world", "a motion is carried out in one world at a time", "give one");
}

// Maps between joints and motors are for controllers that believe in a serial chain.
void requireSerial(const SimulateArguments& arguments) {
  if (!arguments.control.generated_maps) return;
  const Belief of_motion = arguments.robot.empty() ? readSummary(arguments.directory).run.model : Belief::Closed;
  if (arguments.belief.value_or(of_motion) == Belief::Closed) refuseMaps();
}

// The motion solved before or, where a robot is given, the motion of that name.
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
  const double lead = arguments.control.predictive.lead;
  if (!plan.walk && lead > 0 && lead >= longest)
    idle.push_back("--lead has no effect: stages last " + formatNumber(1e3 * longest) + " ms at most");
  return idle;
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

int getStatus(Outcome outcome) {
  return outcome == Outcome::Stood ? kStood : outcome == Outcome::Undecided ? kNotDecided : kFell;
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

// What options name, of the robot.
void requireParts(const SimulateArguments& arguments, const LoadedRobot& robot) {
  const auto blame = [](const std::string& flag, const auto& make) {
    try {
      make();
    } catch (const InputError& error) {
      throw InputError("", flag, error.element() + ": " + error.problem(), error.remedy());
    }
  };
  blame("--payload-at " + arguments.payload_at, [&] { addPayload(robot.model, makePayload(arguments)); });
  blame("--play", [&] { addPlay(robot.model, makePlays(arguments, "")); });
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
  if (start > 0 && !is_reached)
    odd.push_back("--terrain begins " + formatNumber(start) +
                  " m ahead of where the robot stands, and no planned foothold is on it: let it walk farther");
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

int simulate(SimulateArguments arguments, const std::vector<std::string>& command) {
  parseOptions(arguments);
  // A motion that is not there yet, as in a dry run for one that will be solved, is none of a robot.
  if (!isFree(arguments) || (arguments.dry_run && !std::filesystem::exists(arguments.directory)))
    requireShortSteps(arguments, "--control-period", arguments.execution.control_period);
  if (arguments.dry_run) {
    if (!isFree(arguments)) requirePlan(arguments);
    if (!arguments.robot.empty()) requireParts(arguments, loadRobot(arguments.robot));
    tell(listIdleOptions(arguments));
    return kStood;
  }
  chooseRobot(arguments);
  if (arguments.robot.empty()) requireApart(arguments.output, {arguments.directory});
  watchInterrupts();
  if (isFree(arguments)) return simulateFreely(arguments, command) ? kStood : kFell;
  requirePlan(arguments);
  requireSerial(arguments);
  const std::string reason = chooseControl(arguments);
  roundPeriods(arguments);
  arguments.control.duration = arguments.execution.duration;
  const Plan plan = obtainPlan(arguments);
  std::vector<std::string> warnings = arguments.robot.empty() ? plan.robot.warnings : std::vector<std::string>();
  for (const std::string& each : listIdleOptions(arguments)) warnings.push_back(each);
  requirePushesToEnd(plan, arguments.execution);
  const PlanController controller = makeController(plan, arguments.control);
  const StandingPlace place = findPlace(plan.robot.model, plan.schedule.phases.front().contacts);
  const auto [ground, start] = makeGround(arguments, plan.ground, place);
  for (const std::string& each : listOddGround(plan, ground, place, start)) warnings.push_back(each);
  const LoadedRobot robot = loadWorldRobot(plan, arguments);
  const double tolerance = controlsError(arguments.world) ? arguments.accuracy : 0;
  WorldOptions world_options{ground, arguments.time_step, &isInterrupted(), tolerance};
  world_options.wear = makeWear(arguments, robot);
  const auto world = makeWorld(arguments.world, addErrors(plan, robot.model, arguments.errors), world_options);
  for (const std::string& each : listIdleInPlan(arguments, plan, *world)) warnings.push_back(each);
  for (const std::string& each : world->warnings()) warnings.push_back("world " + arguments.world + ": " + each);
  tell(warnings);
  ExecutionOptions& options = arguments.execution;
  options.fall.only_whirling = controller.prediction != nullptr;
  options.interrupt = &isInterrupted();
  makeOutputDirectory(arguments.output);
  const CarriedOut carried{arguments, plan, robot, controller, ground, command, warnings};
  const auto writeFiles = [&carried](const Execution& execution) { return write(carried, execution); };
  ExecutionObserver observer;
  if (!arguments.summary_only) {  // a campaign's, which looks at nothing else
    const auto watch = std::make_shared<Watch>(arguments.live ? writeFiles : Watch::Show());
    observer = [watch](double time, double duration, const ExecutionSoFar& so_far) {
      watch->update(time, duration, so_far);
    };
  }
  requireNoInterrupt();
  const Execution execution = carryOut(plan, *controller.law, *world, arguments.perception, options, observer);
  print(carried, reason, execution);
  for (const std::string& path : writeFiles(execution)) std::cout << "  " << path << "\n";
  return getStatus(execution.outcome);
}

}  // namespace

int main(int argc, char** argv) {
  ignoreClosedPipes();
  CLI::App app{
      "Executes a motion in a physics simulation with contact: a result of `bielle solve`, or a motion that is solved "
      "first. A controller reads the robot's state and commands its motors; feet stand or slip as friction allows. "
      "Given a robot alone, lets it move freely, with or without feet, under torques, springs and pushes."};
  app.failure_message(bielle::cli::describeFailure);
  app.name("bielle simulate");
  SimulateArguments arguments;
  addOptions(app, arguments);
  app.footer(
      "A robot falls when its trunk leans by more than 0.8 rad from its planned attitude or its centre of mass is less\n"
      "than 0.6 times as high over the ground as planned, or a joint is more than 1.5 rad away from its planned angle. With\n"
      "--control mpc, a joint driven by a linkage counts only if the linkage has passed a dead point or the joint is "
      "half\n"
      "a turn away. It stands if it has been at rest, or its capture point over its soles, for the last three time\n"
      "constants sqrt(height / gravity); else the simulation goes on until that is decided, for up to 5 s. Exit "
      "status:\n"
      "0 it stands, 1 it fell, was stopped by Ctrl-C, or the simulation failed, 3 not decided (files are written all "
      "the\n"
      "same, unless Ctrl-C comes while the motion is still solved), 2 bad input.\n"
      "Examples:\n"
      "  bielle solve walk --robot bipetto --speed 0.4 -o walk\n"
      "  bielle simulate walk -o carried-out\n"
      "  bielle simulate walk -o fixed --control gains\n"
      "  bielle simulate walk -o pushed --push t=1.5,impulse=7,direction=90\n"
      "  bielle simulate walk --robot cleobot --speed 0.3 --duration 10 -o long\n"
      "  bielle simulate walk --robot bipetto --command tour.yaml --duration 20 -o tour\n"
      "  bielle simulate fourbar --state swing.json --world bielle,simbody,mujoco -o swing");
  if (argc == 2 && argv[1] == std::string("--yaml-keys")) {  // scripts/update_help.sh
    std::cout << describeYamlKeys();
    return kStood;
  }
  try {
    app.parse(argc, argv);
    arguments.has_record_period = app.count("--record-period") > 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kStood : kBadInput;
  }
  try {
    const int status = simulate(arguments, {argv, argv + argc});
    finishStandardOutput();
    return status;
  } catch (const InterruptedPlan& error) {
    std::cerr << "bielle: error: " << error.what() << std::endl;
    return kFell;
  } catch (const std::exception& error) {
    std::cerr << "bielle: error: " << error.what() << std::endl;
  }
  return kBadInput;
}
