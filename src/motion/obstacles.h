#pragma once
/// \file A box to step onto and a gap to step over, from standing to standing.
///
/// Both feet take one step of equal length to the other side of the obstacle's edge, the right foot first.
#include "bielle/motion/locomotion.h"

namespace bielle {

/// The feet stand on the middle of the box, half its length behind its front.
struct BoxOptions {
  double height = 0.1;     ///< of the box, m
  double length = 0;       ///< of its top, m; 0: 0.2, or a quarter more than the soles
  double width = 0.8;      ///< m
  double distance = 0.05;  ///< from the soles at the start to the front of the box, m
  bool down = false;       ///< step down again on the other side, as far from its back
  LocomotionOptions gait = makeGaitDefaults();

  static LocomotionOptions makeGaitDefaults();
};

/// The ground is missing between two banks of the same height.
struct GapOptions {
  double width = 0.15;     ///< of the gap in the direction of travel, m
  double distance = 0.02;  ///< of the soles from its edges, before and behind, m
  double depth = 0.3;      ///< of the ground in the gap under the banks, m
  LocomotionOptions gait;
};

void describe(OptionFields& fields, BoxOptions& options);
void describe(OptionFields& fields, GapOptions& options);

/// From where the robot stands. \throws InputError when the request is impossible: sizes, a swing that would touch the
/// box, and see locomotion.h
MotionPlan planBox(const Model& model, const BoxOptions& options, const StandingRobot& standing);
MotionPlan planGap(const Model& model, const GapOptions& options, const StandingRobot& standing);

Motion makeBox(const Model& model, const BoxOptions& options = {}, const ProblemOptions& problem = {});
Motion makeGap(const Model& model, const GapOptions& options = {}, const ProblemOptions& problem = {});

}  // namespace bielle
