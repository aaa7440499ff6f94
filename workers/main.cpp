// bielle-workers PORT [FILE]: gives the tasks of `bielle` to workers of Work Queue, as src/tasks/worker_tasks.h says.
//
// PORT 0 is any that is free; FILE holds the password that workers have to know. Work Queue is under the GNU General Public
// License, version 2, and so is this program where it is given away; `bielle` itself does not link it.
#include <sys/types.h>

extern "C" {
#include <cctools/work_queue.h>
}

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr int kMostOutput = 10'000;  // bytes
constexpr int kKeepAlive = 30;       // s; a machine that says nothing for so long is gone, its tasks go to others
constexpr auto kCountAgain = std::chrono::milliseconds(200);  // how old a count of the workers may be

struct QueueDeleter {
  void operator()(work_queue* queue) const { work_queue_delete(queue); }
};
struct TaskDeleter {
  void operator()(work_queue_task* task) const { work_queue_task_delete(task); }
};

class Manager {
 public:
  Manager(int port, const char* password) {
    // Set by nobody here: with a name, Work Queue reports to a public catalogue.
    for (const char* name : {"WORK_QUEUE_NAME", "WORK_QUEUE_PORT"}) unsetenv(name);
    queue_.reset(work_queue_create(port == 0 ? -1 : port));
    if (!queue_)
      throw std::runtime_error("port " + std::to_string(port) + " cannot be opened: another process is using it");
    if (password && !work_queue_specify_password_file(queue_.get(), password))
      throw std::runtime_error(std::string(password) + ": file: it contains no password");
    work_queue_specify_keepalive_interval(queue_.get(), kKeepAlive);
    work_queue_specify_keepalive_timeout(queue_.get(), kKeepAlive);
    say({{"port", work_queue_port(queue_.get())}});
  }

  void submit(const json& request) {
    work_queue_task* task = work_queue_task_create(request.at("command").get<std::string>().c_str());
    for (const json& input : request.at("inputs"))
      specify(task, input.at(0), input.at(1), WORK_QUEUE_INPUT, WORK_QUEUE_CACHE);
    for (const json& output : request.at("outputs"))
      specify(task, output.at(1), output.at(0), WORK_QUEUE_OUTPUT, WORK_QUEUE_NOCACHE);
    work_queue_task_specify_cores(task, 1);
    work_queue_task_specify_tag(task, std::to_string(request.at("task").get<int>()).c_str());
    work_queue_submit(queue_.get(), task);
  }

  void wait() {
    std::unique_ptr<work_queue_task, TaskDeleter> task;
    while (!task) task.reset(work_queue_wait(queue_.get(), WORK_QUEUE_WAITFORTASK));
    // Outputs that are missing tell the caller enough, beside the status.
    const bool ran = (task->result & ~WORK_QUEUE_RESULT_OUTPUT_MISSING) == WORK_QUEUE_RESULT_SUCCESS;
    say({{"task", std::stoi(task->tag)},
         {"output", ran && task->output ? std::string(task->output, strnlen(task->output, kMostOutput)) : ""},
         {"seconds", 1e-6 * static_cast<double>(task->time_workers_execute_last)},
         {"cores", countCores()}});
  }

 private:
  static void specify(work_queue_task* task, const std::string& here, const std::string& there,
                      work_queue_file_type_t type, work_queue_file_flags_t flags) {
    if (!work_queue_task_specify_file(task, here.c_str(), there.c_str(), type, flags))
      throw std::runtime_error("Work Queue does not accept file " + there);
  }

  static void say(const json& message) {
    std::cout << message.dump(-1, ' ', false, json::error_handler_t::replace) << std::endl;
  }

  // Of the workers that have joined. Counting goes through all of them.
  int countCores() {
    if (const auto now = Clock::now(); now - counted_ > kCountAgain) {
      work_queue_stats stats{};
      work_queue_get_stats(queue_.get(), &stats);
      cores_ = static_cast<int>(stats.total_cores);
      counted_ = now;
    }
    return cores_;
  }

  std::unique_ptr<work_queue, QueueDeleter> queue_;
  int cores_ = 0;
  Clock::time_point counted_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::cerr << "usage: bielle-workers PORT [FILE]; started by `bielle campaign --workers PORT --password FILE`\n";
    return 2;
  }
  try {
    Manager manager(std::stoi(argv[1]), argc > 2 ? argv[2] : nullptr);
    for (std::string line; std::getline(std::cin, line);) {
      const json request = json::parse(line);
      request.contains("wait") ? manager.wait() : manager.submit(request);
    }
  } catch (const std::exception& error) {
    std::cerr << "bielle: error: bielle-workers: " << error.what() << std::endl;
    return 2;
  }
  return 0;
}
