#pragma once
// Postures with the feet where a plan has them: the guess of a motion.
#include <array>
#include <memory>
#include <vector>

#include "bielle/motion/locomotion.h"

namespace bielle {

/// Where base and feet are to be.
struct PlannedPosture {
  VectorXd q;                              ///< nq, with the base in its place
  std::array<SE3, 2> feet;                 ///< left, right
  std::array<bool, 2> stands{true, true};  ///< on the ground
};

/// Closed configurations with the feet of `stance` where they are planned. The base keeps its place and its rotation, but is
/// raised or lowered as little as legs need. Each posture is found from the one before, or else from the stance, within ranges of
/// joints, and leaves linkages well before their dead points (transmissions from 0.5 to 2), or at least on their side (by
/// kLeastTransmission). If that fails, soles in the air may tilt; then the base takes the place and rotation that legs give it, next to
/// the posture before; then all soles may tilt. If that fails too, the joints are those of the stance.
std::vector<VectorXd> placeFeet(const Model& model, const Stance& stance, const std::vector<PlannedPosture>& postures);
inline constexpr double kLeastTransmission = 0.15;
inline constexpr double kEasyTransmission = 0.5;  ///< well before the dead points

/// How high the centre of mass can be over a foot with a flat sole while the base keeps its rotation: as far as joints have range
/// and linkages are well before their dead points (transmissions from 0.5 to 2). Found by moving the base of a stance, as far ahead and
/// behind as requested.
class LegReach {
 public:
  struct Heights {
    double shortest = 0, longest = 0;  ///< m
  };

  /// Both must outlive it.
  LegReach(const Model& model, const Stance& stance);
  ~LegReach();
  /// \param ahead, aside  of the foot, where it is farther forward and to the side than in the stance the centre of mass is, m
  Heights calc(double ahead, double aside);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace bielle
