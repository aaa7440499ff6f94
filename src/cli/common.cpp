#include <filesystem>
#include <iostream>

#include "bielle/formats/reader.h"
#include "bielle/results/robot_info.h"
#include "cli/commands.h"
#include "dynamics/loop_conflict.h"
#include "formats/robot_files.h"
#include "results/option_flags.h"

namespace bielle::cli {
namespace {

std::vector<std::string> command_line;
bool is_verbose = false;

}  // namespace

void printWarnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) std::cerr << "bielle: warning: " << warning << "\n";
}

LoadedRobot RobotArgument::load() const {
  LoadOptions options;
  if (fixed_base) options.base = BaseKind::Fixed;
  LoadedRobot robot = loadRobot(name, options);
  const std::vector<std::string> moved = checkReferences(robot);
  robot.warnings.insert(robot.warnings.end(), moved.begin(), moved.end());
  printWarnings(robot.warnings);
  if (is_verbose)
    for (const std::string& line : listHarmless(robot.path())) std::cerr << "bielle: left out: " << line << "\n";
  const AssemblyResult closed = findClosedConfiguration(robot.model);
  if (closed.status != NumericalStatus::Ok) throw makeClosingError(robot.model, robot.path(), closed);
  return robot;
}

std::vector<std::string> listFiles(const LoadedRobot& robot) {
  const std::filesystem::path file = robot.file;
  return {robot.directory, robot.file, std::filesystem::path(file).replace_extension(".yaml").string()};
}

void addRobot(CLI::App& command, RobotArgument& robot, const char* name) {
  command.add_option(name, robot.name, kRobotHelp)->required();
}

void addVerbose(CLI::App& command) {
  command.add_flag("--verbose", is_verbose,
                   "list what is left out of the robot's file and changes no mechanism, such as cameras");
}

void addRobotFlags(CLI::App& command, RobotArgument& robot) {
  command.add_flag("--fixed-base", robot.fixed_base, "fix the root link to the ground");
  addVerbose(command);
}

void addOption(CLI::App& command, const Option& option, const std::function<void(const OptionValue&)>& set) {
  const std::string flag = makeFlag(option.name);
  if (std::holds_alternative<bool>(option.value)) {
    command.add_flag_callback(
        flag, [set] { set(true); }, option.help);
    return;
  }
  CLI::Option* added = command.add_option_function<std::string>(
      flag, [set](const std::string& text) { set(parseOption(text)); },
      option.help + (option.unit.empty() ? "" : " [" + option.unit + "]"));
  added->default_str(formatOption(option.value));
  if (!option.unit.empty()) added->type_name(std::holds_alternative<int>(option.value) ? "INT" : "FLOAT");
  if (!option.choices.empty()) added->check(CLI::IsMember(option.choices));
}

void setCommandLine(int argc, char** argv) { command_line.assign(argv, argv + argc); }
const std::vector<std::string>& getCommandLine() { return command_line; }

}  // namespace bielle::cli
