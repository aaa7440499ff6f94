#include "cli/identify_play.h"

#include <algorithm>

#include "bielle/model/error.h"
#include "cli/smooth_log.h"
#include "identify/play_sides.h"
#include "model/listing.h"
#include "results/interrupt.h"

namespace bielle::cli {
namespace {

constexpr double kFarthest = 0.75;  // of windows, half of one apart: none is missing between two instants

// What is asked for, and whose motor has a column.
std::vector<LinkagePlay> choosePlays(const LoggedTask& logged, const IdentifyChoice& choice) {
  std::vector<LinkagePlay> plays;
  for (LinkagePlay play : logged.task->plays) {
    if (!matches(choice.plays, play.name)) continue;
    if (play.sensor >= 0) {
      const std::string& name = logged.task->sensors[static_cast<size_t>(play.sensor)].name;
      const auto own = std::find_if(logged.sensors.begin(), logged.sensors.end(),
                                    [&name](const LinkageSensor& sensor) { return sensor.name == name; });
      if (own == logged.sensors.end()) continue;
      play.sensor = static_cast<int>(own - logged.sensors.begin());
    }
    plays.push_back(std::move(play));
  }
  return plays;
}

void requireTorquesOf(const Model& model, const ReducedCluster& cluster, const MotionLog& log) {
  std::vector<std::string> missing;
  for (const Motor& motor : model.motors())
    if (contains(cluster.joints, motor.joint) && log.find("u." + motor.name) < 0) missing.push_back("u." + motor.name);
  if (!missing.empty())
    throw InputError(
        log.path, "columns", "--play needs those that are missing: " + listItems(missing),
        "log torques of the motors [N m, N], which tell at which of its stops play is, or leave --play out");
}

}  // namespace

void addPlays(LogFit& fit, const Model& model, ConstVectorRef q, const LoggedTask& logged, const IdentifyChoice& choice,
              double window, const MotionLog& log, const VectorXd& time) {
  std::vector<LinkagePlay> plays = choosePlays(logged, choice);
  if (plays.empty()) return;
  const LinkageTask& task = *logged.task;
  requireTorquesOf(model, *task.cluster, log);
  const SmoothLog smooth_log(log, window);
  const MeasuredLinkage linkage{task.cluster, logged.sensors, task.q,
                                smooth_log.getMotions(listCoordinates(model), logged.sensors, {})};
  LoadedMotion motion = findLoadedStates(model, q, {linkage}, {}, smooth_log.getTorques(model), {}, isInterrupted());
  leaveOutFast(model, smooth_log.window(), motion);
  std::vector<double> instants;
  for (const Eigen::Index i : motion.instants) instants.push_back(smooth_log.instants()[static_cast<size_t>(i)]);
  const PlayLoads loads = calcPlayLoads(model, linkage, plays, motion, smooth_log.getTorqueNoise(model));
  MatrixXd sides = findSides(time, instants, loads, kFarthest * smooth_log.window());
  if (!isInterrupted() && (sides.array() != 0).rowwise().all().count() < 2) {
    std::vector<std::string> names;
    for (const LinkagePlay& play : plays) names.push_back(play.name);
    throw InputError(log.path, "--play",
                     "in no row it is clear at which of their stops all of these are: " + listItems(names),
                     "load them more, hold loads for longer than --window, or name fewer at once");
  }
  fit.addPlays(std::move(plays), std::move(sides));
}

Wear changePlays(Wear wear, const std::vector<LinkagePlay>& plays, const Estimate& estimate) {
  for (const LinkagePlay& play : plays)
    for (const Unknown& unknown : estimate.unknowns)
      if (unknown.kind == "play" && unknown.name == getPlayName(play.name) && unknown.is_seen)
        wear.plays.push_back({play.name, std::max(0.0, unknown.after)});
  return wear;
}

}  // namespace bielle::cli
