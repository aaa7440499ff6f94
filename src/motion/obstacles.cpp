#include "motion/obstacles.h"

#include <algorithm>

#include "bielle/motion/stairs.h"
#include "motion/course.h"
#include "motion/gait.h"

namespace bielle {
namespace {

constexpr double kBank = 1.2, kBankWidth = 2;  // m

double calcHalfLength(const Model& model, const Stance& stance) {
  return std::max(model.contacts()[stance.contacts[0]].half_length, model.contacts()[stance.contacts[1]].half_length);
}

// Both feet, moved by each displacement in turn; displacements are from the start, in the axes of its middle frame.
std::vector<Footstep> moveTogether(const Stance& stance, const std::vector<Vector3d>& displacements) {
  const Matrix3d R = stance.middle.R;
  std::vector<Footstep> steps;
  for (const Vector3d& displacement : displacements)
    for (Side side : {Side::Right, Side::Left}) {
      SE3 X = stance.feet[static_cast<int>(side)];
      X.p += R * displacement;
      steps.push_back({side, X});
    }
  return steps;
}

void checkGap(const GapOptions& o) {
  listOptions(o).check();
  requireOption(o.width < kBank, "width", "it is 1.2 m or more", "give metres, e.g. 0.15");
}

}  // namespace

MotionPlan planBox(const Model& model, const BoxOptions& options, const StandingRobot& standing) {
  BoxOptions o = options;
  listOptions(o).check();
  const Stance stance = makeStance(model, o.gait, standing);
  requireLevel(model, listSoles(stance), "step onto a box");
  o.length = chooseTread(model, stance, "length", o.length);
  checkTreadWidth(model, stance, "width", o.width);
  const double stride = calcHalfLength(model, stance) + o.distance + o.length / 2;
  const Vector3d top(stride, 0, o.height), behind(2 * stride, 0, 0);
  Course course{"box", moveTogether(stance, {top}), {}};
  if (o.down) course.steps = moveTogether(stance, {top, behind});
  course.ground.height = stance.middle.p.z();
  course.ground.steps = {{stance.middle.act(top), o.length, o.width, calcHeading(stance.middle)}};
  MotionPlan plan = planCourse(model, stance, course, o.gait);
  plan.options = listOptions(o).listValues();
  const Goal height =
      makeCourseGoal(model, stance, "height", o.height, Vector3d::UnitZ(), listLandings(plan.schedule)[1]);
  plan.goals.insert(plan.goals.begin(), height);
  return plan;
}

MotionPlan planGap(const Model& model, const GapOptions& o, const StandingRobot& standing) {
  const Stance stance = makeStance(model, o.gait, standing);
  requireLevel(model, listSoles(stance), "step over a gap");
  checkGap(o);
  const double half = calcHalfLength(model, stance), edge = half + o.distance, stride = o.width + 2 * edge;
  Course course{"gap", moveTogether(stance, {Vector3d(stride, 0, 0)}), {}};
  course.ground.height = stance.middle.p.z() - o.depth;
  for (double middle : {edge - kBank / 2, edge + o.width + kBank / 2})
    course.ground.steps.push_back(
        {stance.middle.act(Vector3d(middle, 0, 0)), kBank, kBankWidth, calcHeading(stance.middle)});
  MotionPlan plan = planCourse(model, stance, course, o.gait);
  plan.options = listOptions(o).listValues();
  const Goal across =
      makeCourseGoal(model, stance, "across", stride, stance.middle.R.col(0), plan.schedule.numStages());
  plan.goals.insert(plan.goals.begin(), across);
  return plan;
}

Motion makeBox(const Model& model, const BoxOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planBox(model, options, makeStandingRobot(model)), problem);
}

Motion makeGap(const Model& model, const GapOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planGap(model, options, makeStandingRobot(model)), problem);
}

}  // namespace bielle
