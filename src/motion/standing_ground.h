#pragma once
// Boxes under soles (makeGroundUnder, motion.h).
#include "bielle/dynamics/ground.h"

namespace bielle {

// A box under a sole, which it exceeds by `rim` on all sides, with the sole's inclination.
GroundStep makeStone(const ContactFrame& sole, const SE3& X_WF, double rim);

}  // namespace bielle
