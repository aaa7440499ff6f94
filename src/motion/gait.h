#pragma once
/// \file From footholds and durations to the desired motion of body and feet at every node.
///
/// - The swing foot follows a path with zero velocity at both ends: horizontally a quintic, vertically up to an apex
///   over the higher end and down again; it turns about one axis, the vertical between level footholds.
/// - In double support the weight shifts linearly from foot to foot.
/// - The centre of mass is that of the linear inverted pendulum whose zero-moment point p follows the weight: with z
///   the height of the CoM over the feet, g gravity and h the time step,
///       c_k - z / (g h^2) (c_{k-1} - 2 c_k + c_{k+1}) = p_k,    c_0 and c_N given                                 (1)
///   a tridiagonal system for its only bounded solution (Kajita et al., "Biped walking pattern generation by using
///   preview control", ICRA 2003, where (1) is the table-cart model). At touchdown it is as high over the lower foot as
///   at the start, and rises or falls evenly in between.
#include "bielle/motion/locomotion.h"

namespace bielle {

/// Placement along a swing from a to b.
SE3 calcSwing(const SwingShape& shape, const SE3& a, const SE3& b, double s);

struct GaitPhase {
  int nodes = 0;
  int steps_done = 0;   ///< number of steps completed
  bool swings = false;  ///< the foot of step `steps_done` is in the air
};

struct GaitNode {
  Vector3d com = Vector3d::Zero(), com_velocity = Vector3d::Zero();  ///< m, m/s
  double heading = 0, heading_rate = 0;                              ///< since the start; rad, rad/s
  double load[2] = {0.5, 0.5};  ///< share of the weight on the left and on the right foot
  int phase = 0;
  double progress = 0;              ///< of the swing, in (0, 1)
  SE3 X_WF;                         ///< placement of the swing foot
  Vector6d V_F = Vector6d::Zero();  ///< its velocity and angular velocity, world axes
  bool lands = false;               ///< first node of a double support: the foot of the last step has just landed
};

struct Gait {
  std::vector<GaitPhase> phases;
  std::vector<GaitNode> nodes;  ///< N + 1
};

/// \param com  centre of mass at the start, m
/// \throws ModelError on impossible durations
Gait makeGait(const FootstepPlan& plan, const GaitTiming& timing, const SwingShape& shape, const Vector3d& com,
              double gravity);

// First nodes of the phases that begin with a landing, step by step.
std::vector<int> listLandings(const ContactSchedule& schedule);

}  // namespace bielle
