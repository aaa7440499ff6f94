// bielle synthesize: linkages for a joint, from what it is asked for.
#include <cmath>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <thread>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "design/fourbar_search.h"
#include "formats/motor_catalogue.h"
#include "formats/text_file.h"
#include "model/listing.h"
#include "model/number_text.h"
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
    throw InputError(robot, "joint '" + joint + "'", "its linkage has several motors", "name one of one");
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

// Angle, torque and speed of a joint that its motor drives, at the stages of a motion; the angles need no order but for the ends.
JointDemand readMotion(const SynthesizeArguments& arguments) {
  const ReportRun run = readRun(arguments.motion);
  const Model& model = run.robot.model;
  JointDemand demand;
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[static_cast<size_t>(m)];
    if (motor.name != arguments.joint) continue;
    const Joint& joint = model.joints()[static_cast<size_t>(motor.joint)];
    const Eigen::Index n = run.record.u.rows();
    demand.angles = run.record.q.col(joint.idx_q).head(n);
    demand.speeds = run.record.v.col(joint.idx_v).head(n);
    demand.torques = run.record.u.col(m);
    return demand;
  }
  std::vector<std::string> names;
  for (const Motor& motor : model.motors()) names.push_back(motor.name);
  throw InputError(arguments.motion, "joint '" + arguments.joint + "'", "no motor drives it by itself",
                   "solve the motion with a robot whose motor is on the joint; its motors are on " + listItems(names));
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
  if (!arguments.motor.empty()) {
    Motor motor;
    readYamlDocument("--motor", "[" + arguments.motor + "]", [&](const YamlEntry& root) {
      motor = readMotorTypes(root.getList(), "--motor", nullptr).front();
    });
    demand.largest_speed = motor.velocity_limit;
  }
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

// The part, whose parameters are the numbers of its drawing.
std::string formatPart(const FoundFourBar& found, double drawn_at) {
  const FourBarDrawing& d = found.drawing;
  const auto number = [](double value) { return formatNumber(value, "%.9g"); };
  const auto line = [&](const char* name, double value, const char* unit, double low, double high, const char* help) {
    return std::string("  ") + name + ": {value: " + number(value) + ", unit: " + unit + ", bounds: [" + number(low) +
           ", " + number(high) + "], help: " + help + "}\n";
  };
  std::ostringstream text;
  text << "# Found by `bielle";
  for (size_t i = 1; i < getCommandLine().size(); ++i) text << " " << getCommandLine()[i];
  text
      << "`.\n"
      << "# Ratio " << number(found.least_ratio) << " to " << number(found.largest_ratio) << ", least sine "
      << number(found.least_sine) << ".\n"
      << "help: a motor, crank and rod (found for its joint)\n"
      << "mounts: {base: link, output: link, joint: joint}\n"
      << "parameters:\n  thigh_length: {unit: m}\n  rod_density: {unit: kg/m}\n  motor_mass: {unit: kg}\n"
      << "  armature: {unit: kg m^2}\n"
      << line("found_x", d.motor_x, "m", -1, 1, "distance of the motor in front of the joint")
      << line("found_z", d.motor_z, "m", -1, 1, "height of the motor above the joint")
      << line("found_crank", d.crank, "m", 0.001, 1, "length of the crank")
      << line("found_crank_angle", d.crank_angle, "rad", -7, 7, "its angle from x towards z in the drawing")
      << line("found_arm", d.arm, "m", 0.001, 1, "length of the arm")
      << line("found_arm_angle", d.arm_angle, "rad", -7, 7, "its angle likewise")
      << line("found_drawn_at", drawn_at, "rad", -7, 7, "angle of the joint in the drawing")
      << "let:\n  aside: -0.04*y\n"
      << "  motor: [found_x, -0.04, found_z - thigh_length]\n"
      << "  arm_x: found_arm*cos(found_arm_angle)\n  arm_z: found_arm*sin(found_arm_angle)\n"
      << "linkage:\n  base: base\n  through: aside\n  density: rod_density\n  points:\n"
      << "    motor: [motor.x, motor.z]\n"
      << "    crank: [motor.x + found_crank*cos(found_crank_angle), motor.z + found_crank*sin(found_crank_angle)]\n"
      << "    arm: [arm_x, arm_z - thigh_length]\n"
      << "  fixed:\n    base: [motor]\n    output: {points: [arm], angles: {joint: found_drawn_at}}\n"
      << "  bars:\n    crank_{part}: {points: [motor, crank], radius: 0.01}\n    rod_{part}: [crank, arm]\n"
      << "  hinges: {motor: \"motor_{part}\"}\ntree: {}\n"
      << "solids:\n  base: [{motor: motor_mass, at: motor, axis: y}]\n"
      << "  output: [{rod: [aside, [arm_x*cos(found_drawn_at) - arm_z*sin(found_drawn_at), -0.04, "
         "arm_x*sin(found_drawn_at) + arm_z*cos(found_drawn_at)]], radius: 0.01, density: rod_density, color: steel}]\n"
      << "motors:\n  motor_{part}: {armature: armature}\n";
  return text.str();
}

int synthesize(const SynthesizeArguments& arguments) {
  const JointDemand demand = makeDemand(arguments);
  const int threads = arguments.threads > 0 ? arguments.threads : static_cast<int>(std::thread::hardware_concurrency());
  const std::vector<FoundFourBar> found =
      searchFourBars(demand, makeSpace(arguments), arguments.samples, arguments.count, arguments.seed, threads);
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
    const std::string number = std::to_string(i + 1), name = "found_" + number;
    const auto text = [](double value) { return formatNumber(value, "%.4g"); };
    rows.push_back({name, text(f.value), text(f.least_ratio) + " .. " + text(f.largest_ratio), text(f.least_sine),
                    text(f.drawing.motor_x) + ", " + text(f.drawing.motor_z), text(f.drawing.crank),
                    text(f.drawing.arm)});
    if (has_torques) rows.back().insert(rows.back().end(), {text(f.peak_torque), text(f.peak_speed)});
    const fs::path directory = arguments.directory;
    writeTextFile((directory / (name + ".yaml")).string(), formatPart(f, demand.drawn_at));
    const fs::path leg = directory / ("leg_" + number);
    makeOutputDirectory(leg.string());
    writeTextFile((leg / ("leg_" + number + ".yaml")).string(),
                  "generator: leg_biped\nset: {knee: ../" + name + ".yaml}\n");
  }
  printTable(std::cout, rows);
  std::cout << "  " << arguments.directory << "\n";
  return kOk;
}

}  // namespace

void addSynthesize(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("synthesize", "Find linkages that move a joint as it is asked for");
  const auto a = std::make_shared<SynthesizeArguments>();
  const auto add_pair = [&command](const char* flag, std::vector<double>& pair, const char* help) {
    return command.add_option(flag, pair, help)->expected(2)->delimiter(':')->type_name("LOW:HIGH");
  };
  add_pair("--range", a->range, "angles of the joint [rad]");
  command.add_option("--ratio", a->ratio, "wished turns of the motor per turn of the joint, all over the range");
  command.add_option("--like", a->like, "robot whose linkage has the wished ratios, with --joint");
  command.add_option("--motion", a->motion,
                     "result of a motion whose motor is on the joint, with --joint: the least heat of the motor");
  command.add_option("--joint", a->joint, "joint of --like or --motion");
  command.add_option("--motor", a->motor, "motor of the catalogue, whose speed must not be exceeded, with --motion");
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
  command.add_option("-o,--output", a->directory, "directory of the parts and of bipeds with them")->required();
  command.footer(
      "Draws plane four-bars at random, ranks them by their closed form, refines the best fifty and writes each as a "
      "part\n"
      "(docs/parts.md) whose numbers are parameters, with a biped whose knees it moves. Without a wish, the ratio that "
      "is\n"
      "most constant is best. Exit status: 0 done, 1 none found, 2 bad input.\n"
      "Examples:\n"
      "  bielle synthesize --range 0:1.6 --ratio 0.9 -o knees\n"
      "  bielle synthesize --range 0.1:1.1 --like bipetto --joint knee_right -o again\n"
      "  bielle solve walk --robot rsu_biped -o walk\n"
      "  bielle synthesize --motion walk --joint knee_left -o for_walks");
  command.callback([&action, a] { action = [a] { return synthesize(*a); }; });
}

}  // namespace bielle::cli
