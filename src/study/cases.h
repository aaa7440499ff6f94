#pragma once
// Cases: what a study is made of. One case is a few runs of the command `bielle`, one after the other, whose results go
// into a directory of its own. A case that has been done once is not done again.
//
// The directory of a case holds the results, what each run printed (step1.log, ...), and case.json: what was asked and how
// it ended. case.json is written last, so that a case without one was cut short; it is done anew from the beginning.
#include <functional>
#include <string>
#include <vector>

namespace bielle::study {

struct Case {
  std::string name;  // of its directory; the same name means the same case
  // Arguments of `bielle`, run by run. "@NAME" is the path of NAME in the directory of the case.
  std::vector<std::vector<std::string>> steps;
};

// Outcome of a run of the command: 0 done, 1 not converged or failed (with results), 2 rejected.
struct StepOutcome {
  int status = 0;
  double seconds = 0;
  std::string error;  // what it complained of, or empty
};

struct CaseOutcome {
  std::vector<StepOutcome> steps;  // up to the first that was refused or broke down
  bool complete = false;           // else a run was ended by a signal (status 128 + signal), and nothing is kept
  bool kept = false;               // from an earlier time
};

struct RunOptions {
  std::string program;   // path of the command
  std::string identity;  // what else results depend on: a case done under another one is done anew
  int jobs = 1;          // processes at a time
  std::function<void(const std::string&)> progress;
};

struct RunOutcome {
  std::vector<CaseOutcome> cases;
  bool interrupted = false;  // by the user; the cases under way were dropped
};

// Dependencies of the results: the program and the files of the robots in these directories.
std::string makeIdentity(const std::string& program, const std::vector<std::string>& robots);

// Runs the cases in directory/NAME. \throws ModelError when directories or files cannot be made, or another study is at
// work in the directory
RunOutcome runCases(const std::string& directory, const std::vector<Case>& cases, const RunOptions& options);

}  // namespace bielle::study
