#include "tasks/cases.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "formats/aside_file.h"
#include "formats/process.h"
#include "formats/robot_files.h"
#include "formats/text_file.h"
#include "model/hash.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/json_text.h"
#include "tasks/case_task.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

// Locks the directory for the lifetime of this process.
class DirectoryLock {
 public:
  explicit DirectoryLock(const std::string& directory) {
    makeOutputDirectory(directory);
    const std::string path = directory + "/lock";
    file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
    if (file_ < 0) failToWrite(path, "it cannot be opened");
    if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
      close(file_);
      throw InputError(directory, "directory", "another study is using it", "wait for it, or give another one");
    }
  }
  ~DirectoryLock() { close(file_); }
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  int file_;
};

Json describeRequest(const Case& request, const RunOptions& options) {
  return {{"identity", options.identity}, {"steps", request.steps}};
}

// The outcome in case.json, if it exists and belongs to the same request.
std::optional<CaseOutcome> readOutcome(const std::string& path, const Json& request) {
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  CaseOutcome outcome;
  outcome.complete = outcome.kept = true;
  try {
    const Json json = parseJson(readTextFile(path, ""));
    if (json.at("request") != request) return std::nullopt;
    for (const Json& step : json.at("outcome"))
      outcome.steps.push_back({step.at("status"), step.at("seconds"), step.at("error")});
  } catch (const std::exception&) {  // corrupted: the case is repeated
    return std::nullopt;
  }
  return outcome;
}

void writeOutcome(const std::string& path, const Json& request, const CaseOutcome& outcome) {
  Json steps = Json::array();
  for (const StepOutcome& step : outcome.steps)
    steps.push_back({{"status", step.status}, {"seconds", step.seconds}, {"error", step.error}});
  writeTextFile(path, formatJson({{"request", request}, {"outcome", steps}}) + "\n");
}

// A step did what was asked: with success, without (1), or, of a motion carried out, without a decision (3).
bool hasEnded(int status) { return status <= 1 || status == 3; }

std::string describeOutcome(const CaseOutcome& outcome) {
  if (outcome.kept) return "kept";
  const StepOutcome& last = outcome.steps.back();
  double seconds = 0;
  for (const StepOutcome& step : outcome.steps) seconds += step.seconds;
  const std::string time = formatNumber(seconds, " (%.1f s)");
  if (last.status >= 128) return "terminated by signal " + std::to_string(last.status - 128) + time;
  if (last.status == kNotStarted) return std::string("the command could not be started") + time;
  if (last.status == kNoResult) return "no result: " + last.error + time;
  if (!hasEnded(last.status)) return "refused: " + last.error + time;
  for (const StepOutcome& step : outcome.steps)
    if (step.status != 0) return std::string("done with a failure") + time;
  return std::string("done") + time;
}

class CaseRunner {
 public:
  CaseRunner(const std::string& directory, const std::vector<Case>& cases, const RunOptions& options)
      : directory_(directory), cases_(cases), options_(options) {}
  ~CaseRunner() {
    if (!running_.empty()) options_.engine->stop();
  }
  CaseRunner(const CaseRunner&) = delete;
  CaseRunner& operator=(const CaseRunner&) = delete;

  RunOutcome run() {
    outcome_.cases.resize(cases_.size());
    size_t next = 0;
    while (true) {
      while (next < cases_.size() && options_.engine->hasRoom()) begin(next++);
      if (running_.empty()) return outcome_;
      const std::optional<tasks::TaskEnd> end = options_.engine->wait();
      if (!end) {
        outcome_.interrupted = true;
        return outcome_;
      }
      advance(*end);
    }
  }

 private:
  struct Running {
    size_t index = 0;
    int attempt = 1;
    tasks::Task task;
  };

  std::string getPath(size_t index, const std::string& file = "") const {
    return directory_ + "/" + cases_[index].name + (file.empty() ? "" : "/" + file);
  }

  void begin(size_t index) {
    const Json request = describeRequest(cases_[index], options_);
    if (const auto outcome = readOutcome(getPath(index, "case.json"), request)) {
      outcome_.cases[index] = *outcome;
      finish(index);
      return;
    }
    // case.json is removed first: if we are stopped in between, the remains must not pass for a finished case.
    std::error_code ignored;
    fs::remove(getPath(index, "case.json"), ignored);
    fs::remove_all(getPath(index), ignored);
    makeOutputDirectory(getPath(index));
    startStep(index);
  }

  void startStep(size_t index) {
    const int step = static_cast<int>(outcome_.cases[index].steps.size());
    submit(
        {index, 1, makeStepTask(cases_[index], step, getPath(index), options_.program, options_.engine->isRemote())});
  }

  void submit(Running entry) {
    const int id = options_.engine->submit(entry.task);
    running_.emplace(id, std::move(entry));
  }

  void advance(const tasks::TaskEnd& end) {
    const auto found = running_.find(end.id);
    if (found == running_.end()) return;
    Running entry = std::move(found->second);
    running_.erase(found);
    int status = end.status;
    std::string error = findError(tasks::getOutput(entry.task, entry.task.log));
    if (options_.engine->isRemote())
      if (const std::string problem = findProblem(entry.task, status); !problem.empty()) {
        if (entry.attempt < options_.engine->attempts()) {
          report(cases_[entry.index].name + ": " + problem + "; retrying");
          ++entry.attempt;
          submit(std::move(entry));
          return;
        }
        if (status < kNotStarted) status = kNoResult;
        error = problem;
      }
    CaseOutcome& outcome = outcome_.cases[entry.index];
    outcome.steps.push_back({status, end.seconds, error});
    if (hasEnded(status) && outcome.steps.size() < cases_[entry.index].steps.size()) {
      startStep(entry.index);
      return;
    }
    outcome.complete = status < kNoResult;
    if (outcome.complete) {
      if (options_.engine->isRemote()) bringHome(cases_[entry.index], getPath(entry.index), options_.program);
      writeOutcome(getPath(entry.index, "case.json"), describeRequest(cases_[entry.index], options_), outcome);
    }
    finish(entry.index);
  }

  void finish(size_t index) {
    ++finished_;
    report(cases_[index].name + ": " + describeOutcome(outcome_.cases[index]));
  }
  void report(const std::string& text) const {
    if (options_.progress)
      options_.progress("[" + std::to_string(finished_) + "/" + std::to_string(cases_.size()) + "] " + text);
  }

  const std::string directory_;
  const std::vector<Case>& cases_;
  const RunOptions& options_;
  std::map<int, Running> running_;  // by the number of the task
  size_t finished_ = 0;
  RunOutcome outcome_;
};

}  // namespace

std::string findError(const std::string& log) {
  const std::string prefix = "bielle: error: ";
  std::ifstream file(log);
  std::string line, error;
  while (std::getline(file, line))
    if (line.rfind(prefix, 0) == 0) error = line.substr(prefix.size());
  return error;
}

std::string describeLog(const std::string& log) {
  std::ifstream file(log);
  std::string line, last;
  while (std::getline(file, line))
    if (!line.empty()) last = line;
  return last.empty() ? "" : ": " + last.substr(0, 200);
}

std::vector<fs::path> listRobotFiles(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory))
    if (const fs::path type = entry.path().extension();
        type == ".urdf" || type == ".yaml" || contains(listExchangeExtensions(), type.string()))
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::string makeIdentity(const std::string& program, const std::vector<std::string>& robots) {
  std::vector<fs::path> files;
  for (const std::string& robot : robots) {
    const std::vector<fs::path> parts = listRobotFiles(robot);
    files.insert(files.end(), parts.begin(), parts.end());
  }
  std::sort(files.begin(), files.end());
  files.push_back(program);
  return makeIdentity(files);
}

// Over all of them.
std::string makeIdentity(const std::vector<fs::path>& files) {
  std::uint64_t hash = hashText("");
  for (const fs::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    hash = hashText({std::istreambuf_iterator<char>(file), {}}, hash);
  }
  return getBuildInfo().bielle + formatText(" %016llx", static_cast<unsigned long long>(hash));
}

RunOutcome runCases(const std::string& directory, const std::vector<Case>& cases, const RunOptions& options) {
  const DirectoryLock lock(directory);
  return CaseRunner(directory, cases, options).run();
}

}  // namespace bielle::tasks
