#include "tasks/shipping.h"

#include <algorithm>
#include <filesystem>

#include "bielle/formats/reader.h"
#include "bielle/results/result.h"
#include "formats/robot_files.h"
#include "formats/text_file.h"
#include "results/json_text.h"
#include "results/result_files.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

fs::path getDirectory(const std::string& file) { return fs::absolute(file).lexically_normal().parent_path(); }

}  // namespace

std::vector<std::string> listRobotDirectories(const std::string& robot) {
  const std::string file = findRobotFile(robot);
  std::vector<std::string> directories = {getDirectory(file)};
  if (fs::path(file).extension() == ".yaml")
    if (const std::string urdf = findModel(readYaml(file)); !urdf.empty()) directories.push_back(getDirectory(urdf));
  return directories;
}

std::string getShippedRobot(const std::string& robot) {
  const fs::path file = findRobotFile(robot);
  return fs::path("robots") / getDirectory(file).filename() / file.filename();
}

tasks::Task shipMotion(const std::string& motion, const std::string& place, bool is_remote) {
  tasks::Task task;
  if (!is_remote) {
    task.inputs.push_back({"motion", motion});
    return task;
  }
  const MotionSummary summary = readSummary(motion);
  // The robot's own files, with its meshes, as long as they are those of the motion.
  const LoadedRobot robot = loadRobotOf(motion);
  const bool is_own =
      !robot.warnings.empty() || robot.file == fs::absolute(fs::path(motion) / kMechanismUrdf).lexically_normal();
  if (!is_own) task.robots = listRobotDirectories(robot.file);
  makeOutputDirectory(place);
  readJsonFile(summary.file, "solve the motion again", [&](const Json& json) {
    Json shipped = json;
    shipped["robot_file"] = is_own ? "" : getShippedRobot(robot.file);
    writeTextFile(place + "/summary.json", formatJson(shipped) + "\n");
  });
  task.inputs.push_back({"motion/summary.json", place + "/summary.json"});
  for (const char* name : {kMechanismUrdf, kMechanismYaml})
    if (fs::exists(fs::path(motion) / name))
      task.inputs.push_back({std::string("motion/") + name, (fs::path(motion) / name).string()});
  for (const char* name : {"trajectory.npz", "trajectory.csv"})
    if (fs::exists(fs::path(motion) / name)) {
      task.inputs.push_back({std::string("motion/") + name, (fs::path(motion) / name).string()});
      break;  // the second is the first as text
    }
  return task;
}

void shipFiles(tasks::Task& task) {
  for (size_t i = 0; i < task.arguments.size(); ++i) {
    std::string& argument = task.arguments[i];
    if (i > 0 && task.arguments[i - 1] == "--robot") {
      for (const std::string& directory : listRobotDirectories(argument)) task.robots.push_back(directory);
      argument = getShippedRobot(argument);
    } else if (std::error_code error; fs::is_regular_file(argument, error)) {
      const std::string name = "file" + std::to_string(i) + "-" + fs::path(argument).filename().string();
      task.inputs.push_back({name, argument});
      argument = "@" + name;
    }
  }
}

}  // namespace bielle::tasks
