#pragma once
/// \file The worlds by name.
#include <memory>

#include "bielle/worlds/world.h"
#include "model/play.h"

namespace bielle::worlds {

/// Names for makeWorld(): those that were built.
std::vector<std::string> listWorlds();

/// Whether the steps of a world follow from WorldOptions::tolerance, if that is given.
bool controlsError(const std::string& name);

/// "bielle": makeOwnWorld(). \param plays  play_world.h
/// \throws InputError when there is no world of this name, it cannot carry the robot, or has no use for a tolerance
std::unique_ptr<World> makeWorld(const std::string& name, const Model& model, const WorldOptions& options = {},
                                 const std::vector<Play>& plays = {});

}  // namespace bielle::worlds
