#pragma once
// Parts common to the generated bipeds: a free trunk, mirrored legs, cranks with rods, flat soles.
#include <string>
#include <vector>

#include "robots/solid.h"

namespace bielle {

// A leg's side. Frames are parallel to the trunk's in the neutral configuration.
struct BipedSide {
  double s;          // +1 left, -1 right
  std::string name;  // "_left"

  Vector3d mirror(double x, double y, double z) const { return {x, s * y, z}; }
};

// A motor; all have the same size.
Solid makeMotor(const Vector3d& place, const Vector3d& axis, double mass);

// Motor, crank and rod; the rod has a universal joint at the crank. Points in the frame of the base.
struct CrankChain {
  std::string name;                   // of "motor_NAME", "crank_NAME", "elbow_NAME", "rod_NAME", "rod_end_NAME"
  Vector3d motor, elbow, end;         // axis of the motor is y; joint of crank and rod; end of the rod
  Vector3d axis2 = Vector3d::Zero();  // second axis of the universal joint; the first one is y
};
// Links, the frame of the rod's end and the motor.
void addCrankChain(const CrankChain& chain, const std::string& base, double density, double armature,
                   ModelBuilder& builder);

// Free in space: "trunk", by "root_joint".
void addTrunk(const std::vector<Solid>& solids, ModelBuilder& builder);

// Frame and contact "foot_left", "foot_right" under the link of that foot.
void addSole(const BipedSide& side, const Vector3d& middle, double length, double width, ModelBuilder& builder);

// Reference `half_sitting` except for its joints: soles under the hips, the trunk's frame at a height.
Reference makeStanding(double hip_offset, double trunk_height);

}  // namespace bielle
