#pragma once
// The subcommands of `bielle`, one per file. Each adds itself to the parser and, if it was called, leaves its action.
#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>

#include "bielle/model/reader.h"

namespace bielle::cli {

// Exit statuses.
constexpr int kOk = 0, kFailed = 1, kBadInput = 2;

using Action = std::function<int()>;  // returns the exit status

void addSolve(CLI::App& app, Action& action);
void addReport(CLI::App& app, Action& action);
void addView(CLI::App& app, Action& action);
void addExport(CLI::App& app, Action& action);
void addInfo(CLI::App& app, Action& action);
void addEval(CLI::App& app, Action& action);
void addDesign(CLI::App& app, Action& action);
void addCompare(CLI::App& app, Action& action);
void addGenerate(CLI::App& app, Action& action);
void addRobots(CLI::App& app, Action& action);
void addBench(CLI::App& app, Action& action);
void addRatio(CLI::App& app, Action& action);
void addLift(CLI::App& app, Action& action);
void addStudy(CLI::App& app, Action& action);

// bielle validate and bielle check: only their lines of the help, their arguments are those of other programs.
void addCompanions(CLI::App& app);
// Becomes that program; returns only when it cannot. `arguments` ends with a null pointer and begins with a name.
int becomeCompanion(const std::string& name, char** arguments);
// Runs it to its end. Its exit status, kFailed with a line of error when a signal ended it or it cannot be started, or
// nothing when it is not there.
std::optional<int> runCompanion(const std::string& name, std::vector<std::string> arguments);

// Arguments of every command with a robot.
struct RobotArgument {
  std::string name;
  bool fixed_base = false;
  // Loads the robot and prints its warnings to the standard error.
  LoadedRobot load() const;
};
void addFixedBase(CLI::App& command, RobotArgument& robot);

// name=number. \throws ModelError that shows the example
std::pair<std::string, double> parseSetting(const std::string& flag, const std::string& setting,
                                            const std::string& example);

// The whole command line, for the record.
void setCommandLine(int argc, char** argv);
const std::vector<std::string>& getCommandLine();

}  // namespace bielle::cli
