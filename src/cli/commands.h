#pragma once
// The commands of `bielle`, one per file. Each declares its arguments and, if it is called, sets the action.
#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>

#include "bielle/formats/reader.h"
#include "bielle/model/options.h"
#include "bielle/motion/motion.h"

namespace bielle::cli {

// Exit statuses.
constexpr int kOk = 0, kFailed = 1, kBadInput = 2;

using Action = std::function<int()>;  // returns the exit status

void addSolve(CLI::App& command, Action& action);
void addReport(CLI::App& command, Action& action);
void addView(CLI::App& command, Action& action);
void addExport(CLI::App& command, Action& action);
void addConvert(CLI::App& command, Action& action);
void addAdopt(CLI::App& command, Action& action);
void addInfo(CLI::App& command, Action& action);
void addEval(CLI::App& command, Action& action);
void addDesign(CLI::App& command, Action& action);
void addCompare(CLI::App& command, Action& action);
void addGenerate(CLI::App& command, Action& action);
void addRobots(CLI::App& command, Action& action);
void addBench(CLI::App& command, Action& action);
void addRatio(CLI::App& command, Action& action);
void addModes(CLI::App& command, Action& action);
void addSoftness(CLI::App& command, Action& action);
void addIdentify(CLI::App& command, Action& action);
void addSynthesize(CLI::App& command, Action& action);
void addLift(CLI::App& command, Action& action);
void addCampaign(CLI::App& command, Action& action);
void addDataset(CLI::App& command, Action& action);

// Runs a companion (formats/companion.h) to its end. Returns its exit status; kFailed with an error line if a signal ended it or it
// cannot be started; empty if it is not to be had.
std::optional<int> runCompanion(const std::string& name, std::vector<std::string> arguments);

// Arguments of every command with a robot.
void printWarnings(const std::vector<std::string>& warnings);

struct RobotArgument {
  std::string name;
  bool fixed_base = false;
  // Loads the robot and prints its warnings to the standard error, and with --verbose what is harmless.
  LoadedRobot load() const;
};
inline constexpr const char* kRobotHelp = "name, directory, .urdf, .sdf, .usda, .yaml or MuJoCo .xml file";
// The robot, which is required: the first argument, or the one of this name.
void addRobot(CLI::App& command, RobotArgument& robot, const char* name = "ROBOT");
void addVerbose(CLI::App& command);
// The directory of a robot and its files, which no output may replace.
std::vector<std::string> listFiles(const LoadedRobot& robot);
// --fixed-base and --verbose.
void addRobotFlags(CLI::App& command, RobotArgument& robot);

// An option by its own flag. \param set  receives what the command line gives
void addOption(CLI::App& command, const Option& option, const std::function<void(const OptionValue&)>& set);

// Sets the command line that results record.
void setCommandLine(int argc, char** argv);
const std::vector<std::string>& getCommandLine();

}  // namespace bielle::cli
