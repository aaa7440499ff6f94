#pragma once
/// \file A biped moved by ball screws alone, and one leg of it on a rail: linear motors, light shanks, loops within loops, all
/// planar ones closed by full hinges or welds, so that there are many more rows than rank.
///
/// x forward, y left, z up; s = +1 for the left leg, -1 for the right one. All frames are parallel in the neutral
/// configuration, which is closed: legs straight, screws at zero. Joints of a leg, all angles about x, y, z of these
/// frames: hipz, hipx, hipy in one point, knee (positive: bent), ankley, anklex in one point. A screw is a tube with the
/// motor that turns in its hinge, and a rod that slides out of it, the motor's coordinate (m). Per leg:
///
/// - Yaw: a screw between trunk and an arm of the yaw link, hinges about z: 3 joints, a hinge closure, 3 - 2 = 1.
/// - Hip differential: two screws side by side between yaw link and thigh, universal joints above and balls below; together
///   they pitch the thigh, in opposition they roll it: 2 + 2 (2 + 1) joints, two balls, 8 - 6 = 2.
/// - Knee: a screw along the thigh turns a bell crank over the knee, from which a pair of parallel rods of the length
///   between crank and knee leads to an arm of the same length on the shank: a parallelogram, the crank turns with the
///   knee. With delta the angle of crank and arm below the horizontal, legs straight, they are square to the rods at
///   knee = delta.
/// - Ankle: two screws along the shank, each of which turns an upper crank; a pair of rods to a lower crank makes a
///   parallelogram with the shank, and a link with balls leads from there to the heel, as of a biped with RSU ankles: both
///   cranks turn with the pitch of the foot, and in opposition when it rolls. They are square to the rods at
///   ankley = -epsilon, epsilon being their angle over the horizontal, legs straight.
/// - Rods of knee and ankle screws are kept from turning by a guide, a second slide beside them that is welded to them.
///
/// Rows and rank of a leg: a planar loop of hinges closed by a hinge has 5 and 2, the second rod of a pair 5 and 1, a guide 6 and
/// 1, a ball 3 and 3. With yaw, two hip screws, knee (screw, guide, pair) and two sides of the ankle (screw, guide,
/// pair, link) this is 5 + 6 + 21 + 2 * 24 = 80 rows of rank 2 + 6 + 6 + 2 * 9 = 32, on 38 joints: 48 rows of a leg, 96 of the
/// biped, are redundant.
///
/// The idea is that of Kangaroo (A. Roig et al., "On the Hardware Design and Control Architecture of the Humanoid Robot
/// Kangaroo", 6th Workshop on Legged Robots, ICRA 2022): linear actuators, a hip differential, knee and ankle driven through
/// parallelograms. All dimensions and masses are ours. Screws have 10 mm per turn and rotors of 2e-5 kg m^2, 8 kg at the screw.
#include "robots/biped_parts.h"

namespace bielle {

struct KangarooParameters : SerialBipedParameters {
  KangarooParameters();

  double yaw_arm = 0.06;            ///< of the yaw link beside its axis, m
  double yaw_screw = 0.14;          ///< length of the yaw screw, neutral, m
  double hip_screw_place = 0.07;    ///< of the hip screws before the hip, m
  double hip_screw_width = 0.045;   ///< of the hip screws beside the middle of the thigh, m
  double hip_screw_top = 0.12;      ///< of their upper ends over the hip, m
  double hip_screw_drop = 0.14;     ///< of their lower ends under the hip, m
  double knee_arm = 0.05;           ///< of bell crank and shank, m
  double knee_angle = 0.75;         ///< delta, rad
  double knee_crank_height = 0.10;  ///< of the bell crank over the knee, m
  double knee_screw_drop = 0.06;    ///< of the knee screw's upper end under the hip, m
  double ankle_arm = 0.05;          ///< of all cranks and of the heel, m
  double ankle_angle = 0.5;         ///< epsilon, rad
  double ankle_half_width = 0.05;   ///< of the links beside the ankle, m
  double upper_crank_height = 0.2;  ///< over the ankle, m
  double lower_crank_height = 0.1;  ///< over the ankle, m
  double rod_density = 0.5;         ///< of rods, cranks and screws, kg/m
};

void describe(OptionFields& fields, KangarooParameters& parameters);

/// Free in space, on two legs.
/// \throws InputError when a parameter is outside its bounds, or the legs do not reach from hip_height to the ground
Model makeKangaroo(const KangarooParameters& parameters = {});

/// The left leg, its trunk on a vertical rail over the sole.
Model makeKangarooLeg(const KangarooParameters& parameters = {});

}  // namespace bielle
