#include "robots/biped_parts.h"

#include <cmath>

namespace bielle {
void describeSerial(OptionFields& f, SerialBipedParameters& p) {
  f.number("hip_offset", p.hip_offset, "m", {0.05, 0.4}, "distance of a hip from the middle plane");
  f.number("trunk_height", p.trunk_height, "m", {0, 0.5}, "height of the trunk's frame above the hips");
  f.number("thigh_length", p.thigh_length, "m", {0.05, 1}, "distance from hip to knee");
  f.number("shank_length", p.shank_length, "m", {0.05, 1}, "distance from knee to ankle");
  f.number("ankle_height", p.ankle_height, "m", {0.03, 0.3}, "height of the ankle above the sole");
  f.number("hip_height", p.hip_height, "m", {0.1, 2},
           "height of the hips above the soles in the reference half_sitting");
  f.number("sole_length", p.sole_length, "m", {0.02, 0.5}, "length of the sole, along x");
  f.number("sole_offset", p.sole_offset, "m", {-0.2, 0.2}, "distance of the middle of the sole in front of the ankle");
  f.number("sole_width", p.sole_width, "m", {0.02, 0.3}, "width of the sole, along y");
  f.number("trunk_mass", p.trunk_mass, "kg", {0.1, 100}, "mass of the trunk without motors");
  f.number("motor_mass", p.motor_mass, "kg", {0.01, 10}, "mass of each motor");
  f.number("hip_link_mass", p.hip_link_mass, "kg", {0.01, 10},
           "mass of each of the two links of a hip, without motors");
  f.number("link_density", p.link_density, "kg/m", {0.01, 50}, "mass per length of thigh and shank, without motors");
  f.number("foot_mass", p.foot_mass, "kg", {0.01, 10}, "mass of one foot");
  f.number("armature", p.armature, "kg m^2", {0, 1}, "rotor inertia of every motor");
}

Vector3d getHip(const BipedSide& side, const SerialBipedParameters& p) {
  return side.mirror(0, p.hip_offset, -p.trunk_height);
}

std::vector<Solid> makeFoot(const SerialBipedParameters& p) {
  return {makeBox({p.sole_offset, 0, 0.01 - p.ankle_height}, {p.sole_length, p.sole_width, 0.02}, 0.6 * p.foot_mass,
                  colors::kSole),
          makeCylinder({0, 0, 0.01 - p.ankle_height / 2}, kZ, 0.012, p.ankle_height - 0.02, 0.1 * p.foot_mass,
                       colors::kSteel)};
}

Reference makeSerialHalfSitting(const std::string& robot, const SerialBipedParameters& p) {
  const double a = p.thigh_length, b = p.shank_length, reach = p.hip_height - p.ankle_height;
  if (!(reach > std::abs(a - b) && reach < a + b))
    throw InputError(robot, "parameter 'hip_height'", "the legs do not reach the ground from this height",
                     "give a height above ankle_height that thigh and shank can span");
  const double thigh = std::acos((reach * reach + a * a - b * b) / (2 * reach * a));
  const double shank = std::acos((reach * reach + b * b - a * a) / (2 * reach * b));
  Reference reference = makeStanding(p.hip_offset, p.hip_height + p.trunk_height);
  for (const char* side : {"_left", "_right"}) {
    const auto set = [&](const char* joint, double angle) { reference.joints[std::string(joint) + side] = {angle}; };
    set("hipy", -thigh);
    set("knee", thigh + shank);
    set("ankley", -shank);
    for (const char* joint : {"hipz", "hipx", "anklex"}) set(joint, 0);
  }
  return reference;
}

Solid makeMotor(const Vector3d& place, const Vector3d& axis, double mass) {
  constexpr double kRadius = 0.038, kLength = 0.042;  // m
  return makeCylinder(place, axis, kRadius, kLength, mass, colors::kMotor);
}

void addCrankChain(const CrankChain& chain, const std::string& base, double density, double armature,
                   ModelBuilder& builder) {
  const std::string crank = "crank_" + chain.name, rod = "rod_" + chain.name, motor = "motor_" + chain.name;
  const Vector3d to_elbow = chain.elbow - chain.motor, to_end = chain.end - chain.elbow, y = Vector3d::UnitY();
  addSolidLink(crank, base, makeRevolute(motor, chain.motor, y),
               {makeRod(Vector3d::Zero(), to_elbow, 0.010, density, colors::kSteel),
                makeSphere(to_elbow, 0.011, 0.03, colors::kSteel)},
               builder);
  addSolidLink(rod, crank, makeUniversal("elbow_" + chain.name, to_elbow, y, chain.axis2),
               {makeRod(Vector3d::Zero(), to_end, 0.006, density, colors::kRod),
                makeSphere(to_end, 0.010, 0.02, colors::kSteel)},
               builder);
  builder.addFrame("rod_end_" + chain.name, rod, {Matrix3d::Identity(), to_end});
  builder.addMotor(motor, armature);
}

void addTrunk(const std::vector<Solid>& solids, ModelBuilder& builder) {
  Joint root;
  root.name = "root_joint";
  root.kind = JointKind::FreeFlyer;
  addSolidLink("trunk", "world", root, solids, builder);
}

void addSole(const BipedSide& side, const Vector3d& middle, double length, double width, ModelBuilder& builder) {
  builder.addFrame("foot" + side.name, "foot_link" + side.name, {Matrix3d::Identity(), middle});
  builder.addContact("foot" + side.name, "foot" + side.name, ContactKind::Surface6D, length / 2, width / 2);
}

Reference makeStanding(double hip_offset, double trunk_height) {
  Reference reference;
  reference.name = "half_sitting";
  reference.feet = {{"foot_left", Vector3d(0, hip_offset, 0)}, {"foot_right", Vector3d(0, -hip_offset, 0)}};
  reference.height_frame = "trunk";
  reference.height = trunk_height;
  return reference;
}

}  // namespace bielle
