#pragma once
// A substitute drawing of what a robot's file does not draw.
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

// Rods between the joints and frames of the bodies 1, 2, ... that are not drawn, with balls at their origins.
std::vector<Visual> listSkeleton(const Model& model, const std::vector<bool>& is_drawn);

}  // namespace bielle
