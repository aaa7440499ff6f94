#include "tasks/engine.h"

#include <algorithm>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/text_file.h"

namespace fs = std::filesystem;

namespace bielle::tasks {

std::string getLocalArgument(const Task& task, const std::string& argument) {
  if (argument.rfind("@", 0) != 0) return argument;
  const std::string name = argument.substr(1);
  for (const TaskInput& input : task.inputs)
    if (input.name == name) return input.path;
  if (std::find(task.outputs.begin(), task.outputs.end(), name) != task.outputs.end()) return getOutput(task, name);
  return argument;
}

std::string getRemoteArgument(const Task& task, const std::string& argument) {
  if (argument.rfind("@", 0) != 0) return argument;
  const std::string name = argument.substr(1);
  const bool is_input = std::any_of(task.inputs.begin(), task.inputs.end(), [&name](const TaskInput& input) {
    return input.name == name || input.name.rfind(name + "/", 0) == 0;
  });
  const bool is_output = std::find(task.outputs.begin(), task.outputs.end(), name) != task.outputs.end();
  return is_input || is_output ? name : argument;
}

std::string readOutput(const std::string& path, std::size_t most) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(path, error)))
    throw InputError(path, "file", "the task did not write it", "run the task again");
  if (const auto size = fs::file_size(path, error); error || size > most)
    throw InputError(path, "file", "it is larger than any result of this kind", "run the task again");
  return readTextFile(path);
}

}  // namespace bielle::tasks
