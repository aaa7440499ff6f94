#pragma once
// Where a command has its tasks done, shared by those that have many.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "tasks/engine.h"

namespace bielle::cli {

struct TaskArguments {
  TaskArguments();

  int jobs;  // all cores
  std::string workers, password;
};

// Adds --jobs (with its help), --workers and --password.
void addTaskOptions(CLI::App& command, const std::string& jobs_help, TaskArguments& arguments);

// With workers, prints how they join to the standard error. \throws InputError when there can be none
std::unique_ptr<tasks::TaskEngine> makeTaskEngine(const TaskArguments& arguments);

}  // namespace bielle::cli
