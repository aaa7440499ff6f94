#pragma once
/// \file Sequences of footholds, and their geometric properties.
///
/// A walk is commanded by the displacement per step of the middle frame P of the two feet, in its own axes,
///     P_i = P_{i-1} D_i,    D_i = Rz(yaw / 2) (forward, lateral) Rz(yaw / 2)                                    (1)
/// and the foot of step i lands in the same place relative to P_i as in the starting posture. Every other step makes
/// the lateral displacement of two: the foot on that side opens the stance by twice the amount, and the other foot
/// closes it. The last step brings the feet together.
#include <array>
#include <string>
#include <vector>

#include "bielle/dynamics/ground.h"
#include "bielle/model/model.h"
#include "bielle/ocp/contact_schedule.h"

namespace bielle {

enum class Side { Left = 0, Right = 1 };
inline Side getOther(Side side) { return side == Side::Left ? Side::Right : Side::Left; }
inline const char* getName(Side side) { return side == Side::Left ? "left foot" : "right foot"; }

struct Footstep {
  Side side = Side::Left;
  SE3 X_WF;  ///< placement of the contact frame on the ground
};

/// The initial placements of the two feet and the steps they take in turn.
struct FootstepPlan {
  std::array<SE3, 2> start;  ///< left, right
  std::vector<Footstep> steps;

  /// Placements of both feet (left, right) after `count` steps.
  std::array<SE3, 2> getStance(int count) const;
};

/// Displacement of P in its own axes.
struct StepCommand {
  double forward = 0, lateral = 0;  ///< m, to the left
  double yaw = 0;                   ///< rad, to the left
};

/// Heading of a placement: direction of its x axis seen from above, rad.
double calcHeading(const SE3& X);

/// Pose of the middle of the two feet: level, heading halfway between theirs.
SE3 calcMiddle(const SE3& left, const SE3& right);

/// P after a step of the given foot from P, Eq. (1).
SE3 calcNextMiddle(const SE3& P, const StepCommand& command, Side side);

/// `steps` steps by Eq. (1) on level ground, the first one with the foot `first`; the last one brings the feet
/// together.
FootstepPlan planFootsteps(const SE3& left, const SE3& right, const StepCommand& command, int steps, Side first);

/// Distance between two soles as rectangles seen from above, m; negative if they overlap (a lower bound of the depth).
double calcSoleDistance(const ContactFrame& a, const SE3& X_Wa, const ContactFrame& b, const SE3& X_Wb);

}  // namespace bielle
