#pragma once
/// \file The size of a robot, by which what is tuned for one robot suits others.
///
/// Of two robots of one shape, one's lengths may be L times the other's, its mass M times, its gravity G times. They move alike
/// if times are as T = sqrt(L / G), and torques then are as M G L: Froude's similarity (Alexander, Jayes, "A dynamic
/// similarity hypothesis for the gaits of quadrupedal mammals", Journal of Zoology 201, 1983). The weights of costs, and
/// whatever else has a unit, are those for the reference robot; of another robot they are such that each cost of the motion
/// that is alike is the same.
#include "bielle/motion/locomotion.h"

namespace bielle {

/// L, T and the unit of torques, over those of the reference robot: 1 for itself.
struct RobotSize {
  double length = 1, time = 1, torque = 1;

  double velocity() const { return length / time; }
  double force() const { return torque / length; }
};

/// Of the reference robot, Bipetto as it stands: height of the centre of mass over the soles, m; mass, kg; gravity, m/s^2.
inline constexpr double kReferenceHeight = 0.432282447583715, kReferenceMass = 25.6760512, kReferenceGravity = 9.81;

/// By the height of the centre of mass over the contacts, mass and gravity; that of the reference robot where one of them is
/// missing, of legs on a rail, whose motors do not hold a whole robot, and of robots with springs.
RobotSize calcRobotSize(const Model& model, const StandingRobot& standing);
RobotSize calcRobotSize(const Model& model, const Stance& stance);

/// Springs have a time of their own, by which no other robot is similar.
bool hasSprings(const Model& model);

/// Weights of integrals over time, which a sum of their values at single instants needs times RobotSize::time.
void scaleWeights(const RobotSize& size, MotionOptions& options);
void scaleWeights(const RobotSize& size, LocomotionOptions& options);

/// Of the squares of torques and forces, nu: a force counts by the torque about an arm of kScrewArm.
VectorXd makeControlWeights(const Model& model, const RobotSize& size = {});

/// Weights of the tangents of q and v, 2 nv.
void scaleStateWeights(const Model& model, const RobotSize& size, VectorXd& weights);

}  // namespace bielle
