#pragma once
// A substitute drawing of a robot without visuals: rods between the joints and frames of its bodies.
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

// Points fixed to each body, in its own frame: joints that it carries, ends of closures, contacts.
std::vector<std::vector<Vector3d>> listFastenings(const Model& model);

}  // namespace bielle
