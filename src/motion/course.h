#pragma once
// Steps on given footholds over uneven ground.
#include "bielle/motion/locomotion.h"

namespace bielle {

struct Course {
  std::string name;
  std::vector<Footstep> steps;
  Ground ground;
};

// Length of ground that bears both soles in the direction of travel, of the option `option`: as requested, or, where that is 0,
// 0.2 m, or a quarter more than the sole is long. \throws InputError where it is shorter than the sole and a margin
double chooseTread(const Model& model, const Stance& stance, const std::string& option, double requested);
// Its width, which must be enough for both feet. \throws InputError naming `option`
void checkTreadWidth(const Model& model, const Stance& stance, const std::string& option, double width);

// Whether all soles lie on the ground, edges included: at the start, and on the footholds of all steps.
// \throws InputError naming the step whose sole does not, or whose ground lies under a foot at the start
void checkSoles(const Model& model, const Stance& stance, const Course& course);

// That no swing leads through ground, in the middle half of its way. \throws InputError naming the step
void checkSwings(const Model& model, const Stance& stance, const Course& course, const SwingShape& shape);

// Steps of a locomotion on the footholds of the course; the last one brings the feet together.
// \throws InputError naming the first step whose sole does not lie on the ground or whose swing leads through it, besides
// the errors of planLocomotion()
MotionPlan planCourse(const Model& model, const Stance& stance, const Course& course, const LocomotionOptions& gait);

// Displacement of the middle of the feet between two nodes along a unit vector.
Goal makeCourseGoal(const Model& model, const Stance& stance, const std::string& name, double requested,
                    const Vector3d& direction, int last);

}  // namespace bielle
