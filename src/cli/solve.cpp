// bielle solve MOTION: makes the problem, solves it, writes the result.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "bielle/model/error.h"
#include "bielle/motion/described_options.h"
#include "bielle/motion/serial_model.h"
#include "bielle/report/report.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "cli/free_timings.h"
#include "cli/table.h"
#include "motion/applied_options.h"
#include "motion/feasibility.h"
#include "results/interrupt.h"
#include "results/option_flags.h"
#include "results/other_robot.h"
#include "results/output_place.h"
#include "results/setting.h"

namespace bielle::cli {
namespace {

struct SolveArguments {
  RobotArgument robot;
  std::string directory;
  ProblemOptions problem;
  std::optional<StepRule> step;  // if not given: Euler for the serial model, whose motions may be lifted, else midpoint
  bool serial = false;
  std::string serial_armature = "1e-3";
  std::vector<std::string> settings;                                      // name=value
  std::set<std::string> flags;                                            // options of the motion that are given so
  std::vector<std::string> effort_limits, velocity_limits, power_limits;  // motor=value
  std::vector<std::string> dead_point_margins;                            // linkage=value
  TimingArguments timings;
  FddpOptions solver = makeMotionSolverOptions();
  std::string warm_start;  // directory of a result, or empty
  bool quiet = false, no_check = false, no_report = false, dry_run = false;
};

LimitOptions makeLimits(const SolveArguments& arguments) {
  LimitOptions limits = arguments.problem.limits;
  const auto read = [](const std::string& flag, const std::vector<std::string>& settings, const std::string& example,
                       std::map<std::string, double>& out) {
    requireOnce(flag, settings, example);
    for (const std::string& setting : settings) out.insert(parseSetting(flag, setting, example));
  };
  read("--limit", arguments.effort_limits, "motor_knee_right=12", limits.efforts);
  read("--velocity-limit", arguments.velocity_limits, "motor_knee_right=15", limits.velocities);
  read("--power-limit", arguments.power_limits, "motor_knee_right=40", limits.powers);
  read("--dead-point-margin-of", arguments.dead_point_margins, "'ankley_left, anklex_left=0.5'",
       limits.dead_point_margins);
  requireOption(limits.enforced || !limits.areGiven(), "no-limits", "it contradicts the limit given for a motor",
                "leave out one of them");
  return limits;
}

std::string formatOptionList(const MotionEntry& motion) {
  std::vector<Row> rows;
  for (const Option& option : motion.request.options)
    rows.push_back({option.name, formatOption(option.value),
                    "[" + (option.unit.empty() ? option.describeValues() : option.unit) + "]", option.help});
  std::ostringstream text;
  printTable(text, rows);
  return text.str();
}

std::string formatConstraints(const FddpSummary& solver) {
  if (solver.penalty == 0) return "none";
  if (solver.violation == 0 && solver.multiplier == 0) return "satisfied, none active";
  const std::string violation = formatNumber(solver.violation, "%.1e");
  return (solver.violation > 0 ? "violated by at most " + violation : std::string("satisfied")) +
         ", largest multiplier " + formatNumber(solver.multiplier, "%.3g") + " after " +
         std::to_string(solver.multiplier_updates) + " updates";
}

// E.g. "35.2 J, cost of transport 0.81 (losses of 12 motors assumed: 0.25 W/(N m)^2)".
std::string formatEnergy(const ElectricalEnergy& energy) {
  std::string text = formatNumber(energy.total, "%.2f") + " J";
  if (std::isfinite(energy.cost_of_transport))
    text += ", cost of transport " + formatNumber(energy.cost_of_transport, "%.3f");
  if (energy.num_assumed > 0)
    text += " (losses of " + std::to_string(energy.num_assumed) +
            " motors assumed: " + formatNumber(kDefaultTorqueLoss) + " W/(N m)^2)";
  return text;
}

// Of linkages that come near one, rad or m.
std::string formatDeadPoints(const MotionResult& result) {
  std::string near;
  for (const DeadPointTrace& linkage : result.dead_points)
    if (linkage.getNearest().kind != DeadPointKind::None)
      near += (near.empty() ? "" : ", ") + linkage.output + " " + formatDistance(linkage.getNearest()) + " at " +
              formatNumber(result.record.time[linkage.getNearestNode()], "%.3g") + " s";
  return (near.empty() ? formatDistance({}) : near) + " (rad or m)";
}

std::string formatCycle(const MotionResult& result) {
  const VectorXd& cycle = result.record.cycle;
  const std::optional<double>& floquet = result.cycle->floquet_multiplier;
  // Of the base; x and y of a cycle that turns are about the world's origin.
  const Eigen::Vector2d base = result.record.q.row(0).head<2>().transpose(),
                        moved = Eigen::Rotation2Dd(cycle[3]) * base + cycle.segment<2>(1) - base;
  std::string text = formatNumber(cycle[0], "%.4g") + " s, moves by " + formatNumber(moved.x(), "%.3f") + ", " +
                     formatNumber(moved.y(), "%.3f") + " m";
  if (std::abs(cycle[3]) > 1e-9) text += ", turns by " + formatNumber(cycle[3], "%.3f") + " rad";
  return text + "; closes to " + formatNumber(result.cycle->closing_error, "%.1e") +
         (floquet ? ", largest Floquet multiplier " + formatNumber(*floquet, "%.3f") : "");
}

// Of a robot that has both kinds of motors, N m and N.
std::string makeTorqueLabel(const Model& model) {
  bool turning = false, sliding = false;
  for (const Motor& motor : model.motors())
    (model.joints()[motor.joint].kind == JointKind::Prismatic ? sliding : turning) = true;
  return !sliding ? "peak torques [N m]" : turning ? "peak torques [N m], forces [N]" : "peak forces [N]";
}

void printResult(const Model& model, const MotionResult& result, const std::vector<std::string>& paths) {
  const FddpSummary& solver = result.solver;
  std::string torques;
  for (size_t i = 0; i < std::min<size_t>(4, result.peak_torques.size()); ++i)
    torques +=
        (i ? ", " : "") + result.peak_torques[i].first + " " + formatNumber(result.peak_torques[i].second, "%.2f");
  const auto pair = [](double position, double angle) {
    return formatNumber(position, "%.2e") + " m, " + formatNumber(angle, "%.2e") + " rad";
  };
  std::cout << "\n" << result.motion << " of " << result.run.robot << ": " << getName(solver.termination);
  if (!solver.message.empty()) std::cout << " (" << solver.message << ")";
  std::cout << "\n";
  std::vector<Row> rows;
  for (const GoalOutcome& outcome : result.goals) rows.push_back({outcome.goal.name, formatOutcome(outcome)});
  rows.insert(rows.end(), {{"cost", formatNumber(solver.cost, "%.6f")},
                           {"iterations", std::to_string(solver.iterations)},
                           {"time", formatNumber(solver.seconds, "%.2f") + " s"},
                           {"centre of mass", formatNumber(result.com_start, "%.4f") + " m high, lowest at " +
                                                  formatNumber(result.com_lowest, "%.4f") + " m"},
                           {"constraints", formatConstraints(solver)},
                           {"closure gap", pair(result.gap_position, result.gap_angle)},
                           {"contact slip", pair(result.slip_position, result.slip_angle)},
                           {makeTorqueLabel(model), torques},
                           {"electrical energy", formatEnergy(result.energy)}});
  if (!result.dead_points.empty()) rows.push_back({"dead points", formatDeadPoints(result)});
  if (result.cycle) rows.push_back({"cycle", formatCycle(result)});
  printTable(std::cout, rows);
  printTimings(result.timings);
  for (const std::string& path : paths) std::cout << "  " << path << "\n";
}

// Writes the page beside the other files. A failure leaves the result complete.
void addReport(const std::string& directory) {
  const std::string path = (std::filesystem::path(directory) / "report.html").string();
  try {
    writeReport(path, {directory});
    std::cout << "  " << path << "\n";
  } catch (const std::exception& error) {
    std::cerr << "bielle: warning: the report could not be written: " << error.what() << "\n";
  }
}

// Printed last, to be noticed: the solver may converge and the check pass although goals are missed, or linkages end just
// before their dead points.
void warnOfGoalsAndDeadPoints(const MotionResult& result) {
  std::cout.flush();
  for (const DeadPointTrace& linkage : result.dead_points)
    if (const DeadPoint& nearest = linkage.getNearest(); nearest.distance < kNearDeadPoint)
      std::cerr << "bielle: warning: linkage of " << linkage.output << ": " << formatDistance(nearest)
                << " (rad, m) from a dead point at "
                << formatNumber(result.record.time[linkage.getNearestNode()], "%.3g")
                << " s, where motor and joint hardly move each other; request less motion towards it, or a larger "
                   "--dead-point-margin\n";
  for (const GoalOutcome& outcome : result.goals)
    if (!outcome.met()) std::cerr << "bielle: warning: " << outcome.goal.name << ": " << formatOutcome(outcome) << "\n";
}

// Lists everything that the serial model omits.
void printSerialModel(const SerialModel& serial) {
  const auto join = [](const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
    return text;
  };
  std::cout << "serial model: " << serial.frozen_joints.size() << " joints frozen, " << serial.dropped_closures.size()
            << " closures dropped\n";
  std::vector<Row> rows = {{"frozen", join(serial.frozen_joints)}, {"dropped", join(serial.dropped_closures)}};
  for (const SerialModel::Replacement& replacement : serial.replacements)
    rows.push_back({"motors", join(replacement.motors) + " -> " + join(replacement.joints)});
  if (!serial.dropped_targets.empty()) rows.push_back({"targets", join(serial.dropped_targets) + " (not used)"});
  printTable(std::cout, rows);
  std::cout << "\n";
}

// Whether the motion passes bielle-check, or that program is not installed. A check that breaks off counts as failed.
bool checkResult(const std::string& directory) {
  const std::optional<int> status = runCompanion("bielle-check", {"--brief", directory});
  if (!status)
    std::cout << "  not checked: bielle-check is not built (-DBIELLE_BUILD_VALIDATION=ON)\n";
  else if (*status != kOk && *status != kFailed)
    std::cerr << "bielle: error: " << directory << ": bielle-check failed with status " << *status
              << "; see its message, and run `bielle check " << directory << "` to retry" << std::endl;
  return !status || *status == kOk;
}

// Prints what is done and a line per iteration, unless quiet, and stops at a signal.
SolveObserver makeObserver(const SolveArguments& arguments) {
  SolveObserver observer;
  observer.motion.interrupt = observer.part.interrupt = &isInterrupted();
  observer.warn = [](const std::string& line) { std::cout << line << std::endl; };
  if (arguments.quiet) return observer;
  observer.motion.callback = makeFddpPrinter(std::cout);
  observer.tell = observer.warn;
  return observer;
}

// Errors of the recorded motion name the directory of the result. \param robot  the closed one
StartingPoint readStart(const std::string& directory, const LoadedRobot& robot, const Motion& motion) {
  if (const std::string other = describeOtherRobot(directory, robot); !other.empty())
    printWarnings({directory + ": the motion to start from was solved for another robot than '" + robot.model.name() +
                   "' is now" + other + "; it is no more than a guess"});
  const MotionRecord record = readResultRecord(directory);
  try {
    return makeStart(record, motion);
  } catch (const InputError& error) {
    throw InputError(directory, error.element(), error.problem(), error.remedy());
  }
}

// How long it will take; with free durations, at most. (A campaign reads it: tasks/campaign_command.cpp.)
void printPlan(const Motion& motion) {
  const RobotProblem& problem = *motion.problem;
  double end = 0;
  bool is_free = false;
  for (int k = 0; k < problem.numStages(); ++k) {
    const StageSpec& stage = problem.spec(k);
    if (stage.timing.phase >= 0) is_free = true;
    end += stage.dt * (stage.timing.phase >= 0 ? stage.timing.upper : 1);
  }
  std::cout << "planned: " << motion.schedule.phases.size() << " phases, " << problem.numStages() << " stages, "
            << formatNumber(end, "%.6g") << " s" << (is_free ? " at most" : "") << (motion.cycle ? ", a cycle" : "")
            << "\n";
}

// Options that others make useless.
std::vector<std::string> listIdleOptions(const SolveArguments& arguments) {
  std::vector<std::string> idle;
  const auto check = [&](bool is_given, const std::string& option, const std::string& reason) {
    if (is_given) idle.push_back(option + " has no effect: " + reason);
  };
  const ObjectiveOptions& objective = arguments.problem.objective;
  check(!arguments.serial && arguments.serial_armature != SolveArguments().serial_armature, "--serial-armature",
        "the model is closed");
  check(objective.objective == Objective::Effort && objective.regularization.has_value(), "--regularization",
        "the objective is effort");
  const LimitOptions& limits = arguments.problem.limits;
  const bool has_margin =
      limits.dead_point_margin != LimitOptions().dead_point_margin || !arguments.dead_point_margins.empty();
  check(has_margin && arguments.serial, "--dead-point-margin", "the serial model has no linkages");
  check(has_margin && !limits.enforced, "--dead-point-margin", "--no-limits leaves out all bounds");
  for (const std::string& setting : arguments.settings) {
    const std::string name = splitSetting("--set", setting, "com_weight=1e5").first,
                      last = name.substr(name.rfind('.') + 1);
    check(arguments.problem.formulation == Formulation::Reduced && (last == "closure_kp" || last == "closure_kd"),
          "--set " + name, "loops are closed at every node, without --formulation full");
  }
  return idle;
}

// Options of the motion, or of one in a sequence (walk.steps), that others of it make useless.
std::vector<std::string> listIdleSettings(const SolveArguments& arguments, const OptionSet& options) {
  std::set<std::string> given = arguments.flags;
  for (const std::string& setting : arguments.settings)
    given.insert(splitSetting("--set", setting, "com_weight=1e5").first);
  std::vector<std::string> idle;
  for (const std::string& name : given) {
    const std::string part = name.substr(0, name.rfind('.') + 1), last = name.substr(part.size());
    const Option *periodic = options.find(part + "periodic"), *slope = options.find(part + "slope");
    const bool is_cycle = periodic && periodic->value == OptionValue(true);
    const auto check = [&](bool is_idle, std::initializer_list<const char*> names, const std::string& reason) {
      if (is_idle && std::find(names.begin(), names.end(), last) != names.end())
        idle.push_back("option '" + name + "' has no effect: " + reason);
    };
    check(is_cycle && !options.find(part + "angle"), {"steps"}, "a cycle has two steps");
    check(is_cycle, {"start_support", "start_pressure", "end_support"}, "a cycle neither starts nor ends");
    check(!is_cycle, {"cycles"}, "the motion is no cycle, without periodic");
    check(slope && slope->value != OptionValue(0.0), {"height"}, "slope replaces it");
  }
  return idle;
}

int solve(const SolveArguments& arguments, MotionRequest request) {
  requireOnce("--set", arguments.settings, "com_weight=1e5", arguments.flags);
  for (const std::string& setting : arguments.settings) {
    const auto [name, value] = splitSetting("--set", setting, "com_weight=1e5");
    request.options.set(name, parseOption(value));
  }
  requireApart(arguments.directory, {arguments.warm_start});
  const LoadedRobot robot = arguments.robot.load();
  printWarnings(listIdleOptions(arguments));  // not before: where the robot needs another program, that one tells
  printWarnings(listIdleSettings(arguments, request.options));
  if (!robot.wear.frictions.empty())
    printWarnings({"friction of rod ends is left out of the plan (" + robot.wear.frictions.front().closure +
                   (robot.wear.frictions.size() > 1 ? ", .." : "") + "): it depends on the closure's force"});
  std::optional<SerialModel> serial;
  if (arguments.serial) {
    serial =
        makeSerialModel(robot.model, makeStandingPosture(robot.model), parseSerialArmature(arguments.serial_armature));
    printSerialModel(*serial);
  }
  const Model& model = serial ? serial->model : robot.model;
  ProblemOptions problem = arguments.problem;
  problem.limits = makeLimits(arguments);
  problem.timings = makeTimings(arguments.timings);
  problem.step = arguments.step.value_or(serial ? StepRule::Euler : StepRule::Midpoint);
  const Motion motion = makeMotion(model, request, problem);
  SolveOptions options;
  options.solver = arguments.solver;
  if (!arguments.warm_start.empty()) options.start = readStart(arguments.warm_start, robot, motion);
  if (arguments.dry_run) {
    checkFeasibility(motion, options.start ? &*options.start : nullptr, makeObserver(arguments).warn);
    printPlan(motion);
    return kOk;
  }
  makeOutputDirectory(arguments.directory);
  watchInterrupts();
  const MotionResult result =
      makeResult(makeRunInfo(arguments.robot.name, robot, getCommandLine(), serial ? Belief::Serial : Belief::Closed,
                             serial ? arguments.serial_armature : ""),
                 bielle::solve(motion, options, makeObserver(arguments)));
  printResult(model, result, writeResult(arguments.directory, result));
  const bool failed = !arguments.no_check && !checkResult(arguments.directory);
  if (!arguments.no_report) addReport(arguments.directory);  // the check is part of it
  warnOfGoalsAndDeadPoints(result);
  return result.converged() && !failed ? kOk : kFailed;
}

void addFiles(CLI::App& sub, const std::shared_ptr<MotionRequest>& request) {
  for (const MotionFile& file : request->files)
    sub.add_option_function<std::string>(
           "--" + file.name, [request, read = file.read](const std::string& path) { read(path, *request); }, file.help)
        ->required();
}

void addOutput(CLI::App& sub, const std::shared_ptr<SolveArguments>& arguments) {
  addRobot(sub, arguments->robot, "--robot");
  addVerbose(sub);
  sub.add_option("-o,--output", arguments->directory,
                 "directory for trajectory.csv, trajectory.npz, summary.json, the robot (mechanism.urdf, .yaml) and "
                 "report.html; "
                 "created if necessary; required unless --dry-run is given");
}

// What the options of one command say together.
void requireOutput(const SolveArguments& arguments) {
  if (arguments.directory.empty() && !arguments.dry_run) throw CLI::RequiredError("--output");
}

// Options common to all motions.
void describe(OptionFields& f, SolveArguments& a) {
  f.texts("set", a.settings, "name=value of one of the options below; may be repeated");
  describe(f, a.problem);
  f.texts("limit", a.effort_limits, "motor=largest torque [N m], instead of the robot's; may be repeated");
  f.texts("velocity_limit", a.velocity_limits,
          "motor=largest velocity [rad/s], instead of the robot's; may be repeated");
  f.texts("power_limit", a.power_limits, "motor=largest mechanical power [W], driving or braking; may be repeated");
  f.texts("dead_point_margin_of", a.dead_point_margins,
          "linkage=its margin, where that is larger than --dead-point-margin; may be repeated");
  f.choice(
      "step", a.step, {"euler", "midpoint"},
      "midpoint: second-order steps; euler: first-order steps, as in the paper, which --model serial uses unless a "
      "rule is given (default: midpoint)");
  f.choice("model", a.serial, {"closed", "serial"},
           "closed: with linkages; serial: linkages frozen at the standing posture, motors on the serial joints");
  f.text("serial_armature", a.serial_armature,
         "armature of the motors on serial joints [kg m^2], or `reflected`: the rotors' inertia seen there at the "
         "standing posture");
  f.restrictTo({"max_iterations", "threads"});
  describe(f, a.solver);
  f.restrictTo({});
  f.text("warm_start", a.warm_start,
         "directory of another result of this robot as the initial guess, resampled if its length differs");
  f.flag("quiet", a.quiet, "do not print a line per iteration");
  f.flag("no_report", a.no_report, "do not write report.html");
  f.flag("no_check", a.no_check, "do not run `bielle check` on the result");
  f.flag("dry_run", a.dry_run,
         "plan the motion and check it as before the first iteration: solve nothing, write nothing");
}

void addSolverOptions(CLI::App& sub, const std::shared_ptr<SolveArguments>& arguments) {
  addFlags(*arguments, sub);
  addTimingOptions(sub, arguments->timings);
  sub.add_flag_callback(
      "--no-limits", [arguments] { arguments->problem.limits.enforced = false; },
      "ignore the robot's limits of torque, joint range and velocity, which motions otherwise respect");
  sub.add_flag_callback(
      "--no-multipliers",
      [arguments] {
        arguments->solver.constraints.multipliers = false;
        arguments->solver.constraints.max_penalty = 1e14;
      },
      "hold constraints by a growing quadratic penalty alone, for comparisons");
}

constexpr const char* kOutcome =
    "Ctrl-C stops the solver; its last iterate is written and marked as interrupted. Exit status: 0 converged and\n"
    "checked, 1 not converged, or the check failed or did not finish (results are written all the same), 2 bad input.\n"
    "A missed goal (achieved and requested values differ by more than its tolerance) does not change the status; a\n"
    "warning at the end reports it.";

void addMotion(CLI::App& command, const MotionEntry& motion, Action& action) {
  CLI::App& sub = *command.add_subcommand(motion.name, motion.help);
  const auto arguments = std::make_shared<SolveArguments>();
  const auto request = std::make_shared<MotionRequest>(motion.request);
  addOutput(sub, arguments);
  addFiles(sub, request);
  for (const std::string& flag : motion.flags)
    addOption(sub, request->options.get(flag), [arguments, request, flag](const OptionValue& value) {
      arguments->flags.insert(flag);
      request->options.set(flag, value);
    });
  addSolverOptions(sub, arguments);
  sub.footer("Options of --set, with default and unit:\n" + formatOptionList(motion) + "Examples:\n  " +
             motion.example + "\n  " + motion.example + " --set com_weight=2e5 --max-iterations 50\n" + kOutcome);
  sub.callback([&action, arguments, request] {
    requireOutput(*arguments);
    action = [=] { return solve(*arguments, *request); };
  });
}

constexpr const char* kSequenceExample =
    "bielle solve sequence --robot bipetto --motions squat,walk,stairs,jump --set walk.speed=0.4 -o sequence";

void addSequence(CLI::App& command, Action& action) {
  CLI::App& sub = *command.add_subcommand(kSequence, "several motions one after the other, as one problem");
  const auto arguments = std::make_shared<SolveArguments>();
  const auto motions =
      std::make_shared<std::vector<std::string>>(std::vector<std::string>{"squat", "walk", "stairs", "jump"});
  addOutput(sub, arguments);
  std::vector<std::string> names;
  std::string known;
  for (const MotionEntry& motion : getMotions()) {
    if (!motion.request.files.empty()) continue;
    names.push_back(motion.name);
    known += (known.empty() ? "" : ", ") + motion.name;
  }
  sub.add_option("--motions", *motions, "in order, separated by commas: " + known + "; a motion may be repeated")
      ->delimiter(',')
      ->check(CLI::IsMember(names).description(""))
      ->capture_default_str();
  addSolverOptions(sub, arguments);
  sub.footer(std::string(
                 "Options of --set are those of the motions (`bielle solve MOTION --help`), prefixed by their names: "
                 "walk.speed.\n"
                 "A repeated motion is called walk2, walk3 and so on. Each motion starts where the previous one ends.\n"
                 "Each is first solved separately to make the guess for the whole, unless --warm-start gives one.\n"
                 "Examples:\n"
                 "  ") +
             kSequenceExample +
             "\n  bielle solve sequence --robot bipetto --motions walk,turn,walk --set walk2.speed=0.3 -o " +
             "there\n" + kOutcome);
  sub.callback([&action, arguments, motions] {
    requireOutput(*arguments);
    action = [=] { return solve(*arguments, makeSequenceRequest(*motions)); };
  });
}

}  // namespace

void addSolve(CLI::App& command, Action& action) {
  command.callback([&action] {
    if (!action) throw CLI::RequiredError("A motion");
  });
  std::string examples = "Examples:\n";
  for (const MotionEntry& motion : getMotions()) {
    addMotion(command, motion, action);
    examples += "  " + motion.example + "\n";
  }
  addSequence(command, action);
  examples += std::string("  ") + kSequenceExample + "\n";
  command.footer(examples + "`bielle solve MOTION --help` lists the options.");
}

}  // namespace bielle::cli
