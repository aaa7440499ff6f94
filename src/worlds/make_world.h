#pragma once
/// \file The worlds by name.
#include <memory>

#include "bielle/worlds/world.h"

namespace bielle::worlds {

/// Names for makeWorld(): those that were built.
std::vector<std::string> listWorlds();

/// "bielle": makeOwnWorld().
/// \throws InputError when there is no world of this name, or it cannot carry the robot
std::unique_ptr<World> makeWorld(const std::string& name, const Model& model, const WorldOptions& options = {});

}  // namespace bielle::worlds
