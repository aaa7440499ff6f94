#include "motion/course.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/model/error.h"
#include "math/so3.h"
#include "model/number_text.h"
#include "motion/gait.h"

namespace bielle {
namespace {

constexpr double kLevel = 1e-6;       // m
constexpr double kClearance = 5e-3;   // of a swinging sole in the middle half of its path, m: that of the check
constexpr double kPointEvery = 5e-3;  // m, on a sole

// Heights over the ground of points all over a sole, edges included, m.
struct SoleHeights {
  double least = std::numeric_limits<double>::infinity(), most = -least;
};
SoleHeights calcSoleHeights(const Ground& ground, const ContactFrame& sole, const SE3& X_WF) {
  const int nx = std::max(1, static_cast<int>(std::ceil(2 * sole.half_length / kPointEvery))),
            ny = std::max(1, static_cast<int>(std::ceil(2 * sole.half_width / kPointEvery)));
  SoleHeights heights;
  for (int i = 0; i <= nx; ++i)
    for (int j = 0; j <= ny; ++j) {
      const Vector3d p =
          X_WF.act(Vector3d((2.0 * i / nx - 1) * sole.half_length, (2.0 * j / ny - 1) * sole.half_width, 0));
      const double height = p.z() - ground.calcHeight(p.x(), p.y());
      heights.least = std::min(heights.least, height);
      heights.most = std::max(heights.most, height);
    }
  return heights;
}

[[noreturn]] void refuse(const Model& model, const Course& course, int step, const std::string& problem,
                         const std::string& remedy) {
  throw InputError(model.name(),
                   "step " + std::to_string(step + 1) + " of the " + course.name + " (" +
                       getName(course.steps[static_cast<size_t>(step)].side) + ")",
                   problem, remedy);
}

const ContactFrame& getSole(const Model& model, const Stance& stance, Side side) {
  return model.contacts()[stance.contacts[static_cast<int>(side)]];
}

// By how much a sole and a box overlap as seen from above, m.
double calcOverlap(const ContactFrame& sole, const SE3& X_WF, const GroundStep& step) {
  ContactFrame top;
  top.half_length = step.length / 2;
  top.half_width = step.width / 2;
  return -calcSoleDistance(sole, X_WF, top, {makeAxisRotation(Vector3d::UnitZ(), step.yaw), step.top});
}

// The step that goes to a stone or box.
int findStepOn(const Course& course, const GroundStep& stone) {
  const auto getDistance = [&stone](const Footstep& taken) { return (taken.X_WF.p - stone.top).head<2>().norm(); };
  const auto nearest = std::min_element(course.steps.begin(), course.steps.end(),
                                        [&](const auto& a, const auto& b) { return getDistance(a) < getDistance(b); });
  return static_cast<int>(nearest - course.steps.begin());
}

// The ground that is only a stone or box.
Ground leaveAlone(const GroundStep& stone) {
  Ground alone;
  alone.height = -std::numeric_limits<double>::infinity();
  alone.steps = {stone};
  return alone;
}

// The steps of a course may be so near that their ground lies under a foot before it has moved.
void checkStart(const Model& model, const Stance& stance, const Course& course, Side side) {
  constexpr double kRoom = 1e-3;  // beside the sole, m
  const SE3& X_WF = stance.feet[static_cast<int>(side)];
  const ContactFrame& sole = getSole(model, stance, side);
  for (const GroundStep& step : course.ground.steps) {
    if (!(calcSoleHeights(leaveAlone(step), sole, X_WF).least < -kLevel)) continue;
    const std::string where = std::string("lies under the ") + getName(side) + " where it stands at the start";
    const std::string overlap = formatNumber(calcOverlap(sole, X_WF, step) + kRoom, "%.3f") + " m";
    refuse(model, course, findStepOn(course, step), "its stone or box " + where,
           "move it " + overlap + " away from there, or let it end that much earlier");
  }
  if (calcSoleHeights(course.ground, sole, X_WF).most > kLevel)
    throw InputError(model.name(), course.name,
                     std::string("part of the ") + getName(side) + " has no ground below it at the start",
                     "start with both feet beside each other, or give more ground");
}

}  // namespace

double chooseTread(const Model& model, const Stance& stance, const std::string& option, double requested) {
  constexpr double kUsual = 0.2, kShare = 1.25;  // m; of the sole's length
  constexpr double kSpare = 1e-3;  // before and behind it, m: what a foot in a passed check may slip, and more
  double length = 0;
  for (int contact : stance.contacts) length = std::max(length, 2 * model.contacts()[contact].half_length);
  if (requested == 0) return std::max(kUsual, kShare * length);
  const double least = length + 2 * kSpare;
  requireOption(requested >= least - kLevel, option,
                formatNumber(requested) + " m is too short for soles of " + formatNumber(length) +
                    " m, which lie on it with all of their length",
                "give " + formatNumber(least) + " [m] at least, better " +
                    formatNumber(std::max(kUsual, kShare * length)) + ", as 0 does");
  return requested;
}

void checkTreadWidth(const Model& model, const Stance& stance, const std::string& option, double width) {
  const double least =
      (stance.feet[0].p - stance.feet[1].p).norm() +
      2 * std::max(getSole(model, stance, Side::Left).half_width, getSole(model, stance, Side::Right).half_width);
  requireOption(width > least, option,
                formatNumber(width) + " m is too narrow for both feet, which need " + formatNumber(least) + " m",
                "give " + formatNumber(1.1 * least, "%.2g") + " or more [m]");
}

void checkSoles(const Model& model, const Stance& stance, const Course& course) {
  for (Side side : {Side::Left, Side::Right}) checkStart(model, stance, course, side);
  for (size_t i = 0; i < course.steps.size(); ++i) {
    const Footstep& step = course.steps[i];
    const SoleHeights heights = calcSoleHeights(course.ground, getSole(model, stance, step.side), step.X_WF);
    if (heights.most > kLevel)
      refuse(model, course, static_cast<int>(i),
             "part of its sole would have no ground below it, down to " + formatNumber(heights.most) + " m",
             "move the foothold");
    if (!(heights.least < -kLevel)) continue;
    std::string where = "the ground";
    for (const GroundStep& stone : course.ground.steps) {
      const size_t other = static_cast<size_t>(findStepOn(course, stone));
      const bool is_its_own = (course.steps[other].X_WF.p - stone.top).norm() < kLevel;
      if (other != i && is_its_own &&
          calcSoleHeights(leaveAlone(stone), getSole(model, stance, step.side), step.X_WF).least < -kLevel)
        where = "the stone of step " + std::to_string(other + 1);
    }
    refuse(model, course, static_cast<int>(i),
           "part of its sole would be in " + where + ", by " + formatNumber(-heights.least) + " m",
           "move the foothold");
  }
}

void checkSwings(const Model& model, const Stance& stance, const Course& course, const SwingShape& shape) {
  constexpr int kSamples = 40;  // of a swing
  const FootstepPlan plan{stance.feet, course.steps};
  for (size_t i = 0; i < course.steps.size(); ++i) {
    const Footstep& step = course.steps[i];
    const SE3 before = plan.getStance(static_cast<int>(i))[static_cast<int>(step.side)];
    for (int k = kSamples / 4; k <= 3 * kSamples / 4; ++k)
      if (calcSoleHeights(course.ground, getSole(model, stance, step.side),
                          calcSwing(shape, before, step.X_WF, static_cast<double>(k) / kSamples))
              .least < kClearance)
        refuse(model, course, static_cast<int>(i), "the swing foot would touch the ground on its way",
               "raise swing_height, or move horizontally later (swing_leave) or earlier (swing_arrive)");
  }
}

MotionPlan planCourse(const Model& model, const Stance& stance, const Course& course, const LocomotionOptions& gait) {
  checkSoles(model, stance, course);
  LocomotionTask task;
  task.name = course.name;
  task.plan = {stance.feet, course.steps};
  task.ground = course.ground;
  MotionPlan plan = planLocomotion(model, stance, task, gait);
  checkSwings(model, stance, course, gait.swing);
  return plan;
}

Goal makeCourseGoal(const Model& model, const Stance& stance, const std::string& name, double requested,
                    const Vector3d& direction, int last) {
  Goal goal{GoalKind::Displacement, name, requested, calcTolerance(requested, 0.01), 0, last};
  goal.direction = direction;
  for (int contact : stance.contacts) goal.contacts.push_back(model.contacts()[contact].name);
  return goal;
}

}  // namespace bielle
