#include "tasks/dataset_index.h"

#include <algorithm>
#include <filesystem>

#include "bielle/model/options.h"
#include "bielle/results/result.h"
#include "formats/text_file.h"
#include "model/number_text.h"

namespace fs = std::filesystem;

namespace bielle::tasks {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

Json listTexts(const Pairs& pairs) {
  Json json = Json::object();
  for (const auto& [key, value] : pairs) json[key] = value;
  return json;
}

// Numbers as numbers.
Json listValues(const Pairs& pairs) {
  Json json = Json::object();
  for (const auto& [key, value] : pairs)
    std::visit([&json, &key = key](const auto& held) { json[key] = held; }, parseOption(value));
  return json;
}

constexpr const char* kCard = R"(
## Files

- `index.jsonl`: one JSON object per motion: what was asked (`robot`, `payload_kg`, `motion`, `set`, `options`), what was
  achieved (`goals` with requested and achieved values, `converged`, `check_passed`, `goals_met`; `good` if all three hold),
  `duration_s`, and `files` by format. Motions that are not good are listed, too, and have no files but their result.
  `index.html`: the same with a picture of each motion, for any browser.
  A motion with an `outcome` was carried out in a physics simulation with the options in `simulate`, and its files hold what
  happened there, on which its `goals` are measured; `plan` has those of the plan. It is good only if it `stood`.
- `mjlab/NAME.npz`, `amp/NAME.npz`: joints and bodies at a uniform rate, with the robots as files of MuJoCo beside them;
  `mcap/NAME.mcap`: frames, forces and events over time. Each holds the motions that are good.
- `motions/NAME/motion`: the result of the solver, at its own nodes, with its check; `motions/NAME/step1.log` what it printed.
  `motions/NAME/carried_out`: what happened in simulation.

## How it was made

Each motion is a solution of an optimal control problem for the whole mechanism, whose kinematic loops are closed at every node. It
was verified from its files alone: equations of motion, closing of the loops, contacts, friction cones, limits of the motors.

## Units and frames

SI units, radians. The world has z upwards; the robot starts near its origin, facing x. Quaternions are w, x, y, z in `mjlab` and
`amp`. Positions and velocities of bodies are those of the origins of their frames, in the world. Torques are those of the motors.
)";

// What the index tells of the goals in a summary.
Json readGoals(const std::string& file) {
  Json goals = Json::array();
  readJsonFile(file, "remove it", [&goals](const Json& json) {
    if (!json.contains("goals")) return;
    for (const Json& goal : json.at("goals")) {
      Json entry;
      for (const char* key : {"name", "unit", "requested", "achieved", "met"}) entry[key] = goal.at(key);
      goals.push_back(std::move(entry));
    }
  });
  return goals;
}

std::string formatCard(const DatasetSpec& spec, const std::vector<DatasetEntry>& entries) {
  const auto good = std::count_if(entries.begin(), entries.end(), [](const DatasetEntry& e) { return e.is_good(); });
  double duration = 0;
  for (const DatasetEntry& entry : entries) duration += entry.is_good() ? entry.duration : 0;
  return "# " + fs::path(spec.path).stem().string() + "\n\n" + std::to_string(entries.size()) +
         " motions were asked for, " + std::to_string(good) + " are good, " + formatNumber(duration, "%.1f") +
         " s together. " + describeDataset(spec) + "\n" + kCard + "\n## Specification\n\n```yaml\n" + spec.text +
         (spec.text.empty() || spec.text.back() == '\n' ? "" : "\n") + "```\n";
}

}  // namespace

std::string describeDataset(const DatasetSpec& spec) {
  std::string formats;
  for (const std::string& format : spec.formats) formats += (formats.empty() ? "" : ", ") + format;
  return "Formats: " + formats + "; " + formatNumber(spec.rate) +
         " frames per second. Licence: " + (spec.licence.empty() ? "not stated" : spec.licence) + ". Made by Bielle " +
         getBuildInfo().bielle + ".";
}

Json describeEntry(const DatasetEntry& entry) {
  const DatasetMotion& motion = *entry.motion;
  Json json = {{"name", motion.name},
               {"robot", motion.robot_name},
               {"payload_kg", motion.payload},
               {"motion", motion.motion},
               {"set", listValues(motion.set)},
               {"options", listValues(motion.options)},
               {"simulate", listValues(motion.simulate)},
               {"good", entry.is_good()},
               {"converged", entry.converged},
               {"check_passed", entry.passed},
               {"goals_met", entry.met},
               {"outcome", entry.outcome},
               {"goals", entry.goals},
               {"duration_s", entry.duration},
               {"files", listTexts(entry.files)}};
  if (!entry.planned.is_null()) json["plan"] = {{"goals", entry.planned}};
  if (!entry.error.empty()) json["error"] = entry.error;
  return json;
}

DatasetEntry readDatasetEntry(const DatasetMotion& motion, const CaseOutcome& outcome, const std::string& directory) {
  DatasetEntry entry;
  entry.motion = &motion;
  if (outcome.steps.empty() || !outcome.complete) {
    entry.error = "it did not end";
    return entry;
  }
  const fs::path result = fs::path(directory) / kDatasetMotion, execution = fs::path(directory) / kDatasetExecution;
  if (outcome.steps.front().status > 1 || !fs::exists(result / "summary.json")) {
    entry.error = outcome.steps.front().error;
    return entry;
  }
  entry.result = result.string();
  const MotionSummary summary = readSummary(entry.result);
  entry.converged = summary.converged;
  entry.goals = readGoals((result / "summary.json").string());
  if (const fs::path check = result / "check.json"; fs::exists(check))
    readJsonFile(check.string(), "remove it", [&](const Json& json) { entry.passed = json.at("pass"); });
  if (const fs::path summary_file = execution / "summary.json"; fs::exists(summary_file)) {
    entry.result = execution.string();
    readJsonFile(summary_file.string(), "remove it", [&](const Json& json) {
      entry.outcome = json.at("outcome");
      entry.warnings = json.value("warnings", std::vector<std::string>());
    });
    entry.planned = std::move(entry.goals);
    entry.goals = readGoals(summary_file.string());
  } else if (motion.carried_out) {
    entry.error = outcome.steps.back().error;
  }
  entry.met = std::all_of(entry.goals.begin(), entry.goals.end(), [](const Json& goal) { return goal["met"] == true; });
  const VectorXd time = readResultRecord(entry.result).time;
  entry.duration = time[time.size() - 1];
  return entry;
}

std::vector<std::string> writeDatasetIndex(const std::string& directory, const DatasetSpec& spec,
                                           const std::vector<DatasetEntry>& entries) {
  std::string lines;
  for (const DatasetEntry& entry : entries) lines += describeEntry(entry).dump() + "\n";
  const std::vector<std::string> paths = {directory + "/index.jsonl", directory + "/README.md"};
  writeTextFile(paths[0], lines);
  writeTextFile(paths[1], formatCard(spec, entries));
  return paths;
}

}  // namespace bielle::tasks
