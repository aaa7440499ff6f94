#include "worlds/carried_goals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "control/clock.h"
#include "model/number_text.h"

namespace bielle::worlds {
namespace {

constexpr double kLargestShare = 0.05;

// The row of a record at an instant, the last one at most.
int findRow(const VectorXd& time, double at) {
  const auto found = std::lower_bound(time.begin(), time.end(), at - kClockTolerance);
  return static_cast<int>(std::min<Eigen::Index>(found - time.begin(), time.size() - 1));
}

// When a contact that lands at a node of the plan leaves the ground again, s.
double findEnd(const Plan& plan, const Foothold& foothold) {
  const int contact = plan.robot.model.findContact(foothold.contact);
  int node = 0;
  double end = plan.getTime(foothold.node);
  for (const ContactPhase& phase : plan.schedule.phases) {
    const bool stands = std::any_of(phase.contacts.begin(), phase.contacts.end(),
                                    [contact](const ContactTarget& target) { return target.contact == contact; });
    node += phase.nodes;
    if (node <= foothold.node) continue;
    if (!stands) break;
    end = plan.getTime(node);
  }
  return end;
}

}  // namespace

std::vector<GoalOutcome> measurePlannedGoals(const Plan& plan) {
  std::vector<GoalOutcome> outcomes;
  if (plan.goals.empty()) return outcomes;
  const Motion& motion = plan.solution->motion;
  const MotionTrack track = makeTrack(motion.problem->model(), makeRecord(motion, plan.solution->trajectory));
  for (const Goal& goal : plan.goals) outcomes.push_back({goal, measureGoal(goal, track)});
  return outcomes;
}

std::vector<GoalOutcome> measureCarriedGoals(const Plan& plan, const std::vector<Goal>& goals,
                                             const MotionRecord& record) {
  std::vector<GoalOutcome> outcomes;
  if (goals.empty()) return outcomes;
  const MotionTrack track = makeTrack(plan.robot.model, record);
  const double end = record.time[record.time.size() - 1] + kClockTolerance;
  for (Goal goal : goals) {
    // That of all whole cycles, since the first ones are still disturbed by the start.
    if (plan.cycles > 1 && goal.kind == GoalKind::Speed)
      goal.last *= std::max(1, static_cast<int>(end / plan.getTime(goal.last)));
    bool is_recorded = plan.getTime(goal.first) >= record.time[0] - kClockTolerance && plan.getTime(goal.last) <= end;
    goal.first = findRow(record.time, plan.getTime(goal.first));
    goal.last = findRow(record.time, plan.getTime(goal.last));
    for (Foothold& foothold : goal.footholds) {
      const double at = 0.5 * (plan.getTime(foothold.node) + findEnd(plan, foothold));
      is_recorded &= at <= end;
      foothold.node = findRow(record.time, at);
    }
    outcomes.push_back({goal, is_recorded ? measureGoal(goal, track) : std::numeric_limits<double>::quiet_NaN()});
  }
  return outcomes;
}

std::vector<std::string> listDifferences(const std::vector<GoalOutcome>& planned,
                                         const std::vector<GoalOutcome>& carried) {
  std::vector<std::string> differences;
  for (size_t i = 0; i < carried.size(); ++i) {
    const Goal& goal = carried[i].goal;
    const double plan = planned[i].achieved, other = carried[i].achieved;
    if (std::isnan(other)) continue;  // it ended before
    const bool is_foothold = goal.kind == GoalKind::Footholds;
    const double allowed = is_foothold || goal.requested == 0 ? goal.tolerance : kLargestShare * std::abs(plan);
    if (std::abs(other - plan) <= allowed) continue;
    const std::string name = getUnit(goal.kind), unit = name == "1" ? "" : " " + name;
    differences.push_back(
        goal.name + ": " + formatNumber(other, "%.4g") + unit + " where " + formatNumber(plan, "%.4g") + unit +
        (is_foothold ? " from them, of " + formatNumber(goal.tolerance, "%.2g") + " m, was planned" : " was planned"));
  }
  return differences;
}

}  // namespace bielle::worlds
