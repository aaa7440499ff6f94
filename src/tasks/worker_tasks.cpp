#include "tasks/worker_tasks.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "bielle/model/error.h"
#include "results/json_text.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

// Bundles that wait beyond those that are done: while one is fetched, its worker begins with the next. More make Work Queue
// slower, which goes through all of them whenever something happens.
constexpr int kLeastWaiting = 16;
constexpr double kWaitingShare = 0.25;  // of the cores
constexpr double kBundleSeconds = 1;    // that a bundle takes, if tasks are shorter
constexpr int kLargestBundle = 16;
constexpr int kBrokenStatus = 127;   // of tasks that did not run to their end
constexpr double kForgetting = 0.1;  // share of the last task in the mean duration

std::string quote(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

bool goTogether(const Task& a, const Task& b) {
  const auto same = [](const TaskInput& x, const TaskInput& y) { return x.name == y.name && x.path == y.path; };
  return a.programs == b.programs && a.robots == b.robots && a.outputs == b.outputs && a.log == b.log &&
         std::equal(a.inputs.begin(), a.inputs.end(), b.inputs.begin(), b.inputs.end(), same);
}

Json listInputs(const Task& task) {
  Json inputs = Json::array();
  const auto add = [&inputs](const std::string& path, const std::string& name) {
    inputs.push_back(Json::array({fs::absolute(path).lexically_normal().string(), name}));
  };
  for (const std::string& program : task.programs) add(program, fs::path(program).filename());
  for (const TaskInput& input : task.inputs) add(input.path, input.name);
  for (const std::string& robot : task.robots) {
    const fs::path directory = fs::absolute(robot).lexically_normal();
    for (const fs::directory_entry& entry : fs::directory_iterator(directory))
      if (entry.path().extension() == ".urdf" || entry.path().extension() == ".yaml")
        add(entry.path(), "robots/" + directory.filename().string() + "/" + entry.path().filename().string());
  }
  return inputs;
}

// What a worker runs: the tasks one after the other; their outputs get numbers, and their statuses are printed.
Json describe(int id, const std::vector<const Task*>& tasks) {
  Json outputs = Json::array();
  std::string command = "export OMP_NUM_THREADS=1 BIELLE_ROBOTS=robots";
  for (size_t i = 0; i < tasks.size(); ++i) {
    const Task& task = *tasks[i];
    command += "; ./" + quote(fs::path(task.programs.front()).filename());
    for (const std::string& argument : task.arguments) command += " " + quote(getRemoteArgument(task, argument));
    command += " > " + quote(task.log) + " 2>&1 < /dev/null; echo $?";
    std::vector<std::string> names = task.outputs;
    names.push_back(task.log);
    for (const std::string& name : names) {
      const std::string numbered = name + "." + std::to_string(i);
      command += "; mv " + quote(name) + " " + quote(numbered) + " 2> /dev/null";
      outputs.push_back(Json::array({numbered, fs::absolute(getOutput(task, name)).lexically_normal().string()}));
    }
  }
  return {{"task", id}, {"command", command}, {"inputs", listInputs(*tasks.front())}, {"outputs", outputs}};
}

// One number per line and task; none when the text is anything else.
std::vector<int> readStatuses(const std::string& output, size_t count) {
  std::vector<int> statuses;
  std::istringstream stream(output);
  for (std::string line; statuses.size() <= count && std::getline(stream, line);) {
    if (line.empty() || line.size() > 3 || line.find_first_not_of("0123456789") != std::string::npos) return {};
    statuses.push_back(std::stoi(line));
  }
  return statuses.size() == count ? statuses : std::vector<int>{};
}

[[noreturn]] void failWith(const std::string& problem) {
  throw InputError("", "bielle-workers", problem, "run the same command again to continue");
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
}

bool WorkerTasks::hasRoom() const {
  const int waiting = std::max(kLeastWaiting, static_cast<int>(std::ceil(kWaitingShare * cores_)));
  return static_cast<int>(running_.size()) < (cores_ + waiting) * bundleSize();
}

int WorkerTasks::bundleSize() const {
  return mean_ > 0 ? static_cast<int>(std::clamp(kBundleSeconds / mean_, 1.0, 1.0 * kLargestBundle)) : 1;
}

int WorkerTasks::submit(const Task& task) {
  held_.push_back({++next_, task});
  running_.insert(next_);
  return next_;
}

// As large as there are enough for all workers, in the order in which tasks came.
void WorkerTasks::sendBundles() {
  const size_t share = running_.size() / static_cast<size_t>(std::max(1, cores_));
  const size_t size = std::clamp(share, size_t{1}, static_cast<size_t>(bundleSize()));
  for (size_t begin = 0, end = 0; begin < held_.size(); begin = end) {
    std::vector<const Task*> tasks;
    std::vector<int> ids;
    for (end = begin; end < held_.size() && tasks.size() < size; ++end) {
      if (!goTogether(held_[begin].task, held_[end].task)) break;
      tasks.push_back(&held_[end].task);
      ids.push_back(held_[end].id);
    }
    send(describe(ids.front(), tasks).dump(-1, ' ', false, Json::error_handler_t::replace));
    bundles_[ids.front()] = ids;
  }
  held_.clear();
}

std::optional<TaskEnd> WorkerTasks::wait() {
  if (ended_.empty()) {
    sendBundles();
    send(R"({"wait": true})");
    std::string line;
    if (!receive(line)) return std::nullopt;
    const Json answer = parseJson(line);
    const auto bundle = bundles_.find(answer.at("task"));
    if (bundle == bundles_.end()) failWith("it returned a task that was not sent");
    const std::vector<int>& ids = bundle->second;
    const std::vector<int> statuses = readStatuses(answer.at("output"), ids.size());
    const double seconds = answer.at("seconds").get<double>() / static_cast<double>(ids.size());
    for (size_t i = 0; i < ids.size(); ++i)
      ended_.push_back({ids[i], statuses.empty() ? kBrokenStatus : statuses[i], seconds});
    mean_ = mean_ > 0 ? mean_ + kForgetting * (seconds - mean_) : seconds;
    cores_ = answer.at("cores");
    bundles_.erase(bundle);
  }
  const TaskEnd end = ended_.front();
  ended_.pop_front();
  running_.erase(end.id);
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
