#pragma once
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/assembly.h"

namespace bielle {

/// A target that is out of reach of another one, or of the world, whatever the joints between them do, and what says
/// so: often they are in other units. Empty if none is.
std::pair<std::string, std::string> findTargetsApart(const Model& model, const std::vector<FrameTarget>& frames);

}  // namespace bielle
