// bielle softness: how far the loops of a MuJoCo file open there, and what keeps them closed.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "cli/softness_page.h"
#include "cli/softness_study.h"
#include "cli/table.h"
#include "formats/robot_files.h"
#include "formats/text_file.h"
#include "model/hash.h"
#include "results/interrupt.h"
#include "results/line_log.h"
#include "results/option_flags.h"
#include "results/output_place.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

const std::vector<std::string> kVersions = {"2", "3", "3.7"};  // MujocoVersion

struct SoftnessArguments {
  RobotArgument robot;
  std::string directory, motion;
  std::optional<double> time_step;  // s, instead of the file's
  double within = 1e-4;
  std::vector<double> solref, solimp;
  MujocoVersion mujoco = MujocoVersion::ThreeSeven;
  bool json = false;
  SoftnessOptions options;
};

void describe(OptionFields& f, SoftnessArguments& a) {
  f.number("timestep", a.time_step, "s", kPositive, "instead of the file's");
  f.number("within", a.within, "m, and rad of angles", kPositive, "largest gap that settings.xml shall allow");
  f.text("motion", a.motion,
         "result of a motion of this mechanism, along which to look, instead of at postures of its range");
  f.number("torque", a.options.torque, "N m or N", kPositive, "of each motor, instead of its limit");
  f.integer("postures", a.options.postures, {1, 1000}, "of the range of each motor");
  f.choice("mujoco", a.mujoco, kVersions,
           "version: before 3, rotations of welds are scaled by the inertia of translations; before 3.7, the change of "
           "J is not known");
  f.flag("json", a.json, "print JSON");
}

// The file of MuJoCo that was loaded, or that a YAML file completes.
std::string findMjcf(const LoadedRobot& robot) {
  std::string file = robot.path();
  if (fs::path(file).extension() == ".yaml") file = findModel(readYaml(file));
  if (fs::path(file).extension() == ".xml") return file;
  throw InputError(robot.path(), "file", "it is not one of MuJoCo, which alone has solref and solimp",
                   "write one with `bielle convert " + robot.path() + " --to mjcf -o robot.xml`");
}

MjcfSoftness readSoftness(const SoftnessArguments& arguments, const std::string& file) {
  MjcfSoftness softness = readMjcfSoftness(file);
  if (softness.equalities.empty())
    throw InputError(file, "equality", "the file has no equalities, and so no loops that could be soft",
                     "close its loops by connect, weld, joint or tendon in <equality>");
  softness.step.duration = arguments.time_step.value_or(softness.step.duration);
  for (MjcfEquality& equality : softness.equalities) {
    SoftSettings& settings = equality.settings;
    std::copy(arguments.solref.begin(), arguments.solref.end(), settings.solref.begin());
    std::copy(arguments.solimp.begin(), arguments.solimp.end(), settings.solimp.begin());
  }
  return softness;
}

// What the rows depend on.
Json identify(const SoftnessArguments& arguments, const LoadedRobot& robot, const MjcfSoftness& softness) {
  Json equalities = Json::array(), motion;
  if (!arguments.motion.empty())
    motion = hashText(readTextFile((fs::path(arguments.motion) / "trajectory.npz").string()));
  for (const MjcfEquality& equality : softness.equalities)
    equalities.push_back({equality.name, equality.settings.solref, equality.settings.solimp});
  return {{"softness", getBuildInfo().bielle},
          {"robot", calcFingerprint(makeRunInfo(arguments.robot.name, robot).mechanism)},
          {"timestep", softness.step.duration},
          {"refsafe", softness.step.is_safe},
          {"integrator", static_cast<int>(softness.step.integrator)},
          {"equalities", equalities},
          {"mujoco", kVersions.at(static_cast<size_t>(arguments.mujoco))},
          {"postures", arguments.options.postures},
          {"torque", arguments.options.torque.value_or(-1)},
          {"motion", motion}};
}

// The rows of all tasks; those that the log has are not computed again. Empty if the user asked for the end.
std::vector<Json> collect(const SoftnessStudy& study, LineLog& log) {
  std::vector<Json> rows;
  const auto& tasks = study.tasks();
  size_t known = 0;
  for (size_t t = 0; t < tasks.size(); ++t) {
    const size_t count = study.listLoops(tasks[t].cluster).size();
    if (known + count <= log.lines().size()) {
      for (size_t i = 0; i < count; ++i) rows.push_back(parseJson(log.lines()[known++]));
      continue;
    }
    if (isInterrupted()) return {};
    for (Json& row : study.study(tasks[t])) {
      if (known < log.lines().size())
        ++known;  // of a posture that was cut off
      else
        log.append(row.dump());
      rows.push_back(std::move(row));
    }
    if ((t + 1) % 10 == 0 || t + 1 == tasks.size())
      std::cerr << "bielle: " << t + 1 << " of " << tasks.size() << " postures" << std::endl;
  }
  return rows;
}

// Null without any.
Json getLargest(const std::vector<Json>& rows, const std::string& loop, std::initializer_list<const char*> keys) {
  Json largest;
  for (const Json& row : rows)
    for (const char* key : keys)
      if (row.at("loop") == loop && row.contains(key) && row.at(key).is_number())
        largest = std::max(largest.is_null() ? 0 : largest.get<double>(), std::abs(row.at(key).get<double>()));
  return largest;
}

Json summarize(const SoftnessStudy& study, const Model& model, const std::vector<Json>& rows) {
  Json loops = Json::array();
  for (size_t c = 0; c < model.clusters().size(); ++c)
    for (const std::string& loop : study.listLoops(static_cast<int>(c))) {
      const auto largest = [&](std::initializer_list<const char*> keys) { return getLargest(rows, loop, keys); };
      Json stable = nullptr;  // none along a motion
      std::string worst;
      for (const Json& row : rows)
        if (row.at("loop") == loop && row.contains("stable_step") && row.at("stable_step").is_number())
          stable =
              std::min(stable.is_null() ? kLongestStep : stable.get<double>(), row.at("stable_step").get<double>());
      for (const char* state : kSoftnessStates)
        if (std::any_of(rows.begin(), rows.end(),
                        [&](const Json& row) { return row.at("loop") == loop && row.at("state") == state; }))
          worst = state;
      loops.push_back({{"loop", loop},
                       {"gap", largest({"gap", "angle"})},
                       {"gap_at_limit", largest({"gap_at_limit", "angle_at_limit"})},
                       {"sag", largest({"sag"})},
                       {"sag_at_limit", largest({"sag_at_limit"})},
                       {"torque_error", largest({"torque_error"})},
                       {"frequency_error", largest({"frequency_error"})},
                       {"energy_loss", largest({"energy_loss"})},
                       {"stable_step", stable},
                       {"driven", study.listDriven(static_cast<int>(c))},
                       {"state", worst}});
    }
  return loops;
}

void print(const Json& loops, const SoftnessAdvice& advice) {
  std::vector<Row> rows = {
      {"loop", "gap", "at limit", "sag", "at limit", "torque error", "frequency", "energy 1/s", "stable step", ""}};
  const auto format = [](const Json& x, const char* as = "%.1e") {
    return x.is_null() ? "-" : formatNumber(x.get<double>(), as);
  };
  for (const Json& loop : loops)
    rows.push_back({loop["loop"], format(loop["gap"]), format(loop["gap_at_limit"]), format(loop["sag"]),
                    format(loop["sag_at_limit"]), format(loop["torque_error"]), format(loop["frequency_error"]),
                    format(loop["energy_loss"]), format(loop["stable_step"], "%.2g"), loop["state"]});
  printTable(std::cout, rows);
  std::cout << "within " << formatNumber(advice.within, "%.2g") << ": a gap of " << formatNumber(advice.gap, "%.1e")
            << " with\n"
            << formatMjcf(advice);
}

int run(const SoftnessArguments& arguments) {
  const LoadedRobot robot = arguments.robot.load();
  const std::string file = findMjcf(robot);
  const MjcfSoftness softness = readSoftness(arguments, file);
  const SoftLoops loops = makeSoftLoops(robot.model, softness, arguments.mujoco);
  std::vector<std::string> inputs = listFiles(robot);
  std::vector<SoftnessInstant> motion;
  if (!arguments.motion.empty()) {
    inputs.push_back(arguments.motion);
    motion = readInstants(arguments.motion, robot.model, file);
  }
  requireApart(arguments.directory, inputs);
  makeOutputDirectory(arguments.directory);
  watchInterrupts();
  const SoftnessStudy study(robot.model, loops, findClosedConfiguration(robot.model).q, arguments.options, motion);
  const auto path = [&](const char* name) { return (fs::path(arguments.directory) / name).string(); };
  LineLog log(path("softness.jsonl"), identify(arguments, robot, softness).dump(),
              "its rows are of another file, of other settings or of another version of the program");
  const std::vector<Json> rows = collect(study, log);
  if (rows.empty()) {
    std::cerr << "bielle: error: interrupted; the same command goes on" << std::endl;
    return kFailed;
  }
  const SoftnessAdvice advice = advise(rows, arguments.within, softness.step.duration);
  writeTextFile(path("settings.xml"), formatMjcf(advice));
  writeSoftnessPage(arguments.directory, "How soft the loops of " + robot.model.name() + " are", rows, advice);
  const Json summary = summarize(study, robot.model, rows);
  if (arguments.json)
    std::cout << formatJson({{"loops", summary},
                             {"within", advice.within},
                             {"timestep", advice.time_step},
                             {"solref", advice.settings.solref},
                             {"solimp", advice.settings.solimp},
                             {"gap", advice.gap}})
              << "\n";
  else
    print(summary, advice);
  for (const char* name : {"softness.jsonl", "softness.html", "settings.xml"})
    (arguments.json ? std::cerr : std::cout) << "  " << path(name) << "\n";
  return kOk;
}

}  // namespace

void addSoftness(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<SoftnessArguments>();
  command.add_option("ROBOT", arguments->robot.name, "MuJoCo .xml file, or a .yaml file that completes one")
      ->required();
  command
      .add_option("-o,--output", arguments->directory,
                  "directory for the rows softness.jsonl, the page softness.html and settings.xml")
      ->required();
  addFlags(*arguments, command);
  command.add_option("--solref", arguments->solref, "of all equalities, instead of the file's")->expected(2);
  command.add_option("--solimp", arguments->solimp, "likewise")->expected(1, 5);
  command.get_option("--motion")->check(CLI::ExistingDirectory);
  for (const char* name : {"--torque", "--postures"}) command.get_option(name)->excludes("--motion");
  command.footer(
      "MuJoCo's equalities are springs, dampers and masses; this predicts what they do, one linkage at a time while "
      "all\n"
      "else stands, at postures of its range (docs/softness.md):\n"
      "  gap           of a loop under gravity, its motors being held [m, rad]\n"
      "  sag           of the joints that the motors drive, from where they are with rigid loops [rad, m]\n"
      "  torque error  of a motor that holds the linkage against gravity [N m, N]\n"
      "  at limit      with all motors at their limits, or --torque, while the driven joints are blocked; the sag is "
      "that\n"
      "                of the motors\n"
      "  frequency     largest relative error, of small motions with the motors' torques as they are\n"
      "  energy        share of the energy of such a motion that is lost a second more than with rigid loops\n"
      "  stable step   the largest time step\n"
      "  and what a loop does: holds; falls: the loops let the mechanism fall at any step; gives way: they do not bear "
      "the load;\n"
      "                diverges: the time step is too long\n"
      "With --motion, the first three along it, with its speeds and forces; other motors and bodies move as they did.\n"
      "Rows are appended as they are found: after Ctrl-C the same command goes on. Plots are drawn by gnuplot, if\n"
      "installed. Exit status: 0 done, 1 interrupted, 2 bad input, or a file without loops.\n"
      "Examples:\n"
      "  bielle convert bipetto --to mjcf -o bipetto.xml\n"
      "  bielle softness bipetto.xml --timestep 0.002 -o soft\n"
      "  bielle solve squat --robot bipetto --depth 0.8 -o squat\n"
      "  bielle softness bipetto.xml --motion squat -o soft_squat\n"
      "  bielle softness excavator.xml --solref 0.02 1 --solimp 0.9 0.95 --within 1e-3 -o soft");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
