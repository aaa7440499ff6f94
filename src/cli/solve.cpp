// bielle solve MOTION: makes the problem, solves it, writes the result.
#include <algorithm>
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
#include "cli/solve_output.h"
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
  if (arguments.serial) limits.dead_point_margins.clear();
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
  const auto checkMargin = [&](bool is_given, const std::string& option) {
    check(is_given && arguments.serial, option, "the serial model has no linkages");
    check(is_given && !limits.enforced, option, "--no-limits leaves out all bounds");
  };
  checkMargin(limits.dead_point_margin != LimitOptions().dead_point_margin, "--dead-point-margin");
  checkMargin(!arguments.dead_point_margins.empty(), "--dead-point-margin-of");
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
