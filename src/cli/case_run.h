#pragma once
// Shared by the commands that run cases (tasks/cases.h).
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "cli/task_options.h"
#include "tasks/cases.h"

namespace bielle::cli {

using CaseOutcomes = std::map<std::string, tasks::CaseOutcome>;  // by the name of the case

struct CaseRun {
  std::string directory;            // of the directories of the cases
  std::vector<tasks::Case> cases;   // those of the same name are run once
  std::vector<std::string> robots;  // directories of their robots
  TaskArguments tasks;
};

// Runs the cases with a line for each, then `write`, which makes the requested output from them. Returns the exit
// status: kFailed when the user interrupts, in which case nothing is written, or when cases crashed.
// \throws InputError as runCases does
int runAndWrite(const CaseRun& run, const std::function<void(const CaseOutcomes&)>& write);

// Prints the written files to the standard output, and notes to the standard error.
void printPaths(const std::vector<std::string>& paths, const std::vector<std::string>& notes);

}  // namespace bielle::cli
