#pragma once
/// \file The size of a robot, by which what is tuned for one robot suits others.
///
/// Take two robots of one shape, the second with L times the lengths, M times the mass and G times the gravity of the first. They
/// move alike when times scale by T = sqrt(L / G) and torques by M G L: Froude's similarity (Alexander, Jayes, "A dynamic
/// similarity hypothesis for the gaits of quadrupedal mammals", Journal of Zoology 201, 1983). Weights of costs, and other
/// constants that have units, are given for the reference robot; for another robot they are scaled such that the similar
/// motion has the same cost.
#include "bielle/motion/locomotion.h"

namespace bielle {

/// L, T and M G L relative to the reference robot.
struct RobotSize {
  double length = 1, time = 1, torque = 1;
  /// Of the base where it stands: R A is upright, by right angles and the smallest rotation beside them.
  Matrix3d upright = Matrix3d::Identity();

  double velocity() const { return length / time; }
  double force() const { return torque / length; }
};

/// The reference robot is Bipetto as it stands: height of its centre of mass over the soles, m; mass, kg; gravity, m/s^2.
inline constexpr double kReferenceHeight = 0.432282447583715, kReferenceMass = 25.6760512, kReferenceGravity = 9.81;

/// From the height of the centre of mass over the contacts, the mass and the gravity. It is that of the reference robot where one of
/// them is missing, for legs on a rail, whose motors do not carry a whole robot, and for robots with springs; but for `upright`.
RobotSize calcRobotSize(const Model& model, const StandingRobot& standing);
RobotSize calcRobotSize(const Model& model, const Stance& stance);

/// Springs have a time scale of their own: a robot that has them does not scale by Froude's similarity.
bool hasSprings(const Model& model);

/// Scales the weights of costs that are integrated over time. A cost at a single instant takes such a weight times RobotSize::time.
void scaleWeights(const RobotSize& size, MotionOptions& options);
void scaleWeights(const RobotSize& size, LocomotionOptions& options);

/// Weights of the squares of motor torques, nu; the force of a linear motor counts as its torque about an arm of kScrewArm.
VectorXd makeControlWeights(const Model& model, const RobotSize& size = {});

/// Scales the weights of a state cost, of the tangents of q and v, 2 nv. Those of a free base are given for one that stands with x
/// ahead and z up, and go to calcWeightAxes().
void scaleStateWeights(const Model& model, const RobotSize& size, VectorXd& weights);

/// StateCost::axes of these weights: those of the base that are nearest to x ahead and z up, made upright. The identity for a base that
/// is so but for right angles.
Matrix3d calcWeightAxes(const RobotSize& size);

}  // namespace bielle
