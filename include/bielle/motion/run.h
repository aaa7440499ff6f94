#pragma once
/// \file Running and hopping on one foot, on level ground, from standing to standing.
///
/// Both are steps with flights between single supports (locomotion.h). In flight the centre of mass follows a
/// ballistic parabola, so that the vertical velocity at take-off is g T / 2 with T the time in the air, and the load
/// on the foot is on average 1 + T / D times the weight, with D the time on the ground.
///
/// In a run of n steps of the length L = speed (stance + flight), step i lands (i - 1/2) L ahead of where its foot
/// stood at the start, and each of the last two (n - 2) L ahead, where the feet come together: the first step and the
/// last but one are half as long as the others. The first single support pushes off; the last one, before a step
/// without flight, brakes the body. The speed is a goal of runs of eight or more steps; shorter ones do not reach it.
///
/// In a hop the robot lifts one foot, takes off from the other one and lands on it again, as often as requested; then the
/// foot in the air lands beside it.
#include "bielle/motion/locomotion.h"

namespace bielle {

struct RunOptions {
  double speed = 1;       ///< forward, of the steady steps; negative: backward, m/s
  int steps = 8;          ///< the last one brings the feet together
  double flight = 0.08;   ///< time in the air of every step but the last, rounded to time steps, s
  double stance = 0.24;   ///< time on the ground of each foot, s
  bool periodic = false;  ///< cycles of two of the steady steps alone
  int cycles = 1;         ///< their number
  LocomotionOptions gait = makeGaitDefaults();

  static LocomotionOptions makeGaitDefaults();
};

struct HopOptions {
  Side foot = Side::Left;  ///< to hop on
  int hops = 1;            ///< number of flights
  double flight = 0.15;    ///< time in the air of each, rounded to time steps, s
  double length = 0;       ///< of each hop, forward, m
  double stance = 0.3;     ///< time on one foot before, between and after flights, s
  LocomotionOptions gait = makeGaitDefaults();

  static LocomotionOptions makeGaitDefaults();
};

void describe(OptionFields& fields, RunOptions& options);
void describe(OptionFields& fields, HopOptions& options);

/// From where the robot stands. \throws InputError when the request is impossible (see locomotion.h)
MotionPlan planRun(const Model& model, const RunOptions& options, const StandingRobot& standing);
MotionPlan planHop(const Model& model, const HopOptions& options, const StandingRobot& standing);

/// The same, as problems from the robot's standing posture.
Motion makeRun(const Model& model, const RunOptions& options = {}, const ProblemOptions& problem = {});
Motion makeHop(const Model& model, const HopOptions& options = {}, const ProblemOptions& problem = {});

}  // namespace bielle
