#pragma once
// A servo for benchmarks and tests.
#include "bielle/worlds/world.h"

namespace bielle::worlds {

// Keeps the standing posture by springs and dampers on the motors about the torques that hold it there.
class PostureHold {
 public:
  static constexpr double kStiffness = 100, kDamping = 2;  // N m/rad, N m s/rad

  // \param model  outlives it, has feet
  explicit PostureHold(const Model& model);
  const VectorXd& posture() const { return q_; }
  VectorXd calcTorques(ConstVectorRef q, ConstVectorRef v) const;
  VectorXd calcTorques(const World& world) const { return calcTorques(world.configuration(), world.velocity()); }

 private:
  const Model& model_;
  VectorXd q_, u_;
};

}  // namespace bielle::worlds
