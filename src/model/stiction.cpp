#include "model/stiction.h"

#include <algorithm>

namespace bielle {

std::vector<JointForce> splitJointForce(const WholeJointForce& whole) {
  JointForce force = whole.force, fall;
  if (!whole.sticks()) return {force};
  fall.joint = force.joint, fall.idx_q = force.idx_q, fall.dof = force.dof;
  fall.friction = force.friction - whole.stiction, fall.friction_speed = whole.stribeck_speed;
  force.friction = whole.stiction;
  return {force, fall};
}

std::vector<WholeJointForce> joinJointForces(const Model& model) {
  std::vector<WholeJointForce> out;
  for (const JointForce& force : model.jointForces()) {
    const auto own = std::find_if(out.begin(), out.end(),
                                  [&force](const WholeJointForce& other) { return other.force.joint == force.joint; });
    if (own == out.end()) {
      out.push_back({force, force.friction});
      continue;
    }
    own->force.friction += force.friction;
    own->stribeck_speed = force.friction_speed;
  }
  return out;
}

}  // namespace bielle
