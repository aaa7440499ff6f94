#pragma once
/// \file The world of Bielle's own dynamics in steps of controlled error: a Runge-Kutta method of order 8 on the manifold of
/// closed states.
///
/// For mechanisms in motion: loops are closed to rounding at every evaluation, redundant rows and postures where loops lose
/// rank at an instant need no care, and energy is as good as the tolerance. Contacts, stops, springs and friction
/// are the forces of the world with fixed steps (bielle_world.h), which is the faster one for robots on their feet: each
/// touchdown costs this one many short steps.
#include <memory>

#include "bielle/worlds/contact_law.h"
#include "bielle/worlds/world.h"

namespace bielle::worlds {

struct ManifoldWorldOptions {
  WorldOptions world;  ///< time_step: the longest step; 0: no limit
  ContactOptions contact;
  /// Error allowed per step, 1e-12 at least: of coordinates, in m or rad; of velocities, relative to 1 (m/s, rad/s) or to their
  /// size. Over a motion of many steps the errors add up to ten or a hundred times as much.
  double tolerance = 1e-9;
};

/// advance() fails where the mechanism cannot go on: getMessage() names joint or closure and the time. The robot needs no
/// standing posture and no free joint.
/// \throws InputError when the robot has no closed configuration
std::unique_ptr<World> makeManifoldWorld(const Model& model, const ManifoldWorldOptions& options = {});

}  // namespace bielle::worlds
