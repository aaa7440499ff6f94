#include "robots/belt_biped.h"

#include <algorithm>

namespace bielle {
namespace {

const Vector3d kX = Vector3d::UnitX(), kY = Vector3d::UnitY(), kZ = Vector3d::UnitZ(), kOrigin = Vector3d::Zero();

// What drives knees and ankles; otherwise a motor on each axis does.
struct Drives {
  bool belt = true, differential = true;
};

struct Leg : BipedSide {
  const BeltBipedParameters& p;
  Drives drives;
};

// A pulley about y, turned by its motor.
void addPulley(const Leg& leg, const std::string& name, const std::string& base, const Vector3d& place,
               ModelBuilder& builder) {
  constexpr double kRadius = 0.02, kWidth = 0.012;  // m
  addSolidLink("pulley_" + name + leg.name, base + leg.name, makeRevolute("motor_" + name + leg.name, place, kY),
               {makeCylinder(kOrigin, kY, kRadius, kWidth, leg.p.pulley_mass, colors::kSteel)}, builder);
}

void addKnee(const Leg& leg, ModelBuilder& builder) {
  const BeltBipedParameters& p = leg.p;
  const Vector3d knee = -p.thigh_length * kZ, ankle = -p.shank_length * kZ, inner = -leg.s * 0.04 * kY;
  addSolidLink("thigh" + leg.name, "hip_roll" + leg.name, makeRevolute("hipy" + leg.name, kOrigin, kY),
               {makeRod(kOrigin, knee, 0.022, p.link_density, colors::kFrame), makeMotor(inner, kY, p.motor_mass)},
               builder);
  if (leg.drives.belt) addPulley(leg, "knee", "thigh", inner / 2, builder);
  const Vector3d motors = -p.ankle_motor_drop * kZ, side = 0.03 * kY;
  addSolidLink("shank" + leg.name, "thigh" + leg.name, makeRevolute("knee" + leg.name, knee, kY),
               {makeRod(kOrigin, ankle, 0.018, p.link_density, colors::kOutput),
                makeMotor(motors + side, kY, p.motor_mass), makeMotor(motors - side, kY, p.motor_mass)},
               builder);
  if (!leg.drives.belt) return;
  builder.addCoupler("knee_belt" + leg.name, {{"motor_knee" + leg.name, 1}, {"knee" + leg.name, -p.knee_ratio}});
}

void addAnkle(const Leg& leg, ModelBuilder& builder) {
  const BeltBipedParameters& p = leg.p;
  addSolidLink("ankle_cross" + leg.name, "shank" + leg.name,
               makeRevolute("ankley" + leg.name, -p.shank_length * kZ, kY),
               {makeCylinder(kOrigin, kY, 0.008, 0.05, 0.08, colors::kSteel)}, builder);
  std::vector<Solid> foot = makeFoot(p);
  foot.push_back(makeCylinder(kOrigin, kX, 0.02, 0.03, 0.3 * p.foot_mass, colors::kSteel));
  addSolidLink("foot_link" + leg.name, "ankle_cross" + leg.name, makeRevolute("anklex" + leg.name, kOrigin, kX), foot,
               builder);
  if (!leg.drives.differential) return;
  const std::string motors[] = {"motor_ankle1" + leg.name, "motor_ankle2" + leg.name};
  for (int i : {0, 1})
    addPulley(leg, "ankle" + std::to_string(i + 1), "shank",
              -p.ankle_motor_drop * kZ + (i == 0 ? leg.s : -leg.s) * 0.055 * kY, builder);
  builder.addCoupler("ankle_pitch" + leg.name,
                     {{motors[0], 0.5}, {motors[1], 0.5}, {"ankley" + leg.name, -p.ankle_ratio}});
  builder.addCoupler("ankle_roll" + leg.name,
                     {{motors[0], 0.5 * leg.s}, {motors[1], -0.5 * leg.s}, {"anklex" + leg.name, -p.ankle_ratio}});
}

void addLeg(const Leg& leg, ModelBuilder& builder) {
  const BeltBipedParameters& p = leg.p;
  addHip(leg, p, builder);
  addKnee(leg, builder);
  addAnkle(leg, builder);
  const Drives& d = leg.drives;
  for (const char* joint : {"hipz", "hipx", "hipy", d.belt ? "motor_knee" : "knee",
                            d.differential ? "motor_ankle1" : "ankley", d.differential ? "motor_ankle2" : "anklex"})
    builder.addMotor(joint + leg.name, p.armature);
  for (const char* joint : {"hipz", "hipx", "hipy", "knee", "ankley", "anklex"})
    builder.addSerialJoint(joint + leg.name);
  addSole(leg, {p.sole_offset, 0, -p.ankle_height}, p.sole_length, p.sole_width, builder);
}

Model makeBiped(const std::string& robot, const BeltBipedParameters& p, const std::vector<Parameter>& parameters,
                const Drives& drives) {
  checkParameters(robot, parameters);
  ModelBuilder builder(robot);
  addTrunk(makeSerialTrunk(p), builder);
  for (const Leg& leg : {Leg{{1, "_left"}, p, drives}, Leg{{-1, "_right"}, p, drives}}) addLeg(leg, builder);
  builder.addReference(makeSerialHalfSitting(robot, p));
  return builder.build();
}

std::vector<Parameter> leaveOut(const std::string& name, BeltBipedParameters& p) {
  std::vector<Parameter> parameters = listParameters(p);
  parameters.erase(
      std::find_if(parameters.begin(), parameters.end(), [&](const Parameter& q) { return q.name == name; }));
  return parameters;
}

}  // namespace

std::vector<Parameter> listParameters(BeltBipedParameters& p) {
  std::vector<Parameter> parameters = listSerialParameters(p);
  const std::vector<Parameter> own = {
      {"knee_ratio", &p.knee_ratio, "1", 0.1, 20, "turns of the knee's motor per turn of the knee"},
      {"ankle_ratio", &p.ankle_ratio, "1", 0.1, 20, "mean turns of the ankle's motors per turn of the ankle"},
      {"ankle_motor_drop", &p.ankle_motor_drop, "m", 0, 0.5, "of the ankle motors below the knee"},
      {"pulley_mass", &p.pulley_mass, "kg", 0.001, 2, "of each motor's pulley"},
  };
  parameters.insert(parameters.end(), own.begin(), own.end());
  return parameters;
}

std::vector<Parameter> listParameters(BeltKneeParameters& p) { return leaveOut("ankle_ratio", p); }
std::vector<Parameter> listParameters(DifferentialAnkleParameters& p) { return leaveOut("knee_ratio", p); }

Model makeBeltBiped(const BeltBipedParameters& parameters) {
  BeltBipedParameters p = parameters;
  return makeBiped("belt_biped", p, listParameters(p), {});
}

Model makeBeltKnee(const BeltKneeParameters& parameters) {
  BeltKneeParameters p = parameters;
  return makeBiped("belt_knee", p, listParameters(p), {true, false});
}

Model makeDifferentialAnkle(const DifferentialAnkleParameters& parameters) {
  DifferentialAnkleParameters p = parameters;
  return makeBiped("differential_ankle", p, listParameters(p), {false, true});
}

}  // namespace bielle
