#pragma once
// Rods that were cut and welded, and end in a ball joint.
#include "bielle/model/model.h"

namespace bielle {

// The leaf on a spherical joint that nothing but this weld holds and that has no motor, so that it may count as part of the
// other body; not if that counts as part of a further one, being among those `taken`. -1: there is none.
// \param closures  all that act on the model
int findBallLeaf(const Model& model, const std::vector<Closure>& closures, const Closure& weld,
                 const std::vector<int>& taken);

}  // namespace bielle
