#include "tasks/campaign.h"

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "formats/text_file.h"
#include "results/line_log.h"
#include "tasks/campaign_command.h"
#include "tasks/campaign_result.h"
#include "tasks/cases.h"
#include "tasks/child.h"
#include "tasks/shipping.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

constexpr size_t kMostCells = 1'000'000;
constexpr const char* kMotion = "motion";
constexpr size_t kMostTogether = 64;  // runs in a task
std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

// Removes what an earlier task has written, without the directories: removing those takes milliseconds.
void clearFiles(const fs::path& directory) {
  std::error_code ignored;
  std::vector<fs::path> files;
  for (fs::recursive_directory_iterator it(directory, ignored), end; !ignored && it != end; it.increment(ignored))
    if (!it->is_directory(ignored) || it->is_symlink(ignored)) files.push_back(it->path());
  for (const fs::path& file : files) fs::remove(file, ignored);
}

size_t countCells(const CampaignSpec& spec) {
  size_t count = 1;
  for (const CampaignAxis& axis : spec.axes) {
    count *= axis.values.size();
    if (count > kMostCells)
      throw InputError(spec.path, "campaign", "it has more than a million combinations", "give fewer values");
  }
  return count;
}

std::vector<CampaignCell> listCells(const CampaignSpec& spec) {
  std::vector<CampaignCell> cells(countCells(spec), CampaignCell(spec.axes.size()));
  for (size_t i = 0; i < cells.size(); ++i) {
    size_t rest = i;
    for (size_t axis = spec.axes.size(); axis-- > 0; rest /= spec.axes[axis].values.size())
      cells[i][axis] = rest % spec.axes[axis].values.size();
  }
  return cells;
}

// What the results of a motion depend on besides the options and the program: its files and those of its robot.
std::string identifyMotion(const std::string& directory) {
  std::vector<fs::path> files;
  for (const char* name : {"summary.json", "trajectory.csv", "trajectory.npz"})
    if (fs::exists(fs::path(directory) / name)) files.push_back(fs::path(directory) / name);
  const fs::path robot = readSummary(directory).run.robot_file;
  if (fs::is_regular_file(robot)) {
    const std::vector<fs::path> parts = listRobotFiles(robot.parent_path());
    files.insert(files.end(), parts.begin(), parts.end());
  }
  return makeIdentity(files);
}

class CampaignRunner {
 public:
  CampaignRunner(const CampaignSpec& spec, const std::string& directory, const std::vector<std::string>& motions,
                 const CampaignOptions& options)
      : spec_(spec),
        directory_(directory),
        motions_(motions),
        options_(options),
        commands_(spec, motions),
        cells_(listCells(spec)),
        log_(directory + "/runs.jsonl", Json{{"campaign", makeIdentity({fs::path(options.simulate)})}}.dump(),
             "the log is of another version of the program") {
    for (size_t i = 0; i < motions.size(); ++i) {
      identities_.push_back(identifyMotion(motions[i]));
      shipped_.push_back(
          shipMotion(motions[i], directory + "/running/motion" + std::to_string(i), options.engine->isRemote()));
    }
    readLog();
  }
  ~CampaignRunner() {
    if (!running_.empty()) options_.engine->stop();
    std::error_code ignored;
    fs::remove_all(directory_ + "/running", ignored);
  }
  CampaignRunner(const CampaignRunner&) = delete;
  CampaignRunner& operator=(const CampaignRunner&) = delete;

  CampaignResults run() {
    CampaignResults out;
    std::deque<size_t> waiting;
    for (size_t i = 0; i < cells_.size() && !out.interrupted; ++i) {
      const Progress progress = follow(i);
      done_ += progress.done.size();
      if (progress.next > 0) waiting.push_back(i);
      out.interrupted = i % 1000 == 0 && tasks::SignalWatch::isEndAsked();
    }
    if (out.interrupted) return out;
    std::stable_sort(waiting.begin(), waiting.end(),
                     [this](size_t a, size_t b) { return findGroup(a) < findGroup(b); });
    while (true) {
      while (!waiting.empty() && options_.engine->hasRoom()) begin(waiting);
      if (running_.empty()) break;
      const std::optional<tasks::TaskEnd> end = options_.engine->wait();
      if (!end) {
        keepFinished();
        out.interrupted = true;
        return out;
      }
      for (const size_t cell : finish(*end)) waiting.push_front(cell);
    }
    out.complete = complete_;
    collect(out);
    return out;
  }

 private:
  void readLog() {
    int number = 1;  // of the line; the first one is the header
    for (const std::string& line : log_.lines()) {
      ++number;
      try {
        const Json json = parseJson(line);
        results_[{json.at("motion"), json.at("run")}] = pickCampaignResult(json.at("result"));
      } catch (const std::exception& error) {
        throw InputError(log_.path(), "line " + std::to_string(number),
                         "it was changed or damaged: " + describeJsonError(error),
                         "remove the line to repeat that run");
      }
    }
  }

  struct Run {
    size_t cell = 0;
    std::string key;
    std::vector<std::string> own;  // SplitCommand
  };
  struct Running {
    std::vector<Run> runs;  // one, or those of a file
    bool together = false;
    int slot = 0;  // of its directory
    int attempt = 1;
    tasks::Task task;
  };

  std::string makeImpulse(int multiple) const { return spec_.search ? formatImpulse(*spec_.search, multiple) : ""; }
  std::string makeKey(size_t cell, int multiple) const {
    return spec_.motions[cells_[cell][0]].name + " " + join(commands_.make(cells_[cell], makeImpulse(multiple)));
  }
  const std::string& getIdentity(size_t cell) const { return identities_[cells_[cell][0]]; }
  // -1: it has not been done; else whether the robot stood.
  int findOutcome(size_t cell, int multiple) const {
    const auto found = results_.find({getIdentity(cell), makeKey(cell, multiple)});
    return found == results_.end() ? -1 : found->second.at("outcome") == kStood;
  }
  // Runs of a cell by the multiple of the step of the search, or 1 without a search.
  struct Progress {
    std::vector<int> done;  // ascending
    int next = 0;           // 0: no more is needed
  };
  Progress follow(size_t cell) const {
    Progress progress;
    int low = 0, high = spec_.search ? spec_.search->count + 1 : 2;
    while (high - low > 1) {
      // The largest first: whether it is survived decides if there is anything to search.
      const int next = progress.done.empty() ? high - 1 : (low + high) / 2, outcome = findOutcome(cell, next);
      if (outcome < 0) {
        progress.next = next;
        break;
      }
      progress.done.push_back(next);
      (outcome == 1 ? low : high) = next;
    }
    std::sort(progress.done.begin(), progress.done.end());
    return progress;
  }
  std::string getPlace(int slot) const { return directory_ + "/running/" + std::to_string(slot); }

  // Runs that may share a task have the same number.
  size_t findGroup(size_t cell) {
    const std::string shared = join(splitCommand(commands_.make(cells_[cell], makeImpulse(1))).shared);
    return groups_.emplace(std::pair{cells_[cell][0], shared}, groups_.size()).first->second;
  }

  // Takes the first, and others that go with it. How many there are in a task changes nothing but the time.
  void begin(std::deque<size_t>& waiting) {
    const size_t cell = waiting.front(), group = findGroup(cell);
    const std::vector<std::string> shared = splitCommand(commands_.make(cells_[cell], makeImpulse(1))).shared;
    Running entry;
    entry.together = goesTogether(shared);
    const size_t width = static_cast<size_t>(options_.engine->width());
    const size_t most = entry.together ? std::clamp<size_t>((waiting.size() + width - 1) / width, 1, kMostTogether) : 1;
    for (; !waiting.empty() && entry.runs.size() < most && findGroup(waiting.front()) == group; waiting.pop_front()) {
      const int multiple = follow(waiting.front()).next;
      if (multiple > 0)
        entry.runs.push_back({waiting.front(), makeKey(waiting.front(), multiple),
                              splitCommand(commands_.make(cells_[waiting.front()], makeImpulse(multiple))).own});
    }
    if (entry.runs.empty()) return;
    if (free_slots_.empty()) free_slots_.push_back(static_cast<int>(running_.size()));
    entry.slot = free_slots_.back();
    free_slots_.pop_back();
    entry.task = shipped_[cells_[cell][0]];
    entry.task.programs = {options_.simulate};
    entry.task.arguments = {"@motion", "-o", "@out", "--summary-only"};
    entry.task.arguments.insert(entry.task.arguments.end(), shared.begin(), shared.end());
    if (!entry.together)
      entry.task.arguments.insert(entry.task.arguments.end(), entry.runs[0].own.begin(), entry.runs[0].own.end());
    entry.task.outputs = {"out"};
    entry.task.directory = getPlace(entry.slot);
    if (options_.engine->isRemote()) shipFiles(entry.task);
    if (entry.together) {
      entry.task.inputs.push_back({"runs", entry.task.directory + "/runs"});
      entry.task.arguments.insert(entry.task.arguments.end(), {"--runs", "@runs"});
    }
    submit(std::move(entry));
  }

  void submit(Running entry) {
    clearFiles(entry.task.directory);
    makeOutputDirectory(entry.task.directory);
    if (entry.together) {
      std::string lines;
      for (const Run& run : entry.runs) lines += Json(run.own).dump() + "\n";
      writeTextFile(entry.task.directory + "/runs", lines);
    }
    const int id = options_.engine->submit(entry.task);
    running_.emplace(id, std::move(entry));
  }

  // Null, or a text that says why, where there is none.
  static std::vector<Json> readResults(const Running& entry, int status) {
    if (entry.together) return readCampaignResults(entry.task, static_cast<int>(entry.runs.size()));
    try {
      return {readCampaignResult(entry.task, status)};
    } catch (const std::exception& error) {
      return {error.what()};
    }
  }

  // The cells of a task that has ended for which more may have to be done.
  std::vector<size_t> finish(const tasks::TaskEnd& end) {
    const auto found = running_.find(end.id);
    if (found == running_.end()) return {};
    Running entry = std::move(found->second);
    running_.erase(found);
    const std::vector<Json> results = readResults(entry, end.status);
    std::vector<size_t> cells;
    std::vector<Run> failed;
    const bool again = entry.attempt < options_.engine->attempts();
    for (size_t i = 0; i < results.size(); ++i) {
      if (results[i].is_object()) {
        keep(entry.runs[i], results[i]);
        cells.push_back(entry.runs[i].cell);
        continue;
      }
      failed.push_back(entry.runs[i]);
      const std::string why =
          results[i].is_string() ? results[i].get<std::string>() : describeEnd(entry.task, end.status);
      report(entry.runs[i].key + ": " + why + (again ? "; retrying" : ""), again);
    }
    if (again && !failed.empty()) {
      ++entry.attempt;
      entry.runs = failed;
      submit(std::move(entry));
    } else {
      free_slots_.push_back(entry.slot);
      complete_ = complete_ && failed.empty();
    }
    std::reverse(cells.begin(), cells.end());
    return cells;
  }

  void keep(const Run& run, const Json& result) {
    if (result.at("outcome") != kRefused)
      log_.append(Json{{"motion", getIdentity(run.cell)}, {"run", run.key}, {"result", result}}.dump());
    results_[{getIdentity(run.cell), run.key}] = result;
    report(run.key + ": " + result.at("outcome").get<std::string>());
  }

  // What tasks of several runs have done before they are ended.
  void keepFinished() {
    options_.engine->stop();
    for (const auto& [id, entry] : running_) {
      if (!entry.together) continue;
      const std::vector<Json> results = readResults(entry, 0);
      for (size_t i = 0; i < results.size(); ++i)
        if (results[i].is_object()) keep(entry.runs[i], results[i]);
    }
    running_.clear();
  }

  void report(const std::string& text, bool again = false) {
    if (!again) ++done_;
    if (options_.progress)
      options_.progress("[" + std::to_string(done_) + (spec_.search ? "" : "/" + std::to_string(cells_.size())) + "] " +
                        text);
  }

  void collect(CampaignResults& out) const {
    for (const CampaignAxis& axis : spec_.axes) out.columns.push_back(axis.name);
    out.searched = spec_.search.has_value();
    if (spec_.search) out.columns.push_back("push impulse");
    for (size_t cell = 0; cell < cells_.size(); ++cell)
      for (const int multiple : follow(cell).done) {
        CampaignRun run;
        for (size_t i = 0; i < spec_.axes.size(); ++i) run.values.push_back(spec_.axes[i].values[cells_[cell][i]]);
        if (spec_.search) run.values.push_back(makeImpulse(multiple));
        run.command = join(commands_.make(cells_[cell], makeImpulse(multiple)));
        run.result = results_.at({getIdentity(cell), makeKey(cell, multiple)});
        out.runs.push_back(std::move(run));
      }
  }

  const CampaignSpec& spec_;
  const std::string directory_;
  const std::vector<std::string> motions_;
  const CampaignOptions& options_;
  const CampaignCommands commands_;
  const std::vector<CampaignCell> cells_;
  LineLog log_;
  std::vector<std::string> identities_;                          // of the motions
  std::map<std::pair<std::string, std::string>, Json> results_;  // by identity of the motion, and key
  std::vector<tasks::Task> shipped_;                             // the part of a task that depends on the motion alone
  std::map<int, Running> running_;                               // by the number of the task
  std::map<std::pair<size_t, std::string>, size_t> groups_;      // by motion and shared arguments
  std::vector<int> free_slots_;
  size_t done_ = 0;
  bool complete_ = true;
};

// The directories of all motions; those that have to be solved are, unless they were before. Empty: interrupted.
std::vector<std::string> solveMotions(const CampaignSpec& spec, const std::string& directory,
                                      const CampaignOptions& options) {
  std::vector<Case> cases;
  std::set<std::string> robots;  // each once: another motion of one of them changes nothing for the others
  for (const CampaignMotion& motion : spec.motions) {
    if (!motion.directory.empty()) continue;
    Case one{motion.name, {motion.solve}, motion.robot};
    one.steps[0].insert(one.steps[0].end(), {"-o", std::string("@") + kMotion, "--quiet", "--no-report", "--no-check"});
    cases.push_back(one);
    robots.insert(loadRobot(motion.robot).directory);
  }
  RunOutcome outcome;
  if (!cases.empty())
    outcome = runCases(directory + "/motions", cases,
                       {options.bielle, makeIdentity(options.bielle, {robots.begin(), robots.end()}), options.engine,
                        options.progress});
  if (outcome.interrupted) return {};
  std::vector<std::string> directories;
  size_t next = 0;
  for (const CampaignMotion& motion : spec.motions) {
    directories.push_back(motion.directory.empty() ? directory + "/motions/" + motion.name + "/" + kMotion
                                                   : motion.directory);
    if (!motion.directory.empty()) continue;
    const CaseOutcome& solved = outcome.cases[next++];
    if (!solved.complete || solved.steps.empty() || solved.steps.back().status != 0)
      throw InputError(spec.path, "motion '" + motion.name + "'", "it was not solved",
                       "see step1.log in " + directory + "/motions/" + motion.name);
    for (const GoalOutcome& goal : readSummary(directories.back()).goals)
      if (!goal.met() && options.progress)
        options.progress("warning: motion " + motion.name + ": " + goal.goal.name + ": " + formatOutcome(goal));
  }
  return directories;
}

}  // namespace

CampaignResults runCampaign(const CampaignSpec& spec, const std::string& directory, const CampaignOptions& options) {
  countCells(spec);  // \throws that there are too many
  makeOutputDirectory(directory);
  const std::string check = directory + "/check.log";
  std::set<std::string> warnings;
  const bool is_checked = checkCommands(spec, options.bielle, options.simulate, check, warnings);
  fs::remove(check);
  for (const std::string& warning : warnings)
    if (options.progress) options.progress(warning);
  std::vector<std::string> motions;
  if (is_checked) motions = solveMotions(spec, directory, options);
  if (motions.empty()) {
    CampaignResults out;
    out.interrupted = true;
    return out;
  }
  setenv("OMP_NUM_THREADS", "1", 1);  // processes share the cores, not threads
  return CampaignRunner(spec, directory, motions, options).run();
}

}  // namespace bielle::tasks
