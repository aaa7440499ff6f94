#pragma once
// Rods that were cut and welded, and end in a ball joint.
#include "bielle/model/model.h"

namespace bielle {

// The body on a spherical joint without a motor that carries no other and that only this weld holds: it may count as part of
// the other body of the weld. -1: there is none, or that other body is itself in `taken`.
// \param closures  all that act on the model   \param taken  leaves that count as part of other bodies already
int findBallLeaf(const Model& model, const std::vector<Closure>& closures, const Closure& weld,
                 const std::vector<int>& taken);

}  // namespace bielle
