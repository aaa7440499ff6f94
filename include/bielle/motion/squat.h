#pragma once
/// \file The squat of the paper (its section IV-B): the height of the centre of mass follows a sine down and back, with
/// flat feet. Soles stay inside their wrench cones, and the robot ends at rest, by constraints.
#include "bielle/motion/motion.h"

namespace bielle {

struct SquatOptions : MotionOptions {
  double depth = 0.7;       ///< lowest height of the CoM over its initial height, 1
  double duration = 2.4;    ///< down and back, s
  double settle = 0.3;      ///< at rest before and after, s
  double time_step = 0;     ///< s; 0: 15 ms, less where springs swing faster
  double com_weight = 1e5;  ///< of the CoM's height, 1/m^2
  double closure_kp = 0;    ///< stabilisation of the closures, 1/s^2
  double closure_kd = 0;    ///< 1/s
};

void describe(OptionFields& fields, SquatOptions& options);

/// A squat on all contacts of the robot, from where it stands.
/// \throws InputError when the request is impossible (depth, durations, no contact)
MotionPlan planSquat(const Model& model, const SquatOptions& options, const StandingRobot& standing);
Motion makeSquat(const Model& model, const SquatOptions& options = {}, const ProblemOptions& problem = {});

/// Height of the CoM at time t over its initial height: 1 at rest, `depth` at mid-motion.
double calcSquatHeight(const SquatOptions& options, double t);

}  // namespace bielle
