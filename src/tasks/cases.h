#pragma once
// Cases, the units of a study. A case is a few consecutive runs of the command `bielle`, each a task, whose results go into
// a separate directory. A completed case is not repeated.
//
// The directory of a case holds the results, the output of each run (step1.log, ...), and case.json: the request and
// its outcome. case.json is written last, so that a case without one was interrupted; it is repeated from the
// beginning.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tasks/engine.h"

namespace bielle::tasks {

struct Case {
  std::string name;  // of its directory; the same name means the same case
  // Arguments of `bielle`, run by run. "@NAME" is the path of NAME in the directory of the case; behind "-o" it is written.
  std::vector<std::vector<std::string>> steps;
  std::string robot;  // the argument that names it, which goes with the case
};

constexpr int kNoResult = 126;

// Outcome of a run of the command: 0 done, 1 not converged or failed (with results), 2 rejected.
struct StepOutcome {
  int status = 0;
  double seconds = 0;
  std::string error;  // its error message, or empty
};

struct CaseOutcome {
  std::vector<StepOutcome> steps;  // up to the first that was rejected or crashed
  bool complete = false;  // else a run was ended by a signal (status 128 + signal), or a worker returned what is no
                          // result (kNoResult), and nothing is kept
  bool kept = false;      // from an earlier run
};

struct RunOptions {
  std::string program;   // path of the command; its companions are beside it
  std::string identity;  // other dependencies of the results: a case with another identity is repeated
  tasks::TaskEngine* engine = nullptr;
  std::function<void(const std::string&)> progress;
};

struct RunOutcome {
  std::vector<CaseOutcome> cases;
  bool interrupted = false;  // by the user; unfinished cases were dropped
};

// The files in a directory that robots are read from, sorted.
std::vector<std::filesystem::path> listRobotFiles(const std::filesystem::path& directory);

// Dependencies of the results: the program and the files of the robots in these directories.
std::string makeIdentity(const std::string& program, const std::vector<std::string>& robots);
// The same of any files, the program among them.
std::string makeIdentity(const std::vector<std::filesystem::path>& files);

// The last error message in the output of a run of the command, without its prefix; empty if there is none.
std::string findError(const std::string& log);
// ": " and its last line, for a program that failed; empty if it printed nothing.
std::string describeLog(const std::string& log);

// Runs the cases in directory/NAME. \throws InputError when directories or files cannot be made, or another study uses
// the directory
RunOutcome runCases(const std::string& directory, const std::vector<Case>& cases, const RunOptions& options);

}  // namespace bielle::tasks
