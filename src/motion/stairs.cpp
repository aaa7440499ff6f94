#include "bielle/motion/stairs.h"

#include <algorithm>

#include "model/number_text.h"
#include "motion/course.h"

namespace bielle {
namespace {

void checkDuration(const StairsOptions& o) {
  const double single = o.depth / o.speed - o.gait.timing.both;
  requireOption(single >= 0.2 && single <= 3, "speed",
                "a step of this depth takes " + formatNumber(single) + " s on one foot, outside 0.2 .. 3 s",
                "change speed, depth or double_support");
}

// Foot i on step i; both end on the last one.
FootstepPlan planFootholds(const Stance& stance, const StairsOptions& o) {
  FootstepPlan plan{stance.feet, {}};
  const Vector3d up = stance.middle.R * Vector3d(o.depth, 0, o.height);
  Side side = Side::Right;
  for (int i = 1; i <= o.stairs + 1; ++i, side = getOther(side)) {
    SE3 X = stance.feet[static_cast<int>(side)];
    X.p += std::min(i, o.stairs) * up;
    plan.steps.push_back({side, X});
  }
  return plan;
}

Goal makeClimbGoal(const Model& model, const Stance& stance, double height, int nodes) {
  Goal goal{GoalKind::Displacement, "climb", height, calcTolerance(height, 0.01), 0, nodes};
  goal.direction = Vector3d::UnitZ();
  for (int contact : stance.contacts) goal.contacts.push_back(model.contacts()[contact].name);
  return goal;
}

}  // namespace

Ground makeStairsGround(const StairsOptions& o, const SE3& X_WP) {
  Ground ground;
  ground.height = X_WP.p.z() + std::min(0.0, o.stairs * o.height);
  for (int i = o.height < 0 ? 0 : 1; i <= o.stairs; ++i)
    ground.steps.push_back({X_WP.act(i * Vector3d(o.depth, 0, o.height)), o.depth, o.width, calcHeading(X_WP)});
  return ground;
}

MotionPlan planStairs(const Model& model, const StairsOptions& options, const StandingRobot& standing) {
  StairsOptions o = options;
  listOptions(o).check();
  const Stance stance = makeStance(model, o.gait, standing);
  requireLevel(model, listSoles(stance), "climb of stairs");
  o.depth = chooseTread(model, stance, "depth", o.depth);
  checkTreadWidth(model, stance, "width", o.width);
  checkDuration(o);
  if (o.slope != 0) o.height = o.slope * o.depth;
  o.gait.timing.single = o.depth / o.speed - o.gait.timing.both;
  LocomotionTask task;
  task.name = "stairs";
  task.plan = planFootholds(stance, o);
  task.ground = makeStairsGround(o, stance.middle);
  checkSoles(model, stance, {task.name, task.plan.steps, task.ground});
  task.direction = stance.middle.R * Vector3d::UnitX();
  task.speed = o.speed;
  MotionPlan plan = planLocomotion(model, stance, task, o.gait);
  plan.options = listOptions(o).listValues();
  const std::vector<Goal> speed = makeSpeedGoals(plan.schedule, o.speed, stance.middle.R.col(0));
  plan.goals.insert(plan.goals.begin(), speed.begin(), speed.end());
  plan.goals.insert(plan.goals.begin(), makeClimbGoal(model, stance, o.stairs * o.height, plan.schedule.numStages()));
  return plan;
}

Motion makeStairs(const Model& model, const StairsOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planStairs(model, options, makeStandingRobot(model)), problem);
}

}  // namespace bielle
