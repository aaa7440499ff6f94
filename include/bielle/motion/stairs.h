#pragma once
/// \file Stairs up and down, one foot per step.
///
/// Step i is a box whose top is i times the height over (or under) the ground that the robot starts from; its middle is
/// i times the depth ahead of the starting feet. Foot i lands on the middle of step i, the last foot joins it on the
/// top one. Going down, the robot starts from a step of the same depth.
#include "bielle/motion/locomotion.h"

namespace bielle {

struct StairsOptions {
  double height = 0.06;  ///< of a step; negative: down, m
  double depth = 0;      ///< of a step, m; 0: 0.2, or a quarter more than the soles
  double slope = 0;      ///< height over depth, replaces the height unless it is 0, 1
  int stairs = 4;        ///< number of steps of the stairs
  double speed = 0.3;    ///< forward speed of the CoM; with the depth it determines the duration of a step, m/s
  double width = 0.8;    ///< of the stairs, m
  LocomotionOptions gait = makeGaitDefaults();

  static LocomotionOptions makeGaitDefaults();
};

/// Without the duration of single support, which follows from depth and speed.
void describe(OptionFields& fields, StairsOptions& options);

/// The stairs in front of feet whose middle (calcMiddle) is initially X_WP. \pre the depth is given
Ground makeStairsGround(const StairsOptions& options, const SE3& X_WP);

/// From where the robot stands. \throws InputError when the request is impossible (see locomotion.h)
MotionPlan planStairs(const Model& model, const StairsOptions& options, const StandingRobot& standing);
Motion makeStairs(const Model& model, const StairsOptions& options = {}, const ProblemOptions& problem = {});

}  // namespace bielle
