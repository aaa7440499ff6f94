#pragma once
/// \file Worlds of Bielle's own dynamics. makeBielleWorld(): reduced coordinates, the contact law, fixed small steps.
///
/// A step of length h from middle to middle: at the configuration there, with M^, N and the loads of closed_tree.h Eq. (1),
/// and with the forces f_i of contacts and stops on the points and coordinates whose velocities are P_i w,
///
///     M^ dw = h (N^T (tau - b - M a_d) + sum_i P_i^T f_i(w + dw / 2)),   w <- w + dw,   drift by h                 (1)
///
/// The first drift and the last one of advance() are half as long: it is the leapfrog, of second order, with springs of the robot
/// taken at the middle, and those of contacts and stops as the mean over the step (contact_law.h Eq. (5)). These, and the forces of
/// dampers and sliders, depend on the mean velocity; (1) is solved by Newton steps,
///
///     (M^ + h/2 sum_i P_i^T D_i P_i) d = h (..) - M^ dw,   dw <- dw + s d,   D_i = -d f_i / d velocity             (2)
///
/// s = 1 or, where that does not lower the residual, a half of it and so on; so no damper limits h, nor do contacts and stops;
/// springs of the robot do, by h < 2 / frequency. D_i is not symmetric where a point slides, since the normal force sets its
/// friction. b is taken at a velocity foreseen with the last dw. Since forces act at the middle with the mean velocity, (1)
/// changes the kinetic energy by exactly the work that the books take.
///
/// In a fall, steps of this length may be too long: a loop does not close after a drift, (1) has no solution that Newton
/// steps find, or energy less work differs between the middles of two steps, by more than 3e-4 of the kinetic energy and
/// 1 mJ per kilogram. Then the last steps, up to 20, are taken again with half the length, at most ten times;
/// if that does not help, the world breaks off and tells the time and what was left.
///
/// makeManifoldWorld(): steps of controlled error: a Runge-Kutta method of order 8 on the manifold of
/// closed states.
///
/// For mechanisms in motion: loops are closed to rounding at every evaluation, redundant rows and postures where loops lose
/// rank at an instant need no care, and energy is as good as the tolerance. Contacts, stops, springs and friction
/// are the forces of the world with fixed steps, which is the faster one for robots on their feet: each
/// touchdown costs this one many short steps.
#include <memory>

#include "bielle/worlds/world.h"

namespace bielle::worlds {

/// Of the contact law (src/worlds/contact_law.h), scaled by the weight of the robot, so that one choice suits robots of all
/// sizes: soles of hard rubber. A sole that lands at v rebounds with e v, where by its Eq. (1) c v - ln(1 + c v) = -c e v - ln(1 - c e v):
/// e = 0.8 at 0.02 m/s, 0.4 at 0.1 m/s.
struct ContactOptions {
  double sinkage = 1e-4;       ///< of one sole under the robot's weight, m; gives k
  double damping = 20;         ///< c, s/m
  double shear_ratio = 1;      ///< k_t / k
  int grid = 5;                ///< points along each side of a sole on ground with steps, its corners among them
  double shear_damping = 0.3;  ///< c_t over that which damps the robot's mass on one sole's bristles critically
};

struct BielleWorldOptions {
  WorldOptions world;  ///< time_step 0: kBielleTimeStep
  ContactOptions contact;
};

inline constexpr double kBielleTimeStep = 2.5e-4;  ///< s

/// advance() does not allocate. Its steps are those of the options or a little shorter, to reach its end, or halves of them, as
/// above. If it breaks off, the state is that before the last steps, at time(). Both worlds refuse loops open by over 1e-6 m or rad.
/// \throws InputError when the robot has no closed standing posture
std::unique_ptr<World> makeBielleWorld(const Model& model, const BielleWorldOptions& options = {});

struct ManifoldWorldOptions {
  WorldOptions world;  ///< time_step: the longest step; 0: no limit
  ContactOptions contact;
  /// Error allowed per step, 1e-12 at least: of coordinates, in m or rad; of velocities, relative to 1 (m/s, rad/s) or to their
  /// size. Over a motion of many steps the errors add up to ten or a hundred times as much.
  double tolerance = 1e-9;
};

/// advance() fails where the mechanism cannot go on: message() names joint or closure and the time. The robot needs no
/// standing posture and no free joint.
/// \throws InputError when the robot has no closed configuration
std::unique_ptr<World> makeManifoldWorld(const Model& model, const ManifoldWorldOptions& options = {});

/// The world with steps of controlled error if a tolerance is given, else the one with fixed steps.
std::unique_ptr<World> makeOwnWorld(const Model& model, const WorldOptions& options);

}  // namespace bielle::worlds
