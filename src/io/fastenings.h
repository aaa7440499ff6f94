#pragma once
// What a robot looks like when nothing is drawn of it: rods between what is fastened to its bodies.
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

// Points fastened to each body, in its own frame: joints that it carries, ends of closures, contacts.
std::vector<std::vector<Vector3d>> listFastenings(const Model& model);

}  // namespace bielle
