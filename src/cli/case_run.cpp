#include "cli/case_run.h"

#include <algorithm>
#include <iostream>

#include "cli/commands.h"
#include "formats/companion.h"

namespace bielle::cli {

using namespace bielle::tasks;

int runAndWrite(const CaseRun& run, const std::function<void(const CaseOutcomes&)>& write) {
  std::vector<Case> cases;
  for (const Case& one : run.cases)
    if (std::none_of(cases.begin(), cases.end(), [&](const Case& other) { return other.name == one.name; }))
      cases.push_back(one);
  RunOptions options;
  options.program = requireCompanion("bielle-complete");
  options.identity = makeIdentity(options.program, run.robots);
  auto engine = makeTaskEngine(run.tasks);
  options.engine = engine.get();
  options.progress = [](const std::string& line) { std::cout << line << std::endl; };
  const RunOutcome outcome = runCases(run.directory, cases, options);
  engine.reset();  // signals have their usual effect again
  if (outcome.interrupted) {
    std::cerr << "bielle: error: interrupted; run the same command again to continue" << std::endl;
    return kFailed;
  }
  CaseOutcomes outcomes;
  bool complete = true;
  for (size_t i = 0; i < cases.size(); ++i) {
    outcomes[cases[i].name] = outcome.cases[i];
    complete &= outcome.cases[i].complete;
  }
  write(outcomes);
  if (!complete) std::cerr << "bielle: error: some cases failed; run the same command again to retry them" << std::endl;
  return complete ? kOk : kFailed;
}

void printPaths(const std::vector<std::string>& paths, const std::vector<std::string>& notes) {
  for (const std::string& path : paths) std::cout << "  " << path << "\n";
  for (const std::string& note : notes) std::cerr << "bielle: warning: " << note << "\n";
}

}  // namespace bielle::cli
