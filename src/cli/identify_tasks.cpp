#include "cli/identify_tasks.h"

#include <fnmatch.h>

#include <algorithm>
#include <set>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "dynamics/linkage_workspace.h"
#include "identify/play_sides.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/setting.h"

namespace bielle::cli {
namespace {

constexpr const char *kRods = "rods", *kNoiseExample = "*=2e-4";
constexpr double kStill = 1e-9;  // rad or m

bool matches(const std::string& pattern, const std::string& name) {
  return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

// Sensors, and what else could be one.
void addSensors(const Model& model, const std::vector<std::string>& more, LinkageTask& task) {
  const std::vector<std::string> names = makePositionNames(model);
  const ReducedCluster& cluster = *task.cluster;
  for (size_t i = 0; i < cluster.joints.size(); ++i) {
    const int index = cluster.joints[i];
    const Joint &joint = model.joints()[static_cast<size_t>(index)], &own = cluster.model.joints()[i + 1];
    const bool is_usual = contains(model.serialJoints(), index) || model.findMotor(joint.name) >= 0;
    if (joint.nq != 1 && joint.kind != JointKind::Universal) continue;
    for (int k = 0; k < joint.nq; ++k) {
      const std::string& name = names[static_cast<size_t>(joint.idx_q + k)];
      if (!is_usual && !cli::matches(more, name)) {
        task.others.push_back(name);
        continue;
      }
      LinkageSensor sensor;
      sensor.name = name;
      sensor.position = own.idx_q + k, sensor.dof = own.idx_v + k;
      sensor.is_length = joint.kind == JointKind::Prismatic;
      task.sensors.push_back(std::move(sensor));
    }
  }
}

std::vector<std::string> listJoints(const Model& model, const ReducedCluster& cluster) {
  std::vector<std::string> names;
  for (const int joint : cluster.joints) names.push_back(model.joints()[static_cast<size_t>(joint)].name);
  return names;
}

}  // namespace

bool matches(const std::vector<std::string>& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& pattern) { return matches(pattern, name); });
}

std::vector<LinkageTask> listTasks(const Model& model, ConstVectorRef q, const IdentifyChoice& choice,
                                   const std::vector<Play>& present) {
  const Reduction reduction = makeReduction(model, q);
  std::vector<LinkageTask> tasks;
  std::vector<std::string> names;
  std::set<std::string> asked(choice.joints.begin(), choice.joints.end());
  for (const Linkage& linkage : selectLinkages(model, reduction)) {
    LinkageTask task;
    task.cluster = linkage.cluster;
    if (task.cluster->size == 0) continue;  // it cannot move
    const std::vector<std::string> joints = listJoints(model, *task.cluster);
    task.name = linkage.joint_names.empty() ? joints.front() : linkage.output;
    names.push_back(task.name);
    bool is_chosen = choice.joints.empty();
    for (const std::string& joint : joints) is_chosen = asked.erase(joint) > 0 || is_chosen;
    if (!is_chosen) continue;
    task.q.resize(task.cluster->model.nq());
    gatherConfiguration(model, *task.cluster, q, task.q);
    addSensors(model, choice.sensors, task);
    for (const std::string& setting : choice.noise) {
      const auto [name, value] = parseSetting("--noise", setting, kNoiseExample);
      if (!(value > 0))
        throw InputError("", "--noise " + setting, "it is not above 0",
                         std::string("give a standard deviation, rad or m, e.g. --noise ") + kNoiseExample);
      for (LinkageSensor& sensor : task.sensors)
        if (matches(name, sensor.name)) sensor.noise = value;
    }
    task.geometry = listGeometry(model, *task.cluster, task.q);
    task.plays = listLinkagePlays(model, *task.cluster, task.sensors, present);
    tasks.push_back(std::move(task));
  }
  if (names.empty())
    throw InputError(model.name(), "linkages", "it has none: no loops are closed", "name a robot with `closures`");
  if (!asked.empty())
    throw InputError(model.name(), "--joint " + *asked.begin(), "it is no joint of a linkage",
                     "name a joint of one of: " + listItems(names));
  requireKnown(tasks, choice);
  return tasks;
}

std::vector<GeometryNumber> chooseGeometry(const LinkageTask& task, const std::vector<std::string>& free) {
  std::vector<GeometryNumber> chosen;
  for (const GeometryNumber& number : task.geometry)
    if ((number.is_rod && contains(free, kRods)) || matches(free, number.name)) chosen.push_back(number);
  return chosen;
}

void requireKnown(const std::vector<LinkageTask>& tasks, const IdentifyChoice& choice) {
  std::vector<std::string> sensors, measurable, geometry, plays;
  for (const LinkageTask& task : tasks) {
    for (const LinkageSensor& sensor : task.sensors) sensors.push_back(sensor.name);
    measurable.insert(measurable.end(), task.others.begin(), task.others.end());
    for (const GeometryNumber& number : task.geometry) geometry.push_back(number.name);
    for (const LinkagePlay& play : task.plays) plays.push_back(play.name);
  }
  const auto require = [](const char* flag, const std::string& pattern, const std::vector<std::string>& names) {
    if (std::none_of(names.begin(), names.end(), [&](const std::string& name) { return matches(pattern, name); }))
      throw InputError("", std::string(flag) + " " + pattern, "no linkage has it", "there are: " + listItems(names));
  };
  measurable.insert(measurable.begin(), sensors.begin(), sensors.end());
  for (const std::string& name : choice.sensors) require("--sensor", name, measurable);
  for (const std::string& pattern : choice.exact) require("--no-offset", pattern, sensors);
  for (const std::string& setting : choice.noise)
    require("--noise", parseSetting("--noise", setting, kNoiseExample).first, sensors);
  for (const std::string& pattern : choice.plays) require("--play", pattern, plays);
  geometry.insert(geometry.begin(), {kRods, "none"});
  for (const std::string& pattern : choice.free) require("--free", pattern, geometry);
}

LoggedTask matchLog(const LinkageTask& task, const MotionLog& log) {
  LoggedTask out;
  out.task = &task;
  std::vector<int> columns;
  std::vector<std::string> all, still;
  for (const LinkageSensor& sensor : task.sensors) {
    all.push_back(sensor.name);
    const int column = log.find(sensor.name);
    if (column < 0) continue;
    out.sensors.push_back(sensor);
    columns.push_back(column);
    const auto values = log.values.col(column);
    if (!(values.maxCoeff() - values.minCoeff() > kStill)) still.push_back(sensor.name);
  }
  const auto count = static_cast<int>(columns.size());
  if (count == 0) {
    out.left_out = "the log has none of its columns: " + listItems(all);
    return out;
  }
  if (still.size() == columns.size()) {
    out.left_out = "it stands still in the log";
    return out;
  }
  if (!still.empty())
    throw InputError(log.path, "column '" + still.front() + "'",
                     "it is the same in all rows, while others of its linkage change",
                     "leave the column out if its sensor was not connected");
  out.readings.resize(log.values.rows(), count);
  for (int c = 0; c < count; ++c) out.readings.col(c) = log.values.col(columns[static_cast<size_t>(c)]);
  const int freedoms = LogFit(task.cluster, {}, out.sensors, out.readings, task.q).calcSeenFreedoms(task.q);
  if (count > freedoms) return out;
  std::vector<std::string> more;
  for (const std::string& name : all)
    if (log.find(name) < 0) more.push_back(name);
  more.insert(more.end(), task.others.begin(), task.others.end());
  out.left_out = "its " + std::to_string(count) + " column(s) in the log tell no more than where it is, with " +
                 std::to_string(freedoms) + " freedom(s); log more of its joints: " + listItems(more) +
                 (task.others.empty() ? "" : " (those that are no motors or serial joints by --sensor)");
  return out;
}

}  // namespace bielle::cli
