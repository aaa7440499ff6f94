#include "tasks/local_tasks.h"

#include <algorithm>
#include <chrono>

namespace bielle::tasks {
namespace {

double getSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

void LocalTasks::stop() {
  for (const Running& entry : running_) killChild(entry.pid);
  running_.clear();
}

int LocalTasks::submit(const Task& task) {
  std::vector<std::string> command = {task.programs.front()};
  for (const std::string& argument : task.arguments) command.push_back(getLocalArgument(task, argument));
  running_.push_back({++next_, startChild(command, getOutput(task, task.log)), getSeconds()});
  return next_;
}

std::optional<TaskEnd> LocalTasks::wait() {
  while (ended_.empty()) {
    if (watch_.wait()) return std::nullopt;
    for (const ChildEnd& end : SignalWatch::collect()) {
      const auto found =
          std::find_if(running_.begin(), running_.end(), [&](const Running& entry) { return entry.pid == end.pid; });
      if (found == running_.end()) continue;
      ended_.push_back({found->id, end.status, getSeconds() - found->start});
      running_.erase(found);
    }
  }
  const TaskEnd end = ended_.front();
  ended_.pop_front();
  return end;
}

}  // namespace bielle::tasks
