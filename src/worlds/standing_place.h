#pragma once
/// \file Where a robot stands, and the ground there.
#include <string>
#include <vector>

#include "bielle/dynamics/ground.h"
#include "bielle/ocp/contact_schedule.h"

namespace bielle::worlds {

/// Where a robot stands: the middle of its soles at the height of the ground under them (makeGroundUnder), z up, x ahead; the world
/// itself to 1e-9. \param reach  how far soles go ahead of there, m
struct StandingPlace {
  SE3 X_WP;
  double reach = 0;
};
StandingPlace findPlace(const Model& model, const std::vector<ContactTarget>& soles);
/// A ground that is given where the robot stands, in the world.
Ground carryGround(Ground ground, const SE3& X_WP);
/// Soles that are in the ground, or over it, by more than 1 mm at their lowest corner; a sentence each.
std::vector<std::string> describeSoles(const Model& model, const Ground& ground,
                                       const std::vector<ContactTarget>& soles);
/// Whether a sole lies on a box of the ground that begins beyond x = `start` of P, in part or all.
bool reachesBoxes(const Model& model, const Ground& ground, const std::vector<ContactTarget>& soles, const SE3& X_WP,
                  double start);

}  // namespace bielle::worlds
