#include "robots/rsu_biped.h"

#include <cmath>

#include "robots/biped_parts.h"

namespace bielle {
namespace {

const Vector3d kX = Vector3d::UnitX(), kY = Vector3d::UnitY(), kZ = Vector3d::UnitZ(), kOrigin = Vector3d::Zero();

struct Leg : BipedSide {
  const RsuBipedParameters& p;
};

// Hips are weighted in the state regularization as in the paper's walk.
Joint makeHip(const std::string& name, const Vector3d& place, const Vector3d& axis, double position, double velocity) {
  Joint joint = makeRevolute(name, place, axis);
  joint.position_importance = position;
  joint.velocity_importance = velocity;
  return joint;
}

// Hip of three axes in one point, thigh, shank.
void addSerialJoints(const Leg& leg, ModelBuilder& builder) {
  const RsuBipedParameters& p = leg.p;
  const Vector3d hip(0, leg.s * p.hip_offset, -p.trunk_height), behind(-0.07, 0, 0), beside(0, 0.055 * leg.s, 0);
  addSolidLink("hip_yaw" + leg.name, "trunk", makeHip("hipz" + leg.name, hip, kZ, 10, 5),
               {makeBox(behind / 2 + 0.045 * kZ, {0.09, 0.03, 0.02}, p.hip_link_mass, colors::kFrame),
                makeMotor(behind, kX, p.motor_mass)},
               builder);
  addSolidLink("hip_roll" + leg.name, "hip_yaw" + leg.name, makeHip("hipx" + leg.name, kOrigin, kX, 3, 3),
               {makeBox(behind / 4 + beside / 2, {0.04, 0.06, 0.03}, p.hip_link_mass, colors::kFrame),
                makeMotor(beside, kY, p.motor_mass)},
               builder);
  const Vector3d knee = -p.thigh_length * kZ, ankle = -p.shank_length * kZ;
  addSolidLink("thigh" + leg.name, "hip_roll" + leg.name, makeRevolute("hipy" + leg.name, kOrigin, kY),
               {makeRod(kOrigin, knee, 0.022, p.link_density, colors::kFrame), makeMotor(knee, kY, p.motor_mass)},
               builder);
  const Vector3d motors = ankle + p.motor_height * kZ, side = p.ankle_half_width * kY;
  addSolidLink("shank" + leg.name, "thigh" + leg.name, makeRevolute("knee" + leg.name, knee, kY),
               {makeRod(kOrigin, ankle, 0.018, p.link_density, colors::kOutput),
                makeMotor(motors + side, kY, p.motor_mass), makeMotor(motors - side, kY, p.motor_mass)},
               builder);
  for (const char* joint : {"hipz", "hipx", "hipy", "knee"}) builder.addMotor(joint + leg.name, p.armature);
}

void addFoot(const Leg& leg, ModelBuilder& builder) {
  const RsuBipedParameters& p = leg.p;
  addSolidLink("ankle_cross" + leg.name, "shank" + leg.name,
               makeRevolute("ankley" + leg.name, -p.shank_length * kZ, kY),
               {makeCylinder(kOrigin, kY, 0.008, 0.05, 0.08, colors::kSteel)}, builder);
  builder.addLink("foot_link" + leg.name, "ankle_cross" + leg.name, makeRevolute("anklex" + leg.name, kOrigin, kX), {});
  std::vector<Solid> solids = {makeBox({p.sole_offset, 0, 0.01 - p.ankle_height}, {p.sole_length, p.sole_width, 0.02},
                                       0.6 * p.foot_mass, colors::kSole),
                               makeCylinder({0, 0, 0.01 - p.ankle_height / 2}, kZ, 0.012, p.ankle_height - 0.02,
                                            0.1 * p.foot_mass, colors::kSteel)};
  for (double side : {1.0, -1.0}) {
    const Vector3d heel = p.ankle_arm * Vector3d(-std::cos(p.arm_angle), 0, std::sin(p.arm_angle)) +
                          side * leg.s * p.ankle_half_width * kY;
    const Vector3d root(p.sole_offset - 0.4 * p.sole_length, 0, 0.02 - p.ankle_height);
    solids.push_back(
        makeCylinder((root + heel) / 2, heel - root, 0.009, (heel - root).norm(), 0.15 * p.foot_mass, colors::kSteel));
    builder.addFrame("heel" + std::string(side > 0 ? "1" : "2") + leg.name, "foot_link" + leg.name,
                     {Matrix3d::Identity(), heel});
  }
  addSolids("foot_link" + leg.name, solids, builder);
}

// Crank and rod on the shank; index 1 outer, 2 inner.
void addAnkleChain(const Leg& leg, int index, ModelBuilder& builder) {
  const RsuBipedParameters& p = leg.p;
  const Vector3d arm(-std::cos(p.arm_angle), 0, std::sin(p.arm_angle));
  const Vector3d side = (index == 1 ? leg.s : -leg.s) * p.ankle_half_width * kY, ankle = -p.shank_length * kZ;
  CrankChain chain;
  chain.name = "ankle" + std::to_string(index) + leg.name;
  chain.motor = ankle + p.motor_height * kZ + side;
  chain.elbow = chain.motor + p.ankle_crank * arm;
  chain.end = ankle + p.ankle_arm * arm + side;
  chain.axis2 = kX;
  addCrankChain(chain, "shank" + leg.name, p.rod_density, p.armature, builder);
  builder.addClosure(chain.name, ClosureKind::Ball3D, "heel" + std::to_string(index) + leg.name,
                     "rod_end_" + chain.name);
}

void addLeg(const Leg& leg, ModelBuilder& builder) {
  const RsuBipedParameters& p = leg.p;
  addSerialJoints(leg, builder);
  addFoot(leg, builder);
  for (int i : {1, 2}) addAnkleChain(leg, i, builder);
  for (const char* joint : {"hipz", "hipx", "hipy", "knee", "ankley", "anklex"})
    builder.addSerialJoint(joint + leg.name);
  addSole(leg, {p.sole_offset, 0, -p.ankle_height}, p.sole_length, p.sole_width, builder);
}

std::vector<Solid> makeTrunk(const std::vector<Leg>& legs) {
  const RsuBipedParameters& p = legs.front().p;
  const double plate = 0.055 - p.trunk_height;
  std::vector<Solid> solids = {
      makeBox({-0.01, 0, 0.10}, {0.13, 0.22, 0.20}, 0.72 * p.trunk_mass, colors::kShell),
      makeBox({0, 0, plate + 0.03}, {0.10, 0.34, 0.02}, 0.2 * p.trunk_mass, colors::kSteel),
      makeCylinder({0, 0, plate / 2}, kZ, 0.03, std::abs(plate) + 0.02, 0.03 * p.trunk_mass, colors::kSteel),
      makeSphere({-0.01, 0, 0.26}, 0.055, 0.05 * p.trunk_mass, colors::kShell)};
  for (const Leg& leg : legs) solids.push_back(makeMotor({0, leg.s * p.hip_offset, plate + 0.06}, kZ, p.motor_mass));
  return solids;
}

// Hips over the ankles, by the law of cosines.
Reference makeHalfSitting(const std::vector<Leg>& legs) {
  const RsuBipedParameters& p = legs.front().p;
  const double a = p.thigh_length, b = p.shank_length, reach = p.hip_height - p.ankle_height;
  if (!(reach > std::abs(a - b) && reach < a + b))
    throw ModelError("rsu_biped", "parameter 'hip_height'", "the legs do not reach the ground from there",
                     "give a height between what thigh and shank can bridge, over ankle_height");
  const double thigh = std::acos((reach * reach + a * a - b * b) / (2 * reach * a));
  const double shank = std::acos((reach * reach + b * b - a * a) / (2 * reach * b));
  Reference reference = makeStanding(p.hip_offset, p.hip_height + p.trunk_height);
  for (const Leg& leg : legs) {
    reference.joints["hipy" + leg.name] = {-thigh};
    reference.joints["knee" + leg.name] = {thigh + shank};
    reference.joints["ankley" + leg.name] = {-shank};
    for (const char* joint : {"hipz", "hipx", "anklex"}) reference.joints[joint + leg.name] = {0};
  }
  return reference;
}

}  // namespace

std::vector<Parameter> listParameters(RsuBipedParameters& p) {
  return {
      {"hip_offset", &p.hip_offset, "m", 0.05, 0.4, "of a hip from the middle plane"},
      {"trunk_height", &p.trunk_height, "m", 0, 0.5, "of the trunk's frame over the hips"},
      {"thigh_length", &p.thigh_length, "m", 0.05, 1, "hip to knee"},
      {"shank_length", &p.shank_length, "m", 0.05, 1, "knee to ankle"},
      {"ankle_height", &p.ankle_height, "m", 0.03, 0.3, "of the ankle over the sole"},
      {"hip_height", &p.hip_height, "m", 0.1, 2, "of the hips over the soles in the reference half_sitting"},
      {"sole_length", &p.sole_length, "m", 0.02, 0.5, "along x"},
      {"sole_offset", &p.sole_offset, "m", -0.2, 0.2, "of the middle of the sole before the ankle"},
      {"sole_width", &p.sole_width, "m", 0.02, 0.3, "along y"},
      {"ankle_arm", &p.ankle_arm, "m", 0.01, 0.2, "of the rods' balls behind the ankle"},
      {"ankle_crank", &p.ankle_crank, "m", 0.01, 0.2, "length of the cranks"},
      {"ankle_half_width", &p.ankle_half_width, "m", 0.01, 0.2, "of the rods beside the ankle"},
      {"motor_height", &p.motor_height, "m", 0.05, 0.8, "of the ankle motors over the ankle"},
      {"arm_angle", &p.arm_angle, "rad", -1.2, 1.2, "of cranks and arms over the horizontal, legs straight"},
      {"trunk_mass", &p.trunk_mass, "kg", 0.1, 100, "without motors"},
      {"motor_mass", &p.motor_mass, "kg", 0.01, 10, "of each motor"},
      {"hip_link_mass", &p.hip_link_mass, "kg", 0.01, 10, "each of two links per hip, without motors"},
      {"link_density", &p.link_density, "kg/m", 0.01, 50, "of thigh and shank, without motors"},
      {"rod_density", &p.rod_density, "kg/m", 0.01, 20, "of cranks and rods"},
      {"foot_mass", &p.foot_mass, "kg", 0.01, 10, "of one foot"},
      {"armature", &p.armature, "kg m^2", 0, 1, "rotor inertia of every motor"},
  };
}

Model makeRsuBiped(const RsuBipedParameters& parameters) {
  RsuBipedParameters p = parameters;
  checkParameters("rsu_biped", listParameters(p));
  const std::vector<Leg> legs = {{{1, "_left"}, p}, {{-1, "_right"}, p}};
  ModelBuilder builder("rsu_biped");
  addTrunk(makeTrunk(legs), builder);
  for (const Leg& leg : legs) addLeg(leg, builder);
  builder.addReference(makeHalfSitting(legs));
  return builder.build();
}

}  // namespace bielle
