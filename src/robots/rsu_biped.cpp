#include "robots/rsu_biped.h"

#include <cmath>

#include "robots/biped_parts.h"

namespace bielle {
namespace {

const Vector3d kX = Vector3d::UnitX(), kY = Vector3d::UnitY(), kZ = Vector3d::UnitZ(), kOrigin = Vector3d::Zero();

struct Leg : BipedSide {
  const RsuBipedParameters& p;
};

// Hip of three axes in one point, thigh, shank.
void addSerialJoints(const Leg& leg, ModelBuilder& builder) {
  const RsuBipedParameters& p = leg.p;
  addHip(leg, p, builder);
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
  std::vector<Solid> solids = makeFoot(p);
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

}  // namespace

std::vector<Parameter> listParameters(RsuBipedParameters& p) {
  std::vector<Parameter> parameters = listSerialParameters(p);
  const std::vector<Parameter> own = {
      {"ankle_arm", &p.ankle_arm, "m", 0.01, 0.2, "of the rods' balls behind the ankle"},
      {"ankle_crank", &p.ankle_crank, "m", 0.01, 0.2, "length of the cranks"},
      {"ankle_half_width", &p.ankle_half_width, "m", 0.01, 0.2, "of the rods beside the ankle"},
      {"motor_height", &p.motor_height, "m", 0.05, 0.8, "of the ankle motors over the ankle"},
      {"arm_angle", &p.arm_angle, "rad", -1.2, 1.2, "of cranks and arms over the horizontal, legs straight"},
      {"rod_density", &p.rod_density, "kg/m", 0.01, 20, "of cranks and rods"},
  };
  parameters.insert(parameters.end(), own.begin(), own.end());
  return parameters;
}

Model makeRsuBiped(const RsuBipedParameters& parameters) {
  RsuBipedParameters p = parameters;
  checkParameters("rsu_biped", listParameters(p));
  const std::vector<Leg> legs = {{{1, "_left"}, p}, {{-1, "_right"}, p}};
  ModelBuilder builder("rsu_biped");
  addTrunk(makeSerialTrunk(p), builder);
  for (const Leg& leg : legs) addLeg(leg, builder);
  builder.addReference(makeSerialHalfSitting("rsu_biped", p));
  return builder.build();
}

}  // namespace bielle
