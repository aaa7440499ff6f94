#include "robots/kangaroo.h"

#include <cmath>
#include <limits>

namespace bielle {
namespace {

// A motor that holds 0.25 N m with 1 W of heat, behind a screw of 10 mm per turn: W/N^2.
constexpr double kForceLoss = 4e-5;
constexpr double kRodRadius = 0.006, kPairGap = 0.012, kGuideGap = 0.025;  // m

SE3 makePlace(const Vector3d& p) { return {Matrix3d::Identity(), p}; }

// A closure between points of two links.
struct Tie {
  std::string name;
  ClosureKind kind;
  std::string link1, link2;
  Vector3d place1, place2;
  Vector3d axis = kZ;
};

// A leg being built. Links are added as a reader of files finds them, children in the order of their names; closures follow
// when all are there.
struct KangarooLeg : BipedSide {
  KangarooLeg(const KangarooParameters& parameters, double side, ModelBuilder& model_builder)
      : BipedSide{side, side > 0 ? "_left" : "_right"}, p(parameters), builder(model_builder) {}

  std::string link(const std::string& part) const { return part + name; }
  void close() {
    for (const Tie& tie : ties) {
      builder.addFrame(tie.name + "_pin", tie.link1, makePlace(tie.place1));
      builder.addFrame(tie.name + "_end", tie.link2, makePlace(tie.place2));
      builder.addClosure(tie.name, tie.kind, tie.name + "_pin", tie.name + "_end", tie.axis);
    }
    ties.clear();
  }

  const KangarooParameters& p;
  ModelBuilder& builder;
  std::vector<Tie> ties;
};

// A ball screw from `start` to `tip`, points of its base link; the tip on another link.
struct Screw {
  std::string name;  // of links "NAME_tube", "NAME_rod", of the guide "NAME_guide", and of "motor_NAME"
  std::string base, tip_link;
  Vector3d start, tip, tip_place;
  bool guided = false;
};

Joint makeSlide(const std::string& name, const Vector3d& place, const Vector3d& way) {
  Joint slide;
  slide.name = name;
  slide.kind = JointKind::Prismatic;
  slide.axis = way.normalized();
  slide.X_PJ.p = place;
  return slide;
}

// The tube, turned by `mount`, the rod that slides in it, and the motor; a guide is a second slide, welded to the rod.
void addScrew(KangarooLeg& leg, const Screw& screw, const Joint& mount, ClosureKind end, const Vector3d& axis) {
  const KangarooParameters& p = leg.p;
  const Vector3d way = screw.tip - screw.start, beside = -leg.s * kGuideGap * kY;
  const std::string tube = screw.name + "_tube", rod = screw.name + "_rod", guide = screw.name + "_guide";
  addSolidLink(tube, screw.base, mount,
               {makeCylinder(0.2 * way, way, 0.022, 0.3 * way.norm(), p.motor_mass, colors::kMotor),
                makeRod(0.35 * way, 0.6 * way, 0.012, 2 * p.rod_density, colors::kFrame)},
               leg.builder);
  if (screw.guided)
    addSolidLink(guide, tube, makeSlide(guide + "_slide", way / 2 + beside, way),
                 {makeRod(-0.1 * way, 0.4 * way, 0.004, p.rod_density, colors::kSteel),
                  makeRod(0.4 * way, 0.4 * way - beside, 0.004, p.rod_density, colors::kSteel)},
                 leg.builder);
  addSolidLink(rod, tube, makeSlide("motor_" + screw.name, way / 2, way),
               {makeRod(-0.2 * way, 0.5 * way, kRodRadius, 2 * p.rod_density, colors::kSteel)}, leg.builder);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  leg.builder.addMotor("motor_" + screw.name, p.armature, kInfinity, kInfinity, kForceLoss);
  leg.ties.push_back({screw.name, end, screw.tip_link, rod, screw.tip_place, way / 2, axis});
  if (screw.guided) leg.ties.push_back({guide, ClosureKind::Weld6D, rod, guide, 0.4 * way, 0.4 * way - beside});
}

// In a plane: hinges about `axis` at both ends.
void addPlanarScrew(KangarooLeg& leg, const Screw& screw, const Vector3d& axis) {
  addScrew(leg, screw, makeRevolute(screw.name + "_hinge", screw.start, axis), ClosureKind::Hinge5D, axis);
}

// Two rods beside each other from `start` on one link to `end` on another; `way` from there to here, neutral.
void addRodPair(KangarooLeg& leg, const std::string& name, const std::string& upper, const Vector3d& start,
                const std::string& lower, const Vector3d& end, const Vector3d& way) {
  for (const auto& [suffix, side] : {std::pair<const char*, double>{"1", leg.s}, {"2", -leg.s}}) {
    const Vector3d beside = side * kPairGap * kY;
    const std::string rod = leg.link(name + suffix);
    addSolidLink(rod, upper, makeRevolute(rod + "_hinge", start + beside, kY),
                 {makeRod(kOrigin, way, kRodRadius, leg.p.rod_density, colors::kRod)}, leg.builder);
    leg.ties.push_back({rod, ClosureKind::Hinge5D, lower, rod, end + beside, way, kY});
  }
}

// Yaw and roll links with the hip screws between them and the thigh.
void addHip(KangarooLeg& leg, const Vector3d& hip) {
  const KangarooParameters& p = leg.p;
  const Vector3d arm = leg.s * p.yaw_arm * kY, plate(p.hip_screw_place, 0, p.hip_screw_top);
  const Vector3d fork(p.hip_screw_place, 0, -p.hip_screw_drop);
  addSolidLink(leg.link("hip_yaw"), "trunk", makeRevolute(leg.link("hipz"), hip, kZ),
               {makeRod(kOrigin, arm, 0.012, 0.3 * p.hip_link_mass / p.yaw_arm, colors::kFrame),
                makeRod(kOrigin, plate, 0.015, 0.7 * p.hip_link_mass / plate.norm(), colors::kFrame)},
               leg.builder);
  for (const auto& [suffix, side] : {std::pair<const char*, double>{"hip1", leg.s}, {"hip2", -leg.s}}) {
    const Vector3d beside = side * p.hip_screw_width * kY;
    const Screw screw{leg.link(suffix), leg.link("hip_yaw"), leg.link("thigh"),
                      plate + beside,   fork + beside,       fork + beside};
    addScrew(leg, screw, makeUniversal(screw.name + "_joint", screw.start, kY, kX), ClosureKind::Ball3D, kZ);
  }
  addSolidLink(leg.link("hip_roll"), leg.link("hip_yaw"), makeRevolute(leg.link("hipx"), kOrigin, kX),
               {makeCylinder(kOrigin, kX, 0.012, 0.06, 0.3 * p.hip_link_mass, colors::kSteel)}, leg.builder);
  addSolidLink(leg.link("thigh"), leg.link("hip_roll"), makeRevolute(leg.link("hipy"), kOrigin, kY),
               {makeRod(kOrigin, -p.thigh_length * kZ, 0.022, p.link_density, colors::kFrame),
                makeRod(fork.z() * kZ, fork, 0.012, p.link_density, colors::kFrame)},
               leg.builder);
}

void addYaw(KangarooLeg& leg, const Vector3d& hip) {
  const Vector3d arm = leg.s * leg.p.yaw_arm * kY;
  addPlanarScrew(leg, {leg.link("yaw"), "trunk", leg.link("hip_yaw"), hip + arm - leg.p.yaw_screw * kX, hip + arm, arm},
                 kZ);
  leg.close();
}

void addKnee(KangarooLeg& leg) {
  const KangarooParameters& p = leg.p;
  const Vector3d knee = -p.thigh_length * kZ, pivot = knee + p.knee_crank_height * kZ;
  const Vector3d arm = p.knee_arm * Vector3d(-std::cos(p.knee_angle), 0, -std::sin(p.knee_angle));
  const std::string crank = leg.link("knee_crank"), shank = leg.link("shank");
  addSolidLink(crank, leg.link("thigh"), makeRevolute(crank + "_hinge", pivot, kY),
               {makeRod(arm, -arm, 0.010, 2 * p.rod_density, colors::kSteel)}, leg.builder);
  addRodPair(leg, "knee_rod", crank, arm, shank, arm, -p.knee_crank_height * kZ);
  const Vector3d start(-arm.x(), 0, -p.knee_screw_drop);
  addPlanarScrew(leg, {leg.link("knee_screw"), leg.link("thigh"), crank, start, pivot - arm, -arm, true}, kY);
  addSolidLink(shank, leg.link("thigh"), makeRevolute(leg.link("knee"), knee, kY),
               {makeRod(kOrigin, -p.shank_length * kZ, 0.016, p.link_density, colors::kOutput),
                makeRod(kOrigin, arm, 0.010, p.link_density, colors::kOutput)},
               leg.builder);
}

void addFoot(KangarooLeg& leg) {
  const KangarooParameters& p = leg.p;
  addSolidLink(leg.link("ankle_cross"), leg.link("shank"), makeRevolute(leg.link("ankley"), -p.shank_length * kZ, kY),
               {makeCylinder(kOrigin, kY, 0.008, 0.05, 0.1, colors::kSteel)}, leg.builder);
  std::vector<Solid> solids = makeFoot(p);
  const Vector3d root(p.sole_offset - 0.4 * p.sole_length, 0, 0.02 - p.ankle_height);
  for (double side : {1.0, -1.0}) {
    const Vector3d heel(-p.ankle_arm * std::cos(p.ankle_angle), side * p.ankle_half_width,
                        p.ankle_arm * std::sin(p.ankle_angle));
    solids.push_back(makeRod(root, heel, 0.009, 0.15 * p.foot_mass / (heel - root).norm(), colors::kSteel));
  }
  addSolidLink(leg.link("foot_link"), leg.link("ankle_cross"), makeRevolute(leg.link("anklex"), kOrigin, kX), solids,
               leg.builder);
}

// Foot, screws, lower cranks with their links, upper cranks with their rods; index 1 outer, 2 inner.
void addAnkle(KangarooLeg& leg) {
  const KangarooParameters& p = leg.p;
  addFoot(leg);
  const Vector3d ankle = -p.shank_length * kZ;
  const Vector3d arm = p.ankle_arm * Vector3d(-std::cos(p.ankle_angle), 0, std::sin(p.ankle_angle));
  const Vector3d upper = ankle + p.upper_crank_height * kZ, lower = ankle + p.lower_crank_height * kZ;
  const std::string shank = leg.link("shank"), numbers[] = {"1", "2"};
  const auto getSide = [&](int i) { return Vector3d((i == 0 ? leg.s : -leg.s) * p.ankle_half_width * kY); };
  for (int i : {0, 1})
    addPlanarScrew(leg,
                   {leg.link("ankle_screw" + numbers[i]), shank, leg.link("upper_crank" + numbers[i]),
                    getSide(i) - arm.x() * kX, upper + getSide(i) - arm, -arm, true},
                   kY);
  for (int i : {0, 1}) {
    const std::string crank = leg.link("lower_crank" + numbers[i]), link = leg.link("ankle_link" + numbers[i]);
    const Vector3d way = -p.lower_crank_height * kZ;
    addSolidLink(crank, shank, makeRevolute(crank + "_hinge", lower + getSide(i), kY),
                 {makeRod(kOrigin, arm, 0.009, p.rod_density, colors::kSteel)}, leg.builder);
    addSolidLink(link, crank, makeUniversal(link + "_joint", arm, kY, kX),
                 {makeRod(kOrigin, way, kRodRadius, p.rod_density, colors::kRod)}, leg.builder);
    leg.ties.push_back({link, ClosureKind::Ball3D, leg.link("foot_link"), link, arm + getSide(i), way});
  }
  for (int i : {0, 1}) {
    const std::string crank = leg.link("upper_crank" + numbers[i]);
    addSolidLink(crank, shank, makeRevolute(crank + "_hinge", upper + getSide(i), kY),
                 {makeRod(arm, -arm, 0.009, p.rod_density, colors::kSteel)}, leg.builder);
    addRodPair(leg, "ankle_rod" + numbers[i], crank, arm, leg.link("lower_crank" + numbers[i]), arm, lower - upper);
  }
}

void addLeg(KangarooLeg& leg, const Vector3d& hip) {
  const KangarooParameters& p = leg.p;
  addHip(leg, hip);
  addKnee(leg);
  addAnkle(leg);
  leg.close();
  for (const char* joint : {"hipz", "hipx", "hipy", "knee", "ankley", "anklex"})
    leg.builder.addSerialJoint(leg.link(joint));
  addSole(leg, {p.sole_offset, 0, -p.ankle_height}, p.sole_length, p.sole_width, leg.builder);
}

void check(const std::string& robot, const KangarooParameters& p) {
  checkParameters(robot, p);
  if (!(p.lower_crank_height < p.upper_crank_height && p.upper_crank_height + p.ankle_arm < p.shank_length))
    throw InputError(robot, "parameter 'upper_crank_height'", "the upper cranks are not between lower cranks and knee",
                     "give more than lower_crank_height, and less than shank_length without ankle_arm");
  if (!(p.knee_screw_drop + p.knee_crank_height + p.knee_arm < p.thigh_length))
    throw InputError(robot, "parameter 'knee_screw_drop'", "the thigh has no room for the knee screw",
                     "make the sum of it, knee_crank_height and knee_arm less than thigh_length");
}

// Columns, drawn but without mass, carry the shell and the plate over the yaw links.
std::vector<Solid> makeTrunk(const KangarooParameters& p, const std::vector<Vector3d>& hips) {
  const double plate = -p.trunk_height + p.hip_screw_top + 0.03;
  std::vector<Solid> solids = {makeBox({-0.02, 0, 0.12}, {0.16, 0.26, 0.30}, 0.75 * p.trunk_mass, colors::kShell),
                               makeBox({-0.05, 0, plate}, {0.16, 0.26, 0.02}, 0.2 * p.trunk_mass, colors::kSteel),
                               makeSphere({0, 0, 0.33}, 0.06, 0.05 * p.trunk_mass, colors::kShell)};
  for (const Vector3d& hip : hips)
    solids.push_back(makeRod(hip + 0.045 * kZ, Vector3d(hip.x(), hip.y(), 0), 0.018, 0, colors::kSteel));
  return solids;
}

}  // namespace

KangarooParameters::KangarooParameters() {
  hip_offset = 0.1;
  trunk_height = 0.25;
  thigh_length = shank_length = 0.38;
  ankle_height = 0.06;
  hip_height = 0.74;
  sole_length = 0.2;
  sole_width = 0.1;
  sole_offset = 0.03;
  trunk_mass = 16;
  motor_mass = 0.9;
  hip_link_mass = 1.2;
  link_density = 2.5;
  foot_mass = 0.9;
  armature = 8;
}

void describe(OptionFields& f, KangarooParameters& p) {
  f.omit({"armature"});
  describeSerial(f, p);
  f.omit({});
  f.number("armature", p.armature, "kg", {0, 1000},
           "rotor inertia of every motor, reflected to its screw: (2 pi / lead)^2 J");
  f.number("yaw_arm", p.yaw_arm, "m", {0.02, 0.2}, "distance of the yaw link from its axis");
  f.number("yaw_screw", p.yaw_screw, "m", {0.05, 0.5}, "length of the yaw screw, neutral");
  f.number("hip_screw_place", p.hip_screw_place, "m", {0.02, 0.3}, "distance of the hip screws in front of the hip");
  f.number("hip_screw_width", p.hip_screw_width, "m", {0.01, 0.2},
           "sideways distance of the hip screws from the middle of the thigh");
  f.number("hip_screw_top", p.hip_screw_top, "m", {0.02, 0.5}, "height of their upper ends above the hip");
  f.number("hip_screw_drop", p.hip_screw_drop, "m", {0.02, 0.5}, "distance of their lower ends below the hip");
  f.number("knee_arm", p.knee_arm, "m", {0.01, 0.2}, "lever arms of bell crank and shank");
  f.number("knee_angle", p.knee_angle, "rad", {-1.2, 1.2}, "angle of these arms below the horizontal, legs straight");
  f.number("knee_crank_height", p.knee_crank_height, "m", {0.02, 0.5}, "height of the bell crank above the knee");
  f.number("knee_screw_drop", p.knee_screw_drop, "m", {0, 0.5}, "distance of the knee screw's upper end below the hip");
  f.number("ankle_arm", p.ankle_arm, "m", {0.01, 0.2}, "length of the cranks of ankle and heel");
  f.number("ankle_angle", p.ankle_angle, "rad", {-1.2, 1.2}, "angle of these arms above the horizontal, legs straight");
  f.number("ankle_half_width", p.ankle_half_width, "m", {0.01, 0.2}, "sideways distance of the links from the ankle");
  f.number("upper_crank_height", p.upper_crank_height, "m", {0.03, 0.9}, "height of the upper cranks above the ankle");
  f.number("lower_crank_height", p.lower_crank_height, "m", {0.02, 0.9}, "height of the lower cranks above the ankle");
  f.number("rod_density", p.rod_density, "kg/m", {0.01, 20},
           "mass per length of rods and cranks; screws have twice as much");
}

Model makeKangaroo(const KangarooParameters& p) {
  check("kangaroo", p);
  ModelBuilder builder("kangaroo");
  KangarooLeg legs[] = {{p, 1, builder}, {p, -1, builder}};
  const auto getHip = [&](const KangarooLeg& leg) { return Vector3d(0, leg.s * p.hip_offset, -p.trunk_height); };
  addTrunk(makeTrunk(p, {getHip(legs[0]), getHip(legs[1])}), builder);
  for (KangarooLeg& leg : legs) addLeg(leg, getHip(leg));
  for (KangarooLeg& leg : legs) addYaw(leg, getHip(leg));
  builder.addReference(makeSerialHalfSitting("kangaroo", p));
  return builder.build();
}

Model makeKangarooLeg(const KangarooParameters& p) {
  check("kangaroo_leg", p);
  ModelBuilder builder("kangaroo_leg");
  Joint rail;
  rail.name = "rail";
  rail.kind = JointKind::Prismatic;
  rail.axis = kZ;
  rail.X_PJ.p = (p.trunk_height + p.thigh_length + p.shank_length + p.ankle_height) * kZ;
  const Vector3d hip = -p.trunk_height * kZ;
  addSolidLink("trunk", "world", rail, makeTrunk(p, {hip}), builder);
  KangarooLeg leg(p, 1, builder);
  addLeg(leg, hip);
  addYaw(leg, hip);
  Reference standing = makeSerialHalfSitting("kangaroo_leg", p);
  Reference reference;
  reference.name = standing.name;
  reference.feet["foot_left"] = kOrigin;
  reference.height_frame = standing.height_frame;
  reference.height = standing.height;
  // The sole, not the ankle, is under the hip: pitch of hip and ankle follow.
  for (const char* joint : {"hipz_left", "hipx_left", "knee_left", "anklex_left"})
    reference.joints[joint] = standing.joints.at(joint);
  builder.addReference(reference);
  return builder.build();
}

}  // namespace bielle
