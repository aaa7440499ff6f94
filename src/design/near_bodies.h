#pragma once
/// \file Which bodies a constraint on distances is about.
///
/// Shapes that are fitted to drawings are crude: bodies that belong side by side, and that no joint or closure connects, may
/// overlap as they are drawn, whatever the design. Pairs of bodies that do so where the start stands are left out, as are those
/// that the constraint names. Shapes of the robot's own files are meant: they count, and are left out by name alone.
#include <array>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/distance.h"

namespace bielle {

/// Numbers of two bodies, the smaller one first.
using BodyPairs = std::set<std::pair<int, int>>;

/// Of those that listShapePairs() names, those whose shapes overlap in the standing posture, both fitted.
/// \throws InputError when the robot cannot stand
BodyPairs findOverlaps(const Model& model);

/// Every pair of bodies that two names fit, in which * stands for any text.
BodyPairs findBodyPairs(const Model& model, const std::vector<std::array<std::string, 2>>& names);

/// listShapePairs() without those of these bodies.
std::vector<ShapePair> listPairsBut(const BodyPairs& left_out, const Model& model);

/// "shank_left and foot_link_left".
std::string describePair(const Model& model, int body_a, int body_b);

}  // namespace bielle
