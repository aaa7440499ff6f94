#include <algorithm>
#include <filesystem>
#include <iostream>

#include "bielle/dynamics/loop_conflict.h"
#include "bielle/io/robot_info.h"
#include "cli/commands.h"

namespace bielle::cli {
namespace {

std::vector<std::string> command_line;

// Flags are written with hyphens.
std::string makeFlag(std::string option) {
  std::replace(option.begin(), option.end(), '_', '-');
  return "--" + option;
}

}  // namespace

LoadedRobot RobotArgument::load() const {
  LoadOptions options;
  if (fixed_base) options.base = BaseKind::Fixed;
  LoadedRobot robot = loadRobot(name, options);
  const std::vector<std::string> moved = checkReferences(robot);
  robot.warnings.insert(robot.warnings.end(), moved.begin(), moved.end());
  for (const std::string& warning : robot.warnings) std::cerr << "bielle: warning: " << warning << "\n";
  const AssemblyResult closed = findClosedConfiguration(robot.model);
  if (closed.status != AssemblyStatus::Closed) throw makeClosingError(robot.model, robot.directory, closed);
  return robot;
}

std::vector<std::string> listFiles(const LoadedRobot& robot) {
  const std::filesystem::path file = robot.file;
  return {robot.directory, robot.file, std::filesystem::path(file).replace_extension(".yaml").string()};
}

void addFixedBase(CLI::App& command, RobotArgument& robot) {
  command.add_flag("--fixed-base", robot.fixed_base, "fix the root link to the ground");
}

void addOption(CLI::App& command, const OptionEntry& option) {
  if (option.names.empty()) {
    command.add_option(makeFlag(option.name), *option.value, option.help + " [" + option.unit + "]")
        ->capture_default_str();
    return;
  }
  command
      .add_option_function<std::string>(
          makeFlag(option.name),
          [option](const std::string& name) {
            *option.value = std::find(option.names.begin(), option.names.end(), name) - option.names.begin();
          },
          option.help)
      ->check(CLI::IsMember(option.names))
      ->default_str(option.names.at(static_cast<size_t>(*option.value)));
}

void setCommandLine(int argc, char** argv) { command_line.assign(argv, argv + argc); }
const std::vector<std::string>& getCommandLine() { return command_line; }

}  // namespace bielle::cli
