#include "robots/fivebar_leg.h"

#include <cmath>

#include "robots/solid.h"

namespace bielle {
namespace {

// Upper and lower rod of one side; they pass each other beside the plane of the foot.
void addSide(const FiveBarLegParameters& p, const std::string& name, double sign, double depth, ModelBuilder& builder) {
  const Vector3d knee = p.upper_length * Vector3d(sign * std::sin(p.stand_angle), 0, -std::cos(p.stand_angle));
  const Vector3d to_foot = -depth * kZ - knee;
  addSolidLink("upper_" + name, "body", makeRevolute("motor_" + name, kOrigin, kY),
               {makeRod(kOrigin, knee, 0.008, p.rod_density, colors::kFrame)}, builder);
  std::vector<Solid> lower = {makeRod(kOrigin, to_foot, 0.006, p.rod_density, colors::kOutput)};
  if (sign > 0) lower.push_back(makeSphere(to_foot, 0.012, p.foot_mass, colors::kSole));
  addSolidLink("lower_" + name, "upper_" + name, makeRevolute("knee_" + name, knee, kY), lower, builder);
  builder.addFrame("lower_end_" + name, "lower_" + name, {Matrix3d::Identity(), to_foot});
  builder.addMotor("motor_" + name, p.armature);
}

}  // namespace

void describe(OptionFields& f, FiveBarLegParameters& p) {
  f.number("upper_length", p.upper_length, "m", {0.01, 2}, "distance from motor to knee");
  f.number("lower_length", p.lower_length, "m", {0.01, 2}, "distance from knee to foot");
  f.number("stand_angle", p.stand_angle, "rad", {0.05, 3}, "angle of the upper rods from straight down, standing");
  f.number("body_mass", p.body_mass, "kg", {0.01, 100}, "mass of the body on the rail, without motors");
  f.number("motor_mass", p.motor_mass, "kg", {0.01, 10}, "mass of each motor");
  f.number("rod_density", p.rod_density, "kg/m", {0.01, 20}, "mass per length of the rods");
  f.number("foot_mass", p.foot_mass, "kg", {0.001, 5}, "mass of the foot");
  f.number("armature", p.armature, "kg m^2", {0, 1}, "rotor inertia of every motor");
}

Model makeFiveBarLeg(const FiveBarLegParameters& p) {
  checkParameters("fivebar_leg", p);
  const double side = p.upper_length * std::sin(p.stand_angle), square = p.lower_length * p.lower_length - side * side;
  const double depth = square > 0 ? p.upper_length * std::cos(p.stand_angle) + std::sqrt(square) : 0;
  if (!(depth > 0))
    throw InputError("fivebar_leg", "parameter 'lower_length'", "the lower rods do not meet below the motors",
                     "make them longer, or change stand_angle");
  ModelBuilder builder("fivebar_leg");
  Visual post;
  post.X_BV.p = {0, 0.06, depth};
  post.size = {0.02, 0.01, 2 * depth};
  post.rgba = colors::kSteel;
  builder.addVisual("world", post);
  Joint rail;
  rail.name = "rail";
  rail.kind = JointKind::Prismatic;
  rail.axis = kZ;
  rail.X_PJ.p = depth * kZ;
  std::vector<Solid> body = {makeBox({0, 0.04, 0}, {0.08, 0.03, 0.08}, p.body_mass, colors::kShell)};
  for (double y : {0.015, -0.015})
    body.push_back(makeCylinder({0, y, 0}, kY, 0.04, 0.025, p.motor_mass, colors::kMotor));
  addSolidLink("body", "world", rail, body, builder);
  addSide(p, "front", 1, depth, builder);
  addSide(p, "back", -1, depth, builder);
  builder.addClosure("pin", ClosureKind::Hinge5D, "lower_end_front", "lower_end_back", kY);
  builder.addContact("foot", "lower_end_front", ContactKind::Point3D, 0, 0);
  Reference standing;
  standing.name = "half_sitting";
  standing.feet["foot"] = kOrigin;
  builder.addReference(standing);
  return builder.build();
}

}  // namespace bielle
