#pragma once
// The commands that are made of cases (study/cases.h).
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "study/cases.h"

namespace bielle::cli {

using CaseOutcomes = std::map<std::string, study::CaseOutcome>;  // by the name of the case

struct CaseRun {
  std::string directory;            // of the directories of the cases
  std::vector<study::Case> cases;   // those of one name are one, and done once
  std::vector<std::string> robots;  // directories of the robots that they are of
  int jobs = 1;
};

// Runs the cases with a line for each, then `write`, which makes of them what the user asked for. Returns the exit status:
// kFailed when the user interrupts, and nothing is written, or when cases broke down.
// \throws ModelError as runCases does
int runAndWrite(const CaseRun& run, const std::function<void(const CaseOutcomes&)>& write);

// To the standard output and error: the files that were written, and what else there is to know.
void printPaths(const std::vector<std::string>& paths, const std::vector<std::string>& notes);

}  // namespace bielle::cli
