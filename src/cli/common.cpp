#include <algorithm>
#include <charconv>
#include <iostream>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/error.h"
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
  for (const std::string& warning : robot.warnings) std::cerr << "bielle: warning: " << warning << "\n";
  const AssemblyResult closed = findClosedConfiguration(robot.model);
  if (closed.status != AssemblyStatus::Closed) {
    std::ostringstream gap;
    gap << "its loop cannot be closed: from no start does it come nearer than " << closed.gap << " (m or rad)";
    throw ModelError(robot.directory, closed.worst, gap.str(),
                     "check the lengths and frames along the loop, or give a reference posture near a closed one");
  }
  return robot;
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

std::pair<std::string, double> parseSetting(const std::string& flag, const std::string& setting,
                                            const std::string& example) {
  const size_t equals = setting.find('=');
  double value = 0;
  const char* end = setting.data() + setting.size();
  const char* begin = equals == std::string::npos ? end : setting.data() + equals + 1;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end)
    throw ModelError("", flag + " '" + setting + "'", "it is not of the form name=number",
                     "e.g. " + flag + " " + example);
  return {setting.substr(0, equals), value};
}

void setCommandLine(int argc, char** argv) { command_line.assign(argv, argv + argc); }
const std::vector<std::string>& getCommandLine() { return command_line; }

}  // namespace bielle::cli
