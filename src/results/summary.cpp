#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "formats/text_file.h"
#include "results/ground_json.h"
#include "results/happened_summary.h"
#include "results/json_text.h"

namespace bielle {
namespace {

OptionValue readOption(const Json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_string()) return json.get<std::string>();
  if (json.is_number_integer() && std::abs(json.get<double>()) <= std::numeric_limits<int>::max())
    return json.get<int>();
  return json.get<double>();
}

// A number of nodes, or the index of one.
int readCount(const Json& json) {
  if (!json.is_number_integer() || json < 0 || json > std::numeric_limits<int>::max())
    throw std::runtime_error(json.dump(-1, ' ', true, Json::error_handler_t::replace) + " is not a number of nodes");
  return json;
}

Vector3d readVector(const Json& json) {
  return Vector3d(json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>());
}

SE3 readPlacement(const Json& json) {
  const Json& r = json.at("quaternion");
  const Eigen::Quaterniond quaternion(r.at(3), r.at(0), r.at(1), r.at(2));
  if (!(std::abs(quaternion.norm() - 1) < 1e-6)) throw std::runtime_error("a quaternion is not of unit length");
  return {quaternion.normalized().toRotationMatrix(), readVector(json.at("position"))};
}

GoalOutcome readGoal(const Json& json) {
  GoalOutcome outcome;
  Goal& goal = outcome.goal;
  goal.name = json.at("name");
  goal.kind = parseGoalKind(json.at("kind"));
  goal.requested = json.at("requested");
  goal.tolerance = json.at("tolerance");
  // JSON has no infinity or NaN.
  outcome.achieved =
      json.at("achieved").is_null() ? std::numeric_limits<double>::quiet_NaN() : json.at("achieved").get<double>();
  goal.first = readCount(json.at("first_node"));
  goal.last = readCount(json.at("last_node"));
  if (json.contains("direction")) goal.direction = readVector(json.at("direction"));
  if (json.contains("contacts")) goal.contacts = json.at("contacts").get<std::vector<std::string>>();
  if (json.contains("footholds"))
    for (const Json& entry : json.at("footholds"))
      goal.footholds.push_back({entry.at("contact"), readCount(entry.at("node")), readVector(entry.at("position"))});
  return outcome;
}

ObjectiveOptions readObjective(const Json& json) {
  ObjectiveOptions options;
  const std::string kind = json.at("kind");
  for (Objective objective : {Objective::Energy, Objective::PeakTorque})
    if (kind == getName(objective)) options.objective = objective;
  options.regularization = json.at("regularization").get<double>();
  options.scale = json.at("scale").get<double>();
  return options;
}

// What plans and motions carried out have alike.
MotionSummary readFacts(const Json& json) {
  MotionSummary summary;
  summary.motion = json.at("motion");
  summary.run = {
      json.at("robot"), json.at("robot_file"), {}, parseBelief(json.at("model")), json.at("serial_armature")};
  for (const Json& entry : json.at("phases")) {
    MotionSummary::Phase phase{
        entry.at("name"), readCount(entry.at("start_node")), readCount(entry.at("nodes")), entry.at("time_step_s"), {}};
    for (const Json& contact : entry.at("contacts"))
      phase.stances.push_back({contact.at("name"), readPlacement(contact)});
    summary.phases.push_back(phase);
  }
  summary.ground = readGround(json.at("ground"));
  return summary;
}

MotionSummary readPlan(const Json& json) {
  MotionSummary summary = readFacts(json);
  const std::string formulation = json.at("formulation");
  summary.formulation = formulation == getName(Formulation::Full) ? Formulation::Full : Formulation::Reduced;
  const std::string step = json.at("step");
  summary.step = step == getName(StepRule::Midpoint) ? StepRule::Midpoint : StepRule::Euler;
  summary.objective = readObjective(json.at("objective"));
  summary.objective.regeneration = json.at("electrical_energy").at("regeneration");
  summary.converged = json.at("converged");
  for (const auto& [name, value] : json.at("options").items()) summary.options.emplace_back(name, readOption(value));
  for (const Json& entry : json.at("goals")) summary.goals.push_back(readGoal(entry));
  for (const Json& entry : json.at("free_timings"))
    summary.timings.push_back({entry.at("phase"), readCount(entry.at("start_node")), entry.at("nominal_s"),
                               entry.at("chosen_s"), entry.at("lower_s"), entry.at("upper_s")});
  return summary;
}

bool isLimit(const std::string& name) {
  for (const char* prefix : {kEffortLimit, kVelocityLimit, kPowerLimit, kDeadPointMargin, kNoLimits})
    if (name.rfind(prefix, 0) == 0) return true;
  return false;
}

// The motions of a sequence from the names of its options: "walk2.speed" is one of a walk.
std::vector<std::string> listPartMotions(const OptionValues& options) {
  std::vector<std::string> labels, motions;
  for (const auto& [name, value] : options) {
    const size_t dot = name.find('.');
    if (dot == std::string::npos || isLimit(name)) continue;  // names of motors may have points
    const std::string label = name.substr(0, dot);
    if (std::find(labels.begin(), labels.end(), label) != labels.end()) continue;
    labels.push_back(label);
    motions.push_back(label.substr(0, label.find_last_not_of("0123456789") + 1));
  }
  return motions;
}

}  // namespace

AnySummary readAnySummary(const std::string& directory) {
  const std::string path = (std::filesystem::path(directory) / "summary.json").string();
  const std::string text = readTextFile(path, "give a directory that `bielle solve` wrote");
  try {
    const Json json = parseJson(text);
    AnySummary summary;
    summary.has_happened = json.contains("outcome");
    summary.facts = summary.has_happened ? readFacts(json) : readPlan(json);
    summary.facts.file = path;
    return summary;
  } catch (const std::exception& error) {
    throw InputError(path, "file", describeJsonError(error), "recreate it with `bielle solve`");
  }
}

MotionSummary readSummary(const std::string& directory) {
  const AnySummary summary = readAnySummary(directory);
  if (summary.has_happened)
    throw InputError(summary.facts.file, "motion", "it is a motion carried out, not a plan",
                     "give the directory of `bielle solve`");
  return summary.facts;
}

MotionRequest remakeRequest(const MotionSummary& summary) {
  MotionRequest request = summary.motion == kSequence ? makeSequenceRequest(listPartMotions(summary.options))
                                                      : findMotion(summary.file, summary.motion).request;
  for (const auto& [name, value] : summary.options)
    if (!isLimit(name)) request.options.set(name, value);
  return request;
}

}  // namespace bielle
