#include "cli/simulate/together.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "cli/simulate/output.h"
#include "cli/simulate/prepare.h"
#include "formats/text_file.h"
#include "results/interrupt.h"
#include "results/json_text.h"
#include "results/output_place.h"
#include "worlds/carried_goals.h"
#include "worlds/lane_worlds.h"

namespace bielle::worlds {
namespace {

namespace fs = std::filesystem;

// By which runs in one batch may differ.
const std::vector<std::string> kVaried = {"push", "seed", "friction", "mass_error", "delay", "noise", "terrain"};

struct Run {
  int number = 0;  // from 1 on
  SimulateArguments arguments;
  std::vector<std::string> command;
};

// Runs that share a plan.
struct Shared {
  Plan plan;
  PlanController controller;
  std::vector<GoalOutcome> planned;  // goals of the plan
};

bool isAlike(const SimulateArguments& a, const SimulateArguments& b) {
  const OptionSet one = listOptions(a), other = listOptions(b);
  return a.directory == b.directory && a.has_record_period == b.has_record_period &&
         std::all_of(one.begin(), one.end(), [&](const Option& option) {
           return std::find(kVaried.begin(), kVaried.end(), option.name) != kVaried.end() ||
                  option.value == other.get(option.name).value;
         });
}

// Whether a run can be one of a batch. Torques may begin to act at the ends of periods alone.
bool fitsBatch(const SimulateArguments& a) {
  const PlanControl control = a.wanted_control.value_or(PlanControl::Predictive);
  const double periods = 1e-3 * a.delay / a.execution.control_period;
  return control != PlanControl::Predictive && a.world == "bielle" && a.accuracy == 0 && a.errors.rod == 0 &&
         a.jitter == 0 && std::abs(periods - std::round(periods)) < 1e-6 && !a.live && !a.dry_run;
}

class Runs {
 public:
  Runs(const std::string& file, const std::vector<std::string>& command) {
    SimulateArguments common = parse(command, "--runs");
    output_ = common.output;
    std::vector<std::string> shared = command;
    const auto given = std::find(shared.begin(), shared.end(), "--runs");
    if (given != shared.end()) shared.erase(given, given + 2);
    std::istringstream lines(readTextFile(file));
    for (std::string line; std::getline(lines, line);) {
      Run run;
      run.number = static_cast<int>(runs_.size()) + 1;
      const std::string where = "line " + std::to_string(run.number);
      run.command = shared;
      try {
        for (const Json& word : parseJson(line)) run.command.push_back(word.get<std::string>());
      } catch (const std::exception& error) {
        throw InputError(file, where, describeJsonError(error), "give a list of texts, e.g. [\"--seed\", \"2\"]");
      }
      run.arguments = parse(run.command, file + ", " + where);
      run.arguments.output = output_ + "/" + std::to_string(run.number);
      runs_.push_back(std::move(run));
    }
    if (runs_.empty()) throw InputError(file, "runs", "it has no line", "give a list of options per run");
  }

  std::vector<Run>& runs() { return runs_; }
  const std::string& output() const { return output_; }

 private:
  static SimulateArguments parse(const std::vector<std::string>& command, const std::string& where) {
    SimulateArguments arguments;
    CLI::App app;
    addOptions(app, arguments);
    std::vector<std::string> words(command.rbegin(), command.rend() - 1);  // as CLI11 wants them
    try {
      app.parse(words);
    } catch (const CLI::ParseError& error) {
      throw InputError("", where, error.what(), "see `bielle simulate --help`");
    }
    noteGiven(app, arguments);
    return arguments;
  }

  std::string output_;
  std::vector<Run> runs_;
};

// Line by line what became of the runs.
class Log {
 public:
  explicit Log(const std::string& path) : file_(path) {
    if (!file_) throw InputError(path, "file", "it cannot be opened", "give another directory, or free space");
  }
  void add(const Run& run, int status, const std::string& error = "") {
    Json line = {{"run", run.number}, {"status", status}};
    if (!error.empty()) line["error"] = error;
    file_ << line.dump() << std::endl;
    std::cout << run.number << ": " << (error.empty() ? "exit status " + std::to_string(status) : error) << std::endl;
  }

 private:
  std::ofstream file_;
};

// Runs of one plan, whose grounds either all have steps or none.
void carryOut(const Shared& shared, std::vector<std::pair<Run*, Scene>>& group, Log& log, std::set<std::string>& told) {
  const Plan& plan = shared.plan;
  LaneOptions options;
  options.time_step = group.front().first->arguments.time_step;
  std::vector<PlanController> own;  // serial ones remember the posture that they saw last
  const auto make = [&](int i) {
    auto& [run, scene] = group[i];
    const SimulateArguments& a = run->arguments;
    if (plan.serial) own.push_back(makeController(plan, a.control));
    Controller* law = plan.serial ? own.back().law.get() : shared.controller.law.get();
    return std::make_unique<LaneRun>(LaneRun{law, scene.machine, scene.ground, a.perception, a.execution});
  };
  const auto done = [&](int i, const LaneRun&, const Execution& execution, const World& world) {
    auto& [run, scene] = group[i];
    for (const std::string& each : listIdleInPlan(run->arguments, plan, world)) scene.warnings.push_back(each);
    for (const std::string& each : world.warnings()) scene.warnings.push_back("world bielle: " + each);
    for (const std::string& each : scene.warnings)
      if (told.insert(each).second) tell({each});
    if (execution.outcome == Outcome::Stopped) return;
    makeOutputDirectory(run->arguments.output);
    write({run->arguments, plan, scene.robot, shared.planned, shared.controller, scene.ground, run->command,
           scene.warnings},
          execution);
    log.add(*run, getStatus(execution.outcome));
  };
  carryOutInLanes(plan, group.front().second.robot.model, static_cast<int>(group.size()), options, make, done);
}

}  // namespace

int simulateTogether(const std::string& file, const std::vector<std::string>& command,
                     const std::function<int(SimulateArguments, const std::vector<std::string>&)>& alone) {
  Runs all(file, command);
  makeOutputDirectory(all.output());
  Log log(all.output() + "/runs.jsonl");
  watchInterrupts();
  std::vector<Run*> left;
  for (Run& run : all.runs()) left.push_back(&run);
  std::set<std::string> told;
  while (!left.empty() && !isInterrupted()) {
    Run& first = *left.front();
    std::vector<Run*> alike, others;
    for (Run* run : left) (run == &first || isAlike(first.arguments, run->arguments) ? alike : others).push_back(run);
    left = std::move(others);
    std::unique_ptr<Shared> shared;
    std::vector<std::pair<Run*, Scene>> groups[2];  // by whether their grounds have steps
    for (Run* run : alike) {
      SimulateArguments arguments = run->arguments;
      try {
        parseOptions(arguments);
        requireShortSteps(arguments, "--control-period", arguments.execution.control_period);
        if (!fitsBatch(arguments) || !isOfPlan(arguments) || !arguments.robot.empty() || isInterrupted()) {
          if (!isInterrupted()) log.add(*run, alone(run->arguments, run->command));
          continue;
        }
        adaptToPlan(arguments);
        if (!shared) {
          Plan plan = obtainPlan(arguments);
          PlanController controller = makeController(plan, arguments.control);
          std::vector<GoalOutcome> planned = measurePlannedGoals(plan);
          shared = std::make_unique<Shared>(Shared{std::move(plan), std::move(controller), std::move(planned)});
        }
        Scene scene = makeScene(shared->plan, arguments);
        const Wear wear = makeWear(arguments, scene.robot);
        if (!wear.plays.empty() || !wear.frictions.empty()) {
          log.add(*run, alone(run->arguments, run->command));
          continue;
        }
        run->arguments = arguments;
        groups[!scene.ground.steps.empty()].emplace_back(run, std::move(scene));
      } catch (const InputError& error) {
        log.add(*run, kBadInput, error.what());
      }
    }
    for (auto& group : groups)
      if (!group.empty()) carryOut(*shared, group, log, told);
  }
  return isInterrupted() ? kFell : kStood;
}

}  // namespace bielle::worlds
