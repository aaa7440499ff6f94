#pragma once
/// \file How the module `_bielle` calls the module `_engines`, which links Simbody and MuJoCo: through a capsule that
/// points to one function, so that the package works without them.
#include <memory>

#include "bielle/worlds/world.h"

namespace bielle::python {

/// As worlds::makeWorld.
using MakeWorld = std::unique_ptr<worlds::World> (*)(const std::string& name, const Model& model,
                                                     const worlds::WorldOptions& options);

/// The name of the capsule, which changes when its type does.
inline constexpr char kEnginesCapsule[] = "bielle.make_world.3";

}  // namespace bielle::python
