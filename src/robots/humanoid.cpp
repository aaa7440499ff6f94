#include "robots/humanoid.h"

namespace bielle {
namespace {

struct HumanoidArm : BipedSide {
  const HumanoidParameters& p;

  std::string part(const std::string& base) const { return base + name; }
};

// A finger of two links at +-y of the hand; the second one carries on where the first one ends.
void addFinger(const HumanoidArm& arm, const std::string& number, double sign, ModelBuilder& builder) {
  constexpr double kRadius = 0.006, kGap = 0.02;  // m
  const HumanoidParameters& p = arm.p;
  const Vector3d root(0, sign * kGap, -p.forearm_length - 0.03), end(0, 0, -p.finger_length);
  const std::vector<Solid> link = {makeRod(kOrigin, end, kRadius, p.finger_mass / p.finger_length, colors::kSteel)};
  addSolidLink(arm.part("finger" + number), arm.part("forearm"),
               makeRevolute(arm.part("finger" + number + "_joint"), root, kX), link, builder);
  addSolidLink(arm.part("fingertip" + number), arm.part("finger" + number),
               makeRevolute(arm.part("fingertip" + number + "_joint"), end, kX), link, builder);
}

void addArm(const HumanoidArm& arm, ModelBuilder& builder) {
  const HumanoidParameters& p = arm.p;
  const Vector3d elbow(0, 0, -p.upper_arm_length), hand(0, 0, -p.forearm_length);
  addSolidLink(arm.part("shoulder"), "trunk",
               makeRevolute(arm.part("armpitch"), arm.mirror(0, p.shoulder_offset, p.shoulder_height), kY),
               {makeMotor(kOrigin, kX, p.arm_motor_mass)}, builder);
  addSolidLink(arm.part("upper_arm"), arm.part("shoulder"), makeRevolute(arm.part("armroll"), kOrigin, kX),
               {makeRod(kOrigin, elbow, 0.02, p.arm_density, colors::kFrame), makeMotor(elbow, kY, p.arm_motor_mass)},
               builder);
  addSolidLink(arm.part("forearm"), arm.part("upper_arm"), makeRevolute(arm.part("elbow"), elbow, kY),
               {makeRod(kOrigin, hand, 0.018, p.arm_density, colors::kOutput),
                makeBox(hand - 0.015 * kZ, {0.03, 0.05, 0.03}, 0.5 * p.arm_motor_mass, colors::kMotor)},
               builder);
  for (const char* joint : {"armpitch", "armroll", "elbow"}) builder.addMotor(arm.part(joint), p.armature);
  addFinger(arm, "1", 1, builder);
  addFinger(arm, "2", -1, builder);
  const std::string driven = arm.part("finger1_joint");
  builder.addMotor(driven, p.finger_armature);
  const std::pair<const char*, double> mimics[] = {
      {"finger2_joint", -1}, {"fingertip1_joint", -p.finger_ratio}, {"fingertip2_joint", p.finger_ratio}};
  for (const auto& [joint, ratio] : mimics)
    builder.addCoupler(arm.part(joint), {{arm.part(joint), 1}, {driven, -ratio}});
  for (const char* joint : {"armpitch", "armroll", "elbow", "finger1_joint"}) builder.addSerialJoint(arm.part(joint));
}

}  // namespace

void describe(OptionFields& f, HumanoidParameters& p) {
  describeRsu(f, p, "mass of each motor of the legs");
  f.number("shoulder_height", p.shoulder_height, "m", {0, 1}, "height of the shoulders above the trunk's frame");
  f.number("shoulder_offset", p.shoulder_offset, "m", {0.05, 0.5}, "distance of a shoulder from the middle plane");
  f.number("upper_arm_length", p.upper_arm_length, "m", {0.05, 1}, "distance from shoulder to elbow");
  f.number("forearm_length", p.forearm_length, "m", {0.05, 1}, "distance from elbow to hand");
  f.number("finger_length", p.finger_length, "m", {0.01, 0.2}, "length of each of the two links of a finger");
  f.number("finger_ratio", p.finger_ratio, "1", {0.1, 3},
           "backward turns of a fingertip per turn of its finger; 1: tips stay parallel");
  f.number("arm_density", p.arm_density, "kg/m", {0.01, 50},
           "mass per length of upper arm and forearm, without motors");
  f.number("arm_motor_mass", p.arm_motor_mass, "kg", {0.01, 10}, "mass of each motor of an arm; a hand has half of it");
  f.number("finger_mass", p.finger_mass, "kg", {0.001, 1}, "mass of each link of a finger");
  f.number("finger_armature", p.finger_armature, "kg m^2", {0, 1}, "rotor inertia of the gripper's motor");
}

Model makeHumanoid(const HumanoidParameters& parameters) {
  checkParameters("humanoid", parameters);
  HumanoidParameters p = parameters;
  p.knee = KneePart::Serial, p.ankle = AnklePart::Rsu;
  p.knee_motor_mass = p.ankle_motor_mass = p.motor_mass;
  ModelBuilder builder("humanoid");
  addLegBiped(p, builder);
  Reference half_sitting = makeSerialHalfSitting("humanoid", p);
  for (const BipedSide& side : {BipedSide{1, "_left"}, BipedSide{-1, "_right"}}) {
    addArm({side, p}, builder);
    half_sitting.joints["armpitch" + side.name] = {0.3};
    half_sitting.joints["armroll" + side.name] = {side.s * 0.15};
    half_sitting.joints["elbow" + side.name] = {-0.8};
    half_sitting.joints["finger1_joint" + side.name] = {0};
  }
  builder.addReference(half_sitting);
  return builder.build();
}

}  // namespace bielle
