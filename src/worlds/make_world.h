#pragma once
/// \file The worlds by name.
#include <memory>

#include "bielle/worlds/world.h"

namespace bielle::worlds {

/// Names for makeWorld(): those that were built.
std::vector<std::string> listWorlds();

/// Whether the steps of a world follow from WorldOptions::tolerance, if that is given.
bool controlsError(const std::string& name);

/// "bielle": makeOwnWorld().
/// \throws InputError when there is no world of this name, it cannot carry the robot, or has no use for a tolerance
std::unique_ptr<World> makeWorld(const std::string& name, const Model& model, const WorldOptions& options = {});

}  // namespace bielle::worlds
