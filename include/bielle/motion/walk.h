#pragma once
/// \file Walking on level ground: forward, sideways, on the spot and along an arc.
///
/// All four take footholds from footsteps.h Eq. (1), start from the standing posture, and end standing at rest; periodic ones are a
/// cycle of two steps out of the middle of such a motion, a turn's by the angle of its steps.
#include "bielle/motion/locomotion.h"

namespace bielle {

struct WalkOptions {
  double speed = 0.5;     ///< forward, of the steady steps; negative: backward, m/s
  int steps = 6;          ///< the last one brings the feet together
  bool periodic = false;  ///< cycles of two of the steady steps alone
  int cycles = 1;         ///< their number
  LocomotionOptions gait;
};

struct SideWalkOptions {
  double speed = 0.2;     ///< to the left, of the steady steps; negative: to the right, m/s
  int steps = 6;          ///< every other one opens the stance, the next one closes it
  bool periodic = false;  ///< cycles of two of the steady steps alone
  int cycles = 1;         ///< their number
  LocomotionOptions gait;
};

struct TurnOptions {
  double angle = 1.57;    ///< to the left; negative: to the right, rad
  double radius = 0;      ///< of the arc that the middle of the feet follows; 0: on the spot, m
  int steps = 8;          ///< the last one brings the feet together
  bool periodic = false;  ///< cycles of two of the steady steps alone
  int cycles = 1;         ///< their number
  LocomotionOptions gait;
};

void describe(OptionFields& fields, WalkOptions& options);
void describe(OptionFields& fields, SideWalkOptions& options);
void describe(OptionFields& fields, TurnOptions& options);

/// From where the robot stands. \throws InputError when the request is impossible (see locomotion.h)
MotionPlan planWalk(const Model& model, const WalkOptions& options, const StandingRobot& standing);
MotionPlan planSideWalk(const Model& model, const SideWalkOptions& options, const StandingRobot& standing);
MotionPlan planTurn(const Model& model, const TurnOptions& options, const StandingRobot& standing);

/// The same, as problems from the robot's standing posture.
Motion makeWalk(const Model& model, const WalkOptions& options = {}, const ProblemOptions& problem = {});
Motion makeSideWalk(const Model& model, const SideWalkOptions& options = {}, const ProblemOptions& problem = {});
Motion makeTurn(const Model& model, const TurnOptions& options = {}, const ProblemOptions& problem = {});

}  // namespace bielle
