#pragma once
/// \file A world of a robot with play (model/wear.h), which looks like one of the robot without.
#include <functional>
#include <memory>

#include "bielle/worlds/world.h"

namespace bielle::worlds {

/// Coordinates are those of the model: a joint with play is where its link is, and the play of a rod shows in loops that are open by
/// up to half of it. Torques act on the motors' side. A reset puts all that has play in the middle of it. The ends of play are
/// stops (makeJointStops(), MuJoCo's in its world); their losses are stop_loss.
/// \param options  whose wear has the plays; none: a world of the robot itself   \param make  the world of the robot with play   \throws InputError as addPlay() does
std::unique_ptr<World> makePlayWorld(
    const Model& model, const WorldOptions& options,
    const std::function<std::unique_ptr<World>(const Model& model, const WorldOptions& options)>& make);

}  // namespace bielle::worlds
