// bielle ratio: reduction ratios of a linkage, and its dead points.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "cli/ratio_report.h"
#include "results/option_flags.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

// Relative residual of the virtual work.
constexpr double kBalanceTolerance = 1e-8;

struct RatioArguments {
  RobotArgument robot;
  std::vector<std::string> joints;
  std::string reference, directory;
  int grid = 25;
  SweepOptions sweep;
  bool json = false;
};

void describe(OptionFields& f, RatioArguments& a) {
  f.text("reference", a.reference, "start from this reference of the robot; default: the first");
  f.number("step", a.sweep.step, "rad", {1e-4, 0.2}, "largest step along the linkage, all its joints together");
  f.integer("grid", a.grid, {2, 500}, "number of angles of the first joint in the map of a linkage with two motors");
  f.flag("json", a.json, "print JSON");
}

VectorXd findStart(const LoadedRobot& robot, const std::string& reference) {
  if (reference.empty()) return findClosedConfiguration(robot.model).q;
  const AssemblyResult result = assembleReference(robot.model, reference);
  if (result.status != NumericalStatus::Ok)
    throw InputError(robot.path(), "reference '" + reference + "'", result.message, "start from another one");
  return result.q;
}

double calcLargestBalanceError(const Model& model, const RatioReport& report, const VectorXd& q) {
  double largest = 0;
  for (const RatioSample& sample : report.sweep.samples) {
    if (sample.dead == DeadPointKind::Output || sample.loses_rank) continue;
    const VectorXd whole = carryLinkage(model, report.linkage, sample, q);
    largest = std::max(largest, calcBalanceError(model, report.linkage, whole, sample.ratio.R));
  }
  return largest;
}

int run(const RatioArguments& arguments) {
  const LoadedRobot robot = arguments.robot.load();
  const Model& model = robot.model;
  RatioReport report;
  report.robot = arguments.robot.name;
  const VectorXd q = findStart(robot, arguments.reference);
  report.linkage = makeLinkage(model, q, arguments.joints);
  report.sweep = sweepRatio(model, report.linkage, q, 0, arguments.sweep);
  if (report.linkage.size() == 2) report.map = mapRatio(model, report.linkage, q, arguments.grid, arguments.sweep);
  addDistances(model, report.linkage, q, report.sweep);
  report.balance_error = calcLargestBalanceError(model, report, q);
  std::vector<std::string> written;
  if (!arguments.directory.empty()) {
    makeOutputDirectory(arguments.directory);
    written = writeReport(arguments.directory, report);
  }
  if (arguments.json)
    std::cout << formatJson(describeReport(report)) << "\n";
  else
    printReport(std::cout, report);
  for (const std::string& line : written) (arguments.json ? std::cerr : std::cout) << "  " << line << "\n";
  return report.balance_error < kBalanceTolerance ? kOk : kFailed;
}

}  // namespace

void addRatio(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<RatioArguments>();
  addRobot(command, arguments->robot);
  command
      .add_option("--joint", arguments->joints,
                  "joint to sweep; then the other joints of its linkage, unless the robot's serial joints name them")
      ->required();
  command.add_option("-o,--output", arguments->directory,
                     "directory for ratio.csv, ratio.json, ratio.svg (and map.csv)");
  addFlags(*arguments, command);
  addRobotFlags(command, arguments->robot);
  command.footer(
      "The ratio R is the speed of a motor over that of a joint [rad/rad], v_motor = R v_joint; motor torques u give "
      "the\n"
      "joint torques R^T u. dR is its derivative with respect to the swept angle [1/rad]. The linkage is followed\n"
      "from its start until a joint limit, a loss of rank, or a full turn, through its dead points:\n"
      "  output  the joint stands still while the motor turns: R is infinite, the angle reverses, another branch "
      "begins\n"
      "  motors  the motor stands still while the joint turns: R is zero (singular), the motor does not hold the "
      "joint\n"
      "The distance from the nearest of them is the largest way of a motor or joint to there [rad], up to 0.5.\n"
      "A linkage with two motors gets a 2 x 2 R, its condition number, and a map over both joints, up to the first "
      "dead\n"
      "points. Virtual work is checked by the constrained dynamics of the whole robot at every sample. Figures are "
      "drawn\n"
      "by gnuplot, if installed. Exit status: 0 done, 1 virtual work does not balance, 2 bad input.\n"
      "Examples:\n"
      "  bielle ratio bipetto --joint knee_right\n"
      "  bielle ratio bipetto --joint ankley_right -o ankle\n"
      "  bielle ratio fivebar --joint elbow_left elbow_right --json");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
