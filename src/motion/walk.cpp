#include "bielle/motion/walk.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "math/constants.h"
#include "model/number_text.h"
#include "motion/course.h"
#include "motion/standing_ground.h"

namespace bielle {
namespace {

// A motion of steps on level ground, where one foot may stand higher at the start, and the stance that it starts from.
struct StepsPlan {
  MotionPlan motion;
  SE3 start;  // middle of the feet
};

// Beside the box that a foot steps down from, m: a foot that comes nearer may land on its edge.
constexpr double kBesideBox = 0.01;

// Whether a sole on the plane would be in a box, or too near to it.
bool isOnBox(const ContactFrame& contact, const SE3& X_WF, const Ground& ground) {
  constexpr int kPoints = 10;  // in each direction, edges besides
  ContactFrame sole = contact;
  sole.half_length += kBesideBox, sole.half_width += kBesideBox;
  for (int i = 0; i <= kPoints; ++i)
    for (int j = 0; j <= kPoints; ++j) {
      const Vector3d p =
          X_WF.act(Vector3d((2.0 * i / kPoints - 1) * sole.half_length, (2.0 * j / kPoints - 1) * sole.half_width, 0));
      if (ground.calcHeight(p.x(), p.y()) > ground.height) return true;
    }
  return false;
}

// \param direction  in the axes of the feet at the start
template <typename Options>
StepsPlan planSteps(const Model& model, const char* name, const StepCommand& command, const Vector3d& direction,
                    double speed, Side first, const Options& options, const StandingRobot& standing) {
  listOptions(options).check();
  const Stance stance = makeStance(model, options.gait, standing);
  LocomotionTask task;
  task.name = name;
  if (options.periodic) requireLevel(model, listSoles(stance), std::string(name) + " that repeats");
  task.lead = options.periodic ? kCycleLead : 0;
  task.cycles = options.cycles;
  const int steps = options.periodic ? countCycleSteps(options.cycles) : options.steps;
  task.plan = planFootsteps(stance.feet[0], stance.feet[1], command, steps, first);
  task.ground = makeGroundUnder(model, listSoles(stance));
  if (!task.ground.steps.empty())  // down from what one foot stands on
    for (Footstep& step : task.plan.steps) {
      step.X_WF.p.z() = task.ground.height;
      if (isOnBox(model.contacts()[stance.contacts[static_cast<int>(step.side)]], step.X_WF, task.ground))
        requireLevel(
            model, listSoles(stance),
            std::string(name) + " with a foothold on its higher level, or within " + formatNumber(kBesideBox) +
                " m of it,",
            "give them the same height in the reference, or take longer steps, by a larger speed or angle, away from "
            "where the higher one stands");
    }
  task.direction = stance.middle.R * direction;
  task.speed = speed;
  MotionPlan plan = planLocomotion(model, stance, task, options.gait);
  if (!task.ground.steps.empty()) checkSwings(model, stance, {name, task.plan.steps, task.ground}, options.gait.swing);
  plan.options = listOptions(options).listValues();
  return {std::move(plan), stance.middle};
}

template <typename Options>
std::vector<Goal> makeSpeed(const Options& options, const ContactSchedule& schedule, const Vector3d& direction,
                            int steps_per_cycle) {
  if (options.periodic) return {makeCycleSpeedGoal(schedule, options.speed, direction)};
  return makeSpeedGoals(schedule, options.speed, direction, steps_per_cycle);
}

void addGoals(std::vector<Goal> goals, MotionPlan& plan) {
  plan.goals.insert(plan.goals.begin(), goals.begin(), goals.end());
}

}  // namespace

MotionPlan planWalk(const Model& model, const WalkOptions& o, const StandingRobot& standing) {
  StepsPlan plan = planSteps(model, "walk", {o.speed * o.gait.timing.stepDuration(), 0, 0}, Vector3d::UnitX(), o.speed,
                             Side::Right, o, standing);
  addGoals(makeSpeed(o, plan.motion.schedule, plan.start.R.col(0), 1), plan.motion);
  return std::move(plan.motion);
}

MotionPlan planSideWalk(const Model& model, const SideWalkOptions& o, const StandingRobot& standing) {
  const Side opening = o.speed > 0 ? Side::Left : Side::Right;
  StepsPlan plan = planSteps(model, "side-walk", {0, o.speed * o.gait.timing.stepDuration(), 0}, Vector3d::UnitY(),
                             o.speed, opening, o, standing);
  addGoals(makeSpeed(o, plan.motion.schedule, plan.start.R.col(1), 2), plan.motion);
  return std::move(plan.motion);
}

MotionPlan planTurn(const Model& model, const TurnOptions& o, const StandingRobot& standing) {
  const double yaw = o.angle / std::max(1, o.steps - 1);
  requireOption(std::abs(yaw) <= kPi, "angle", "it is more than half a turn per step",
                "give radians, a smaller angle, or more steps");
  StepsPlan plan = planSteps(model, "turn", {2 * o.radius * std::sin(std::abs(yaw) / 2), 0, yaw}, Vector3d::Zero(), 0,
                             yaw > 0 ? Side::Left : Side::Right, o, standing);
  const int nodes = plan.motion.schedule.numStages();
  const double angle = o.periodic ? 2 * o.cycles * yaw : o.angle;
  addGoals({{GoalKind::Turn, "angle", angle, calcTolerance(angle, 0.02), 0, nodes}}, plan.motion);
  return std::move(plan.motion);
}

Motion makeWalk(const Model& model, const WalkOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planWalk(model, options, makeStandingRobot(model)), problem);
}

Motion makeSideWalk(const Model& model, const SideWalkOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planSideWalk(model, options, makeStandingRobot(model)), problem);
}

Motion makeTurn(const Model& model, const TurnOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planTurn(model, options, makeStandingRobot(model)), problem);
}

}  // namespace bielle
