#pragma once
/// \file The jump of the paper (its section IV-B): stand, push, fly for a given time, land, settle.
///
/// In flight the centre of mass follows a ballistic parabola. The time T between take-off and touchdown at the same
/// height z1 determines speed and height (as in the paper)
///     v0 = g T / 2,    z(T / 2) = z1 + g T^2 / 8,    z1 = z0 + `stretch`,                                      (1)
/// with z0 the height at the start. While pushing, for D seconds, it follows the polynomial of fifth degree that leaves
/// z0 at rest and arrives at z1 with v0, both without acceleration: first down, then up; landing is its mirror image.
/// Feet on the ground carry the load
///     f = m (g + z''),    on average m g (1 + v0 / (g D)),                                                     (2)
/// and in flight they follow
///     z_f(t) = max(g T^2 / 8, `clearance`) p^2 (2 - p),    p = 4 t/T (1 - t/T),                                    (3)
/// at rest at both ends (forward: by a smooth step). The body rises by g T^2 / 8 p: legs stretch by 4/27 of the rise.
/// Costs of a stage, h the time step:
/// - state regularization about the posture at the start, at rest; motor torques;
/// - height of the CoM: at mid-flight (over h, as in the paper) and, with less weight, on the ground;
/// - feet on the ground: force by Eq. (2), shared evenly, centre of pressure;
/// - feet in flight: placement by Eq. (3);
/// - at the end: posture, and the centre of mass over the feet as at the start.
/// Path constraints:
/// - wrench cones of the soles on the ground;
/// - feet in flight: no corner below the ground, and 6 mm over it in the middle half of the flight;
/// - touchdown, at the first node of the landing: the feet are at their places, flat and at rest, so that the legs fold
///   as fast as the body falls;
/// - at the end the centre of mass is at rest and the torso does not turn.
#include "bielle/motion/motion.h"

namespace bielle {

struct JumpOptions : MotionOptions {
  JumpOptions() { state_weight = 0.02, torso_weight = 2000, control_weight = 3e-3, force_weight = 30; }

  double flight = 0.3;       ///< time in the air, s; rounded to an even number of time steps
  double length = 0;         ///< distance ahead at which the feet land, m
  double stand = 0.15;       ///< before the push, s
  double push = 0.3;         ///< D, s
  double land = 0.3;         ///< s
  double settle = 0.4;       ///< until the end, s
  double stretch = 0.02;     ///< height of the CoM at take-off and touchdown above that at the start, m
  double clearance = 0.04;   ///< least height of the soles at mid-flight, m
  double time_step = 0.002;  ///< s

  double apex_weight = 1e4;            ///< of the CoM's height at mid-flight, over h, 1/m^2
  double com_weight = 1e3;             ///< of the CoM's height on the ground, 1/m^2
  double swing_weight = 1e5;           ///< of the feet's path in flight, 1/m^2
  double swing_rotation_weight = 1e2;  ///< of their orientation, 1
  double terminal_weight = 1e3;        ///< of the place of the CoM at the end, 1/m^2
};

void describe(OptionFields& fields, JumpOptions& options);

/// Figures of a jump by Eq. (1), with durations rounded to the time step.
struct JumpFigures {
  double stand = 0, push = 0, flight = 0, land = 0;  ///< s
  double take_off = 0;                               ///< v0, m/s
  double rise = 0;                                   ///< of the centre of mass from take-off to mid-flight, m
};
JumpFigures calcJumpFigures(const JumpOptions& options, double gravity);

/// Height of the CoM over its height at the start (m) and its acceleration (m/s^2), t seconds after the start.
struct JumpHeight {
  double height = 0, acceleration = 0;
};
JumpHeight calcJumpHeight(const JumpOptions& options, double gravity, double t);

/// A jump off all contacts of the robot at once, from where it stands.
/// \throws InputError when the request is impossible (durations, lengths, no contact)
MotionPlan planJump(const Model& model, const JumpOptions& options, const StandingRobot& standing);
Motion makeJump(const Model& model, const JumpOptions& options = {}, const ProblemOptions& problem = {});

}  // namespace bielle
