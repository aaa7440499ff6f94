#include "cli/task_options.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <thread>

#include "bielle/model/error.h"
#include "cli/commands.h"
#include "formats/companion.h"
#include "formats/text_file.h"
#include "tasks/local_tasks.h"
#include "tasks/worker_tasks.h"

namespace bielle::cli {
namespace {

constexpr int kMostPort = 65535;

int readPort(const std::string& text) {
  if (text == "auto") return 0;
  const bool is_number = !text.empty() && text.size() <= 5 && text.find_first_not_of("0123456789") == std::string::npos;
  const int port = is_number ? std::stoi(text) : 0;
  if (port < 1 || port > kMostPort)
    throw InputError("", "--workers " + text, "it is not a port", "give 1 to 65535, or auto for any free port");
  return port;
}

std::string getHost() {
  char name[256] = "";
  gethostname(name, sizeof name - 1);
  return name;
}

}  // namespace

TaskArguments::TaskArguments() : jobs(static_cast<int>(std::max(1u, std::thread::hardware_concurrency()))) {}

void addTaskOptions(CLI::App& command, const std::string& jobs_help, TaskArguments& arguments) {
  command.add_option("--jobs", arguments.jobs, jobs_help)->check(CLI::Range(1, 1024))->capture_default_str();
  CLI::Option* workers =
      command.add_option("--workers", arguments.workers,
                         "port, or auto for a free one, at which Work Queue workers on any machine (work_queue_worker "
                         "HOST PORT) connect to run the tasks, instead of local processes");
  command.add_option("--password", arguments.password, "file with the workers' password")->needs(workers);
}

std::unique_ptr<tasks::TaskEngine> makeTaskEngine(const TaskArguments& arguments) {
  if (arguments.workers.empty()) return std::make_unique<tasks::LocalTasks>(arguments.jobs);
  const int port = readPort(arguments.workers);
  if (!arguments.password.empty() && readTextFile(arguments.password).find_first_not_of(" \n") == std::string::npos)
    throw InputError(arguments.password, "file", "it is empty", "write a password into it");
  const std::string program = requireCompanion("bielle-workers");
  auto engine = std::make_unique<tasks::WorkerTasks>(tasks::WorkerOptions{program, port, arguments.password});
  std::cerr << "start workers with: work_queue_worker " << (arguments.password.empty() ? "" : "--password FILE ")
            << getHost() << " " << engine->port() << std::endl;
  if (arguments.password.empty())
    std::cerr << "bielle: warning: without --password anyone who reaches this port can take tasks and return results"
              << std::endl;
  return engine;
}

}  // namespace bielle::cli
