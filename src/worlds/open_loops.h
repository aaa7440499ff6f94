#pragma once
/// \file Loops that are open where a world is reset.
#include <string>

#include "bielle/dynamics/workspace.h"

namespace bielle::worlds {

/// What World::message() says of a configuration whose loops are open by more than 1e-6 m or rad; else empty. The first step would
/// close them, and the world would begin elsewhere than asked.
std::string describeOpenLoops(const Model& model, Workspace& ws, ConstVectorRef q);

}  // namespace bielle::worlds
