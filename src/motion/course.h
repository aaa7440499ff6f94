#pragma once
// Steps on given footholds over uneven ground.
#include "bielle/motion/locomotion.h"

namespace bielle {

struct Course {
  std::string name;
  std::vector<Footstep> steps;
  Ground ground;
};

// A box under a sole, which it exceeds by `rim` on all sides, with the sole's inclination.
GroundStep makeStone(const ContactFrame& sole, const SE3& X_WF, double rim);

// Steps of a locomotion on the footholds of the course; the last one brings the feet together.
// \throws InputError naming the first step whose sole does not lie on the ground or whose swing leads through it, besides
// the errors of planLocomotion()
MotionPlan planCourse(const Model& model, const Stance& stance, const Course& course, const LocomotionOptions& gait);

// Displacement of the middle of the feet between two nodes along a unit vector.
Goal makeCourseGoal(const Model& model, const Stance& stance, const std::string& name, double requested,
                    const Vector3d& direction, int last);

}  // namespace bielle
