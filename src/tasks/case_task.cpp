#include "tasks/case_task.h"

#include <algorithm>
#include <filesystem>

#include "bielle/formats/reader.h"
#include "bielle/results/result.h"
#include "formats/text_file.h"
#include "results/json_text.h"
#include "tasks/shipping.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

constexpr std::size_t kMostSummary = 64'000'000;

std::string getPath(const std::string& directory, const std::string& argument) {
  return argument.rfind("@", 0) == 0 ? directory + "/" + argument.substr(1) : argument;
}

// Programs beside the command that it may start, here those that there are.
std::vector<std::string> listPrograms(const std::string& program) {
  std::vector<std::string> programs = {program};
  for (const char* name : {"bielle-check", "bielle-check-complete"})
    if (const fs::path check = fs::path(program).parent_path() / name; fs::exists(check))
      programs.push_back(check.string());
  return programs;
}

void checkOutput(const std::string& place) {
  for (const char* name : {"summary.json", "check.json"})
    if (const std::string path = place + "/" + name; fs::exists(path)) parseJson(tasks::readOutput(path, kMostSummary));
  if (!fs::exists(place + "/summary.json")) return;
  readSummary(place);
  const MotionRecord record = readResultRecord(place);
  for (const RowMatrixXd* numbers : {&record.q, &record.v, &record.u})
    if (!numbers->allFinite()) throw std::runtime_error(place + ": the trajectory is not finite");
}

}  // namespace

tasks::Task makeStepTask(const Case& one, int step, const std::string& directory, const std::string& program,
                         bool is_remote) {
  tasks::Task task;
  task.directory = directory;
  task.log = "step" + std::to_string(step + 1) + ".log";
  task.programs = is_remote ? listPrograms(program) : std::vector<std::string>{program};
  task.arguments = one.steps[static_cast<size_t>(step)];
  for (size_t i = 0; i < task.arguments.size(); ++i) {
    std::string& argument = task.arguments[i];
    if (argument.rfind("@", 0) == 0) {
      const std::string name = argument.substr(1);
      if (i > 0 && task.arguments[i - 1] == "-o")
        task.outputs.push_back(name);
      else
        task.inputs.push_back({name, getPath(directory, argument)});
    } else if (is_remote && argument == one.robot) {
      argument = getShippedRobot(one.robot);
    }
  }
  if (is_remote) task.robots = listRobotDirectories(one.robot);
  return task;
}

std::string findProblem(const tasks::Task& task, int status) {
  const std::string log = tasks::getOutput(task, task.log);
  if (status < 0 || status > 2 || (status == 2 && findError(log).empty()))
    return "it ended with status " + std::to_string(status) + describeLog(log);
  if (status == 2) return "";
  try {
    for (const std::string& output : task.outputs) {
      if (!fs::is_directory(tasks::getOutput(task, output))) return "there is no output '" + output + "'";
      checkOutput(tasks::getOutput(task, output));
    }
  } catch (const std::exception& error) {
    return describeJsonError(error);
  }
  return "";
}

void bringHome(const Case& one, const std::string& directory, const std::string& program) {
  const std::string file = fs::absolute(findRobotFile(one.robot)).lexically_normal();
  for (size_t step = 0; step < one.steps.size(); ++step) {
    std::vector<std::string> command = {program};
    for (const std::string& argument : one.steps[step]) command.push_back(getPath(directory, argument));
    const auto output = std::find(one.steps[step].begin(), one.steps[step].end(), "-o");
    if (output == one.steps[step].end()) continue;
    const std::string path = getPath(directory, *(output + 1)) + "/summary.json";
    if (!fs::exists(path)) continue;
    readJsonFile(path, "remove it", [&](const Json& json) {
      Json summary = json;
      const bool names_robot = std::count(one.steps[step].begin(), one.steps[step].end(), one.robot) > 0;
      summary["robot"] = names_robot ? one.robot : file;  // as `bielle lift` does
      summary["robot_file"] = file;
      summary["command"] = command;
      writeTextFile(path, formatJson(summary) + "\n");
    });
  }
}

}  // namespace bielle::tasks
