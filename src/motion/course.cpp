#include "motion/course.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/model/error.h"
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

void check(const Model& model, const Stance& stance, const Course& course, const SwingShape& shape) {
  constexpr int kSamples = 40;  // of a swing
  FootstepPlan plan{stance.feet, course.steps};
  for (size_t i = 0; i < course.steps.size(); ++i) {
    const Footstep& step = course.steps[i];
    const ContactFrame& sole = model.contacts()[stance.contacts[static_cast<int>(step.side)]];
    const auto refuse = [&](const std::string& problem, const std::string& remedy) {
      throw InputError(model.name(),
                       "step " + std::to_string(i + 1) + " of the " + course.name + " (" + getName(step.side) + ")",
                       problem, remedy);
    };
    const SoleHeights standing = calcSoleHeights(course.ground, sole, step.X_WF);
    if (standing.most > kLevel) refuse("part of its sole would have no ground below it", "move the foothold");
    if (standing.least < -kLevel) refuse("part of its sole would be in the ground", "move the foothold");
    const SE3 before = plan.getStance(static_cast<int>(i))[static_cast<int>(step.side)];
    for (int k = kSamples / 4; k <= 3 * kSamples / 4; ++k)
      if (calcSoleHeights(course.ground, sole, calcSwing(shape, before, step.X_WF, static_cast<double>(k) / kSamples))
              .least < kClearance)
        refuse("the swing foot would touch the ground on its way",
               "raise swing_height, or move horizontally later (swing_leave) or earlier (swing_arrive)");
  }
}

}  // namespace

GroundStep makeStone(const ContactFrame& sole, const SE3& X_WF, double rim) {
  const double yaw = calcHeading(X_WF), pitch = std::asin(std::clamp(-X_WF.R(2, 0), -1.0, 1.0)),
               roll = std::atan2(X_WF.R(2, 1), X_WF.R(2, 2));
  return {X_WF.p, 2 * (sole.half_length + rim), 2 * (sole.half_width + rim), yaw, pitch, roll};
}

MotionPlan planCourse(const Model& model, const Stance& stance, const Course& course, const LocomotionOptions& gait) {
  check(model, stance, course, gait.swing);
  LocomotionTask task;
  task.name = course.name;
  task.plan = {stance.feet, course.steps};
  task.ground = course.ground;
  return planLocomotion(model, stance, task, gait);
}

Goal makeCourseGoal(const Model& model, const Stance& stance, const std::string& name, double requested,
                    const Vector3d& direction, int last) {
  Goal goal{GoalKind::Displacement, name, requested, calcTolerance(requested, 0.01), 0, last};
  goal.direction = direction;
  for (int contact : stance.contacts) goal.contacts.push_back(model.contacts()[contact].name);
  return goal;
}

}  // namespace bielle
