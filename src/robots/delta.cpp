#include "robots/delta.h"

#include <cmath>

#include "math/constants.h"
#include "robots/solid.h"

namespace bielle {
namespace {

// Directions and points of one arm, Eqs. (1) and (2); the platform's centre is at -depth z.
struct DeltaArm {
  Vector3d radial, tangent, normal;
  Vector3d motor, elbow, wrist;
};

DeltaArm makeArm(const DeltaParameters& p, int index, double depth) {
  const double azimuth = 2 * kPi * index / 3;
  DeltaArm arm;
  arm.radial = {std::cos(azimuth), std::sin(azimuth), 0};
  arm.tangent = kZ.cross(arm.radial);
  arm.motor = p.base_radius * arm.radial;
  arm.elbow = arm.motor + p.upper_length * (std::cos(p.arm_angle) * arm.radial - std::sin(p.arm_angle) * kZ);
  arm.wrist = p.platform_radius * arm.radial - depth * kZ;
  arm.normal = arm.tangent.cross(arm.wrist - arm.elbow).normalized();
  return arm;
}

// A bar between the rods of a parallelogram, its middle at a point.
Solid makeBar(const DeltaParameters& p, const DeltaArm& arm, const Vector3d& middle) {
  const Vector3d side = p.half_width * arm.tangent;
  return makeRod(middle - side, middle + side, 0.008, p.rod_density, colors::kSteel);
}

// Motor to lower bar; the parallelogram is closed between its second rod and the lower bar.
void addArm(const DeltaParameters& p, const DeltaArm& arm, const std::string& name, ModelBuilder& builder) {
  const Vector3d side = p.half_width * arm.tangent, forearm = arm.wrist - arm.elbow, upper = arm.elbow - arm.motor;
  addSolidLink("upper" + name, "world", makeRevolute("motor" + name, arm.motor, arm.tangent),
               {makeRod(kOrigin, upper, 0.02, 2 * p.rod_density, colors::kMotor)}, builder);
  addSolidLink("upper_bar" + name, "upper" + name, makeRevolute("elbow" + name, upper, arm.tangent),
               {makeBar(p, arm, kOrigin)}, builder);
  for (const char* rod : {"b", "a"}) {
    const Vector3d place = *rod == 'a' ? side : Vector3d(-side);
    addSolidLink("rod" + name + rod, "upper_bar" + name, makeRevolute("swing" + name + rod, place, arm.normal),
                 {makeRod(kOrigin, forearm, 0.008, p.rod_density, colors::kRod)}, builder);
    builder.addFrame("rod_end" + name + rod, "rod" + name + rod, {Matrix3d::Identity(), forearm});
  }
  addSolidLink("lower_bar" + name, "rod" + name + "a", makeRevolute("lower" + name, forearm, arm.normal),
               {makeBar(p, arm, -side)}, builder);
  builder.addFrame("lower_bar_end" + name, "lower_bar" + name, {Matrix3d::Identity(), -2 * side});
  builder.addClosure("parallelogram" + name, ClosureKind::Hinge5D, "lower_bar_end" + name, "rod_end" + name + "b",
                     arm.normal);
  builder.addMotor("motor" + name, p.armature);
}

}  // namespace

void describe(OptionFields& f, DeltaParameters& p) {
  f.number("base_radius", p.base_radius, "m", {0.01, 2}, "distance of the motors from the middle");
  f.number("platform_radius", p.platform_radius, "m", {0.005, 2}, "distance of the platform's joints from its middle");
  f.number("upper_length", p.upper_length, "m", {0.01, 2}, "length of the arms that the motors turn");
  f.number("forearm_length", p.forearm_length, "m", {0.01, 3}, "length of the parallelograms");
  f.number("half_width", p.half_width, "m", {0.005, 0.5}, "half the width of the parallelograms");
  f.number("arm_angle", p.arm_angle, "rad", {-1.5, 1.5}, "angle of the upper arms below the horizontal, neutral");
  f.number("rod_density", p.rod_density, "kg/m", {0.01, 20},
           "mass per length of the rods; the upper arms have twice as much");
  f.number("platform_mass", p.platform_mass, "kg", {0.01, 20}, "mass of the platform");
  f.number("armature", p.armature, "kg m^2", {0, 1}, "rotor inertia of every motor");
}

Model makeDelta(const DeltaParameters& p) {
  checkParameters("delta", p);
  const double reach = p.base_radius + p.upper_length * std::cos(p.arm_angle) - p.platform_radius;
  const double square = p.forearm_length * p.forearm_length - reach * reach;
  if (!(square > 0))
    throw InputError("delta", "parameter 'forearm_length'", "the forearms do not reach the platform",
                     "make them longer, or change arm_angle, base_radius or platform_radius");
  const double depth = p.upper_length * std::sin(p.arm_angle) + std::sqrt(square);

  ModelBuilder builder("delta");
  std::vector<DeltaArm> arms;
  for (int i = 0; i < 3; ++i) arms.push_back(makeArm(p, i, depth));
  Solid plate =
      makeCylinder(-depth * kZ - arms[0].wrist, kZ, p.platform_radius, 0.02, p.platform_mass, colors::kOutput);
  for (int i = 0; i < 3; ++i) {
    const std::string name = std::to_string(i + 1);
    Visual motor;
    motor.shape = Visual::Shape::Cylinder;
    const Solid solid = makeCylinder(arms[i].motor, arms[i].tangent, 0.05, 0.1, 0, colors::kMotor);
    motor.X_BV = solid.X_LS;
    motor.size = solid.size;
    motor.rgba = solid.rgba;
    builder.addVisual("world", motor);
    addArm(p, arms[i], name, builder);
    if (i == 0) {  // the first arm carries the platform
      addSolidLink("platform", "lower_bar1", makeRevolute("wrist1", -p.half_width * arms[0].tangent, arms[0].tangent),
                   {plate}, builder);
      builder.addFrame("effector", "platform", {Matrix3d::Identity(), plate.X_LS.p});
    }
    builder.addFrame("wrist_end" + name, "lower_bar" + name, {Matrix3d::Identity(), -p.half_width * arms[i].tangent});
    if (i == 0) continue;
    builder.addFrame("platform_end" + name, "platform", {Matrix3d::Identity(), arms[i].wrist - arms[0].wrist});
    builder.addClosure("wrist" + name, ClosureKind::Hinge5D, "platform_end" + name, "wrist_end" + name,
                       arms[i].tangent);
  }
  return builder.build();
}

}  // namespace bielle
