#include "tasks/worker_tasks.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "io/json_text.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

// Tasks that wait beyond those that are done: while one is fetched, its worker begins with the next. More make Work Queue
// slower, which goes through all of them whenever something happens.
constexpr int kLeastWaiting = 16;
constexpr double kWaitingShare = 0.25;  // of the cores

std::string quote(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

Json describe(int id, const Task& task) {
  Json inputs = Json::array(), outputs = Json::array();
  const auto addInput = [&inputs](const std::string& path, const std::string& name) {
    inputs.push_back(Json::array({fs::absolute(path).lexically_normal().string(), name}));
  };
  for (const std::string& program : task.programs) addInput(program, fs::path(program).filename());
  for (const TaskInput& input : task.inputs) addInput(input.path, input.name);
  for (const std::string& robot : task.robots) {
    const fs::path directory = fs::absolute(robot).lexically_normal();
    for (const fs::directory_entry& entry : fs::directory_iterator(directory))
      if (entry.path().extension() == ".urdf" || entry.path().extension() == ".yaml")
        addInput(entry.path(), "robots/" + directory.filename().string() + "/" + entry.path().filename().string());
  }
  const auto addOutput = [&](const std::string& name) {
    outputs.push_back(Json::array({name, fs::absolute(getOutput(task, name)).lexically_normal().string()}));
  };
  for (const std::string& output : task.outputs) addOutput(output);
  addOutput(task.log);
  std::string command = "OMP_NUM_THREADS=1 BIELLE_ROBOTS=robots ./" + quote(fs::path(task.programs.front()).filename());
  for (const std::string& argument : task.arguments) command += " " + quote(getRemoteArgument(task, argument));
  command += " > " + quote(task.log) + " 2>&1 < /dev/null";
  return {{"task", id}, {"command", command}, {"inputs", inputs}, {"outputs", outputs}};
}

[[noreturn]] void failWith(const std::string& problem) {
  throw ModelError("", "bielle-workers", problem, "the same command goes on from here");
}

}  // namespace

WorkerTasks::WorkerTasks(const WorkerOptions& options) {
  std::vector<std::string> command = {options.program, std::to_string(options.port)};
  if (!options.password.empty()) command.push_back(options.password);
  companion_ = startPipedChild(command);
  try {
    std::string line;
    if (!receive(line)) failWith("it was interrupted");
    port_ = parseJson(line).at("port");
  } catch (...) {
    WorkerTasks::stop();
    throw;
  }
}

void WorkerTasks::stop() {
  if (companion_.pid == 0) return;
  killChild(companion_.pid);
  close(companion_.in), close(companion_.out);
  companion_ = {};
  running_.clear();
}

bool WorkerTasks::hasRoom() const {
  const int waiting = std::max(kLeastWaiting, static_cast<int>(std::ceil(kWaitingShare * cores_)));
  return static_cast<int>(running_.size()) < cores_ + waiting;
}

int WorkerTasks::submit(const Task& task) {
  send(describe(++next_, task).dump(-1, ' ', false, Json::error_handler_t::replace));
  running_.insert(next_);
  return next_;
}

std::optional<TaskEnd> WorkerTasks::wait() {
  send(R"({"wait": true})");
  std::string line;
  if (!receive(line)) return std::nullopt;
  const Json answer = parseJson(line);
  const TaskEnd end{answer.at("task"), answer.at("status"), answer.at("seconds")};
  cores_ = answer.at("cores");
  if (running_.erase(end.id) == 0) failWith("it returned a task that nobody has asked for");
  return end;
}

void WorkerTasks::send(const std::string& line) {
  const std::string text = line + "\n";
  for (size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(companion_.in, text.data() + done, text.size() - done);
    if (count < 0 && errno != EINTR) failWith("it has ended");
    if (count > 0) done += static_cast<size_t>(count);
  }
}

bool WorkerTasks::receive(std::string& line) {
  size_t end;
  while ((end = received_.find('\n')) == std::string::npos) {
    if (watch_.waitForFile(companion_.out)) return false;
    char buffer[65536];
    const ssize_t count = ::read(companion_.out, buffer, sizeof buffer);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) failWith("it has ended");
    received_.append(buffer, static_cast<size_t>(count));
  }
  line = received_.substr(0, end);
  received_.erase(0, end + 1);
  return true;
}

}  // namespace bielle::tasks
