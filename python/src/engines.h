#pragma once
/// \file How the module `_bielle` calls the module `_engines`, which links Simbody and MuJoCo: through a capsule that
/// points to one function, so that the package works without them.
#include <memory>

#include "simulation/world.h"

namespace bielle::python {

/// As simulation::makeWorld.
using MakeWorld = std::unique_ptr<simulation::World> (*)(const std::string& name, const Model& model,
                                                         const simulation::WorldOptions& options);

/// The name of the capsule, which changes when its type does.
inline constexpr char kEnginesCapsule[] = "bielle.make_world.1";

}  // namespace bielle::python
