#pragma once
/// \file Steps on footholds from a file, at any height and inclination.
///
/// The file is YAML, one entry per step:
///
///     footholds:
///       - {foot: right, x: 0.20, y: -0.1, z: 0.03, yaw: 0.1}
///       - {foot: left, x: 0.35, y: 0.1, z: 0.05, pitch: -0.1, roll: 0.05}
///
/// with the place of the contact frame relative to the middle of the feet at the start (calcMiddle), x ahead, y to the
/// left, z up, m; and its rotation Rz(yaw) Ry(pitch) Rx(roll) relative to the axes there, rad. x and y have no defaults,
/// the others are 0. Feet alternate. Under every foothold is a stone: a box that exceeds the sole by `rim`.
/// After the last foothold, which must be level, the other foot steps beside it, unless it is there.
#include "bielle/motion/locomotion.h"

namespace bielle {

struct FootholdsOptions {
  /// The list of such a file in one line, at least one entry. It is text so that a result holds it among its other options, and
  /// needs no file besides.
  std::string footholds;
  double rim = 0.02;  ///< of the stones around the soles, m
  LocomotionOptions gait = makeGaitDefaults();

  static LocomotionOptions makeGaitDefaults();
};

void describe(OptionFields& fields, FootholdsOptions& options);

/// The list in a file, for FootholdsOptions: with the numbers as they are written there.
/// \throws InputError naming file, entry and line
std::string readFootholds(const std::string& path);

/// From where the robot stands. \throws InputError naming the step that is impossible: a sole on the edge of another
/// stone or in it, a swing that would touch the ground, and see locomotion.h
MotionPlan planFootholds(const Model& model, const FootholdsOptions& options, const StandingRobot& standing);
Motion makeFootholds(const Model& model, const FootholdsOptions& options, const ProblemOptions& problem = {});

}  // namespace bielle
