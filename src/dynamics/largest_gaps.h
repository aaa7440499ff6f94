#pragma once
// How far the loops of a model are open.
#include "bielle/dynamics/closure.h"
#include "math/largest.h"

namespace bielle {

// The largest distance and the largest angle of all closures; they need not be of the same one. Placements must be up to date.
inline ClosureGap calcLargestGaps(const Model& model, const Workspace& ws) {
  ClosureGap largest;
  for (const Closure& closure : model.closures()) {
    const ClosureGap gap = calcClosureGap(ws, closure);
    largest.position = getLarger(largest.position, gap.position);
    largest.angle = getLarger(largest.angle, gap.angle);
  }
  return largest;
}

}  // namespace bielle
