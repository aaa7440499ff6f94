#include "bielle/motion/goal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "math/constants.h"
#include "math/largest.h"
#include "model/number_text.h"

namespace bielle {
namespace {

struct KindText {
  GoalKind kind;
  const char *name, *unit;
};
constexpr std::array<KindText, 7> kKinds = {{{GoalKind::Speed, "speed", "m/s"},
                                             {GoalKind::Height, "height", "1"},
                                             {GoalKind::Rise, "rise", "m"},
                                             {GoalKind::FlightTime, "flight time", "s"},
                                             {GoalKind::Turn, "turn", "rad"},
                                             {GoalKind::Displacement, "displacement", "m"},
                                             {GoalKind::Footholds, "footholds", "m"}}};

const KindText& getText(GoalKind kind) { return kKinds.at(static_cast<size_t>(kind)); }

const SE3& getFoot(const MotionTrack& track, const std::string& contact, int node) {
  const auto it = std::find(track.contacts.begin(), track.contacts.end(), contact);
  if (it == track.contacts.end()) throw std::out_of_range("there is no contact '" + contact + "'");
  return track.feet.at(node).at(it - track.contacts.begin());
}

Vector3d calcMeanFoot(const Goal& goal, const MotionTrack& track, int node) {
  Vector3d sum = Vector3d::Zero();
  for (const std::string& contact : goal.contacts) sum += getFoot(track, contact, node).p;
  return sum / static_cast<double>(std::max<size_t>(1, goal.contacts.size()));
}

double measureSpeed(const Goal& goal, const MotionTrack& track) {
  return goal.direction.dot(track.com[goal.last] - track.com[goal.first]) /
         (track.time[goal.last] - track.time[goal.first]);
}

double measureHeight(const Goal& goal, const MotionTrack& track) {
  const double soles = calcMeanFoot(goal, track, goal.first).z(), start = track.com[goal.first].z();
  double farthest = start;
  for (int k = goal.first; k <= goal.last; ++k)
    if (!(std::abs(track.com[k].z() - start) <= std::abs(farthest - start))) farthest = track.com[k].z();
  return (farthest - soles) / (start - soles);
}

double measureRise(const Goal& goal, const MotionTrack& track) {
  double most = track.com[goal.first].z();
  for (int k = goal.first; k <= goal.last; ++k) most = getLarger(most, track.com[k].z());
  return most - track.com[goal.first].z();
}

double measureFlightTime(const Goal& goal, const MotionTrack& track) {
  double seconds = 0;
  for (int k = goal.first; k < goal.last; ++k)
    if (track.load[k] == 0) seconds += track.time[k + 1] - track.time[k];
  return seconds;
}

double measureTurn(const Goal& goal, const MotionTrack& track) {
  double turned = 0;
  for (int k = goal.first; k < goal.last; ++k)
    turned += std::remainder(track.heading[k + 1] - track.heading[k], 2 * kPi);
  return turned;
}

double measureDisplacement(const Goal& goal, const MotionTrack& track) {
  return goal.direction.dot(calcMeanFoot(goal, track, goal.last) - calcMeanFoot(goal, track, goal.first));
}

double measureFootholds(const Goal& goal, const MotionTrack& track) {
  double farthest = 0;
  for (const Foothold& foothold : goal.footholds) {
    const double distance = (getFoot(track, foothold.contact, foothold.node).p - foothold.position).norm();
    if (!(distance <= farthest)) farthest = distance;  // NaN is kept
    if (std::isnan(farthest)) break;
  }
  return farthest;
}

}  // namespace

const char* getName(GoalKind kind) { return getText(kind).name; }
const char* getUnit(GoalKind kind) { return getText(kind).unit; }

GoalKind parseGoalKind(const std::string& name) {
  for (const KindText& text : kKinds)
    if (name == text.name) return text.kind;
  throw std::invalid_argument("there is no kind of goal '" + name + "'");
}

double calcTolerance(double requested, double least) { return std::max(0.05 * std::abs(requested), least); }

double measureGoal(const Goal& goal, const MotionTrack& track) {
  const int nodes = static_cast<int>(track.time.size());
  if (goal.first < 0 || goal.first > goal.last || goal.last >= nodes)
    throw std::out_of_range("goal '" + goal.name + "': the trajectory does not have its nodes");
  switch (goal.kind) {
    case GoalKind::Speed:
      return measureSpeed(goal, track);
    case GoalKind::Height:
      return measureHeight(goal, track);
    case GoalKind::Rise:
      return measureRise(goal, track);
    case GoalKind::FlightTime:
      return measureFlightTime(goal, track);
    case GoalKind::Turn:
      return measureTurn(goal, track);
    case GoalKind::Displacement:
      return measureDisplacement(goal, track);
    case GoalKind::Footholds:
      return measureFootholds(goal, track);
  }
  throw std::logic_error("a kind of goal is not measured");
}

bool GoalOutcome::met() const { return std::abs(achieved - goal.requested) <= goal.tolerance; }

std::string formatOutcome(const GoalOutcome& outcome) {
  const Goal& goal = outcome.goal;
  const std::string name = getUnit(goal.kind), unit = name == "1" ? "" : " " + name;
  const auto format = [](double value) { return formatNumber(value, "%.4g"); };
  const bool exact = goal.kind == GoalKind::Footholds;  // the requested distance is zero
  std::string text = exact ? "requested within " + format(goal.tolerance) : "requested " + format(goal.requested);
  text += unit + ", achieved " + format(outcome.achieved) + unit;
  // A percentage of a ratio of heights would be misleading.
  if (!exact && goal.kind != GoalKind::Height && goal.requested != 0 && std::isfinite(outcome.achieved))
    text += ": " + std::to_string(std::lround(100 * outcome.achieved / goal.requested)) + " %";
  if (!outcome.met()) text += exact ? ", missed" : ", missed (tolerance " + format(goal.tolerance) + unit + ")";
  return text;
}

}  // namespace bielle
