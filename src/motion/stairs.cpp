#include "bielle/motion/stairs.h"

#include <algorithm>

#include "model/number_text.h"

namespace bielle {
namespace {

void check(const Model& model, const Stance& stance, const StairsOptions& o) {
  const ContactFrame& foot = model.contacts()[stance.contacts[0]];
  listOptions(o).check();
  requireOption(o.depth > 2 * foot.half_length, "depth", "it is shorter than the sole", "give metres, e.g. 0.2");
  requireOption(o.width > (stance.feet[0].p - stance.feet[1].p).norm() + 2 * foot.half_width, "width",
                "the stairs are too narrow for the feet", "give metres, e.g. 0.8");
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
  if (o.slope != 0) o.height = o.slope * o.depth;
  const Stance stance = makeStance(model, o.gait, standing);
  check(model, stance, o);
  o.gait.timing.single = o.depth / o.speed - o.gait.timing.both;
  LocomotionTask task;
  task.name = "stairs";
  task.plan = planFootholds(stance, o);
  task.ground = makeStairsGround(o, stance.middle);
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
