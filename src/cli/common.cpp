#include <iostream>

#include "cli/commands.h"

namespace bielle::cli {
namespace {

std::vector<std::string> command_line;

}  // namespace

LoadedRobot RobotArgument::load() const {
  LoadOptions options;
  if (fixed_base) options.base = BaseKind::Fixed;
  LoadedRobot robot = loadRobot(name, options);
  for (const std::string& warning : robot.warnings) std::cerr << "bielle: warning: " << warning << "\n";
  return robot;
}

void addFixedBase(CLI::App& command, RobotArgument& robot) {
  command.add_flag("--fixed-base", robot.fixed_base, "fix the root link to the ground");
}

void setCommandLine(int argc, char** argv) { command_line.assign(argv, argv + argc); }
const std::vector<std::string>& getCommandLine() { return command_line; }

}  // namespace bielle::cli
