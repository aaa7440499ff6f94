// bielle synthesize: linkages for a joint, from what is requested of it.
#include <cmath>
#include <filesystem>
#include <iostream>
#include <thread>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "design/fourbar_search.h"
#include "design/marks.h"
#include "design/page_data.h"
#include "formats/motor_catalogue.h"
#include "formats/text_file.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "report/page.h"
#include "report/run.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr int kAngles = 25;  // of a range

struct SynthesizeArguments {
  std::vector<double> range, motor_x = {-0.1, 0.1}, motor_z = {0.08, 0.25}, crank = {0.02, 0.1}, arm = {0.02, 0.1};
  std::optional<double> ratio;
  std::string like, joint, motion, motor, directory;
  long samples = 1000000;
  int count = 10, threads = 0;
  unsigned seed = 1;
  double margin = 0.3, clearance = 0.01;
};

// |R| of a robot's linkage at these angles, on the branch of its posture.
VectorXd readRatios(const std::string& robot, const std::string& joint, const VectorXd& angles) {
  const Model model = RobotArgument{robot}.load().model;
  const VectorXd q = findClosedConfiguration(model).q;
  const Linkage linkage = makeLinkage(model, q, {joint});
  if (linkage.size() != 1)
    throw InputError(robot, "joint '" + joint + "'", "its linkage has several motors",
                     "name a joint whose linkage has one motor");
  const RatioSweep sweep = sweepRatio(model, linkage, q);
  VectorXd ratios = VectorXd::Constant(angles.size(), -1);
  for (size_t i = 0; i + 1 < sweep.samples.size(); ++i) {
    const RatioSample &a = sweep.samples[i], &b = sweep.samples[i + 1];
    if (a.branch != 0 || b.branch != 0 || a.dead != DeadPointKind::None || b.dead != DeadPointKind::None) continue;
    for (Eigen::Index k = 0; k < angles.size(); ++k) {
      const double share = (angles[k] - a.joints[0]) / (b.joints[0] - a.joints[0]);
      if (share < 0 || share > 1) continue;
      // Cubic with both derivatives: the samples are as far apart as the sweep's steps.
      const double w = b.joints[0] - a.joints[0], t = share, p = a.ratio.R(0, 0), r = b.ratio.R(0, 0);
      const double m = w * a.ratio.dR[0](0, 0), n = w * b.ratio.dR[0](0, 0);
      ratios[k] = std::abs((2 * t * t * t - 3 * t * t + 1) * p + (t * t * t - 2 * t * t + t) * m +
                           (3 * t * t - 2 * t * t * t) * r + (t * t * t - t * t) * n);
    }
  }
  if (ratios.minCoeff() < 0)
    throw InputError(robot, "joint '" + joint + "'", "its linkage does not reach the whole range without a dead point",
                     "`bielle ratio` shows how far it goes; narrow --range");
  return ratios;
}

// Angle, torque and speed of a joint that its motor drives, at the stages of a motion.
JointDemand readMotion(const SynthesizeArguments& arguments) {
  const ReportRun run = readRun(arguments.motion);
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

JointDemand makeDemand(const SynthesizeArguments& arguments) {
  JointDemand demand;
  if (!arguments.motion.empty()) {
    demand = readMotion(arguments);
  } else {
    if (arguments.range.empty())
      throw InputError("", "option --range", "it is missing", "give it, or --motion with --joint");
    if (!(arguments.range[0] < arguments.range[1]))
      throw InputError("", "option --range", "it is empty", "give the smaller angle first");
    demand.angles = VectorXd::LinSpaced(kAngles, arguments.range[0], arguments.range[1]);
    if (arguments.ratio) demand.ratios = VectorXd::Constant(kAngles, *arguments.ratio);
    if (!arguments.like.empty()) demand.ratios = readRatios(arguments.like, arguments.joint, demand.angles);
  }
  demand.drawn_at = 0.5 * (demand.angles.minCoeff() + demand.angles.maxCoeff());
  if (!arguments.motor.empty()) demand.largest_speed = readMotor(arguments.motor).velocity_limit;
  return demand;
}

FourBarSpace makeSpace(const SynthesizeArguments& a) {
  FourBarSpace space;
  space.lower.resize(FourBarDrawing::kCount), space.upper.resize(FourBarDrawing::kCount);
  space.lower << a.motor_x[0], a.motor_z[0], a.crank[0], -M_PI, a.arm[0], -M_PI;
  space.upper << a.motor_x[1], a.motor_z[1], a.crank[1], M_PI, a.arm[1], M_PI;
  for (Eigen::Index i = 0; i < space.lower.size(); ++i)
    if (!(space.lower[i] <= space.upper[i]))
      throw InputError("", "bounds of the drawing", "a pair is in the wrong order", "give the smaller number first");
  space.margin = a.margin, space.clearance = a.clearance;
  return space;
}

std::string getLegName(size_t i) { return "leg_" + std::to_string(i + 1); }

// The biped whose knees it moves, as a file.
std::string formatBiped(const FoundFourBar& found, double drawn_at) {
  const FourBarDrawing& d = found.drawing;
  const std::pair<const char*, double> numbers[] = {
      {"motor_x", d.motor_x}, {"motor_z", d.motor_z},     {"drawn_crank", d.crank}, {"crank_angle", d.crank_angle},
      {"drawn_arm", d.arm},   {"arm_angle", d.arm_angle}, {"drawn_at", drawn_at}};
  std::string text = "# Found by `bielle";
  for (size_t i = 1; i < getCommandLine().size(); ++i) text += " " + getCommandLine()[i];
  text += "`.\ngenerator: leg_biped\nset:\n  knee: drawn\n";
  for (const auto& [name, value] : numbers)
    text += std::string("  knee_") + name + ": " + formatNumber(value, "%.9g") + "\n";
  return text;
}

const char* nameValue(const JointDemand& demand) {
  return demand.torques.size() > 0 ? "rms torque"
         : demand.ratios.size()    ? "deviation of the ratio"
                                   : "spread of the ratio";
}

// Columns and values of the page.
struct FourBarTable {
  Json columns = Json::array(), values = Json::array();
  void add(Json column, double value, const std::string& mark = "") {
    columns.push_back(std::move(column));
    values.push_back({{"value", value}});
    if (!mark.empty()) values.back()["mark"] = mark;
  }
};

FourBarTable makeFourBarTable(const FoundFourBar& f, const JointDemand& demand, const FourBarSpace& space) {
  FourBarTable table;
  const bool has_torques = demand.torques.size() > 0;
  table.add({{"kind", "objective"}, {"name", nameValue(demand)}, {"unit", has_torques ? "N m" : ""}}, f.value);
  table.add({{"kind", "margin"},
             {"name", "least sine, 0 at dead points"},
             {"unit", ""},
             {"bound", "≥ " + formatNumber(space.margin, "%.4g")}},
            f.least_sine, f.least_sine < 1.001 * space.margin ? "at its bound" : "");
  table.add({{"kind", "measure"}, {"name", "least ratio"}, {"unit", ""}}, f.least_ratio);
  table.add({{"kind", "measure"}, {"name", "largest ratio"}, {"unit", ""}}, f.largest_ratio);
  if (has_torques) {
    table.add({{"kind", "measure"}, {"name", "peak torque"}, {"unit", "N m"}}, f.peak_torque);
    table.add({{"kind", "measure"}, {"name", "peak speed"}, {"unit", "rad/s"}}, f.peak_speed);
  }
  const VectorXd x = f.drawing.toVector();
  const std::pair<const char*, const char*> names[] = {{"motor x", "m"},       {"motor z", "m"}, {"crank", "m"},
                                                       {"crank angle", "rad"}, {"arm", "m"},     {"arm angle", "rad"}};
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const auto& [name, unit] = names[i];
    const std::string bound = findBound(space.lower[i], space.upper[i], x[i]);
    table.add({{"kind", "variable"},
               {"name", name},
               {"unit", unit},
               {"bound", formatNumber(space.lower[i], "%.4g") + " to " + formatNumber(space.upper[i], "%.4g")}},
              x[i], bound.empty() ? "" : bound + " bound");
  }
  return table;
}

// What the motor of the joint does through the linkage.
Json describeMotor(const FoundFourBar& f, const JointDemand& demand, const Motor& motor) {
  std::vector<std::pair<double, double>> points;
  for (Eigen::Index k = 0; k < demand.torques.size(); ++k) {
    const double ratio = calcFourBar(f.drawing, demand.angles[k] - demand.drawn_at).ratio;
    points.emplace_back(ratio * demand.speeds[k], demand.torques[k] / ratio);
  }
  return describeCloud(motor, points);
}

void writeFourBars(const SynthesizeArguments& arguments, const std::vector<FoundFourBar>& found,
                   const JointDemand& demand, const FourBarSpace& space) {
  Motor motor;
  if (!arguments.motor.empty()) motor = readMotor(arguments.motor);
  motor.name = arguments.joint;
  Json columns, designs = Json::array();
  for (size_t i = 0; i < found.size(); ++i) {
    const std::string name = getLegName(i);
    const FourBarTable table = makeFourBarTable(found[i], demand, space);
    columns = table.columns;
    const Json mechanism = describeMechanism(loadRobot((fs::path(arguments.directory) / name).string()).model);
    Json motions = Json::array();
    if (demand.torques.size() > 0)
      motions.push_back(
          {{"name", arguments.motion}, {"page", Json()}, {"motors", {describeMotor(found[i], demand, motor)}}});
    designs.push_back({{"name", name},
                       {"architecture", ""},
                       {"status", ""},
                       {"values", table.values},
                       {"svg", mechanism["svg"]},
                       {"distances", mechanism["distances"]},
                       {"directory", name},
                       {"files", {name + "/" + name + ".yaml"}},
                       {"text", formatBiped(found[i], demand.drawn_at)},
                       {"motions", motions}});
  }
  writeTextFile((fs::path(arguments.directory) / "synthesis.html").string(),
                makeDesignPage({{"title", "Four-bars for a joint"},
                                {"baseline", false},
                                {"best", 0},
                                {"plot", "Value and margin"},
                                {"axes", {0, 1}},
                                {"columns", columns},
                                {"designs", designs}}));
}

int synthesize(const SynthesizeArguments& arguments) {
  const JointDemand demand = makeDemand(arguments);
  const FourBarSpace space = makeSpace(arguments);
  const int threads = arguments.threads > 0 ? arguments.threads : static_cast<int>(std::thread::hardware_concurrency());
  const std::vector<FoundFourBar> found =
      searchFourBars(demand, space, arguments.samples, arguments.count, arguments.seed, threads);
  if (found.empty()) {
    std::cerr << "bielle: none of " << arguments.samples
              << " four-bars closes over the whole range with this margin; widen the bounds, or lower --margin\n";
    return kFailed;
  }
  makeOutputDirectory(arguments.directory);
  const bool has_torques = demand.torques.size() > 0;
  std::vector<Row> rows = {{"",
                            has_torques            ? "rms [N m]"
                            : demand.ratios.size() ? "deviation"
                                                   : "spread",
                            "ratio", "sine", "motor x, z [m]", "crank", "arm [m]"}};
  if (has_torques) rows[0].insert(rows[0].end(), {"peak [N m]", "[rad/s]"});
  for (size_t i = 0; i < found.size(); ++i) {
    const FoundFourBar& f = found[i];
    const std::string name = getLegName(i);
    const auto text = [](double value) { return formatNumber(value, "%.4g"); };
    rows.push_back({name, text(f.value), text(f.least_ratio) + " .. " + text(f.largest_ratio), text(f.least_sine),
                    text(f.drawing.motor_x) + ", " + text(f.drawing.motor_z), text(f.drawing.crank),
                    text(f.drawing.arm)});
    if (has_torques) rows.back().insert(rows.back().end(), {text(f.peak_torque), text(f.peak_speed)});
    const fs::path directory = fs::path(arguments.directory) / name;
    makeOutputDirectory(directory.string());
    writeTextFile((directory / (name + ".yaml")).string(), formatBiped(f, demand.drawn_at));
  }
  writeFourBars(arguments, found, demand, space);
  printTable(std::cout, rows);
  std::cout << "  " << arguments.directory << "/synthesis.html\n  " << arguments.directory << "\n";
  return kOk;
}

}  // namespace

void addSynthesize(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("synthesize", "Find linkages that move a joint as requested");
  const auto a = std::make_shared<SynthesizeArguments>();
  const auto add_pair = [&command](const char* flag, std::vector<double>& pair, const char* help) {
    return command.add_option(flag, pair, help)->expected(2)->delimiter(':')->type_name("LOW:HIGH");
  };
  CLI::Option* range = add_pair("--range", a->range, "angles of the joint [rad]");
  CLI::Option* ratio = command.add_option("--ratio", a->ratio,
                                          "requested turns of the motor per turn of the joint, over the whole range");
  CLI::Option* joint = command.add_option("--joint", a->joint, "joint of --like or --motion");
  CLI::Option* like = command.add_option("--like", a->like, "robot whose linkage has the requested ratios");
  CLI::Option* motion = command.add_option(
      "--motion", a->motion, "result of a motion whose motor is on the joint: the least heat of the motor");
  command.add_option("--motor", a->motor, "motor of the catalogue, whose speed must not be exceeded")->needs(motion);
  like->needs(joint)->excludes(ratio);
  motion->needs(joint)->excludes(range)->excludes(ratio)->excludes(like);
  add_pair("--motor-x", a->motor_x, "place of the motor in front of the joint [m]")->capture_default_str();
  add_pair("--motor-z", a->motor_z, "place of the motor above the joint [m]")->capture_default_str();
  add_pair("--crank", a->crank, "length of the crank [m]")->capture_default_str();
  add_pair("--arm", a->arm, "length of the joint's arm [m]")->capture_default_str();
  command.add_option("--margin", a->margin, "least sine of the angles between rod, crank and arm; 0 at dead points")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_option("--clearance", a->clearance, "least distance of the rod from the joint's axis [m]")
      ->capture_default_str();
  command.add_option("--samples", a->samples, "four-bars at random")
      ->check(CLI::Range(1L, 1000000000L))
      ->capture_default_str();
  command.add_option("--count", a->count, "four-bars kept")->check(CLI::Range(1, 50))->capture_default_str();
  command.add_option("--seed", a->seed, "of the random numbers")->capture_default_str();
  command.add_option("--threads", a->threads, "threads; 0: one per core")->capture_default_str();
  command
      .add_option("-o,--output", a->directory,
                  "directory of the bipeds whose knees they move, with the page synthesis.html")
      ->required();
  command.footer(
      "Draws plane four-bars at random, ranks them by their closed form, refines the best fifty and writes for each a\n"
      "biped whose knees it moves: the part `drawn` (docs/parts.md) with its numbers. Without a request, the best "
      "ratio is\n"
      "the most constant one. Exit status: 0 done, 1 none found, 2 bad input.\n"
      "Examples:\n"
      "  bielle synthesize --range 0:1.6 --ratio 0.9 -o knees\n"
      "  bielle synthesize --range 0.1:1.1 --like bipetto --joint knee_right -o again\n"
      "  bielle solve walk --robot rsu_biped -o walk\n"
      "  bielle synthesize --motion walk --joint knee_left -o for_walks");
  command.callback([&action, a] { action = [a] { return synthesize(*a); }; });
}

}  // namespace bielle::cli
