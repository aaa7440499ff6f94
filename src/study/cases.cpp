#include "study/cases.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

#include "bielle/io/result.h"
#include "bielle/model/error.h"
#include "io/aside_file.h"
#include "io/json_text.h"
#include "io/text_file.h"
#include "model/text_file.h"
#include "study/child.h"

namespace fs = std::filesystem;

namespace bielle::study {
namespace {

using Clock = std::chrono::steady_clock;

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
      throw ModelError(directory, "directory", "another study is at work there", "wait for it, or give another one");
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

std::string describeOutcome(const CaseOutcome& outcome) {
  if (outcome.kept) return "kept";
  const StepOutcome& last = outcome.steps.back();
  double seconds = 0;
  for (const StepOutcome& step : outcome.steps) seconds += step.seconds;
  char time[32];
  std::snprintf(time, sizeof time, " (%.1f s)", seconds);
  if (last.status >= 128) return "ended by signal " + std::to_string(last.status - 128) + time;
  if (last.status == 127) return std::string("the command could not be started") + time;
  if (last.status >= 2) return "refused: " + last.error + time;
  for (const StepOutcome& step : outcome.steps)
    if (step.status != 0) return std::string("done, with a failure") + time;
  return std::string("done") + time;
}

class CaseRunner {
 public:
  CaseRunner(const std::string& directory, const std::vector<Case>& cases, const RunOptions& options)
      : directory_(directory), cases_(cases), options_(options) {}
  ~CaseRunner() {
    for (const Running& entry : running_) killChild(entry.pid);
  }
  CaseRunner(const CaseRunner&) = delete;
  CaseRunner& operator=(const CaseRunner&) = delete;

  RunOutcome run() {
    outcome_.cases.resize(cases_.size());
    size_t next = 0;
    SignalWatch watch;
    while (true) {
      while (next < cases_.size() && static_cast<int>(running_.size()) < options_.jobs) begin(next++);
      if (running_.empty()) return outcome_;
      if (watch.wait()) {
        outcome_.interrupted = true;
        return outcome_;
      }
      for (const ChildEnd& end : SignalWatch::collect()) advance(end);
    }
  }

 private:
  struct Running {
    size_t index = 0;
    pid_t pid = 0;
    Clock::time_point start;
  };

  std::string getPath(size_t index, const std::string& file = "") const {
    return directory_ + "/" + cases_[index].name + (file.empty() ? "" : "/" + file);
  }
  std::string getLog(size_t index) const {
    return getPath(index, "step" + std::to_string(outcome_.cases[index].steps.size() + 1) + ".log");
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
    std::vector<std::string> arguments = {options_.program};
    for (const std::string& argument : cases_[index].steps[outcome_.cases[index].steps.size()])
      arguments.push_back(argument.rfind("@", 0) == 0 ? getPath(index, argument.substr(1)) : argument);
    const pid_t pid = startChild(arguments, getLog(index));
    running_.push_back({index, pid, Clock::now()});
  }

  void advance(const ChildEnd& end) {
    const auto found =
        std::find_if(running_.begin(), running_.end(), [&](const Running& entry) { return entry.pid == end.pid; });
    if (found == running_.end()) return;
    const Running entry = *found;
    running_.erase(found);
    CaseOutcome& outcome = outcome_.cases[entry.index];
    const double seconds = std::chrono::duration<double>(Clock::now() - entry.start).count();
    const std::string error = findError(getLog(entry.index));
    outcome.steps.push_back({end.status, seconds, error});
    if (end.status < 2 && outcome.steps.size() < cases_[entry.index].steps.size()) {
      startStep(entry.index);
      return;
    }
    outcome.complete = end.status < 127;
    if (outcome.complete)
      writeOutcome(getPath(entry.index, "case.json"), describeRequest(cases_[entry.index], options_), outcome);
    finish(entry.index);
  }

  void finish(size_t index) {
    ++finished_;
    if (options_.progress)
      options_.progress("[" + std::to_string(finished_) + "/" + std::to_string(cases_.size()) + "] " +
                        cases_[index].name + ": " + describeOutcome(outcome_.cases[index]));
  }

  const std::string directory_;
  const std::vector<Case>& cases_;
  const RunOptions& options_;
  std::vector<Running> running_;
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

std::string makeIdentity(const std::string& program, const std::vector<std::string>& robots) {
  std::vector<fs::path> files;
  for (const std::string& robot : robots)
    for (const fs::directory_entry& entry : fs::directory_iterator(robot))
      if (entry.path().extension() == ".urdf" || entry.path().extension() == ".yaml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  files.push_back(program);
  return makeIdentity(files);
}

// FNV-1a over all of them.
std::string makeIdentity(const std::vector<fs::path>& files) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const fs::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    for (std::istreambuf_iterator<char> c(file), end; c != end; ++c)
      hash = (hash ^ static_cast<unsigned char>(*c)) * 0x100000001b3;
  }
  char text[32];
  std::snprintf(text, sizeof text, " %016llx", static_cast<unsigned long long>(hash));
  return getBuildInfo().bielle + text;
}

RunOutcome runCases(const std::string& directory, const std::vector<Case>& cases, const RunOptions& options) {
  const DirectoryLock lock(directory);
  return CaseRunner(directory, cases, options).run();
}

}  // namespace bielle::study
