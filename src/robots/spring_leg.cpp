#include "robots/spring_leg.h"

#include <cmath>
#include <optional>

#include "robots/solid.h"

namespace bielle {
namespace {

const Vector3d kX = Vector3d::UnitX(), kY = Vector3d::UnitY(), kZ = Vector3d::UnitZ(), kOrigin = Vector3d::Zero();

// d(a) of Eq. (1).
Vector3d makeDirection(double angle) { return {std::sin(angle), 0, -std::cos(angle)}; }

// Intersection of rods from a and b in the plane, behind the line down from a to b.
std::optional<Vector3d> findMeeting(const Vector3d& a, double rod_a, const Vector3d& b, double rod_b) {
  const double span = (b - a).norm(), along = (span * span + rod_a * rod_a - rod_b * rod_b) / (2 * span);
  const double square = rod_a * rod_a - along * along;
  if (!(square > 0)) return std::nullopt;
  const Vector3d way = (b - a) / span;
  return a + along * way + std::sqrt(square) * kY.cross(way);
}

// Points of the neutral configuration relative to their frames, all frames parallel.
struct Shape {
  Vector3d knee, shin, tarsus, heel;         // O to K, K to T, T to P, T to H
  Vector3d rod_start, rod;                   // on the thigh, and from there to H
  Vector3d crank_pivot, crank, lever, rod2;  // T to C, the crank, P to the end of the lever, the plantar rod
};

Shape makeShape(const SpringLegParameters& p) {
  Shape shape;
  shape.knee = p.thigh_length * makeDirection(p.thigh_angle);
  shape.shin = p.shin_length * makeDirection(p.shin_angle);
  shape.rod_start = p.rod_offset * kY;
  const Vector3d T = shape.knee + shape.shin;
  const double rod_in_plane = std::sqrt(std::max(0.0, std::pow(p.heel_rod_length, 2) - std::pow(p.rod_offset, 2)));
  const std::optional<Vector3d> H = findMeeting(kOrigin, rod_in_plane, T, p.heel_length);
  if (!H)
    throw ModelError("spring_leg", "parameter 'heel_rod_length'",
                     "the rod does not reach the heel in the neutral posture",
                     "change it, heel_length, thigh_angle or shin_angle");
  shape.heel = *H - T;
  shape.rod = *H - shape.rod_start;
  const double a3 = std::atan2(-shape.heel.x(), shape.heel.z()) + p.heel_bend;
  shape.tarsus = p.tarsus_length * makeDirection(a3);
  shape.crank_pivot = p.crank_place * makeDirection(a3 - p.crank_bend);
  shape.lever = p.lever_length * makeDirection(p.lever_angle);
  const Vector3d lever_end = shape.tarsus + shape.lever;
  const std::optional<Vector3d> E = findMeeting(shape.crank_pivot, p.crank_length, lever_end, p.plantar_length);
  if (!E)
    throw ModelError("spring_leg", "parameter 'plantar_length'",
                     "the plantar rod does not reach from crank to lever in the neutral posture",
                     "change it, crank_place, crank_length, lever_length or lever_angle");
  shape.crank = *E - shape.crank_pivot;
  shape.rod2 = lever_end - *E;
  return shape;
}

Solid makeMotor(const Vector3d& place, const Vector3d& axis, double mass) {
  return makeCylinder(place, axis, 0.045, 0.05, mass, colors::kMotor);
}

// A link of `mass` between two points, a share of it in a motor (or joint) at `place`.
std::vector<Solid> makeLimb(const Vector3d& a, const Vector3d& b, double radius, double mass, const Vector3d& place) {
  return {makeRod(a, b, radius, 0.5 * mass / (b - a).norm(), colors::kFrame), makeMotor(place, kY, 0.5 * mass)};
}

// Roll and yaw over the pitch axis, with the motors of what follows.
void addHip(const SpringLegParameters& p, ModelBuilder& builder) {
  const Vector3d yaw(-p.yaw_offset, 0, -p.yaw_drop), pitch = -p.pitch_drop * kZ;
  addSolidLink("hip_roll_link", "world", makeRevolute("hip_roll", kOrigin, kX),
               {makeRod(kOrigin, yaw, 0.02, 0.3 * p.hip_roll_mass / yaw.norm(), colors::kFrame),
                makeMotor(yaw, kZ, 0.7 * p.hip_roll_mass)},
               builder);
  addSolidLink("hip_yaw_link", "hip_roll_link", makeRevolute("hip_yaw", yaw, kZ),
               {makeRod(kOrigin, pitch, 0.02, 0.3 * p.hip_yaw_mass / p.pitch_drop, colors::kFrame),
                makeMotor(pitch + 0.05 * kY, kY, 0.7 * p.hip_yaw_mass)},
               builder);
}

// A hinge that a leaf spring holds at neutral.
void addLeaf(const std::string& joint, double stiffness, ModelBuilder& builder) {
  JointForce force;
  force.stiffness = stiffness;
  builder.addJointForce(joint, force);
}

void addShin(const SpringLegParameters& p, const Shape& shape, ModelBuilder& builder) {
  const Joint knee = makeRevolute("knee", shape.knee, kY);
  const std::vector<Solid> solids = makeLimb(kOrigin, shape.shin, 0.015, p.shin_mass, kOrigin);
  if (p.shin_stiffness == 0) return addSolidLink("shin", "thigh", knee, solids, builder);
  addSolidLink("knee_link", "thigh", knee, {solids.back()}, builder);
  addSolidLink("shin", "knee_link", makeRevolute("shin_spring", kOrigin, kY), {solids.front()}, builder);
  addLeaf("shin_spring", p.shin_stiffness, builder);
}

void addTarsus(const SpringLegParameters& p, const Shape& shape, ModelBuilder& builder) {
  std::vector<Solid> tarsus = makeLimb(kOrigin, shape.tarsus, 0.015, 0.8 * p.tarsus_mass, shape.crank_pivot);
  const Solid heel = makeRod(shape.heel, kOrigin, 0.012, 0.2 * p.tarsus_mass / p.heel_length, colors::kFrame);
  const bool sprung = p.heel_stiffness > 0;
  if (!sprung) tarsus.push_back(heel);
  addSolidLink("tarsus_link", "shin", makeRevolute("tarsus", shape.shin, kY), tarsus, builder);
  if (sprung) {
    addSolidLink("heel_leaf", "tarsus_link", makeRevolute("heel_spring", kOrigin, kY), {heel}, builder);
    addLeaf("heel_spring", p.heel_stiffness, builder);
  }
  builder.addFrame("heel", sprung ? "heel_leaf" : "tarsus_link", {Matrix3d::Identity(), shape.heel});
}

// From the toe's crank on the tarsus to its lever.
void addToe(const SpringLegParameters& p, const Shape& shape, ModelBuilder& builder) {
  const Vector3d sole(p.sole_offset, 0, -p.ankle_height);
  addSolidLink("toe", "tarsus_link", makeRevolute("toe_joint", shape.tarsus, kY),
               {makeBox(sole + 0.01 * kZ, {p.toe_length, 0.04, 0.02}, 0.8 * p.foot_mass, colors::kSole),
                makeRod(kOrigin, shape.lever, 0.007, 0.2 * p.foot_mass / p.lever_length, colors::kSteel)},
               builder);
  builder.addFrame("foot", "toe", {Matrix3d::Identity(), sole});
  builder.addFrame("lever_end", "toe", {Matrix3d::Identity(), shape.lever});
  addSolidLink("toe_crank", "tarsus_link", makeRevolute("motor_toe", shape.crank_pivot, kY),
               {makeRod(kOrigin, shape.crank, 0.007, p.crank_mass / p.crank_length, colors::kSteel)}, builder);
  addSolidLink("plantar_rod", "toe_crank", makeRevolute("plantar_joint", shape.crank, kY),
               {makeRod(kOrigin, shape.rod2, 0.005, p.plantar_mass / p.plantar_length, colors::kRod)}, builder);
  builder.addFrame("plantar_end", "plantar_rod", {Matrix3d::Identity(), shape.rod2});
  builder.addClosure("plantar", ClosureKind::Hinge5D, "lever_end", "plantar_end", kY);
}

}  // namespace

std::vector<Parameter> listParameters(SpringLegParameters& p) {
  return {{"thigh_length", &p.thigh_length, "m", 0.02, 1, "hip pitch axis to knee"},
          {"shin_length", &p.shin_length, "m", 0.05, 2, "knee to tarsus joint"},
          {"tarsus_length", &p.tarsus_length, "m", 0.05, 2, "tarsus joint to toe"},
          {"heel_length", &p.heel_length, "m", 0.02, 1, "tarsus joint to the end of the heel rod"},
          {"heel_bend", &p.heel_bend, "rad", -1, 1, "of the heel out of the line of the tarsus"},
          {"heel_rod_length", &p.heel_rod_length, "m", 0.05, 2, "hip pitch axis to heel"},
          {"rod_offset", &p.rod_offset, "m", -0.2, 0.2, "of the rod's upper end beside the plane of the leg"},
          {"crank_place", &p.crank_place, "m", 0.005, 1, "tarsus joint to the pivot of the toe's crank"},
          {"crank_bend", &p.crank_bend, "rad", -1, 1, "of that pivot behind the line of the tarsus"},
          {"crank_length", &p.crank_length, "m", 0.01, 0.3, "of the toe's crank"},
          {"plantar_length", &p.plantar_length, "m", 0.02, 2, "of the rod from crank to lever"},
          {"lever_length", &p.lever_length, "m", 0.01, 0.3, "of the toe's lever"},
          {"lever_angle", &p.lever_angle, "rad", -3, 0, "from straight down, forward positive, sole level"},
          {"ankle_height", &p.ankle_height, "m", 0.021, 0.3, "of the toe's pivot over the sole"},
          {"sole_offset", &p.sole_offset, "m", -0.2, 0.2, "of the middle of the sole before that pivot"},
          {"toe_length", &p.toe_length, "m", 0.02, 0.5, "of the sole"},
          {"yaw_offset", &p.yaw_offset, "m", -0.3, 0.3, "of the yaw axis behind the middle of the roll axis"},
          {"yaw_drop", &p.yaw_drop, "m", 0.01, 0.5, "of the frame of the yaw axis under the roll axis"},
          {"pitch_drop", &p.pitch_drop, "m", 0.01, 0.5, "of the pitch axis under that frame"},
          {"thigh_angle", &p.thigh_angle, "rad", -1.5, 1.5, "from straight down, forward positive, neutral"},
          {"shin_angle", &p.shin_angle, "rad", -1.5, 1.5, "likewise; that of the tarsus follows"},
          {"hip_roll_mass", &p.hip_roll_mass, "kg", 0.01, 20, "of the link behind the roll axis"},
          {"hip_yaw_mass", &p.hip_yaw_mass, "kg", 0.01, 20, "of the link behind the yaw axis"},
          {"thigh_mass", &p.thigh_mass, "kg", 0.01, 20, "with the motor of the knee"},
          {"shin_mass", &p.shin_mass, "kg", 0.01, 20, "of the shin"},
          {"tarsus_mass", &p.tarsus_mass, "kg", 0.01, 20, "with the motor of the toe"},
          {"foot_mass", &p.foot_mass, "kg", 0.01, 10, "of the foot"},
          {"heel_rod_mass", &p.heel_rod_mass, "kg", 0.001, 5, "of the heel rod"},
          {"crank_mass", &p.crank_mass, "kg", 0.001, 5, "of the toe's crank"},
          {"plantar_mass", &p.plantar_mass, "kg", 0.001, 5, "of the plantar rod"},
          {"armature", &p.armature, "kg m^2", 0, 1, "rotor inertia of every motor, behind its gear"},
          {"shin_stiffness", &p.shin_stiffness, "N m/rad", 0, 1e9, "of the leaf between knee and shin, 0: rigid"},
          {"heel_stiffness", &p.heel_stiffness, "N m/rad", 0, 1e9, "of the leaf between tarsus and heel, 0: rigid"}};
}

Model makeSpringLeg(const SpringLegParameters& parameters) {
  SpringLegParameters p = parameters;
  checkParameters("spring_leg", listParameters(p));
  if (!(p.crank_place < p.tarsus_length))
    throw ModelError("spring_leg", "parameter 'crank_place'", "the crank would sit beyond the toe",
                     "give less than tarsus_length");
  const Shape shape = makeShape(p);
  ModelBuilder builder("spring_leg");
  addHip(p, builder);
  addSolidLink("thigh", "hip_yaw_link", makeRevolute("hip_pitch", -p.pitch_drop * kZ, kY),
               makeLimb(kOrigin, shape.knee, 0.02, p.thigh_mass, shape.knee / 2), builder);
  addShin(p, shape, builder);
  addTarsus(p, shape, builder);
  addToe(p, shape, builder);
  // The rod must not spin: its universal joint turns about y and about the axis that is more perpendicular to the rod.
  const Vector3d second = std::abs(shape.rod.x()) > std::abs(shape.rod.z()) ? kZ : kX;
  addSolidLink("heel_rod", "thigh", makeUniversal("heel_rod_joint", shape.rod_start, kY, second),
               {makeRod(kOrigin, shape.rod, 0.006, p.heel_rod_mass / p.heel_rod_length, colors::kRod)}, builder);
  builder.addFrame("heel_rod_end", "heel_rod", {Matrix3d::Identity(), shape.rod});
  builder.addClosure("heel_rod", ClosureKind::Ball3D, "heel", "heel_rod_end");
  for (const char* joint : {"hip_roll", "hip_yaw", "hip_pitch", "knee", "motor_toe"})
    builder.addMotor(joint, p.armature);
  for (const char* joint : {"hip_roll", "hip_yaw", "hip_pitch", "knee", "toe_joint"}) builder.addSerialJoint(joint);
  return builder.build();
}

}  // namespace bielle
