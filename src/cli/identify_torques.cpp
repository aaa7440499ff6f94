#include "cli/identify_torques.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "cli/smooth_log.h"
#include "identify/loaded_states.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/interrupt.h"

namespace bielle::cli {
namespace {

constexpr int kRounds = 3;  // of weighing

// What is used of the log.
struct TorqueTask {
  std::vector<LinkageTask> linkages;                // that move
  std::vector<std::vector<LinkageSensor>> sensors;  // of each, which the log has
  std::vector<Coordinate> coordinates;              // outside all loops
};

TorqueTask makeTask(const Model& model, ConstVectorRef q, const IdentifyChoice& choice, const MotionLog& log) {
  if (model.hasFreeFlyer())
    throw InputError(model.name(), "base", "it moves, and the forces on it are not in the log",
                     "log the robot while its base is clamped, its feet in the air, and give --fixed-base");
  std::vector<std::string> missing;
  for (const Motor& motor : model.motors())
    if (log.find("u." + motor.name) < 0) missing.push_back("u." + motor.name);
  if (model.nu() == 0)
    throw InputError(model.name(), "motors", "it has none, so that nothing is known of its forces",
                     "name a robot with `motors`");
  TorqueTask task;
  IdentifyChoice all = choice;
  all.joints.clear();
  if (!model.closures().empty()) task.linkages = listTasks(model, q, all);
  std::set<int> looped;
  for (const LoopCluster& cluster : model.clusters())
    for (const int dof : cluster.dofs) looped.insert(model.dofs()[static_cast<size_t>(dof)].joint);
  for (const Coordinate& coordinate : listCoordinates(model)) {
    if (looped.count(coordinate.joint) > 0) continue;
    task.coordinates.push_back(coordinate);
    if (log.find(coordinate.name) < 0) missing.push_back(coordinate.name);
  }
  for (int i = 1; i < model.numBodies(); ++i)
    if (const Joint& joint = model.joints()[static_cast<size_t>(i)];
        joint.nq > 1 && joint.kind != JointKind::Universal && looped.count(i) == 0)
      throw InputError(model.name(), "joint '" + joint.name + "'", "no column of a log tells where it is",
                       "leave --dynamics out: torques tell of joints with one or two angles, or one length");
  for (const LinkageTask& linkage : task.linkages) {
    std::vector<LinkageSensor> sensors;
    std::vector<std::string> absent;
    for (const LinkageSensor& sensor : linkage.sensors)
      if (log.find(sensor.name) >= 0)
        sensors.push_back(sensor);
      else
        absent.push_back(sensor.name);
    const MatrixXd none(0, static_cast<Eigen::Index>(sensors.size()));
    if (sensors.empty() ||
        LogFit(linkage.cluster, {}, sensors, none, linkage.q).calcSeenFreedoms(linkage.q) < linkage.cluster->size)
      missing.insert(missing.end(), absent.begin(), absent.end());
    task.sensors.push_back(std::move(sensors));
  }
  if (!missing.empty())
    throw InputError(log.path, "columns", "--dynamics needs those that are missing: " + listItems(missing),
                     "log positions of all motors and joints [rad, m] and torques of all motors [N m, N], or leave "
                     "--dynamics out");
  return task;
}

}  // namespace

std::vector<std::string> listTorqueColumns(const Model& model) {
  std::vector<std::string> columns;
  for (const Coordinate& coordinate : listCoordinates(model)) {
    columns.push_back(coordinate.name);
    columns.push_back(coordinate.speed);
  }
  for (const Motor& motor : model.motors()) columns.push_back("u." + motor.name);
  return columns;
}

std::vector<LoadNumber> chooseLoads(const Model& model, const std::vector<std::string>& asked) {
  const std::map<std::string, std::vector<LoadKind>> kinds = {{"masses", {LoadKind::Mass}},
                                                              {"coms", {LoadKind::Com}},
                                                              {"armatures", {LoadKind::Armature}},
                                                              {"frictions", {LoadKind::Damping, LoadKind::Friction}}};
  const std::vector<LoadNumber> all = listLoads(model);
  std::vector<LoadNumber> chosen;
  std::set<std::string> used;
  for (const LoadNumber& number : all) {
    bool is_chosen = false;
    for (const std::string& one : asked) {
      const auto kind = kinds.find(one);
      if (kind != kinds.end() ? !contains(kind->second, number.kind)
                              : !matches(std::vector<std::string>{one}, number.name))
        continue;
      is_chosen = true;
      used.insert(one);
    }
    if (is_chosen) chosen.push_back(number);
  }
  for (const std::string& one : asked)
    if (used.count(one) == 0)
      throw InputError("", "--dynamics " + one, "the robot has no such number",
                       "there are: " + listKeys(kinds) + ", " + listItems(getNames(all)));
  return chosen;
}

void requireTorques(const Model& model, ConstVectorRef q, const IdentifyChoice& choice, const MotionLog& log) {
  makeTask(model, q, choice, log);
}

IdentifiedLoads identifyLoads(const Model& model, ConstVectorRef q, const IdentifyChoice& choice,
                              const TorqueChoice& torques, const MotionLog& log,
                              const std::map<std::string, double>& offsets, const EstimateOptions& options) {
  const TorqueTask task = makeTask(model, q, choice, log);
  const std::vector<Coordinate> all = listCoordinates(model);
  SmoothLog smooth_log(log, torques.window);
  IdentifiedLoads out;
  out.at_stops = smooth_log.leaveOutStops(model, all, offsets);
  std::vector<MeasuredLinkage> linkages;
  for (size_t l = 0; l < task.linkages.size(); ++l)
    linkages.push_back({task.linkages[l].cluster, task.sensors[l], task.linkages[l].q,
                        smooth_log.getMotions(all, task.sensors[l], offsets)});
  std::vector<MeasuredCoordinate> coordinates;
  for (const Coordinate& coordinate : task.coordinates)
    coordinates.push_back(
        {coordinate.position, coordinate.dof, smooth_log.getMotion(coordinate.name, coordinate.speed, offsets)});
  LoadedMotion motion = findLoadedStates(model, q, linkages, coordinates, smooth_log.getTorques(model),
                                         smooth_log.getSigns(model, all), isInterrupted());
  out.numbers = chooseLoads(model, torques.dynamics);
  out.instants = static_cast<int>(motion.states.size());
  out.left_out = static_cast<int>(smooth_log.size()) - out.instants;
  out.window = smooth_log.window();
  if (isInterrupted()) return out;
  if (2 * out.instants < smooth_log.size() || out.instants < 2)
    throw InputError(log.path, log.rows.front(),
                     "only at " + std::to_string(out.instants) + " of " + std::to_string(smooth_log.size()) +
                         " instants, half a window of " + formatNumber(out.window, "%.3g") +
                         " s apart, the linkages have a configuration near what was measured",
                     smooth_log.size() < 4 && out.at_stops > 0 ? "log a motion away from the joints' limits"
                     : smooth_log.size() < 4                   ? "give a longer log, or a shorter --window"
                                             : "check units (rad, m), signs and zeros, and take a shorter --window");
  out.too_fast = leaveOutFast(model, out.window, motion);
  out.instants -= out.too_fast;
  if (out.instants < 2)
    throw InputError(log.path, log.rows.front(),
                     "at every instant a joint turns by more than " + formatNumber(kMostTurnInWindow) + " rad within " +
                         formatNumber(out.window, "%.3g") + " s, over which torques are smoothed",
                     "give a shorter --window, or log a slower motion");
  const TorqueFit first(model, out.numbers, motion.states, motion.groups);
  out.estimate = estimate(makeProblem(first), options);
  // Then each linkage and joint counts by what is left of it, so that one that hardly needs torque does not hide what others tell.
  for (int round = 0; round < kRounds && !out.estimate.interrupted; ++round) {
    const Model found = changeLoads(model, out.numbers, out.estimate.x);
    const TorqueFit fit(model, out.numbers, motion.states, motion.groups,
                        calcRowWeights(found, motion.states, motion.groups, 1));
    out.estimate = estimate(makeProblem(fit), options);
  }
  const auto calcSquares = [&](const Model& of, double with) {
    const VectorXd weights = calcRowWeights(of, motion.states, motion.groups, with);
    return (weights.array() > 0).select(weights.array().square().inverse(), 0).sum();
  };
  const double torque = calcSquares(model, 0);
  out.estimate.misfit_before = std::sqrt(calcSquares(model, 1) / torque);
  out.estimate.misfit_after = std::sqrt(calcSquares(changeLoads(model, out.numbers, out.estimate.x), 1) / torque);
  out.estimate.noise = out.estimate.misfit_after / kTorqueNoise;
  return out;
}

}  // namespace bielle::cli
