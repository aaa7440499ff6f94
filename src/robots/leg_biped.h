#pragma once
/// \file Bipeds composed of parts: one that moves the hips, one that moves the knees and one that moves the ankles.
///
/// x forward, y left, z up; s = +1 for the left leg, -1 for the right one. All frames are parallel in the neutral
/// configuration, legs straight. Joints of a leg: those of SerialBipedParameters. Every leg has six motors: three at the hip,
/// one of the knee, two of the ankle. A part says where its motors are, and adds what leads from them to the joints:
///
/// Hip: yaw, roll and pitch in one point, hinges in this order.
/// - serial: motors on the joints, that of the yaw on the trunk and the two others on the links between trunk and thigh.
/// - three_rrs: the hinges are passive, and three limbs turn the thigh: a motor on the trunk, a link, a hinge, a link and a ball
///   at the thigh each. The axes of motor and hinge meet in the centre O of the hip, so that hinge and ball of a limb move on a
///   sphere of radius r about it (0.7 r for limb 3). Directions from O of motor, hinge and ball, legs straight:
///       limb 1:  u = (-1, 0, 0),   w = (0, 0, 1),    v = (0, s, 0)                                              (0a)
///       limb 2:  u = (0, -s, 0),   w = (1, 0, 0),    v = (0, 0, -1)
///       limb 3:  u = (0, 0, 1),    w = (0, -s, 0),   v = (cos theta, 0, sin theta)
///   A limb moves the thigh by a moment about the normal w x v of its second link. Without yaw and roll that of limbs 1 and 2 is
///   the axis of their own motor at any pitch, and so is that of limb 3 at the middle pitch hipy = theta: there the motors turn
///   roll, pitch and yaw one to one. A quarter turn of the pitch from theta the normals of limbs 1 and 3 are parallel, and the
///   hip is singular. Hinges and limb both place a ball on its sphere, so a closure has three rows and rank two: 3 + 3 2 - 3 2 = 3.
///
/// Knee, with its motor at the hip, on the thigh, but for the serial one:
/// - serial: a motor on the joint, at the knee.
/// - belt: a motor turns the knee by a belt,
///       motor_knee = n knee                                                                                      (1)
/// - four_bar: a motor turns a crank of length c; a rod leads down from it to an arm of length a behind the knee. Crank and
///   arm are square to the rod at the middle angle theta of the knee, where the ratio is a / c. With c = a they form a
///   parallelogram with the thigh, and dead points are a quarter turn from theta.
///
/// Ankle: pitch and roll in one point.
/// - serial: motors on the joints, that of the pitch on the shank and that of the roll behind the ankle.
/// - differential: two motors on the shank, below the knee, of angles relative to it,
///       (motor_ankle1 + motor_ankle2) / 2 = m ankley,    s (motor_ankle1 - motor_ankle2) / 2 = m anklex          (2)
///   so that equal turns pitch the foot and opposite ones roll it, each motor with half of the torque.
/// - rsu: two chains of a revolute crank and a rod with spherical ends. The motors are on the shank at the height h over the
///   ankle and at +-w beside it, cranks of length c backward and up by the angle delta; rods run down from their ends, with
///   a universal joint there, to balls at the heel
///       (-a cos delta, +-w, a sin delta)                                                                         (3)
///   of the foot, relative to the ankle. With c = a, rods and shank form parallelograms: the cranks turn with the pitch of the
///   foot, and in opposition when it rolls; dead points are at ankley = -delta -+ a quarter turn. Each chain leaves the ankle's
///   two freedoms: with the two hinges of the ankle, 6 bodies and 36 - 2 5 - 2 (5 + 4 + 3) = 2.
///
/// (1) and (2) are couplers: belts and gears have no mass of their own, pulleys have. The rods have: a four-bar is 3 rows over
/// crank, universal joint and knee.
///
/// Parts are meant to be compared: trunk, links of the hips, thighs, shanks, feet and soles are the same to the last gram, as is
/// the number of motors and the mass of each, and every part pays for what it adds (pulleys, cranks, rods) and for where its
/// motors are.
///
/// The architectures are common. Distance of the hips, soles, height of the trunk in half_sitting and total mass are about those
/// of robots/bipetto; all other dimensions and masses are ours, and no such robot was built.
#include "robots/biped_parts.h"

namespace bielle {

enum class HipPart { Serial, ThreeRrs };
enum class KneePart { Serial, Belt, FourBar };
enum class AnklePart { Serial, Differential, Rsu };

struct LegBipedParameters : SerialBipedParameters {
  KneePart knee = KneePart::FourBar;
  AnklePart ankle = AnklePart::Differential;
  HipPart hip = HipPart::Serial;

  double knee_motor_mass = 0.8, ankle_motor_mass = 0.8;  ///< each, kg; motor_mass is that of the hips'

  double hip_radius = 0.07;  ///< r of three RRS limbs, m
  double hip_middle = -0.6;  ///< theta of them, rad

  double knee_ratio = 2;     ///< n of a belt: turns of the motor's pulley per turn of the knee
  double knee_crank = 0.05;  ///< c of a four-bar, m
  double knee_arm = 0.05;    ///< a of a four-bar, m
  double knee_middle = 1.2;  ///< theta, rad

  double ankle_ratio = 2;          ///< m of a differential
  double ankle_motor_drop = 0.06;  ///< of its motors below the knee, m
  double pulley_mass = 0.1;        ///< of each motor's pulley, with belt and differential, kg

  double ankle_arm = 0.05;         ///< a of (3), m
  double ankle_crank = 0.05;       ///< c of an RSU chain, m
  double ankle_half_width = 0.06;  ///< w, m
  double motor_height = 0.17;      ///< h, m
  double arm_angle = 0.6;          ///< delta, rad
  double rod_density = 0.5;        ///< of cranks and rods, kg/m
};
void describe(OptionFields& fields, LegBipedParameters& parameters);

/// Trunk, legs and soles, for a robot with more on its trunk.
void addLegBiped(const LegBipedParameters& parameters, ModelBuilder& builder);

/// \throws InputError when a parameter is outside its bounds, or the legs do not reach from hip_height to the ground
Model makeLegBiped(const LegBipedParameters& parameters = {});

/// Bipeds of certain parts, with one mass for all motors. BeltBiped: belt and differential; RsuBiped: serial and rsu.
struct BeltBipedParameters : LegBipedParameters {};
void describe(OptionFields& fields, BeltBipedParameters& parameters);
Model makeBeltBiped(const BeltBipedParameters& parameters = {});

struct RsuBipedParameters : LegBipedParameters {};
void describe(OptionFields& fields, RsuBipedParameters& parameters);
/// Those of a biped with serial knees and RSU ankles. \param motor_mass  its help
void describeRsu(OptionFields& fields, LegBipedParameters& parameters, const std::string& motor_mass);
Model makeRsuBiped(const RsuBipedParameters& parameters = {});

/// The belt biped with its belts or its differentials alone. The other motors act on the joints, but their masses stay in their
/// places: what changes are the transmission and its pulleys.
struct BeltKneeParameters : LegBipedParameters {};
void describe(OptionFields& fields, BeltKneeParameters& parameters);
Model makeBeltKnee(const BeltKneeParameters& parameters = {});

struct DifferentialAnkleParameters : LegBipedParameters {};
void describe(OptionFields& fields, DifferentialAnkleParameters& parameters);
Model makeDifferentialAnkle(const DifferentialAnkleParameters& parameters = {});

}  // namespace bielle
