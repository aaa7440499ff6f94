#include "bielle/robots/spring_leg.h"

#include <cmath>

#include "bielle/robots/solid.h"

namespace bielle {
namespace {

const Vector3d kX = Vector3d::UnitX(), kY = Vector3d::UnitY(), kZ = Vector3d::UnitZ(), kOrigin = Vector3d::Zero();

// Unit vector at an angle from straight down, forward positive.
Vector3d makeDirection(double angle) { return {std::sin(angle), 0, -std::cos(angle)}; }

Solid makeMotor(const Vector3d& place, const Vector3d& axis, double mass) {
  return makeCylinder(place, axis, 0.045, 0.05, mass, colors::kMotor);
}

// Roll and yaw over the pitch axis, with the motors of what follows.
void addHip(const SpringLegParameters& p, ModelBuilder& builder) {
  addSolidLink(
      "hip_roll_link", "world", makeRevolute("hip_roll", kOrigin, kX),
      {makeRod(kOrigin, -0.04 * kZ, 0.02, p.link_density, colors::kFrame), makeMotor(-0.06 * kX, kZ, p.motor_mass)},
      builder);
  addSolidLink("hip_yaw_link", "hip_roll_link", makeRevolute("hip_yaw", -0.04 * kZ, kZ),
               {makeRod(kOrigin, -0.05 * kZ, 0.02, p.link_density, colors::kFrame),
                makeMotor({0, 0.05, -0.05}, kY, p.motor_mass)},
               builder);
}

// From the toe's crank on the tarsus to its lever.
void addToe(const SpringLegParameters& p, ModelBuilder& builder) {
  const Vector3d down = makeDirection(p.tarsus_angle), front = -kY.cross(down);  // across the tarsus
  const Vector3d lever = p.lever_length * front, crank = p.crank_length * front, pivot = p.tarsus_length * down;
  addSolidLink("toe", "tarsus_link", makeRevolute("toe_joint", pivot, kY),
               {makeBox({0, 0, -0.03}, {p.toe_length, 0.04, 0.02}, 0.8 * p.foot_mass, colors::kSole),
                makeRod(kOrigin, lever, 0.007, 0.2 * p.foot_mass / p.lever_length, colors::kSteel)},
               builder);
  builder.addFrame("foot", "toe", {Matrix3d::Identity(), {0, 0, -0.04}});
  builder.addFrame("lever_end", "toe", {Matrix3d::Identity(), lever});
  addSolidLink("toe_crank", "tarsus_link", makeRevolute("motor_toe", p.crank_place * down, kY),
               {makeRod(kOrigin, crank, 0.007, p.rod_density, colors::kSteel)}, builder);
  const Vector3d rod = pivot + lever - p.crank_place * down - crank;
  addSolidLink("plantar_rod", "toe_crank", makeRevolute("plantar_joint", crank, kY),
               {makeRod(kOrigin, rod, 0.005, p.rod_density, colors::kRod)}, builder);
  builder.addFrame("plantar_end", "plantar_rod", {Matrix3d::Identity(), rod});
  builder.addClosure("plantar", ClosureKind::Hinge5D, "lever_end", "plantar_end", kY);
}

}  // namespace

std::vector<Parameter> listParameters(SpringLegParameters& p) {
  return {{"thigh_length", &p.thigh_length, "m", 0.02, 1, "hip pitch axis to knee"},
          {"shin_length", &p.shin_length, "m", 0.05, 2, "knee to tarsus joint"},
          {"tarsus_length", &p.tarsus_length, "m", 0.05, 2, "tarsus joint to toe"},
          {"heel_length", &p.heel_length, "m", 0.02, 1, "tarsus joint to the end of the heel rod"},
          {"crank_length", &p.crank_length, "m", 0.01, 0.3, "of the toe's crank"},
          {"lever_length", &p.lever_length, "m", 0.01, 0.3, "of the toe's lever"},
          {"crank_place", &p.crank_place, "m", 0, 1, "of the crank along the tarsus"},
          {"toe_length", &p.toe_length, "m", 0.02, 0.5, "of the foot"},
          {"thigh_angle", &p.thigh_angle, "rad", -1.5, 1.5, "from straight down, forward positive, neutral"},
          {"shin_angle", &p.shin_angle, "rad", -1.5, 1.5, "likewise"},
          {"tarsus_angle", &p.tarsus_angle, "rad", -1.5, 1.5, "likewise"},
          {"motor_mass", &p.motor_mass, "kg", 0.01, 10, "of each motor"},
          {"link_density", &p.link_density, "kg/m", 0.01, 50, "of thigh, shin and tarsus"},
          {"rod_density", &p.rod_density, "kg/m", 0.01, 20, "of heel rod, plantar rod and crank"},
          {"foot_mass", &p.foot_mass, "kg", 0.01, 10, "of the foot"},
          {"armature", &p.armature, "kg m^2", 0, 1, "rotor inertia of every motor, behind its gear"}};
}

Model makeSpringLeg(const SpringLegParameters& parameters) {
  SpringLegParameters p = parameters;
  checkParameters("spring_leg", listParameters(p));
  if (!(p.crank_place < p.tarsus_length))
    throw ModelError("spring_leg", "parameter 'crank_place'", "the crank would sit beyond the toe",
                     "give less than tarsus_length");
  const Vector3d knee = p.thigh_length * makeDirection(p.thigh_angle),
                 shin = p.shin_length * makeDirection(p.shin_angle);
  const Vector3d heel = -p.heel_length * makeDirection(p.thigh_angle), rod = knee + shin + heel;
  ModelBuilder builder("spring_leg");
  addHip(p, builder);
  addSolidLink("thigh", "hip_yaw_link", makeRevolute("hip_pitch", -0.05 * kZ, kY),
               {makeRod(kOrigin, knee, 0.02, p.link_density, colors::kFrame), makeMotor(knee, kY, p.motor_mass)},
               builder);
  addSolidLink("shin", "thigh", makeRevolute("knee", knee, kY),
               {makeRod(kOrigin, shin, 0.015, p.link_density, colors::kOutput)}, builder);
  addSolidLink(
      "tarsus_link", "shin", makeRevolute("tarsus", shin, kY),
      {makeRod(heel, kOrigin, 0.012, p.link_density, colors::kFrame),
       makeRod(kOrigin, p.tarsus_length * makeDirection(p.tarsus_angle), 0.015, p.link_density, colors::kFrame),
       makeMotor(p.crank_place * makeDirection(p.tarsus_angle), kY, p.motor_mass)},
      builder);
  builder.addFrame("heel", "tarsus_link", {Matrix3d::Identity(), heel});
  addToe(p, builder);
  // The rod must not spin: its universal joint turns about y and about what is more square to it.
  const Vector3d second = std::abs(rod.x()) > std::abs(rod.z()) ? kZ : kX;
  addSolidLink("heel_rod", "thigh", makeUniversal("heel_rod_joint", kOrigin, kY, second),
               {makeRod(kOrigin, rod, 0.006, p.rod_density, colors::kRod)}, builder);
  builder.addFrame("heel_rod_end", "heel_rod", {Matrix3d::Identity(), rod});
  builder.addClosure("heel_rod", ClosureKind::Ball3D, "heel", "heel_rod_end");
  for (const char* joint : {"hip_roll", "hip_yaw", "hip_pitch", "knee", "motor_toe"})
    builder.addMotor(joint, p.armature);
  for (const char* joint : {"hip_roll", "hip_yaw", "hip_pitch", "knee", "toe_joint"}) builder.addSerialJoint(joint);
  return builder.build();
}

}  // namespace bielle
