#pragma once
/// \file The world of MuJoCo: all joints of the tree, with closures, contacts and stops as its soft constraints.
///
/// MuJoCo (here 2.2.2) finds the acceleration by a convex problem over all constraints at once and takes semi-implicit
/// Euler steps, or those of Runge and Kutta; friction cones are elliptic. Its constraints are springs and dampers of a time
/// constant T, at least two steps. A closure opens by T^2 times the acceleration that its force does not cancel: dJ/dt v,
/// which version 2.2.2 leaves out, and a share 1 - impedance of the rest. Soles creep by the same share.
///
/// The friction of a joint is that of the model, not MuJoCo's, which sticks: with the speed v before a step it is the damper
///     friction / sqrt(v^2 + friction_speed^2),                                                                      (2)
/// which Euler's steps take at their end, so that none is too stiff. Springs between points may have any preload here, those
/// without a stiffness, too, which a file cannot say (formats/mjcf.h).
///
/// The ground consists of its plane and boxes; those with inclined tops have sides normal to the top.
#include <memory>

#include "bielle/worlds/world.h"
#include "formats/mjcf.h"

namespace bielle::worlds {

struct MujocoWorldOptions {
  WorldOptions world;  ///< time_step 0: that of MjcfOptions
  MjcfOptions robot;   ///< stiffnesses; friction and ground are those of `world`
  /// Steps of fourth order, for smooth motions. Works are then those of the forces at the last of their stages.
  bool runge_kutta = false;
};

/// Books: within a step MuJoCo's forces are constant and the velocity changes by M^-1 h f, so that a force f does the
/// work
///     h f . (v + v+) / 2                                                                                           (1)
/// and the sum of all is the change of the kinetic energy at a fixed configuration. By (1) contacts, stops and closures
/// are booked apart. The energy that their springs hold is among the losses, which it can make negative; `elastic` is
/// zero. Eq. (1) of world.h then misses the error of the steps, which is of first order in their length.
///
/// Wrenches of soles are means over the last advance(). Steps are those of the options, or a little shorter.
/// \throws InputError when the robot has no closed configuration, or MuJoCo refuses it
std::unique_ptr<World> makeMujocoWorld(const Model& model, const MujocoWorldOptions& options = {});

}  // namespace bielle::worlds
