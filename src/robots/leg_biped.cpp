#include "robots/leg_biped.h"

#include <cmath>
#include <set>

namespace bielle {
namespace {

struct ComposedLeg : BipedSide {
  const LegBipedParameters& p;
  HipPart hip;
  KneePart knee;
  AnklePart ankle;
  bool motors_on_joints;  // those of serial parts; otherwise where belts and differentials have them

  Vector3d inner() const { return -s * 0.04 * kY; }  // the knee's motor, from the hip
  Vector3d ankle_place() const { return -p.shank_length * kZ; }
  // Backward, up by an angle.
  static Vector3d arm(double angle) { return {-std::cos(angle), 0, std::sin(angle)}; }
  // Index 1 outer, 2 inner.
  Vector3d beside(int index, double distance) const { return (index == 1 ? s : -s) * distance * kY; }
};

// Limb of a 3-RRS hip, Eq. (0a), about its centre; legs straight.
struct HipLimb {
  std::string name;  // "hip1_left"
  Vector3d motor, elbow, ball;
};

HipLimb makeHipLimb(const ComposedLeg& leg, int index) {
  const double r = leg.p.hip_radius, inside = 0.7 * r, middle = leg.p.hip_middle;
  const std::string name = "hip" + std::to_string(index) + leg.name;
  if (index == 1) return {name, -r * kX, r * kZ, leg.s * r * kY};
  if (index == 2) return {name, -leg.s * r * kY, r * kX, -r * kZ};
  return {name, inside * kZ, -leg.s * inside * kY, inside * Vector3d(std::cos(middle), 0, std::sin(middle))};
}

// Share of the passive hinges in the mass of the links between trunk and thigh.
constexpr double kHipCross = 0.1;

// Of the limbs and of the thigh's arms to their balls, kg/m: all links of the hip weigh what those of a serial one do.
double calcLimbDensity(const ComposedLeg& leg) {
  double length = 0;
  for (int i = 1; i <= 3; ++i) {
    const HipLimb limb = makeHipLimb(leg, i);
    length += (limb.elbow - limb.motor).norm() + (limb.ball - limb.elbow).norm() + limb.ball.norm();
  }
  return 2 * (1 - kHipCross) * leg.p.hip_link_mass / length;
}

// Passive hinges and three limbs: motor, link, hinge, link.
void addParallelHip(const ComposedLeg& leg, ModelBuilder& builder) {
  const LegBipedParameters& p = leg.p;
  const double cross = kHipCross * p.hip_link_mass, density = calcLimbDensity(leg);
  addHipLinks(leg, p, {makeCylinder(kOrigin, kX, 0.008, 0.05, cross, colors::kSteel)},
              {makeCylinder(kOrigin, kY, 0.008, 0.05, cross, colors::kSteel)}, builder);
  for (int i = 1; i <= 3; ++i) {
    const HipLimb limb = makeHipLimb(leg, i);
    const Vector3d to_elbow = limb.elbow - limb.motor, to_ball = limb.ball - limb.elbow;
    const std::string upper = "upper_" + limb.name, lower = "lower_" + limb.name;
    addSolidLink(upper, "trunk",
                 makeRevolute("motor_" + limb.name, getHip(leg, p) + limb.motor, limb.motor.normalized()),
                 {makeRod(kOrigin, to_elbow, 0.010, density, colors::kFrame)}, builder);
    addSolidLink(lower, upper, makeRevolute("elbow_" + limb.name, to_elbow, limb.elbow.normalized()),
                 {makeRod(kOrigin, to_ball, 0.008, density, colors::kOutput)}, builder);
    builder.addFrame("limb_end_" + limb.name, lower, {Matrix3d::Identity(), to_ball});
  }
}

// The thigh's arms to the balls.
std::vector<Solid> makeHipArms(const ComposedLeg& leg) {
  std::vector<Solid> arms;
  for (int i = 1; i <= 3 && leg.hip == HipPart::ThreeRrs; ++i)
    arms.push_back(makeRod(kOrigin, makeHipLimb(leg, i).ball, 0.009, calcLimbDensity(leg), colors::kFrame));
  return arms;
}

void closeParallelHip(const ComposedLeg& leg, ModelBuilder& builder) {
  for (int i = 1; i <= 3; ++i) {
    const HipLimb limb = makeHipLimb(leg, i);
    builder.addFrame("thigh_end_" + limb.name, "thigh" + leg.name, {Matrix3d::Identity(), limb.ball});
    builder.addClosure(limb.name, ClosureKind::Ball3D, "thigh_end_" + limb.name, "limb_end_" + limb.name);
    builder.addMotor("motor_" + limb.name, leg.p.armature);
  }
}

// Motors of the hips on the trunk.
std::vector<Solid> makeHipMotors(const std::vector<ComposedLeg>& legs) {
  const LegBipedParameters& p = legs.front().p;
  if (legs.front().hip == HipPart::Serial) return makeHipYawMotors(p);
  std::vector<Solid> motors;
  for (const ComposedLeg& leg : legs)
    for (int i = 1; i <= 3; ++i) {
      const Vector3d place = makeHipLimb(leg, i).motor;
      motors.push_back(makeMotor(getHip(leg, p) + place, place, p.motor_mass));
    }
  return motors;
}

// A pulley about y, turned by its motor.
void addPulley(const ComposedLeg& leg, const std::string& name, const std::string& base, const Vector3d& place,
               ModelBuilder& builder) {
  constexpr double kRadius = 0.02, kWidth = 0.012;  // m
  addSolidLink("pulley_" + name + leg.name, base + leg.name, makeRevolute("motor_" + name + leg.name, place, kY),
               {makeCylinder(kOrigin, kY, kRadius, kWidth, leg.p.pulley_mass, colors::kSteel)}, builder);
}

Vector3d getKneeArm(const ComposedLeg& leg) { return leg.p.knee_arm * ComposedLeg::arm(-leg.p.knee_middle); }

// Crank on the thigh, and rod.
void addKneeChain(const ComposedLeg& leg, ModelBuilder& builder) {
  const LegBipedParameters& p = leg.p;
  CrankChain chain;
  chain.name = "knee" + leg.name;
  chain.motor = leg.inner();
  chain.elbow = chain.motor + p.knee_crank * ComposedLeg::arm(-p.knee_middle);
  chain.end = chain.elbow + Vector3d(p.knee_crank - p.knee_arm, 0, -p.thigh_length);
  chain.axis2 = kX;
  addCrankChain(chain, "thigh" + leg.name, p.rod_density, p.armature, builder);
}

void closeFourBar(const ComposedLeg& leg, ModelBuilder& builder) {
  builder.addFrame("knee_arm" + leg.name, "shank" + leg.name, {Matrix3d::Identity(), leg.inner() + getKneeArm(leg)});
  builder.addClosure("knee_rod" + leg.name, ClosureKind::Ball3D, "knee_arm" + leg.name, "rod_end_knee" + leg.name);
}

std::vector<Solid> makeShank(const ComposedLeg& leg) {
  const LegBipedParameters& p = leg.p;
  std::vector<Solid> solids = {makeRod(kOrigin, leg.ankle_place(), 0.018, p.link_density, colors::kOutput)};
  if (leg.knee == KneePart::FourBar)
    solids.push_back(makeRod(leg.inner(), leg.inner() + getKneeArm(leg), 0.010, p.rod_density, colors::kSteel));
  if (leg.ankle == AnklePart::Serial && leg.motors_on_joints) {
    solids.push_back(makeMotor(leg.ankle_place(), kY, p.ankle_motor_mass));
    return solids;
  }
  const bool rsu = leg.ankle == AnklePart::Rsu;
  const Vector3d place = rsu ? Vector3d(leg.ankle_place() + p.motor_height * kZ) : Vector3d(-p.ankle_motor_drop * kZ);
  const Vector3d side = (rsu ? p.ankle_half_width : 0.03) * kY;
  for (double sign : {1.0, -1.0}) solids.push_back(makeMotor(place + sign * side, kY, p.ankle_motor_mass));
  return solids;
}

// Thigh, shank and what moves the knee.
void addKnee(const ComposedLeg& leg, ModelBuilder& builder) {
  const LegBipedParameters& p = leg.p;
  const Vector3d knee = -p.thigh_length * kZ;
  const bool at_knee = leg.knee == KneePart::Serial && leg.motors_on_joints;
  std::vector<Solid> thigh = {makeRod(kOrigin, knee, 0.022, p.link_density, colors::kFrame),
                              makeMotor(at_knee ? knee : leg.inner(), kY, p.knee_motor_mass)};
  for (const Solid& arm : makeHipArms(leg)) thigh.push_back(arm);
  addSolidLink("thigh" + leg.name, "hip_roll" + leg.name, makeRevolute("hipy" + leg.name, kOrigin, kY), thigh, builder);
  for (const char* joint : {"hipz", "hipx", "hipy"})
    if (leg.hip == HipPart::Serial) builder.addMotor(joint + leg.name, p.armature);
  if (leg.hip == HipPart::ThreeRrs) closeParallelHip(leg, builder);
  if (leg.knee == KneePart::Belt) addPulley(leg, "knee", "thigh", leg.inner() / 2, builder);
  if (leg.knee == KneePart::FourBar) addKneeChain(leg, builder);
  addSolidLink("shank" + leg.name, "thigh" + leg.name, makeRevolute("knee" + leg.name, knee, kY), makeShank(leg),
               builder);
  if (leg.knee == KneePart::FourBar) return closeFourBar(leg, builder);
  builder.addMotor((leg.knee == KneePart::Belt ? "motor_knee" : "knee") + leg.name, p.armature);
  if (leg.knee == KneePart::Belt)
    builder.addCoupler("knee_belt" + leg.name, {{"motor_knee" + leg.name, 1}, {"knee" + leg.name, -p.knee_ratio}});
}

void addDifferential(const ComposedLeg& leg, ModelBuilder& builder) {
  const LegBipedParameters& p = leg.p;
  const std::string motors[] = {"motor_ankle1" + leg.name, "motor_ankle2" + leg.name};
  for (int i : {1, 2})
    addPulley(leg, "ankle" + std::to_string(i), "shank", -p.ankle_motor_drop * kZ + leg.beside(i, 0.055), builder);
  builder.addCoupler("ankle_pitch" + leg.name,
                     {{motors[0], 0.5}, {motors[1], 0.5}, {"ankley" + leg.name, -p.ankle_ratio}});
  builder.addCoupler("ankle_roll" + leg.name,
                     {{motors[0], 0.5 * leg.s}, {motors[1], -0.5 * leg.s}, {"anklex" + leg.name, -p.ankle_ratio}});
  for (const std::string& motor : motors) builder.addMotor(motor, p.armature);
}

Vector3d getHeel(const ComposedLeg& leg, int index) {
  return leg.p.ankle_arm * ComposedLeg::arm(leg.p.arm_angle) + leg.beside(index, leg.p.ankle_half_width);
}

void addAnkleChain(const ComposedLeg& leg, int index, ModelBuilder& builder) {
  const LegBipedParameters& p = leg.p;
  CrankChain chain;
  chain.name = "ankle" + std::to_string(index) + leg.name;
  chain.motor = leg.ankle_place() + p.motor_height * kZ + leg.beside(index, p.ankle_half_width);
  chain.elbow = chain.motor + p.ankle_crank * ComposedLeg::arm(p.arm_angle);
  chain.end = leg.ankle_place() + getHeel(leg, index);
  chain.axis2 = kX;
  addCrankChain(chain, "shank" + leg.name, p.rod_density, p.armature, builder);
  builder.addClosure(chain.name, ClosureKind::Ball3D, "heel" + std::to_string(index) + leg.name,
                     "rod_end_" + chain.name);
}

// Ankle, foot and what moves them.
void addAnkle(const ComposedLeg& leg, ModelBuilder& builder) {
  const LegBipedParameters& p = leg.p;
  std::vector<Solid> cross = {makeCylinder(kOrigin, kY, 0.008, 0.05, 0.08, colors::kSteel)};
  if (leg.ankle == AnklePart::Serial && leg.motors_on_joints)
    cross.push_back(makeMotor({-0.06, 0, 0}, kX, p.ankle_motor_mass));
  addSolidLink("ankle_cross" + leg.name, "shank" + leg.name, makeRevolute("ankley" + leg.name, leg.ankle_place(), kY),
               cross, builder);
  builder.addLink("foot_link" + leg.name, "ankle_cross" + leg.name, makeRevolute("anklex" + leg.name, kOrigin, kX), {});
  std::vector<Solid> foot = makeFoot(p);
  if (leg.ankle != AnklePart::Rsu)
    foot.push_back(makeCylinder(kOrigin, kX, 0.02, 0.03, 0.3 * p.foot_mass, colors::kSteel));
  const Vector3d root(p.sole_offset - 0.4 * p.sole_length, 0, 0.02 - p.ankle_height);
  for (int i = 1; i <= 2 && leg.ankle == AnklePart::Rsu; ++i) {
    const Vector3d heel = getHeel(leg, i);
    foot.push_back(
        makeCylinder((root + heel) / 2, heel - root, 0.009, (heel - root).norm(), 0.15 * p.foot_mass, colors::kSteel));
    builder.addFrame("heel" + std::to_string(i) + leg.name, "foot_link" + leg.name, {Matrix3d::Identity(), heel});
  }
  addSolids("foot_link" + leg.name, foot, builder);
  if (leg.ankle == AnklePart::Differential) addDifferential(leg, builder);
  for (int i = 1; i <= 2 && leg.ankle == AnklePart::Rsu; ++i) addAnkleChain(leg, i, builder);
  for (const char* joint : {"ankley", "anklex"})
    if (leg.ankle == AnklePart::Serial) builder.addMotor(joint + leg.name, p.armature);
}

void addLeg(const ComposedLeg& leg, ModelBuilder& builder) {
  const LegBipedParameters& p = leg.p;
  if (leg.hip == HipPart::Serial)
    addHip(leg, p, builder);
  else
    addParallelHip(leg, builder);
  addKnee(leg, builder);
  addAnkle(leg, builder);
  for (const char* joint : {"hipz", "hipx", "hipy", "knee", "ankley", "anklex"})
    builder.addSerialJoint(joint + leg.name);
  addSole(leg, {p.sole_offset, 0, -p.ankle_height}, p.sole_length, p.sole_width, builder);
}

void addBiped(const LegBipedParameters& p, bool motors_on_joints, ModelBuilder& builder) {
  std::vector<ComposedLeg> legs;
  for (const BipedSide& side : {BipedSide{1, "_left"}, BipedSide{-1, "_right"}})
    legs.push_back({side, p, p.hip, p.knee, p.ankle, motors_on_joints});
  std::vector<Solid> trunk = makeSerialTrunk(p);
  for (const Solid& motor : makeHipMotors(legs)) trunk.push_back(motor);
  addTrunk(trunk, builder);
  for (const ComposedLeg& leg : legs) addLeg(leg, builder);
}

Model makeBiped(const std::string& robot, const LegBipedParameters& p, bool motors_on_joints = true) {
  ModelBuilder builder(robot);
  addBiped(p, motors_on_joints, builder);
  builder.addReference(makeSerialHalfSitting(robot, p));
  return builder.build();
}

// A biped of certain parts, its parameters checked.
template <typename Parameters>
Model makeOf(KneePart knee, AnklePart ankle, const std::string& robot, Parameters p, bool motors_on_joints) {
  checkParameters(robot, p);
  p.knee = knee, p.ankle = ankle, p.hip = HipPart::Serial;
  p.knee_motor_mass = p.ankle_motor_mass = p.motor_mass;
  return makeBiped(robot, p, motors_on_joints);
}

void describeParts(OptionFields& f, LegBipedParameters& p) {
  f.choice("knee", p.knee, {"serial", "belt", "four_bar"}, "part that moves the knee");
  f.choice("ankle", p.ankle, {"serial", "differential", "rsu"}, "part that moves the ankle");
  f.choice("hip", p.hip, {"serial", "three_rrs"}, "part that moves the hip");
  f.number("knee_motor_mass", p.knee_motor_mass, "kg", {0.01, 10}, "mass of each motor of the knees");
  f.number("ankle_motor_mass", p.ankle_motor_mass, "kg", {0.01, 10}, "mass of each motor of the ankles");
  f.number("hip_radius", p.hip_radius, "m", {0.03, 0.2},
           "3-RRS limbs: distance of their hinges and balls from the hip");
  f.number("hip_middle", p.hip_middle, "rad", {-1.5, 1.5},
           "3-RRS limbs: angle of hipy at which all are at right angles");
  f.number("knee_ratio", p.knee_ratio, "1", {0.1, 20}, "belt: turns of the knee's motor per turn of the knee");
  f.number("knee_crank", p.knee_crank, "m", {0.01, 0.2}, "four-bar: length of the crank at the hip");
  f.number("knee_arm", p.knee_arm, "m", {0.01, 0.2}, "four-bar: length of the arm at the knee");
  f.number("knee_middle", p.knee_middle, "rad", {0, 2},
           "four-bar: angle of the knee at which crank and arm are perpendicular to the rod");
  f.number("ankle_ratio", p.ankle_ratio, "1", {0.1, 20},
           "differential: mean turns of the ankle's motors per turn of the ankle");
  f.number("ankle_motor_drop", p.ankle_motor_drop, "m", {0, 0.5},
           "differential: distance of the ankle motors below the knee");
  f.number("pulley_mass", p.pulley_mass, "kg", {0.001, 2}, "belt and differential: mass of each motor's pulley");
  f.number("ankle_arm", p.ankle_arm, "m", {0.01, 0.2}, "rods (RSU): distance of their balls behind the ankle");
  f.number("ankle_crank", p.ankle_crank, "m", {0.01, 0.2}, "rods (RSU): length of the cranks");
  f.number("ankle_half_width", p.ankle_half_width, "m", {0.01, 0.2}, "rods (RSU): sideways distance from the ankle");
  f.number("motor_height", p.motor_height, "m", {0.05, 0.8}, "rods (RSU): height of the ankle motors above the ankle");
  f.number("arm_angle", p.arm_angle, "rad", {-1.2, 1.2},
           "rods (RSU): angle of cranks and arms above the horizontal, legs straight");
  f.number("rod_density", p.rod_density, "kg/m", {0.01, 20}, "mass per length of cranks and rods");
}

// Those of all bipeds, and some of the parts.
void describeSome(OptionFields& f, LegBipedParameters& p, const std::set<std::string>& own,
                  const std::string& motor_mass = "mass of each motor") {
  describeSerial(f, p, motor_mass);
  f.restrictTo(own);
  describeParts(f, p);
  f.restrictTo({});
}

}  // namespace

void describe(OptionFields& f, LegBipedParameters& p) {
  describeSerial(f, p, "mass of each motor of the hips");
  describeParts(f, p);
}

void addLegBiped(const LegBipedParameters& p, ModelBuilder& builder) { addBiped(p, true, builder); }

Model makeLegBiped(const LegBipedParameters& p) {
  checkParameters("leg_biped", p);
  return makeBiped("leg_biped", p);
}

void describe(OptionFields& f, BeltBipedParameters& p) {
  describeSome(f, p, {"knee_ratio", "ankle_ratio", "ankle_motor_drop", "pulley_mass"});
}
Model makeBeltBiped(const BeltBipedParameters& p) {
  return makeOf(KneePart::Belt, AnklePart::Differential, "belt_biped", p, true);
}

void describe(OptionFields& f, RsuBipedParameters& p) { describeRsu(f, p, "mass of each motor"); }
void describeRsu(OptionFields& f, LegBipedParameters& p, const std::string& motor_mass) {
  describeSome(f, p, {"ankle_arm", "ankle_crank", "ankle_half_width", "motor_height", "arm_angle", "rod_density"},
               motor_mass);
}
Model makeRsuBiped(const RsuBipedParameters& p) {
  return makeOf(KneePart::Serial, AnklePart::Rsu, "rsu_biped", p, true);
}

void describe(OptionFields& f, BeltKneeParameters& p) {
  describeSome(f, p, {"knee_ratio", "ankle_motor_drop", "pulley_mass"});
}
Model makeBeltKnee(const BeltKneeParameters& p) {
  return makeOf(KneePart::Belt, AnklePart::Serial, "belt_knee", p, false);
}

void describe(OptionFields& f, DifferentialAnkleParameters& p) {
  describeSome(f, p, {"ankle_ratio", "ankle_motor_drop", "pulley_mass"});
}
Model makeDifferentialAnkle(const DifferentialAnkleParameters& p) {
  return makeOf(KneePart::Serial, AnklePart::Differential, "differential_ankle", p, false);
}

}  // namespace bielle
