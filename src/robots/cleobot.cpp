#include "robots/cleobot.h"

#include <cmath>

#include "math/constants.h"
#include "robots/biped_parts.h"

namespace bielle {
namespace {

// One side of the robot.
struct Side : BipedSide {
  const CleobotParameters& p;

  Vector3d hip() const { return mirror(0, p.hip_offset, -p.trunk_height); }  // in the trunk
};

// Limb of the lower leg, Eqs. (1), (2), in the frame of the thigh.
struct Limb {
  std::string name;                                      // "1_left"
  Vector3d base, ball;                                   // b, s
  Vector3d knee;                                         // at the neutral configuration
  Vector3d direction;                                    // d
  Vector3d axis() const { return direction.cross(kZ); }  // a positive rotation moves the links below towards d
};

Limb makeLimb(const Side& side, int index) {
  const CleobotParameters& p = side.p;
  const double sign = index == 3 ? -side.s : side.s;
  const double place = index == 1 ? kPi : sign * p.base_angle, heading = index == 1 ? kPi : sign * p.limb_heading;
  Limb limb;
  limb.name = std::to_string(index) + side.name;
  limb.direction = {std::cos(heading), std::sin(heading), 0};
  limb.base = p.base_radius * Vector3d(std::cos(place), std::sin(place), 0) - p.thigh_length * kZ;
  const double height = p.hip_height - p.thigh_length - p.ankle_height;
  limb.ball = limb.base - p.platform_inset * limb.direction - height * kZ;
  // The knee by the law of cosines, on the side of d.
  const double span = (limb.ball - limb.base).norm(), l1 = p.upper_length, l2 = p.shank_length;
  const double along = (span * span + l1 * l1 - l2 * l2) / (2 * span), square = l1 * l1 - along * along;
  if (!(height > 0 && square > 0))
    throw InputError("cleobot", "limb " + std::to_string(index),
                     "its upper rod and its shank do not meet when the robot stands, or the thigh is under the foot",
                     "change hip_height, thigh_length, ankle_height, upper_length or shank_length");
  const Vector3d down = (limb.ball - limb.base) / span;
  limb.knee =
      limb.base + along * down + std::sqrt(square) * (limb.direction - limb.direction.dot(down) * down).normalized();
  return limb;
}

// Chain of the hip, Eqs. (3), (4), in the frame of the trunk.
CrankChain makeHipChain(const Side& side, int index) {
  const CleobotParameters& p = side.p;
  CrankChain chain;
  chain.name = "hip" + std::to_string(index) + side.name;
  if (index == 3) {
    chain.end = side.hip() + side.mirror(0, p.yaw_arm, 0);
    chain.elbow = chain.end + p.yaw_rod * kX;
    chain.motor = chain.elbow + p.yaw_crank * kZ;
    chain.axis2 = kZ;
  } else {
    chain.end = side.hip() + side.mirror(-p.hip_arm, index == 1 ? p.hip_half_width : -p.hip_half_width, 0);
    chain.elbow = chain.end + p.hip_rod * kZ;
    chain.motor = chain.elbow + p.hip_crank * kX;
    chain.axis2 = kX;
  }
  return chain;
}

std::vector<Solid> makeThigh(const Side& side) {
  const CleobotParameters& p = side.p;
  const Vector3d under = -p.thigh_length * kZ;
  std::vector<Solid> solids = {makeSphere(Vector3d::Zero(), 0.022, 0.25 * p.thigh_mass, colors::kSteel),
                               makeCylinder(under / 2, kZ, 0.018, p.thigh_length, 0.25 * p.thigh_mass, colors::kFrame)};
  for (int i = 1; i <= 3; ++i) {
    const Vector3d end = makeHipChain(side, i).end - side.hip();
    solids.push_back(makeCylinder(end / 2, end, 0.009, end.norm(), p.thigh_mass / 12, colors::kFrame));
    const Limb limb = makeLimb(side, i);
    const Vector3d spoke = limb.base - under;
    solids.push_back(makeCylinder(under + spoke / 2, spoke, 0.012, spoke.norm(), p.thigh_mass / 12, colors::kFrame));
    solids.push_back(makeMotor(limb.base, limb.axis(), p.leg_motor_mass));
  }
  return solids;
}

// Motor to knee and knee to ball.
void addLimb(const Side& side, const Limb& limb, ModelBuilder& builder) {
  const CleobotParameters& p = side.p;
  const Vector3d to_knee = limb.knee - limb.base, to_ball = limb.ball - limb.knee;
  addSolidLink("upper" + limb.name, "thigh" + side.name, makeRevolute("motor_leg" + limb.name, limb.base, limb.axis()),
               {makeRod(Vector3d::Zero(), to_knee, 0.016, p.limb_density, colors::kFrame)}, builder);
  addSolidLink("shank" + limb.name, "upper" + limb.name, makeRevolute("knee" + limb.name, to_knee, limb.axis()),
               {makeRod(Vector3d::Zero(), to_ball, 0.013, p.limb_density, colors::kOutput)}, builder);
  builder.addFrame("shank_end" + limb.name, "shank" + limb.name, {Matrix3d::Identity(), to_ball});
}

// The foot hangs on the first limb; its frame is the first ball.
void addFoot(const Side& side, const std::vector<Limb>& limbs, ModelBuilder& builder) {
  const CleobotParameters& p = side.p;
  const Vector3d origin = limbs[0].ball;
  const Vector3d sole = Vector3d(0, 0, -p.hip_height) - origin;  // right under the hip
  std::vector<Solid> solids = {
      makeBox(sole + Vector3d(0, 0, 0.01), {p.sole_length, p.sole_width, 0.02}, 0.7 * p.foot_mass, colors::kSole)};
  for (const Limb& limb : limbs) {
    const Vector3d top = limb.ball - origin;
    const Vector3d bottom(0.8 * (top.x() - sole.x()) + sole.x(), 0.6 * top.y(), sole.z() + 0.02);
    solids.push_back(makeCylinder((top + bottom) / 2, top - bottom, 0.009, (top - bottom).norm(), 0.1 * p.foot_mass,
                                  colors::kSteel));
  }
  const Joint ball = makeSpherical("ankle1" + side.name, origin - limbs[0].knee);
  addSolidLink("foot_link" + side.name, "shank" + limbs[0].name, ball, solids, builder);
  addSole(side, sole, p.sole_length, p.sole_width, builder);
  for (int i = 1; i < 3; ++i)
    builder.addFrame("ankle" + limbs[i].name, "foot_link" + side.name, {Matrix3d::Identity(), limbs[i].ball - origin});
}

void addLeg(const Side& side, ModelBuilder& builder) {
  const CleobotParameters& p = side.p;
  for (int i = 1; i <= 3; ++i) addCrankChain(makeHipChain(side, i), "trunk", p.rod_density, p.armature, builder);
  addSolidLink("thigh" + side.name, "trunk", makeSpherical("hip" + side.name, side.hip()), makeThigh(side), builder);
  std::vector<Limb> limbs;
  for (int i = 1; i <= 3; ++i) limbs.push_back(makeLimb(side, i));
  addLimb(side, limbs[0], builder);
  addFoot(side, limbs, builder);
  for (int i = 1; i < 3; ++i) addLimb(side, limbs[i], builder);

  for (int i = 1; i <= 3; ++i) {
    const CrankChain chain = makeHipChain(side, i);
    builder.addFrame("thigh_end_" + chain.name, "thigh" + side.name, {Matrix3d::Identity(), chain.end - side.hip()});
    builder.addClosure(chain.name, ClosureKind::Ball3D, "thigh_end_" + chain.name, "rod_end_" + chain.name);
  }
  for (int i = 1; i < 3; ++i)
    builder.addClosure("ankle" + limbs[i].name, ClosureKind::Ball3D, "ankle" + limbs[i].name,
                       "shank_end" + limbs[i].name);
  for (const Limb& limb : limbs) builder.addMotor("motor_leg" + limb.name, p.armature);
}

std::vector<Solid> makeTrunk(const std::vector<Side>& sides) {
  const CleobotParameters& p = sides.front().p;
  std::vector<Solid> solids = {makeBox({-0.035, 0, 0.15}, {0.13, 0.22, 0.20}, 0.70 * p.trunk_mass, colors::kShell),
                               makeBox({0.01, 0, 0.045}, {0.10, 0.34, 0.02}, 0.2 * p.trunk_mass, colors::kSteel),
                               makeSphere({-0.02, 0, 0.30}, 0.055, 0.05 * p.trunk_mass, colors::kShell)};
  for (const Side& side : sides) {
    // Carries the ball of the hip and the motor of the yaw chain.
    const Vector3d yaw_motor = makeHipChain(side, 3).motor, plate(0, side.hip().y(), 0.04);
    for (const Vector3d& end : {side.hip(), yaw_motor})
      solids.push_back(makeCylinder((plate + end) / 2, end - plate, 0.012, (end - plate).norm(), 0.0125 * p.trunk_mass,
                                    colors::kSteel));
    for (int i = 1; i <= 3; ++i) solids.push_back(makeMotor(makeHipChain(side, i).motor, kY, p.hip_motor_mass));
  }
  return solids;
}

}  // namespace

void describe(OptionFields& f, CleobotParameters& p) {
  f.number("hip_height", p.hip_height, "m", {0.2, 1.5}, "height of the hips above the soles, standing");
  f.number("hip_offset", p.hip_offset, "m", {0.05, 0.4}, "distance of a hip from the middle plane");
  f.number("trunk_height", p.trunk_height, "m", {0, 0.5}, "height of the trunk's frame above the hips");
  f.number("hip_arm", p.hip_arm, "m", {0.02, 0.2}, "lever arm of the vertical hip rods about the pitch axis");
  f.number("hip_half_width", p.hip_half_width, "m", {0.02, 0.2},
           "lever arm of the vertical hip rods about the roll axis");
  f.number("hip_rod", p.hip_rod, "m", {0.03, 0.5}, "length of the vertical hip rods");
  f.number("hip_crank", p.hip_crank, "m", {0.02, 0.3}, "length of their cranks");
  f.number("yaw_arm", p.yaw_arm, "m", {0.02, 0.2}, "lever arm of the horizontal hip rod about the yaw axis");
  f.number("yaw_rod", p.yaw_rod, "m", {0.03, 0.5}, "length of the horizontal hip rod");
  f.number("yaw_crank", p.yaw_crank, "m", {0.02, 0.3}, "length of its crank");
  f.number("thigh_length", p.thigh_length, "m", {0.02, 0.5},
           "distance from the hip down to the motors of the lower leg");
  f.number("base_radius", p.base_radius, "m", {0.02, 0.3}, "distance of these motors from the axis of the thigh");
  f.number("base_angle", p.base_angle, "rad", {0.2, 1.4}, "angle of the front motors from the middle plane of the leg");
  f.number("limb_heading", p.limb_heading, "rad", {0.1, 1.4}, "heading of the planes of the front limbs");
  f.number("upper_length", p.upper_length, "m", {0.05, 1}, "distance from motor to knee");
  f.number("shank_length", p.shank_length, "m", {0.05, 1}, "distance from knee to ball");
  f.number("platform_inset", p.platform_inset, "m", {-0.2, 0.2},
           "inward distance of the foot's balls from the points below the motors");
  f.number("ankle_height", p.ankle_height, "m", {0.03, 0.3}, "height of the balls above the sole");
  f.number("sole_length", p.sole_length, "m", {0.02, 0.5}, "length of the sole, along x");
  f.number("sole_width", p.sole_width, "m", {0.02, 0.3}, "width of the sole, along y");
  f.number("trunk_mass", p.trunk_mass, "kg", {0.1, 100}, "mass of the trunk without motors");
  f.number("hip_motor_mass", p.hip_motor_mass, "kg", {0.01, 10}, "mass of each motor on the trunk");
  f.number("leg_motor_mass", p.leg_motor_mass, "kg", {0.01, 10}, "mass of each motor on the thigh");
  f.number("thigh_mass", p.thigh_mass, "kg", {0.01, 20}, "mass of the thigh without motors");
  f.number("limb_density", p.limb_density, "kg/m", {0.01, 20}, "mass per length of upper rods and shanks");
  f.number("rod_density", p.rod_density, "kg/m", {0.01, 20}, "mass per length of the rods and cranks of the hip");
  f.number("foot_mass", p.foot_mass, "kg", {0.01, 10}, "mass of one foot");
  f.number("armature", p.armature, "kg m^2", {0, 1}, "rotor inertia of every motor");
}

Model makeCleobot(const CleobotParameters& p) {
  checkParameters("cleobot", p);
  const std::vector<Side> sides = {{{1, "_left"}, p}, {{-1, "_right"}, p}};
  ModelBuilder builder("cleobot");
  addTrunk(makeTrunk(sides), builder);
  for (const Side& side : sides) addLeg(side, builder);
  builder.addReference(makeStanding(p.hip_offset, p.hip_height + p.trunk_height));
  return builder.build();
}

}  // namespace bielle
