// bielle identify: lengths and offsets of a robot from logs of its motors and joints, masses and friction from torques.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <stdexcept>

#include "bielle/dynamics/assembly.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "cli/identify_motion.h"
#include "cli/identify_play.h"
#include "cli/identify_report.h"
#include "cli/table.h"
#include "formats/text_file.h"
#include "identify/loaded_states.h"
#include "model/listing.h"
#include "results/interrupt.h"
#include "results/output_place.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr double kQuiet = 0.5;     // s, before progress is told
constexpr double kSuspicious = 5;  // noise over the one assumed
constexpr double kBelowZero = 3;   // standard deviations, before it is told
constexpr double kLongGone = 0.5;  // share of rows in which play is at no stop, before it is told

struct IdentifyArguments {
  RobotArgument robot;
  std::string log, directory;
  IdentifyChoice choice;
  TorqueChoice torques;
  double motion = 0;  // s, of the one that shows most; 0: none
  int every = 1, iterations = 50;
  bool json = false;
};

// Without a log: what can be found.
int list(const Model& model, const std::vector<LinkageTask>& tasks, const std::vector<LoadNumber>& loads) {
  std::cout << model.name() << "\n";
  for (const LinkageTask& task : tasks) {
    std::cout << "  linkage of " << task.name << "\n";
    std::vector<std::string> columns, rods, lengths, places;
    for (const LinkageSensor& sensor : task.sensors) columns.push_back(sensor.name);
    for (const GeometryNumber& number : task.geometry) {
      if (const size_t dot = number.name.rfind('.'); dot != std::string::npos) {
        if (number.name[dot + 1] == 'x') places.push_back(number.name.substr(0, dot));
        continue;
      }
      (number.is_rod ? rods : lengths).push_back(number.name + " " + formatNumber(number.value, "%.5g"));
    }
    printTable(std::cout,
               {{"columns", listItems(columns)},
                {"by --sensor", listItems(task.others)},
                {"rods", listItems(rods)},
                {"lengths", listItems(lengths)},
                {"places .x .y .z", listItems(places)},
                {"play", listItems(getNames(task.plays))}},
               "    ");
  }
  if (loads.empty()) return kOk;
  std::vector<Row> rows = {{"numbers of the dynamics", "unit", "as drawn"}};
  for (const LoadNumber& number : loads) rows.push_back({number.name, number.unit, formatNumber(number.value, "%.5g")});
  printTable(std::cout, rows);
  return kOk;
}

// Every n-th row.
MotionLog thin(MotionLog log, int every) {
  if (every == 1) return log;
  MotionLog out{log.path, {}, log.names, {}, {}};
  const auto count = static_cast<Eigen::Index>((log.rows.size() - 1) / static_cast<size_t>(every) + 1);
  if (count < 2)
    throw InputError(log.path, "--every " + std::to_string(every),
                     "it leaves one row of " + std::to_string(log.rows.size()), "give a smaller number");
  out.time.resize(count), out.values.resize(count, log.values.cols());
  for (Eigen::Index k = 0; k < count; ++k) {
    out.time[k] = log.time[k * every];
    out.values.row(k) = log.values.row(k * every);
    out.rows.push_back(log.rows[static_cast<size_t>(k * every)]);
  }
  return out;
}

// The linkages that the log tells about. \param may_be_none  because other things are looked for as well
std::vector<LoggedTask> chooseTasks(const std::vector<LinkageTask>& tasks, const MotionLog& log, bool may_be_none) {
  std::vector<LoggedTask> chosen;
  std::vector<std::string> reasons, told;
  for (const LinkageTask& task : tasks) {
    LoggedTask logged = matchLog(task, log);
    if (!logged.left_out.empty()) {
      reasons.push_back("linkage of " + task.name + ": " + logged.left_out);
      if (!logged.sensors.empty()) told.push_back(reasons.back());
      continue;
    }
    chosen.push_back(std::move(logged));
  }
  if (chosen.empty() && !may_be_none)
    throw InputError(log.path, "columns", listItems(told.empty() ? reasons : told),
                     "log positions of motors and of joints, named as above, in rad or m");
  for (const std::string& reason : told) std::cerr << "bielle: warning: " << log.path << ": " << reason << "\n";
  return chosen;
}

// Tells progress of what takes long.
class Teller {
 public:
  explicit Teller(std::string of) : of_(std::move(of)) {}
  void operator()(const std::string& text) const {
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count() > kQuiet)
      std::cerr << "bielle: " << of_ << ": " << text << std::endl;
  }

 private:
  std::string of_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

EstimateOptions makeOptions(const IdentifyArguments& arguments, const Teller& tell) {
  EstimateOptions options;
  options.iterations = arguments.iterations;
  options.progress = [tell](int iteration, double misfit) {
    tell("iteration " + std::to_string(iteration) + ", misfit " + formatNumber(misfit, "%.3g"));
    return !isInterrupted();
  };
  return options;
}

// Of one linkage; empty if the user asked for the end before there was one.
std::optional<Identified> identify(const IdentifyArguments& arguments, const Model& model, const VectorXd& q,
                                   const MotionLog& whole, const MotionLog& log, LoggedTask logged) {
  const Teller tell("linkage of " + logged.task->name);
  Identified out;
  out.task = logged.task;
  out.geometry = chooseGeometry(*logged.task, arguments.choice.free);
  out.sensors = logged.sensors;
  const auto K = static_cast<int>(logged.readings.rows());
  LogFit fit(logged.task->cluster, out.geometry, out.sensors, logged.readings, logged.task->q);
  addPlays(fit, model, q, logged, arguments.choice, arguments.torques.window, whole, log.time);
  if (!fit.follow(isInterrupted())) return {};
  out.plays = fit.plays();
  const std::vector<Eigen::Index>& followed = fit.followedRows();
  out.rows = fit.numRows(), out.left_out = K - static_cast<int>(followed.size());
  out.unclear = static_cast<int>(followed.size()) - out.rows;
  out.time.resize(out.rows);
  for (int k = 0; k < out.rows; ++k) out.time[k] = log.time[fit.usedRows()[static_cast<size_t>(k)]];
  if (K - out.left_out < 2 || 2 * out.left_out > K) {
    size_t first = 0;
    while (first < followed.size() && followed[first] == static_cast<Eigen::Index>(first)) ++first;
    throw InputError(log.path, log.rows[first],
                     "the linkage of " + out.task->name +
                         " has no configuration near these positions, nor near those of " +
                         std::to_string(out.left_out - 1) + " more of " + std::to_string(K) + " rows",
                     "check units (rad, m), signs and zeros, and that the columns are named as the robot's joints");
  }
  tell("followed through " + std::to_string(out.rows) + " rows");
  std::vector<bool> fixed;
  for (const LinkageSensor& sensor : out.sensors) fixed.push_back(matches(arguments.choice.exact, sensor.name));
  out.estimate = estimate(makeProblem(fit, fixed), makeOptions(arguments, tell));
  if (out.estimate.unknowns.empty())
    throw std::runtime_error("linkage of " + out.task->name + ": " + out.estimate.message);
  out.left_before = fit.calcLeft(out.estimate.r_before), out.left_after = fit.calcLeft(out.estimate.r_after);
  return out;
}

// From the torques, with the geometry that was found.
std::optional<IdentifiedLoads> findLoads(const IdentifyArguments& arguments, const Model& model, const VectorXd& q,
                                         const MotionLog& log, const std::vector<Identified>& geometry) {
  std::map<std::string, double> offsets;
  for (const Identified& found : geometry)
    for (const Unknown& unknown : found.estimate.unknowns)
      if (unknown.kind == "offset") offsets[unknown.name] = unknown.after;
  const AssemblyResult closed = closeConfiguration(model, q);
  if (closed.status != NumericalStatus::Ok)
    throw std::runtime_error("with the lengths that were found, the robot does not close: " + closed.message);
  IdentifiedLoads found = identifyLoads(model, closed.q, arguments.choice, arguments.torques, log, offsets,
                                        makeOptions(arguments, Teller("torques")));
  if (found.estimate.unknowns.empty()) return {};
  return found;
}

void warn(const IdentifiedLoads& found, const std::string& log) {
  const auto tell = [&](const std::string& text) {
    std::cerr << "bielle: warning: " << log << ": torques: " << text << std::endl;
  };
  if (found.left_out > 0)
    tell(std::to_string(found.left_out) + " instants near which a linkage has no configuration are left out");
  if (found.at_stops > 0)
    tell(std::to_string(found.at_stops) +
         " instants near which a joint is at its limit are left out: its stop may bear it");
  if (found.too_fast > 0)
    tell(std::to_string(found.too_fast) + " instants at which a joint turns by more than " +
         formatNumber(kMostTurnInWindow) + " rad within " + formatNumber(found.window, "%.3g") +
         " s are left out; a shorter --window takes them in");
  if (found.estimate.noise > kSuspicious)
    tell("what is left is " + formatNumber(kTorqueNoise * found.estimate.noise, "%.3g") +
         " of them: other numbers than the free ones are wrong, torques are not those at the joints, or something "
         "touches it");
  for (const Unknown& unknown : found.estimate.unknowns)
    if (const double margin = unknown.kind == "mass" ? 0 : kBelowZero * unknown.deviation;
        unknown.is_seen && unknown.after < -margin && unknown.kind != "com")
      tell(unknown.name + " is below zero; the robot has " +
           (unknown.kind == "mass" ? "a hundredth of what was drawn" : "0"));
}

void warn(const Identified& found, const std::string& log) {
  const auto tell = [&](const std::string& text) {
    std::cerr << "bielle: warning: " << log << ": linkage of " << found.task->name << ": " << text << std::endl;
  };
  if (found.left_out > 0)
    tell(std::to_string(found.left_out) + " rows near which it has no configuration are left out");
  if (found.unclear > kLongGone * (found.rows + found.unclear))
    tell(std::to_string(found.unclear) + " rows in which it is not clear at which stop play is are left out");
  if (found.estimate.noise > kSuspicious)
    tell("what is left is " + formatNumber(found.estimate.noise, "%.3g") +
         " times the noise that is assumed (--noise): other numbers than the free ones are wrong, or it has play");
  for (const Unknown& unknown : found.estimate.unknowns)
    if (unknown.kind == "play" && unknown.is_seen && unknown.after < -kBelowZero * unknown.deviation)
      tell(unknown.name + " is below zero: torques or positions have other signs than the robot; it has 0");
}

int run(const IdentifyArguments& arguments) {
  const LoadedRobot robot = arguments.robot.load();
  const VectorXd q = findClosedConfiguration(robot.model).q;
  const bool has_dynamics = !arguments.torques.dynamics.empty();
  const std::vector<LoadNumber> loads = chooseLoads(robot.model, arguments.torques.dynamics);
  if (arguments.motion > 0) {
    if (!has_dynamics || !arguments.log.empty() || arguments.directory.empty())
      throw InputError("", "--motion", "it needs --dynamics and -o, and no LOG",
                       "e.g. bielle identify fourbar --dynamics masses --motion 10 -o motion");
    return findMotion(robot.model, q, arguments.choice, loads, arguments.motion, arguments.torques.window,
                      arguments.iterations, arguments.robot.name, arguments.directory);
  }
  if (arguments.log.empty() != arguments.directory.empty())
    throw InputError("", arguments.log.empty() ? "-o" : "LOG", "LOG and --output need each other",
                     "give both, or none");
  std::vector<LinkageTask> tasks;
  if (!has_dynamics || !robot.model.closures().empty())
    tasks = listTasks(robot.model, q, arguments.choice, robot.wear.plays);
  if (arguments.log.empty()) return list(robot.model, tasks, loads);
  std::vector<std::string> inputs = listFiles(robot), wanted;
  inputs.push_back(arguments.log);
  requireApart(arguments.directory, inputs);
  formatRobot(robot.model);  // \throws what its files could not say in the end
  if (has_dynamics || !arguments.choice.plays.empty()) wanted = listTorqueColumns(robot.model);
  for (const LinkageTask& task : tasks)
    for (const LinkageSensor& sensor : task.sensors) wanted.push_back(sensor.name);
  const MotionLog whole = readLog(arguments.log, wanted), log = thin(whole, arguments.every);
  if (has_dynamics) requireTorques(robot.model, q, arguments.choice, whole);
  std::vector<LoggedTask> chosen = chooseTasks(tasks, log, has_dynamics);
  watchInterrupts();
  std::vector<Identified> all;
  for (LoggedTask& logged : chosen) {
    if (isInterrupted()) break;
    if (std::optional<Identified> found = identify(arguments, robot.model, q, whole, log, std::move(logged)))
      all.push_back(std::move(*found));
  }
  Model model = robot.model;
  Wear wear = robot.wear;
  Json linkages = Json::array();
  bool converged = all.size() == chosen.size();
  for (const Identified& found : all) {
    const auto n = static_cast<Eigen::Index>(found.geometry.size());
    model = changeGeometry(model, found.task->cluster.get(), found.geometry, found.estimate.x.head(n));
    wear = changePlays(std::move(wear), found.plays, found.estimate);
    linkages.push_back(describe(found));
    converged = converged && found.estimate.converged;
  }
  std::optional<IdentifiedLoads> dynamics;
  if (has_dynamics && !isInterrupted()) dynamics = findLoads(arguments, model, q, whole, all);
  if (dynamics) {
    model = changeLoads(model, dynamics->numbers, dynamics->estimate.x);
    converged = converged && dynamics->estimate.converged;
  }
  if (all.empty() && !dynamics) {
    std::cerr << "bielle: error: interrupted before the first estimate; nothing is written" << std::endl;
    return kFailed;
  }
  makeOutputDirectory(arguments.directory);
  writeRobot(model, arguments.directory, "with what `bielle identify` found", wear);
  Json summary = {{"robot", arguments.robot.name},
                  {"log", arguments.log},
                  {"interrupted", static_cast<bool>(isInterrupted())},
                  {"linkages", linkages}};
  if (dynamics) summary["dynamics"] = describe(*dynamics);
  const std::string path = (fs::path(arguments.directory) / "identified.json").string();
  writeTextFile(path, formatJson(summary) + "\n");
  if (arguments.json) std::cout << formatJson(summary) << "\n";
  if (!arguments.json) {
    for (const Identified& found : all) print(std::cout, found);
    if (dynamics) print(std::cout, *dynamics);
  }
  for (const Identified& found : all) warn(found, arguments.log);
  if (dynamics) warn(*dynamics, arguments.log);
  const std::string page = writeIdentifyPage(arguments.directory, robot.model.name() + ": found in " + arguments.log,
                                             all, dynamics ? &*dynamics : nullptr);
  (arguments.json ? std::cerr : std::cout) << "  " << arguments.directory << "\n  " << path << "\n  " << page << "\n";
  if (isInterrupted())
    std::cerr << "bielle: error: interrupted; what is written is the best estimate so far" << std::endl;
  return converged && !isInterrupted() ? kOk : kFailed;
}

}  // namespace

void addIdentify(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<IdentifyArguments>();
  IdentifyChoice& choice = arguments->choice;
  addRobot(command, arguments->robot);
  command.add_option("LOG", arguments->log,
                     ".csv or .npz with the columns time [s] and positions of motors and joints by name [rad, m], "
                     "also a trajectory of "
                     "`bielle simulate`; without it, the columns and numbers of each linkage are listed");
  command.add_option("-o,--output", arguments->directory,
                     "directory for the robot with what was found, identified.json and report.html");
  const auto addList = [&command](const char* name, std::vector<std::string>& list, const char* help) {
    command.add_option(name, list, help)->allow_extra_args(false);
  };
  addList("--joint", choice.joints, "only the linkage of this joint; may be repeated");
  addList(
      "--free", choice.free,
      "what is looked for, beside offsets: rods, or the name of a length or a coordinate of a place (* stands for any "
      "text); none; may be repeated (default: rods)");
  addList("--no-offset", choice.exact, "a column without an offset (* stands for any text); may be repeated");
  addList("--sensor", choice.sensors,
          "a column that is measured beside motors and serial joints (* stands for any text); may be repeated");
  addList("--noise", choice.noise,
          "NAME=VALUE: standard deviation of a column's noise [rad or m], * for all (default: 1e-4); may be repeated");
  addList("--dynamics", arguments->torques.dynamics,
          "what is looked for in torques, columns u.MOTOR [N m or N]: masses, coms (centres of mass), armatures, "
          "frictions, or the name of one, as LINK.mass or MOTOR.friction (* stands for any text); the base must not "
          "move; may be repeated");
  addList("--play", choice.plays,
          "what may have play: a motor, behind its gear, or a closure, along its rod (* stands for any text); torques, "
          "columns u.MOTOR [N m or N], tell at which stop it is; may be repeated");
  command
      .add_option("--window", arguments->torques.window,
                  "of the polynomials that smooth positions for --dynamics and --play, their degree being 4 [s]")
      ->capture_default_str()
      ->check(CLI::Range(1e-4, 10.0));
  command
      .add_option(
          "--motion", arguments->motion,
          "without LOG: the motion of this duration that shows most of what --dynamics names, within the limits of the "
          "motors [s]")
      ->check(CLI::Range(0.1, 600.0));
  command.add_option("--every", arguments->every, "only every n-th row, but for --dynamics")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  command.add_option("--iterations", arguments->iterations, "at most, for each linkage, the torques and --motion")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  command.add_flag("--json", arguments->json, "print JSON");
  addRobotFlags(command, arguments->robot);
  command.footer(
      "Finds the lengths of rods, and the offsets of encoders, with which the closed linkages go where motors and "
      "joints "
      "were\n"
      "measured, all of which may be noisy (docs/identify.md). A reading is the coordinate plus the offset. `+-` is "
      "the "
      "standard\n"
      "deviation, by the noise that is left. What the log does not show is `not seen`, and which changes together it "
      "does "
      "not\n"
      "show: with angles alone, that of all lengths of a linkage by the same factor.\n"
      "With --play, columns u.MOTOR tell at which of its stops play is, and its size is found as well, where the load "
      "changes sides.\n"
      "With --dynamics, columns u.MOTOR and, if there are any, v.JOINT tell masses, armatures and friction as well.\n"
      "-o is a robot for every other command. After Ctrl-C it has the best estimate so far.\n"
      "Exit status: 0 done, 1 interrupted or not converged, 2 bad input.\n"
      "Examples:\n"
      "  bielle identify fourbar\n"
      "  bielle identify fourbar log.csv -o found\n"
      "  bielle identify fourbar log.csv --free rods --free crank --no-offset crank_joint -o found\n"
      "  bielle identify fourbar log.csv --dynamics masses --dynamics frictions -o found\n"
      "  bielle identify fourbar log.csv --play coupler -o found\n"
      "  bielle identify fourbar --dynamics masses --dynamics frictions --motion 10 -o motion\n"
      "  bielle identify bipetto log.npz --joint knee_left --noise '*=5e-5' --noise knee_left=2e-4 -o found");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
