#include "robots/spring_leg.h"

#include <cmath>
#include <optional>

#include "robots/solid.h"

namespace bielle {
namespace {

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
struct Outline {
  Vector3d knee, shin, tarsus, heel;         // O to K, K to T, T to P, T to H
  Vector3d rod_start, rod;                   // on the thigh, and from there to H
  Vector3d crank_pivot, crank, lever, rod2;  // T to C, the crank, P to the end of the lever, the plantar rod
};

// \param side  +1: the rod is rod_offset to the left
Outline makeShape(const std::string& robot, const SpringLegParameters& p, double side) {
  Outline shape;
  shape.knee = p.thigh_length * makeDirection(p.thigh_angle);
  shape.shin = p.shin_length * makeDirection(p.shin_angle);
  shape.rod_start = side * p.rod_offset * kY;
  const Vector3d T = shape.knee + shape.shin;
  const double rod_in_plane = std::sqrt(std::max(0.0, std::pow(p.heel_rod_length, 2) - std::pow(p.rod_offset, 2)));
  const std::optional<Vector3d> H = findMeeting(kOrigin, rod_in_plane, T, p.heel_length);
  if (!H)
    throw InputError(robot, "parameter 'heel_rod_length'", "the rod does not reach the heel in the neutral posture",
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
    throw InputError(robot, "parameter 'plantar_length'",
                     "the plantar rod does not reach from crank to lever in the neutral posture",
                     "change it, crank_place, crank_length, lever_length or lever_angle");
  shape.crank = *E - shape.crank_pivot;
  shape.rod2 = lever_end - *E;
  return shape;
}

// A leg being built.
struct SpringLeg {
  const SpringLegParameters& p;
  const SpringLegMount& mount;
  Outline shape;
  ModelBuilder& builder;

  std::string name(const std::string& part) const { return part + mount.suffix; }
};

Solid makeLegMotor(const Vector3d& place, const Vector3d& axis, double mass) {
  return makeCylinder(place, axis, 0.045, 0.05, mass, colors::kMotor);
}

// A link of `mass` between two points, a share of it in a motor (or joint) at `place`.
std::vector<Solid> makeLimb(const Vector3d& a, const Vector3d& b, double radius, double mass, const Vector3d& place) {
  return {makeRod(a, b, radius, 0.5 * mass / (b - a).norm(), colors::kFrame), makeLegMotor(place, kY, 0.5 * mass)};
}

// The joint of a rod that must not spin: it turns about y and about the axis that is more perpendicular to the rod.
Joint makeRodJoint(const std::string& name, const Vector3d& place, const Vector3d& rod) {
  return makeUniversal(name, place, kY, std::abs(rod.x()) > std::abs(rod.z()) ? kZ : kX);
}

// Roll and yaw over the pitch axis, with the motors of what follows, and the thigh.
void addHip(const SpringLeg& leg) {
  const SpringLegParameters& p = leg.p;
  const Vector3d yaw(-p.yaw_offset, 0, -p.yaw_drop), pitch = -p.pitch_drop * kZ;
  addSolidLink(leg.name("hip_roll_link"), leg.mount.base, makeRevolute(leg.name("hip_roll"), leg.mount.hip, kX),
               {makeRod(kOrigin, yaw, 0.02, 0.3 * p.hip_roll_mass / yaw.norm(), colors::kFrame),
                makeLegMotor(yaw, kZ, 0.7 * p.hip_roll_mass)},
               leg.builder);
  addSolidLink(leg.name("hip_yaw_link"), leg.name("hip_roll_link"), makeRevolute(leg.name("hip_yaw"), yaw, kZ),
               {makeRod(kOrigin, pitch, 0.02, 0.3 * p.hip_yaw_mass / p.pitch_drop, colors::kFrame),
                makeLegMotor(pitch + leg.mount.side * 0.05 * kY, kY, 0.7 * p.hip_yaw_mass)},
               leg.builder);
  const Vector3d& knee = leg.shape.knee;
  addSolidLink(leg.name("thigh"), leg.name("hip_yaw_link"), makeRevolute(leg.name("hip_pitch"), pitch, kY),
               makeLimb(kOrigin, knee, 0.02, p.thigh_mass, knee / 2), leg.builder);
}

// A hinge that a leaf spring holds at neutral.
void addLeaf(const std::string& joint, double stiffness, ModelBuilder& builder) {
  JointForce force;
  force.stiffness = stiffness;
  builder.addJointForce(joint, force);
}

void addShin(const SpringLeg& leg) {
  const SpringLegParameters& p = leg.p;
  const std::string shin = leg.name("shin"), thigh = leg.name("thigh"), spring = leg.name("shin_spring");
  const Joint knee = makeRevolute(leg.name("knee"), leg.shape.knee, kY);
  const std::vector<Solid> solids = makeLimb(kOrigin, leg.shape.shin, 0.015, p.shin_mass, kOrigin);
  if (p.shin_stiffness == 0) return addSolidLink(shin, thigh, knee, solids, leg.builder);
  addSolidLink(leg.name("knee_link"), thigh, knee, {solids.back()}, leg.builder);
  addSolidLink(shin, leg.name("knee_link"), makeRevolute(spring, kOrigin, kY), {solids.front()}, leg.builder);
  addLeaf(spring, p.shin_stiffness, leg.builder);
}

void addTarsus(const SpringLeg& leg) {
  const SpringLegParameters& p = leg.p;
  const Outline& shape = leg.shape;
  const std::string link = leg.name("tarsus_link"), leaf = leg.name("heel_leaf"), spring = leg.name("heel_spring");
  std::vector<Solid> tarsus = makeLimb(kOrigin, shape.tarsus, 0.015, 0.8 * p.tarsus_mass, shape.crank_pivot);
  const Solid heel = makeRod(shape.heel, kOrigin, 0.012, 0.2 * p.tarsus_mass / p.heel_length, colors::kFrame);
  const bool sprung = p.heel_stiffness > 0;
  if (!sprung) tarsus.push_back(heel);
  addSolidLink(link, leg.name("shin"), makeRevolute(leg.name("tarsus"), shape.shin, kY), tarsus, leg.builder);
  if (sprung) {
    addSolidLink(leaf, link, makeRevolute(spring, kOrigin, kY), {heel}, leg.builder);
    addLeaf(spring, p.heel_stiffness, leg.builder);
  }
  leg.builder.addFrame(leg.name("heel"), sprung ? leaf : link, {Matrix3d::Identity(), shape.heel});
}

// Sole and levers; a foot that rolls does so in a cross at the toe's pivot.
void addFoot(const SpringLeg& leg, const std::vector<Vector3d>& levers) {
  const SpringLegParameters& p = leg.p;
  const Vector3d sole(p.sole_offset, 0, -p.ankle_height);
  std::vector<Solid> foot = {
      makeBox(sole + 0.01 * kZ, {p.toe_length, p.toe_width, 0.02}, 0.8 * p.foot_mass, colors::kSole)};
  for (const Vector3d& lever : levers)
    foot.push_back(makeRod(kOrigin, lever, 0.007, 0.2 * p.foot_mass / levers.size() / lever.norm(), colors::kSteel));
  Joint joint = makeRevolute(leg.name("toe_joint"), leg.shape.tarsus, kY);
  std::string base = leg.name("tarsus_link");
  if (leg.mount.toe == SpringLegToe::PitchRoll) {
    addSolidLink(leg.name("toe_cross"), base, joint,
                 {makeCylinder(kOrigin, kY, 0.008, 0.04, p.toe_cross_mass, colors::kSteel)}, leg.builder);
    base = leg.name("toe_cross");
    joint = makeRevolute(leg.name("toe_roll"), kOrigin, kX);
  }
  addSolidLink(leg.name("toe"), base, joint, foot, leg.builder);
  leg.builder.addFrame(leg.name("foot"), leg.name("toe"), {Matrix3d::Identity(), sole});
}

// A crank about y that pulls the toe by a plantar rod, in the plane at `beside` the leg's own.
// \param number  follows the names   \param share  of the masses of cranks and of rods
void addCrank(const SpringLeg& leg, const std::string& number, const Vector3d& beside, double share) {
  const SpringLegParameters& p = leg.p;
  const Outline& shape = leg.shape;
  const bool rolls = leg.mount.toe == SpringLegToe::PitchRoll;
  const auto name = [&](const std::string& part) { return leg.name(part + number); };
  leg.builder.addFrame(name("lever_end"), leg.name("toe"), {Matrix3d::Identity(), shape.lever + beside});
  addSolidLink(
      name("toe_crank"), leg.name("tarsus_link"), makeRevolute(name("motor_toe"), shape.crank_pivot + beside, kY),
      {makeRod(kOrigin, shape.crank, 0.007, share * p.crank_mass / p.crank_length, colors::kSteel)}, leg.builder);
  const Joint joint = rolls ? makeRodJoint(name("plantar_joint"), shape.crank, shape.rod2)
                            : makeRevolute(name("plantar_joint"), shape.crank, kY);
  addSolidLink(name("plantar_rod"), name("toe_crank"), joint,
               {makeRod(kOrigin, shape.rod2, 0.005, share * p.plantar_mass / p.plantar_length, colors::kRod)},
               leg.builder);
  leg.builder.addFrame(name("plantar_end"), name("plantar_rod"), {Matrix3d::Identity(), shape.rod2});
  leg.builder.addClosure(name("plantar"), rolls ? ClosureKind::Ball3D : ClosureKind::Hinge5D, name("lever_end"),
                         name("plantar_end"), rolls ? kZ : kY);
}

void addToe(const SpringLeg& leg) {
  if (leg.mount.toe == SpringLegToe::Pitch) {
    addFoot(leg, {leg.shape.lever});
    return addCrank(leg, "", kOrigin, 1);
  }
  const Vector3d beside = leg.mount.side * leg.p.crank_spread / 2 * kY;
  addFoot(leg, {leg.shape.lever + beside, leg.shape.lever - beside});
  addCrank(leg, "1", beside, 0.5);
  addCrank(leg, "2", -beside, 0.5);
}

}  // namespace

void describeSpringLeg(OptionFields& f, SpringLegParameters& p, const std::string& armature) {
  f.number("thigh_length", p.thigh_length, "m", {0.02, 1}, "distance from the hip pitch axis to the knee");
  f.number("shin_length", p.shin_length, "m", {0.05, 2}, "distance from knee to tarsus joint");
  f.number("tarsus_length", p.tarsus_length, "m", {0.05, 2}, "distance from tarsus joint to toe");
  f.number("heel_length", p.heel_length, "m", {0.02, 1}, "distance from the tarsus joint to the end of the heel rod");
  f.number("heel_bend", p.heel_bend, "rad", {-1, 1}, "angle between the heel and the line of the tarsus");
  f.number("heel_rod_length", p.heel_rod_length, "m", {0.05, 2}, "distance from the hip pitch axis to the heel");
  f.number("rod_offset", p.rod_offset, "m", {-0.2, 0.2}, "distance of the rod's upper end from the plane of the leg");
  f.number("crank_place", p.crank_place, "m", {0.005, 1},
           "distance from the tarsus joint to the pivot of the toe's crank");
  f.number("crank_bend", p.crank_bend, "rad", {-1, 1}, "angle of that pivot behind the line of the tarsus");
  f.number("crank_length", p.crank_length, "m", {0.01, 0.3}, "length of the toe's crank");
  f.number("plantar_length", p.plantar_length, "m", {0.02, 2}, "length of the rod from crank to lever");
  f.number("lever_length", p.lever_length, "m", {0.01, 0.3}, "length of the toe's lever");
  f.number("lever_angle", p.lever_angle, "rad", {-3, 0},
           "angle of the lever from straight down, forward positive, sole level");
  f.number("ankle_height", p.ankle_height, "m", {0.021, 0.3}, "height of the toe's pivot above the sole");
  f.number("sole_offset", p.sole_offset, "m", {-0.2, 0.2}, "distance of the middle of the sole in front of that pivot");
  f.number("toe_length", p.toe_length, "m", {0.02, 0.5}, "length of the sole");
  f.number("toe_width", p.toe_width, "m", {0.005, 0.3}, "width of the sole");
  f.number("yaw_offset", p.yaw_offset, "m", {-0.3, 0.3}, "distance of the yaw axis behind the middle of the roll axis");
  f.number("yaw_drop", p.yaw_drop, "m", {0.01, 0.5}, "distance of the yaw axis' frame below the roll axis");
  f.number("pitch_drop", p.pitch_drop, "m", {0.01, 0.5}, "distance of the pitch axis below that frame");
  f.number("thigh_angle", p.thigh_angle, "rad", {-1.5, 1.5},
           "angle of the thigh from straight down, forward positive, neutral");
  f.number("shin_angle", p.shin_angle, "rad", {-1.5, 1.5}, "angle of the shin, likewise; that of the tarsus follows");
  f.number("hip_roll_mass", p.hip_roll_mass, "kg", {0.01, 20}, "mass of the link after the roll axis");
  f.number("hip_yaw_mass", p.hip_yaw_mass, "kg", {0.01, 20}, "mass of the link after the yaw axis");
  f.number("thigh_mass", p.thigh_mass, "kg", {0.01, 20}, "mass of the thigh with the knee motor");
  f.number("shin_mass", p.shin_mass, "kg", {0.01, 20}, "mass of the shin");
  f.number("tarsus_mass", p.tarsus_mass, "kg", {0.01, 20}, "mass of the tarsus with the toe motor");
  f.number("foot_mass", p.foot_mass, "kg", {0.01, 10}, "mass of the foot");
  f.number("heel_rod_mass", p.heel_rod_mass, "kg", {0.001, 5}, "mass of the heel rod");
  f.number("crank_mass", p.crank_mass, "kg", {0.001, 5}, "mass of the toe's crank");
  f.number("plantar_mass", p.plantar_mass, "kg", {0.001, 5}, "mass of the plantar rod");
  f.number("armature", p.armature, "kg m^2", {0, 1}, armature);
  f.number("shin_stiffness", p.shin_stiffness, "N m/rad", {0, 1e9},
           "stiffness of the leaf spring between knee and shin; 0: rigid");
  f.number("heel_stiffness", p.heel_stiffness, "N m/rad", {0, 1e9},
           "stiffness of the leaf spring between tarsus and heel; 0: rigid");
}

void describe(OptionFields& f, SpringLegParameters& p) {
  describeSpringLeg(f, p, "rotor inertia of every motor, after its gear");
  f.number("carriage_mass", p.carriage_mass, "kg", {0, 100},
           "mass of a carriage on a vertical rail that bears the hip, so that the leg can hop; 0: the hip is fixed");
}

void addSpringLeg(const std::string& robot, const SpringLegParameters& p, const SpringLegMount& mount,
                  ModelBuilder& builder) {
  if (!(p.crank_place < p.tarsus_length))
    throw InputError(robot, "parameter 'crank_place'", "the crank would be beyond the toe",
                     "give less than tarsus_length");
  const SpringLeg leg{p, mount, makeShape(robot, p, mount.side), builder};
  addHip(leg);
  addShin(leg);
  addTarsus(leg);
  addToe(leg);
  const Outline& shape = leg.shape;
  addSolidLink(leg.name("heel_rod"), leg.name("thigh"),
               makeRodJoint(leg.name("heel_rod_joint"), shape.rod_start, shape.rod),
               {makeRod(kOrigin, shape.rod, 0.006, p.heel_rod_mass / p.heel_rod_length, colors::kRod)}, builder);
  builder.addFrame(leg.name("heel_rod_end"), leg.name("heel_rod"), {Matrix3d::Identity(), shape.rod});
  builder.addClosure(leg.name("heel_rod"), ClosureKind::Ball3D, leg.name("heel"), leg.name("heel_rod_end"));
}

Vector3d calcSolePlace(const std::string& robot, const SpringLegParameters& p) {
  const Outline shape = makeShape(robot, p, 1);
  return Vector3d(-p.yaw_offset, 0, -p.yaw_drop - p.pitch_drop) + shape.knee + shape.shin + shape.tarsus +
         Vector3d(p.sole_offset, 0, -p.ankle_height);
}

namespace {

// The carriage, as high as puts the sole on the ground, and how the leg stands.
void addCarriage(const SpringLegParameters& p, ModelBuilder& builder) {
  Joint rail;
  rail.name = "rail";
  rail.kind = JointKind::Prismatic;
  rail.axis = kZ;
  rail.X_PJ.p = -calcSolePlace("spring_leg", p).z() * kZ;
  addSolidLink("carriage", "world", rail, {makeBox(0.06 * kZ, {0.1, 0.1, 0.08}, p.carriage_mass, colors::kShell)},
               builder);
}

void addStand(const SpringLegParameters& p, ModelBuilder& builder) {
  builder.addContact("foot", "foot", ContactKind::Edge5D, p.toe_length / 2, 0);
  Reference standing;
  standing.name = "half_sitting";
  standing.feet["foot"] = calcSolePlace("spring_leg", p).x() * kX;
  for (const char* joint : {"rail", "hip_roll", "hip_yaw", "hip_pitch", "knee"}) standing.joints[joint] = {0};
  builder.addReference(standing);
}

}  // namespace

Model makeSpringLeg(const SpringLegParameters& p) {
  checkParameters("spring_leg", p);
  ModelBuilder builder("spring_leg");
  const bool slides = p.carriage_mass > 0;
  SpringLegMount mount;
  if (slides) {
    mount.base = "carriage";
    addCarriage(p, builder);
  }
  addSpringLeg("spring_leg", p, mount, builder);
  if (slides) addStand(p, builder);
  for (const char* joint : {"hip_roll", "hip_yaw", "hip_pitch", "knee", "motor_toe"})
    builder.addMotor(joint, p.armature);
  for (const char* joint : {"hip_roll", "hip_yaw", "hip_pitch", "knee", "toe_joint"}) builder.addSerialJoint(joint);
  return builder.build();
}

}  // namespace bielle
