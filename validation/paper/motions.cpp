// bielle-paper walk, jump and lift-walk: the paper's own motions, with results as `bielle solve` and `bielle lift` write them.
#include <chrono>
#include <iostream>
#include <optional>

#include "bielle/model/error.h"
#include "bielle/motion/described_options.h"
#include "bielle/motion/solve.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "paper/commands.h"
#include "paper/jump.h"
#include "paper/walk.h"
#include "results/option_flags.h"

namespace bielle::paper {
namespace {

constexpr const char* kArmature = "1e-3";  // of the motors on serial joints, kg m^2

struct MotionArguments {
  std::string robot = "bipetto", directory;
  bool serial = false;
  WalkOptions walk;
  JumpOptions jump;
};

using Maker = std::function<Motion(const Model&, const VectorXd& q0)>;

void print(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) std::cout << "  " << path << "\n";
}

SerialModel makeSerial(const Model& model) {
  return makeSerialModel(model, makeStandingPosture(model), parseSerialArmature(kArmature));
}

int solve(const MotionArguments& arguments, const CommandLine& command, const Maker& make) {
  const LoadedRobot robot = loadRobot(arguments.robot);
  std::optional<SerialModel> serial;
  if (arguments.serial) serial = makeSerial(robot.model);
  const Model& model = serial ? serial->model : robot.model;
  const Motion motion = make(model, makeStandingPosture(model));
  makeOutputDirectory(arguments.directory);
  const Solution solution = bielle::solve(motion);
  const RunInfo run =
      makeRunInfo(arguments.robot, robot, command, serial ? Belief::Serial : Belief::Closed, serial ? kArmature : "");
  const MotionResult result = makeResult(run, solution);
  std::cout << motion.name << " of " << arguments.robot << ": " << getName(solution.summary.termination) << ", "
            << solution.summary.iterations << " iterations, cost " << solution.summary.cost << "\n";
  print(writeResult(arguments.directory, result));
  return result.converged() ? 0 : 1;
}

struct LiftArguments {
  std::string serial_directory, directory;
  LiftOptions options;
};

int liftWalk(const LiftArguments& arguments, const CommandLine& command) {
  const MotionSummary summary = readSummary(arguments.serial_directory);
  if (summary.motion != "paper-walk" || summary.run.model != Belief::Serial)
    throw InputError(summary.file, "motion '" + summary.motion + "' of the " + getName(summary.run.model) + " model",
                     "it is not the paper's walk of the serial model", "make one with `bielle-paper walk --serial`");
  WalkOptions walk;
  for (const auto& [name, value] : summary.options)
    if (name == "speed") walk.speed = std::get<double>(value);
  const LoadedRobot robot = loadRobotOf(arguments.serial_directory);
  for (const std::string& warning : robot.warnings) std::cerr << "bielle-paper: warning: " << warning << "\n";
  const SerialModel serial = makeSerial(robot.model);
  const Motion motion = makeWalk(serial.model, walk, makeStandingPosture(serial.model));
  const SerialTrajectory trajectory = makeSerialTrajectory(motion, readResultRecord(arguments.serial_directory));
  makeOutputDirectory(arguments.directory);
  const auto start = std::chrono::steady_clock::now();
  const LiftResult lifted = lift(robot.model, serial, trajectory, arguments.options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::optional<MotionResult> result;
  if (!lifted.trajectory.us.empty())
    result = makeLiftedResult(makeRunInfo(summary.run.robot, robot, command), robot.model, motion, lifted, seconds);
  print(writeLift(arguments.directory, arguments.options.method, lifted, result ? &*result : nullptr));
  return lifted.lifted() ? 0 : 1;
}

CLI::App& addMotion(CLI::App& app, const char* name, const char* help, Action& action,
                    const std::shared_ptr<MotionArguments>& arguments, const Maker& make) {
  CLI::App& command = *app.add_subcommand(name, help);
  command.add_option("--robot", arguments->robot, "name, directory or file of a robot")->capture_default_str();
  command.add_option("-o,--output", arguments->directory, "directory of the results")->required();
  command.add_flag("--serial", arguments->serial, "the approximate serial model in place of the closed one");
  command.callback(
      [&action, arguments, make] { action = [=](const CommandLine& line) { return solve(*arguments, line, make); }; });
  return command;
}

}  // namespace

void addMotions(CLI::App& app, Action& action) {
  const auto walk = std::make_shared<MotionArguments>(), jump = std::make_shared<MotionArguments>();
  addMotion(app, "walk", "The paper's walk: a velocity instead of footholds", action, walk,
            [walk](const Model& model, const VectorXd& q0) { return makeWalk(model, walk->walk, q0); })
      .add_option("--speed", walk->walk.speed, "requested of the centre of mass [m/s]")
      ->capture_default_str();
  addMotion(app, "jump", "The paper's jump: only the height at mid-flight, no foot paths", action, jump,
            [jump](const Model& model, const VectorXd& q0) { return makeJump(model, jump->jump, q0); })
      .add_option("--flight", jump->jump.flight, "time in the air [s]")
      ->capture_default_str();
}

void addLift(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("lift-walk", "Lift a walk of the serial model to the closed robot");
  const auto arguments = std::make_shared<LiftArguments>();
  command.add_option("DIR", arguments->serial_directory, "result of `bielle-paper walk --serial`")->required();
  command.add_option("-o,--output", arguments->directory, "directory of the results")->required();
  addFlags(arguments->options, command);
  command.callback(
      [&action, arguments] { action = [=](const CommandLine& line) { return liftWalk(*arguments, line); }; });
}

}  // namespace bielle::paper
