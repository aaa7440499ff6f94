// bielle synthesize: linkages for a joint, from what is requested of it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>
#include <thread>
#include <tuple>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "cli/parameter_range.h"
#include "cli/synthesis.h"
#include "cli/synthesis_page.h"
#include "cli/table.h"
#include "design/robot_ratios.h"
#include "formats/motor_catalogue.h"
#include "formats/text_file.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "report/run.h"
#include "results/option_flags.h"
#include "robots/generator_entry.h"
#include "solve/fddp_checks.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr int kAngles = 25;                           // of a range
constexpr long kDrawings = 1000000, kRobots = 10000;  // usual samples, in closed form and by their mechanism
constexpr int kRobotEvaluations = 200;                // of a refinement, likewise by its mechanism
constexpr long kShownSamples = 1000;
constexpr int kMostKept = 50;

struct SynthesizeArguments {
  std::vector<double> range, motor_x = {-0.1, 0.1}, motor_z = {0.08, 0.25}, crank = {0.02, 0.1}, arm = {0.02, 0.1};
  std::optional<double> ratio;
  std::string robot, like, joint, motion, motor, directory;
  std::vector<std::string> parameters;
  std::optional<long> samples;
  int count = 10, threads = 0;
  unsigned seed = 1;
  double margin = 0.3, clearance = 0.01, distance = 0.2;
};

void describe(OptionFields& f, SynthesizeArguments& a) {
  f.number("ratio", a.ratio, "1", kPositive,
           "requested turns of the motor per turn of the joint, over the whole range, in either direction");
  f.text("joint", a.joint, "joint of --like, --motion and --parameter, of the same name in all");
  f.text("like", a.like, "robot whose linkage has the requested ratios");
  f.text("motion", a.motion, "result of a motion whose motor is on the joint: the least heat of the motor");
  f.text("motor", a.motor, "motor of the catalogue, whose speed must not be exceeded");
  f.number("distance", a.distance, "rad", {0, 10},
           "least way from the range to a dead point, of linkages by --parameter");
  f.number("margin", a.margin, "1", {0, 1},
           "least sine of the angles between rod, crank and arm of four-bars; 0 at dead points");
  f.number("clearance", a.clearance, "m", {0, 10}, "least distance of the rod of four-bars from the joint's axis");
  f.integer("count", a.count, {1, kMostKept}, "linkages kept");
  f.integer("seed", a.seed, "of the random numbers");
  f.integer("threads", a.threads, {0, kMostThreads}, "threads; 0: one per core");
}

// Angle, torque and speed of a joint that its motor drives, at the stages of a motion.
JointDemand readDemand(const ReportRun& run, const SynthesizeArguments& arguments) {
  const Model& model = run.robot.model;
  const MotionRecord& record = run.record;
  const RowMatrixXd &q = record.has_midpoints ? record.q_mid : record.q,
                    &v = record.has_midpoints ? record.v_mid : record.v;
  JointDemand demand;
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[static_cast<size_t>(m)];
    if (motor.name != arguments.joint) continue;
    const Joint& joint = model.joints()[static_cast<size_t>(motor.joint)];
    const Eigen::Index n = record.u.rows();
    demand.angles = q.col(joint.idx_q).head(n);
    demand.speeds = v.col(joint.idx_v).head(n);
    demand.torques = record.u.col(m);
    return demand;
  }
  std::vector<std::string> names;
  for (const Motor& motor : model.motors()) names.push_back(motor.name);
  throw InputError(arguments.motion, "joint '" + arguments.joint + "'", "no motor drives it by itself",
                   "solve the motion with a robot whose motor is on the joint; its motors are on " + listItems(names));
}

// Of the catalogue.
Motor readMotor(const std::string& name) {
  Motor motor;
  readYamlDocument("--motor", "[" + name + "]",
                   [&](const YamlEntry& root) { motor = readMotorTypes(root.getList(), "--motor", nullptr).front(); });
  return motor;
}

JointDemand makeDemand(const SynthesizeArguments& arguments, const std::optional<ReportRun>& motion) {
  JointDemand demand;
  if (motion) {
    demand = readDemand(*motion, arguments);
  } else {
    if (arguments.range.empty())
      throw InputError("", "option --range", "it is missing", "give it, or --motion with --joint");
    if (!(arguments.range[0] < arguments.range[1]))
      throw InputError("", "option --range", "it is empty", "give the smaller angle first");
    if (std::max(-arguments.range[0], arguments.range[1]) > 2 * M_PI)
      throw InputError("", "option --range", "it is beyond a turn", "give radians");
    demand.angles = VectorXd::LinSpaced(kAngles, arguments.range[0], arguments.range[1]);
    if (arguments.ratio) demand.ratios = VectorXd::Constant(kAngles, *arguments.ratio);
    if (!arguments.like.empty())
      demand.ratios =
          calcJointRatios(RobotArgument{arguments.like}.load().model, arguments.joint, demand.angles).ratios;
  }
  if (!arguments.motor.empty()) demand.largest_speed = readMotor(arguments.motor).velocity_limit;
  return demand;
}

FourBarSpace makeSpace(const SynthesizeArguments& a) {
  FourBarSpace space;
  space.lower.resize(FourBarDrawing::kCount), space.upper.resize(FourBarDrawing::kCount);
  space.lower << a.motor_x[0], a.motor_z[0], a.crank[0], -M_PI, a.arm[0], -M_PI;
  space.upper << a.motor_x[1], a.motor_z[1], a.crank[1], M_PI, a.arm[1], M_PI;
  for (const auto& [flag, pair, is_length] :
       {std::tuple("--motor-x", a.motor_x, false), std::tuple("--motor-z", a.motor_z, false),
        std::tuple("--crank", a.crank, true), std::tuple("--arm", a.arm, true)}) {
    if (!(pair[0] <= pair[1]))
      throw InputError("", flag, "its bounds are in the wrong order", "give the smaller number first");
    if (is_length && !(pair[0] > 0))
      throw InputError("", flag, "a length is not positive", "give metres, e.g. 0.02:0.1");
  }
  space.margin = a.margin, space.clearance = a.clearance;
  return space;
}

SoughtLinkage makeSought(const SynthesizeArguments& a, const JointDemand& demand,
                         const std::optional<ReportRun>& motion) {
  if (a.parameters.empty()) {
    // The robot of the motion, with other knees.
    const bool is_generated = a.robot.empty() && motion && readGeneratorOf(motion->robot.file);
    return makeDrawnKnees(is_generated      ? motion->robot.file
                          : a.robot.empty() ? "leg_biped"
                                            : a.robot,
                          makeSpace(a), demand);
  }
  if (a.robot.empty()) throw InputError("", "option --parameter", "there is no robot that has it", "name one first");
  if (a.joint.empty()) throw InputError("", "option --joint", "it is missing", "name the joint that the linkage moves");
  return makeVariedLinkages(a.robot, a.parameters, a.joint, demand, a.distance);
}

// What an earlier search left there and this one does not write again.
void removeFormer(const std::string& directory, size_t kept) {
  for (size_t i = kept; i < kMostKept; ++i) {
    const fs::path former = fs::path(directory) / getLegName(i);
    std::error_code ignored;  // a directory with something else in it stays
    if (fs::remove(former / (former.filename().string() + ".yaml"), ignored)) fs::remove(former, ignored);
  }
  std::remove((fs::path(directory) / "design.yaml").c_str());
}

std::string joinCommandLine() {
  std::string text = "bielle";
  for (size_t i = 1; i < getCommandLine().size(); ++i) text += " " + getCommandLine()[i];
  return text;
}

std::vector<Row> makeTable(const SoughtLinkage& sought, const std::vector<FoundLinkage>& found,
                           const JointDemand& demand) {
  const bool has_torques = demand.torques.size() > 0;
  const auto [value, unit] = nameValue(demand);
  std::vector<Row> rows = {{"", unit.empty() ? value : value + " [" + unit + "]", "|ratio|", sought.margin}};
  if (has_torques) rows[0].insert(rows[0].end(), {"peak [N m]", "[rad/s]"});
  for (const DesignVariable& variable : sought.variables)
    rows[0].push_back(variable.name + (variable.unit == "1" ? "" : " [" + variable.unit + "]"));
  const auto format = [](double number) { return formatNumber(number, "%.4g"); };
  for (const FoundLinkage& f : found) {
    rows.push_back({getLegName(rows.size() - 1), format(f.value),
                    format(f.least_ratio) + " .. " + format(f.largest_ratio), format(f.margin)});
    if (has_torques) rows.back().insert(rows.back().end(), {format(f.peak_torque), format(f.peak_speed)});
    for (const double number : f.x) rows.back().push_back(format(number));
  }
  return rows;
}

int synthesize(const SynthesizeArguments& arguments) {
  std::optional<ReportRun> motion;
  if (!arguments.motion.empty()) {
    motion = readRun(arguments.motion);
    printWarnings(motion->robot.warnings);
  }
  const JointDemand demand = makeDemand(arguments, motion);
  const SoughtLinkage sought = makeSought(arguments, demand, motion);
  const bool is_drawn = arguments.parameters.empty();
  LinkageSearchOptions options;
  options.samples = arguments.samples.value_or(is_drawn ? kDrawings : kRobots);
  if (!is_drawn) options.refined = arguments.count, options.evaluations = kRobotEvaluations;
  options.count = arguments.count;
  options.seed = arguments.seed;
  options.threads = arguments.threads > 0 ? arguments.threads : static_cast<int>(std::thread::hardware_concurrency());
  if (!is_drawn)
    options.progress = [&options](long rated) {
      if (rated % kShownSamples == 0) std::cerr << "bielle: " << rated << " of " << options.samples << " robots\n";
    };
  const std::vector<FoundLinkage> found = searchLinkages(sought.family, demand, options);
  if (found.empty()) {
    std::cerr << "bielle: none of " << options.samples << " linkages closes over the whole range with this "
              << (is_drawn ? "margin and clearance; widen the bounds, or lower --margin or --clearance\n"
                           : "distance; widen the ranges, or lower --distance\n");
    return kFailed;
  }
  makeOutputDirectory(arguments.directory);
  removeFormer(arguments.directory, found.size());
  for (size_t i = 0; i < found.size(); ++i) {
    const std::string name = getLegName(i);
    const fs::path directory = fs::path(arguments.directory) / name;
    makeOutputDirectory(directory.string());
    writeTextFile((directory / (name + ".yaml")).string(), formatRobot(sought, found[i], joinCommandLine()));
  }
  Motor motor;
  if (!arguments.motor.empty()) motor = readMotor(arguments.motor);
  motor.name = arguments.joint;
  writeSynthesisPage(arguments.directory, sought, found, demand, arguments.motion, motor);
  printTable(std::cout, makeTable(sought, found, demand));
  std::cout << "  " << arguments.directory << "/synthesis.html\n  " << arguments.directory << "\n";
  if (motion) {
    const std::string design = (fs::path(arguments.directory) / "design.yaml").string();
    const std::optional<size_t> start =
        writeDesign(design, sought, found, *motion, arguments.joint, arguments.motor, joinCommandLine());
    if (!start) {
      std::cerr << "bielle: warning: none of the robots makes the motion from its plan; there is no design.yaml\n";
      return kFailed;
    }
    std::cout << "  " << design << "\n";
  }
  return kOk;
}

}  // namespace

void addSynthesize(CLI::App& command, Action& action) {
  const auto a = std::make_shared<SynthesizeArguments>();
  const auto add_pair = [&command](const char* flag, std::vector<double>& pair, const char* help) {
    return command.add_option(flag, pair, help)->expected(2)->delimiter(':')->type_name("LOW:HIGH");
  };
  command.add_option("robot", a->robot,
                     "generated robot whose linkage is looked for; default: that of --motion, or leg_biped");
  add_pair("--range", a->range, "angles of the joint [rad]");
  addFlags(*a, command);
  command.get_option("--motor")->needs("--motion");
  command.get_option("--like")->needs("--joint")->excludes("--ratio");
  CLI::Option* motion = command.get_option("--motion")->needs("--joint");
  for (const char* other : {"--range", "--ratio", "--like"}) motion->excludes(other);
  command
      .add_option("--parameter", a->parameters,
                  "this parameter of the robot varies, 30 % about its value or over a range; may be repeated. "
                  "Without: four-bars by their drawing")
      ->type_name(kParameterRange);
  add_pair("--motor-x", a->motor_x, "four-bars: place of the motor in front of the joint [m]")->capture_default_str();
  add_pair("--motor-z", a->motor_z, "four-bars: place of the motor above the joint [m]")->capture_default_str();
  add_pair("--crank", a->crank, "four-bars: length of the crank [m]")->capture_default_str();
  add_pair("--arm", a->arm, "four-bars: length of the joint's arm [m]")->capture_default_str();
  for (const char* flag : {"--motor-x", "--motor-z", "--crank", "--arm", "--margin", "--clearance"})
    command.get_option(flag)->excludes("--parameter");
  command.get_option("--distance")->needs("--parameter");
  command
      .add_option("--samples", a->samples,
                  "linkages at random; default: 1000000 by their drawing, 10000 by --parameter")
      ->check(CLI::Range(1L, 1000000000L));
  command.add_option("-o,--output", a->directory, "directory of the robots that have them")->required();
  command.footer(
      "Draws linkages at random, ranks them by the ratio of motor to joint, refines the best and writes a robot for "
      "each.\n"
      "Four-bars are ranked by their closed form; their robots have the part `drawn` (docs/parts.md) as knees. By "
      "--parameter\n"
      "any generated robot is searched, some hundred linkages per second and core. Without a request, the best ratio "
      "is the "
      "most\n"
      "constant one.\n"
      "With --motion, design.yaml is written as well: `bielle design` solves the motion anew for each robot, refines "
      "the "
      "best\n"
      "by gradients and gives the front of energy and peak torque.\n"
      "Exit status: 0 done, 1 none found, 2 bad input.\n"
      "Examples:\n"
      "  bielle synthesize --range 0:1.6 --ratio 0.9 -o knees\n"
      "  bielle synthesize --range 0.1:1.1 --like bipetto --joint knee_right -o again\n"
      "  bielle synthesize leg_biped --joint knee_left --range 0.8:1.6 --parameter knee_crank --parameter knee_arm -o "
      "lengths\n"
      "  bielle solve walk --robot rsu_biped -o walk\n"
      "  bielle synthesize --motion walk --joint knee_left -o for_walks\n"
      "  bielle design for_walks/design.yaml -o best");
  command.callback([&action, a] { action = [a] { return synthesize(*a); }; });
}

}  // namespace bielle::cli
