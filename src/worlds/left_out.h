#pragma once
/// \file What some worlds leave out of a model or take otherwise, for World::warnings().
#include <functional>
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "bielle/model/wear.h"

namespace bielle::worlds {

/// Limits at which nothing stops. \param has_stop  of coordinate k of a joint
std::vector<std::string> listMissingStops(const Model& model, const std::function<bool(const Joint&, int k)>& has_stop);
/// Those of worlds of the contact law (hasStops()).
std::vector<std::string> listMissingStops(const Model& model);
/// Armatures of planar and free joints, in worlds whose velocities of these lie along the axes of the parent.
std::vector<std::string> listTurnedArmatures(const Model& model);

/// Friction of rod ends.
std::vector<std::string> listRodFrictions(const Wear& wear);

}  // namespace bielle::worlds
