#pragma once
// Parts common to the generated bipeds: a free trunk, mirrored legs, cranks with rods, flat soles.
#include <string>
#include <vector>

#include "robots/check_parameters.h"
#include "robots/solid.h"

namespace bielle {

// Bipeds with hips of three axes in one point, knees and ankles of two axes; joints of a leg are hipz, hipx, hipy, knee
// (positive: bent), ankley, anklex.
struct SerialBipedParameters {
  double hip_offset = 0.125;                     // of a hip from the middle plane, m
  double trunk_height = 0.185;                   // of the trunk's frame over the hips, m
  double thigh_length = 0.22;                    // m
  double shank_length = 0.24;                    // m
  double ankle_height = 0.045;                   // over the sole, m
  double hip_height = 0.39;                      // of the hips over the soles in the reference `half_sitting`, m
  double sole_length = 0.10, sole_width = 0.10;  // m
  double sole_offset = 0.017;                    // of the middle of the sole before the ankle, m

  double trunk_mass = 6.72;    // without motors, kg
  double motor_mass = 0.8;     // each of twelve, kg
  double hip_link_mass = 1.2;  // each of the two links between trunk and thigh, without motors, kg
  double link_density = 3;     // of thigh and shank, kg/m
  double foot_mass = 0.5;      // kg
  double armature = 1e-3;      // of every motor, kg m^2
};
void describeSerial(OptionFields& fields, SerialBipedParameters& parameters);

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

// Centre of a hip, in the trunk.
Vector3d getHip(const BipedSide& side, const SerialBipedParameters& p);
// Sole and post of a foot, 0.7 of its mass.
std::vector<Solid> makeFoot(const SerialBipedParameters& p);
// Hips over the ankles, by the law of cosines. \throws InputError if the legs do not reach
Reference makeSerialHalfSitting(const std::string& robot, const SerialBipedParameters& p);

// Reference `half_sitting` except for its joints: soles under the hips, the trunk's frame at a height.
Reference makeStanding(double hip_offset, double trunk_height);

}  // namespace bielle
