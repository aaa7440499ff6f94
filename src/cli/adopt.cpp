// bielle adopt: a file that completes a robot of others.
#include "formats/adopt.h"

#include <filesystem>
#include <iostream>
#include <memory>

#include "bielle/model/error.h"
#include "cli/commands.h"
#include "formats/robot_files.h"
#include "formats/text_file.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

int adopt(const RobotArgument& argument, const std::string& directory) {
  const LoadedRobot robot = argument.load();
  if (fs::path(robot.file).extension() == ".yaml" && !readYaml(robot.file).models.empty())
    throw InputError(robot.path(), "robot", "it already completes another robot", "edit it");
  const fs::path place = fs::absolute(directory).lexically_normal();
  const std::string name = (place.has_filename() ? place : place.parent_path()).filename().string();
  const Adoption adoption = adoptRobot(robot, fs::path(robot.file).lexically_relative(place).string());
  std::error_code error;
  fs::create_directories(place, error);
  const fs::path file = place / (name + ".yaml");
  if (error)
    throw InputError(directory, "directory", "it cannot be created: " + error.message(), "give another one with -o");
  if (fs::exists(file))
    throw InputError(file.string(), "file", "it already exists", "give another directory, or remove it");
  writeTextFile(file.string(), adoption.yaml);
  std::cout << (fs::path(directory) / (name + ".yaml")).lexically_normal().string() << "\n";
  for (const std::string& guess : adoption.guesses) std::cout << "  " << guess << "\n";
  return kOk;
}

}  // namespace

void addAdopt(CLI::App& command, Action& action) {
  const auto robot = std::make_shared<RobotArgument>();
  const auto directory = std::make_shared<std::string>();
  addRobot(command, *robot);
  command.add_option("-o,--output", *directory, "directory of the new robot; its last part names the robot's file")
      ->required();
  addVerbose(command);
  command.footer(
      "Writes DIR/NAME.yaml, which refers to the robot's own files. Correct it by hand: comments explain every guess.\n"
      "Example:\n"
      "  bielle adopt path/to/published.urdf -o mine\n"
      "  bielle solve squat --robot mine -o squat");
  command.callback([&action, robot, directory] { action = [=] { return adopt(*robot, *directory); }; });
}

}  // namespace bielle::cli
