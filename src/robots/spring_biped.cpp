#include "robots/spring_biped.h"

#include <limits>

#include "robots/solid.h"

namespace bielle {
namespace {

// Largest torque at the joint, N m, and heat, W/(N m)^2, of motors of 4.5 N m behind gears of 25, of 12.2 behind 16, of 0.9
// behind 50; heat of about 500 W at these torques.
struct Drive {
  double torque, loss;
};
constexpr Drive kHip{112.5, 0.04}, kLeg{195.2, 0.013}, kToe{45, 0.25};

void addMotor(const std::string& joint, double armature, const Drive& drive, ModelBuilder& builder) {
  builder.addMotor(joint, armature, drive.torque, std::numeric_limits<double>::infinity(), drive.loss);
}

void addLeg(const SpringBipedParameters& p, double side, ModelBuilder& builder) {
  const std::string suffix = side > 0 ? "_left" : "_right";
  addSpringLeg("spring_biped", p,
               {"trunk", suffix, Vector3d(p.hip_place, side * p.hip_offset, 0), side, SpringLegToe::PitchRoll},
               builder);
  for (const char* joint : {"hip_roll", "hip_yaw"}) addMotor(joint + suffix, p.armature, kHip, builder);
  for (const char* joint : {"hip_pitch", "knee"}) addMotor(joint + suffix, p.leg_armature, kLeg, builder);
  for (const char* number : {"1", "2"}) addMotor("motor_toe" + (number + suffix), p.toe_armature, kToe, builder);
  for (const char* joint : {"hip_roll", "hip_yaw", "hip_pitch", "knee", "toe_joint", "toe_roll"})
    builder.addSerialJoint(joint + suffix);
  builder.addContact("foot" + suffix, "foot" + suffix, ContactKind::Surface6D, p.toe_length / 2, p.toe_width / 2);
}

}  // namespace

SpringBipedParameters::SpringBipedParameters() {
  yaw_offset = 0.07;
  yaw_drop = 0.01;  // where along its axis is of no account; both drops are 0.09 m together
  pitch_drop = 0.08;
  thigh_length = 0.12;
  shin_length = 0.5;
  tarsus_length = 0.41;
  heel_length = 0.12;
  heel_bend = 0.129;
  heel_rod_length = 0.5012;
  rod_offset = -0.045;
  crank_place = 0.0672;
  crank_bend = 0.432;
  crank_length = 0.055;
  plantar_length = 0.3501;
  lever_length = 0.055;
  lever_angle = -0.872;
  ankle_height = 0.057;
  sole_offset = 0.02;
  toe_length = 0.16;
  toe_width = 0.08;
  thigh_angle = 0.5;
  shin_angle = -0.57;
  hip_roll_mass = 1.82;
  hip_yaw_mass = 1.171;
  thigh_mass = 5.52;
  shin_mass = 1.521;
  tarsus_mass = 0.908;
  foot_mass = 0.1;
  toe_cross_mass = 0.05;
  heel_rod_mass = 0.1567;
  crank_mass = 0.1261;
  plantar_mass = 0.1186;
  armature = 0.038125;
  shin_stiffness = 1500;
  heel_stiffness = 1250;
}

void describe(OptionFields& f, SpringBipedParameters& p) {
  describeSpringLeg(f, p, "rotor inertia of the roll and yaw motors, after their gears");
  f.number("crank_spread", p.crank_spread, "m", {0.01, 0.3}, "distance between the two cranks of a toe");
  f.number("toe_cross_mass", p.toe_cross_mass, "kg", {0.001, 5}, "mass of the part between the axes of a toe");
  f.number("trunk_mass", p.trunk_mass, "kg", {0.1, 100}, "mass of the trunk without legs");
  f.number("hip_offset", p.hip_offset, "m", {0.05, 0.4}, "distance of a hip from the middle plane");
  f.number("hip_place", p.hip_place, "m", {-0.5, 0.5}, "distance of the hips in front of the trunk's frame");
  f.number("trunk_place", p.trunk_place, "m", {-0.5, 0.5},
           "distance of the trunk's centre of mass in front of its frame");
  f.number("trunk_height", p.trunk_height, "m", {-0.5, 0.5}, "height of the trunk's centre of mass above its frame");
  f.number("stand_height", p.stand_height, "m", {0.1, 3},
           "height of the trunk's frame above the soles in the reference half_sitting");
  f.number("leg_armature", p.leg_armature, "kg m^2", {0, 1}, "rotor inertia of the hip pitch and knee motors");
  f.number("toe_armature", p.toe_armature, "kg m^2", {0, 1}, "rotor inertia of each toe motor");
}

Model makeSpringBiped(const SpringBipedParameters& p) {
  checkParameters("spring_biped", p);
  ModelBuilder builder("spring_biped");
  Joint root;
  root.name = "root_joint";
  root.kind = JointKind::FreeFlyer;
  addSolidLink("trunk", "world", root,
               {makeBox({p.trunk_place, 0, p.trunk_height}, {0.26, 0.28, 0.22}, p.trunk_mass, colors::kShell)},
               builder);
  for (double side : {1.0, -1.0}) addLeg(p, side, builder);
  const double x = p.hip_place + calcSolePlace("spring_biped", p).x();
  Reference standing;
  standing.name = "half_sitting";
  standing.feet = {{"foot_left", Vector3d(x, p.hip_offset, 0)}, {"foot_right", Vector3d(x, -p.hip_offset, 0)}};
  standing.height_frame = "trunk";
  standing.height = p.stand_height;
  standing.joints[root.name] = {0, 0, p.stand_height, 0, 0, 0, 1};  // the soles are ahead of the trunk's frame
  for (const char* side : {"_left", "_right"})
    for (const char* joint : {"hip_roll", "hip_yaw", "hip_pitch", "knee"})
      standing.joints[std::string(joint) + side] = {0};
  builder.addReference(standing);
  return builder.build();
}

}  // namespace bielle
