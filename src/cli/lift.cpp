// bielle lift: a motion of the serial model on the closed robot.
#include <algorithm>
#include <chrono>
#include <iostream>
#include <optional>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/described_options.h"
#include "bielle/motion/registry.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "motion/applied_options.h"
#include "results/option_flags.h"
#include "results/output_place.h"

namespace bielle::cli {
namespace {

struct LiftArguments {
  std::string serial_directory, directory;
  LiftOptions options;
};

void printOutcome(const LiftArguments& arguments, const LiftResult& lifted, const MotionResult* result, int stages) {
  const std::vector<LiftNode>& nodes = lifted.nodes;
  LiftNode worst = nodes.front();
  for (const LiftNode& node : nodes) {
    worst.position_error = std::max(worst.position_error, node.position_error);
    worst.velocity_error = std::max(worst.velocity_error, node.velocity_error);
    worst.acceleration_error = std::max(worst.acceleration_error, node.acceleration_error);
    worst.margin = std::min(worst.margin, node.margin);
  }
  if (lifted.lifted())
    std::cout << "lifted: all " << nodes.size() << " nodes";
  else
    std::cout << "not lifted: node " << nodes.size() - 1 << " of " << stages << ", " << getName(nodes.back().status)
              << ": " << nodes.back().message;
  std::cout << " (" << getName(arguments.options.method) << ")\n";
  std::vector<Row> rows = {{"position error", formatNumber(worst.position_error, "%.2e") + " rad or m"},
                           {"velocity error", formatNumber(worst.velocity_error, "%.2e") + " rad/s or m/s"},
                           {"acceleration error", formatNumber(worst.acceleration_error, "%.2e") + " rad/s^2 or m/s^2"},
                           {"smallest margin", formatNumber(worst.margin, "%.4f") + " (0: dead point of a joint)"}};
  if (result) {
    for (const GoalOutcome& outcome : result->goals) rows.push_back({outcome.goal.name, formatOutcome(outcome)});
    rows.push_back({"closure gap", formatNumber(result->gap_position, "%.2e") + " m"});
    rows.push_back({"contact slip", formatNumber(result->slip_position, "%.2e") + " m"});
  }
  printTable(std::cout, rows);
  if (!result) return;
  const MotionRecord& record = result->record;
  std::vector<Row> motors = {{"motor", "peak torque [N m]", "peak speed [rad/s]"}};
  for (size_t m = 0; m < record.u_names.size(); ++m) {
    const int at = findColumn(record.v_names, record.u_names[m]);
    motors.push_back({record.u_names[m], formatNumber(record.u.col(m).cwiseAbs().maxCoeff(), "%.3f"),
                      formatNumber(record.v.col(at).cwiseAbs().maxCoeff(), "%.3f")});
  }
  printTable(std::cout, motors);
}

int run(const LiftArguments& arguments) {
  requireApart(arguments.directory, {arguments.serial_directory});
  const MotionSummary summary = readSummary(arguments.serial_directory);
  if (summary.run.model != Belief::Serial)
    throw InputError(summary.file, std::string("model '") + getName(summary.run.model) + "'",
                     "it is not a motion of the serial model",
                     "make one with `bielle solve " + summary.motion + " --model serial`");
  if (summary.step != StepRule::Euler)
    throw InputError(summary.file, std::string("step '") + getName(summary.step) + "'",
                     "only motions with Euler steps, which have accelerations at their nodes, can be lifted",
                     "make one with `bielle solve " + summary.motion + " --model serial --step euler`");
  const MotionRecord record = readResultRecord(arguments.serial_directory);
  const LoadedRobot robot = loadRobotOf(arguments.serial_directory);
  printWarnings(robot.warnings);
  const SerialModel serial =
      makeSerialModel(robot.model, makeStandingPosture(robot.model), parseSerialArmature(summary.run.serial_armature));
  MotionPlan plan = remakeRequest(summary).plan(serial.model, makeStandingRobot(serial.model));
  fixTimings(summary.timings, StepRule::Euler, plan.schedule, plan.stages);
  const Motion motion = makeMotion(serial.model, std::move(plan), {summary.formulation, StepRule::Euler});
  const SerialTrajectory trajectory = makeSerialTrajectory(motion, record);
  makeOutputDirectory(arguments.directory);

  const auto start = std::chrono::steady_clock::now();
  const LiftResult lifted = lift(robot.model, serial, trajectory, arguments.options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::optional<MotionResult> result;
  if (!lifted.trajectory.us.empty())
    result =
        makeLiftedResult(makeRunInfo(summary.run.robot, robot, getCommandLine()), robot.model, motion, lifted, seconds);
  const MotionResult* written = result ? &*result : nullptr;
  printOutcome(arguments, lifted, written, static_cast<int>(trajectory.a.size()));
  for (const std::string& path : writeLift(arguments.directory, arguments.options.method, lifted, written))
    std::cout << "  " << path << "\n";
  return lifted.lifted() ? kOk : kFailed;
}

}  // namespace

void addLift(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<LiftArguments>();
  command.add_option("DIR", arguments->serial_directory, "result of `bielle solve MOTION --model serial`")->required();
  command
      .add_option("-o,--output", arguments->directory,
                  "directory for lift.json, trajectory.csv, trajectory.npz and summary.json; created if necessary")
      ->required();
  addFlags(arguments->options, command);
  command.footer(
      "The closed robot takes on the serial model's postures, velocities and accelerations wherever its linkages "
      "allow;\n"
      "motor torques follow from these. A failed lift reports the node and the reason, and writes the lifted part.\n"
      "Exit status: 0 lifted, 1 not lifted, 2 bad input.\n"
      "Examples:\n"
      "  bielle solve squat --robot bipetto --depth 0.8 --model serial -o serial\n"
      "  bielle lift serial -o lifted\n"
      "  bielle lift serial -o lifted --method nlopt");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
