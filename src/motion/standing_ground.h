#pragma once
// Boxes under soles (makeGroundUnder, motion.h).
#include <string>
#include <vector>

#include "bielle/motion/motion.h"

namespace bielle {

// A box under a sole, which it exceeds by `rim` on all sides, with the sole's inclination.
GroundStep makeStone(const ContactFrame& sole, const SE3& X_WF, double rim);

// requireLevel() of motion.h with another remedy.
void requireLevel(const Model& model, const std::vector<ContactTarget>& soles, const std::string& motion,
                  const std::string& remedy);

}  // namespace bielle
