#pragma once
// Postures with the feet where a plan has them: the guess of a motion.
#include <array>
#include <vector>

#include "bielle/motion/locomotion.h"

namespace bielle {

/// Where base and feet are to be.
struct PlannedPosture {
  VectorXd q;               ///< nq, with the base in its place
  std::array<SE3, 2> feet;  ///< left, right
};

/// Closed configurations with the feet of `stance` where they are planned. The base keeps its place and its rotation, but is
/// lowered where a leg would have to be longer than in the stance. Each posture is found from the one before, or else from the
/// stance, and leaves linkages on their side of dead points (Transmission, by kLeastTransmission). If that fails, soles
/// may tilt; if that fails too, the joints are those of the stance.
std::vector<VectorXd> placeFeet(const Model& model, const Stance& stance, const std::vector<PlannedPosture>& postures);
inline constexpr double kLeastTransmission = 0.15;

}  // namespace bielle
