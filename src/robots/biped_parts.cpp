#include "robots/biped_parts.h"

namespace bielle {

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
