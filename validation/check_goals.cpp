// Rows of the goals: requested and achieved values, measured here by Simbody's kinematics and the recorded forces.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bielle/model/error.h"
#include "check_rows.h"
#include "math/constants.h"

namespace bielle::validation {
namespace {

class GoalMeter {
 public:
  GoalMeter(const CheckContext& context, const Goal& goal) : context_(context), goal_(goal) {
    require(goal.first <= goal.last && goal.last <= context.motion.numStages(), "its nodes do not fit the trajectory");
    require(std::isfinite(goal.requested) && std::isfinite(goal.tolerance) && goal.direction.allFinite(),
            "it contains a number that is not finite");
  }

  double measure() const {
    const MotionRecord& record = context_.motion.record;
    const double seconds = record.time[goal_.last] - record.time[goal_.first];
    switch (goal_.kind) {
      case GoalKind::Speed:
        require(seconds > 0, "no time passes between its nodes");
        return goal_.direction.dot(getCom(goal_.last) - getCom(goal_.first)) / seconds;
      case GoalKind::Height:
        return measureHeight();
      case GoalKind::Rise:
        return calcExtremes().second - getCom(goal_.first).z();
      case GoalKind::FlightTime:
        return measureFlightTime();
      case GoalKind::Turn:
        return measureTurn();
      case GoalKind::Displacement:
        return goal_.direction.dot(calcMeanFoot(goal_.last) - calcMeanFoot(goal_.first));
      case GoalKind::Footholds:
        return measureFootholds();
    }
    return std::nan("");
  }

 private:
  void require(bool ok, const std::string& problem) const {
    if (!ok)
      throw InputError(context_.motion.summary.file, "goal '" + goal_.name + "'", problem,
                       "recreate it with `bielle solve`");
  }
  const Vector3d& getCom(int node) const { return context_.trace.nodes[node].com; }
  const Vector3d& getFoot(const std::string& name, int node) const {
    const int contact = context_.model().findContact(name);
    require(contact >= 0, "the robot has no contact '" + name + "'");
    require(node <= context_.motion.numStages(), "its nodes do not fit the trajectory");
    return context_.trace.nodes[node].feet[contact].p;
  }
  Vector3d calcMeanFoot(int node) const {
    require(!goal_.contacts.empty(), "it names no contact");
    Vector3d sum = Vector3d::Zero();
    for (const std::string& name : goal_.contacts) sum += getFoot(name, node);
    return sum / static_cast<double>(goal_.contacts.size());
  }
  // Lowest and highest centre of mass.
  std::pair<double, double> calcExtremes() const {
    double lowest = getCom(goal_.first).z(), highest = lowest;
    for (int k = goal_.first; k <= goal_.last; ++k) {
      lowest = std::min(lowest, getCom(k).z());
      highest = std::max(highest, getCom(k).z());
    }
    return {lowest, highest};
  }

  double measureHeight() const {
    const double start = getCom(goal_.first).z(), soles = calcMeanFoot(goal_.first).z();
    const auto [lowest, highest] = calcExtremes();
    return ((start - lowest > highest - start ? lowest : highest) - soles) / (start - soles);
  }

  double measureFlightTime() const {
    double seconds = 0;
    for (int k = goal_.first; k < goal_.last; ++k)
      if (context_.motion.record.contact_wrenches.row(k).isZero(0)) seconds += context_.motion.getTimeStep(k);
    return seconds;
  }

  // From the quaternions of the free-flyer, q = (position, x y z w): by its axis x, or y where x stands upright at the start of the
  // record.
  double measureTurn() const {
    require(context_.model().hasFreeFlyer(), "the robot's base does not turn");
    const auto getAttitude = [this](int k) {
      const Eigen::Vector4d r = context_.motion.record.q.row(k).segment<4>(3);
      return Eigen::Quaterniond(r[3], r[0], r[1], r[2]).toRotationMatrix();
    };
    const Eigen::Matrix3d start = getAttitude(0);
    const bool x_is_upright =
        start(2, 2) <= 0.7 && std::abs(start(2, 0)) >= start.block<1, 2>(2, 1).cwiseAbs().maxCoeff();
    double turned = 0, before = 0;
    for (int k = goal_.first; k <= goal_.last; ++k) {
      const Eigen::Vector3d ahead = getAttitude(k).col(x_is_upright ? 1 : 0);
      const double yaw = std::atan2(ahead.y(), ahead.x());
      if (k > goal_.first) turned += std::remainder(yaw - before, 2 * kPi);
      before = yaw;
    }
    return turned;
  }

  double measureFootholds() const {
    double farthest = 0;
    for (const Foothold& foothold : goal_.footholds)
      farthest = std::max(farthest, (getFoot(foothold.contact, foothold.node) - foothold.position).norm());
    return farthest;
  }

  const CheckContext& context_;
  const Goal& goal_;
};

}  // namespace

void addGoalRows(CheckContext& context) {
  Worst claims;
  for (const GoalOutcome& reported : context.motion.summary.goals) {
    const Goal& goal = reported.goal;
    const double value = GoalMeter(context, goal).measure();
    const std::string unit = getUnit(goal.kind);
    char note[64];
    std::snprintf(note, sizeof note, "requested; tolerance %.3g%s", goal.tolerance,
                  unit == "1" ? "" : (" " + unit).c_str());
    context.rows.push_back({"goal: " + goal.name, CheckRow::Kind::Goal, value, goal.requested, unit, note});
    context.rows.back().tolerance = goal.tolerance;
    const double difference = std::abs(value - reported.achieved);
    claims.add(std::isnan(difference) ? std::numeric_limits<double>::infinity() : difference, goal.last, goal.name);
  }
  context.add(claims, "goals: reported vs. measured", "", context.bounds.goal, "no goal was reported");
}

}  // namespace bielle::validation
