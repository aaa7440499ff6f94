#pragma once
/// \file A leg like Cassie's, its leaf springs rigid or not: tarsus and toe are moved by four-bars.
///
/// Hip roll, yaw and pitch, knee, tarsus and toe; the last four move in the sagittal plane. With O the hip pitch axis,
/// K the knee, T the tarsus joint, P the toe pivot, H the heel on the tarsus, d(a) = (sin a, -cos a) the direction of
/// the angle a from straight down, forward positive:
///     K = O + l1 d(a1),   T = K + l2 d(a2),   P = T + l3 d(a3),   H = T - h d(a3 - e),                            (1)
/// The heel rod keeps |OH| = r, which determines a3. O K T H is nearly a parallelogram, so that the rod keeps the
/// tarsus (nearly) parallel to itself while the knee bends; of the two branches, H is behind the line from O to T. The
/// rod has a universal joint at O, at the distance w from the plane, and a ball at H: three rows on four joints.
///
/// The toe's four-bar: a crank of length c about C = T + m d(a3 - f), the plantar rod of length k, the lever of length
/// v on the foot, at the angle g when the sole is level; the crank points backward. It is closed by a hinge: five rows,
/// rank two, on three joints. Mobility 5, one per motor: hip_roll, hip_yaw, hip_pitch, knee, motor_toe.
///
/// Cassie's leaves are at the root of the shin and of the heel. With a stiffness, each is a hinge about y with a spring that
/// is at rest in the neutral configuration: shin_spring at K carries the shin, heel_spring at T the heel; the motor of the
/// knee then turns the knee's link. Each adds a joint, and one to the mobility. The stiffer they are, the less they bend:
/// by tau / k under a torque tau.
///
/// Lengths, angles between them and masses of links are those of the leg of Digit, Cassie's successor, as modelled in
/// `digit_like_2legs` of example-parallel-robots (LAAS-CNRS and Inria, 2024, BSD 3-Clause), its right leg. Simplified:
/// parts beside the sagittal plane are moved into it (shin 0.025, tarsus 0.014 m), except for the upper end of the heel
/// rod; the toe only pitches, and its two cranks and rods are merged into one with the mass of both. Toe, posture,
/// radii and armature are ours.
#include "bielle/model/builder.h"
#include "robots/check_parameters.h"

namespace bielle {

struct SpringLegParameters {
  double yaw_offset = 0.0352;  ///< of the yaw axis behind the middle of the roll axis, m
  double yaw_drop = 0.0527;    ///< of its frame under the roll axis, m
  double pitch_drop = 0.0549;  ///< of the pitch axis under that frame, m

  double thigh_length = 0.12;       ///< l1, m
  double shin_length = 0.3993;      ///< l2, m
  double tarsus_length = 0.3283;    ///< l3, m
  double heel_length = 0.1198;      ///< h, m
  double heel_bend = 0.189;         ///< e, rad
  double heel_rod_length = 0.3999;  ///< r, m
  double rod_offset = 0.0347;       ///< w, m

  double crank_place = 0.0926;     ///< m, m
  double crank_bend = 0.168;       ///< f, rad
  double crank_length = 0.057;     ///< c, m
  double plantar_length = 0.2399;  ///< k, m
  double lever_length = 0.0447;    ///< v, m
  double lever_angle = -0.839;     ///< g, rad
  double ankle_height = 0.0509;    ///< of P over the sole, m
  double sole_offset = 0.0235;     ///< of the middle of the sole before P, m
  double toe_length = 0.16;        ///< of the sole, m
  double toe_width = 0.04;         ///< of the sole, m

  double thigh_angle = 0.6;   ///< a1 in the neutral configuration, rad
  double shin_angle = -0.85;  ///< a2, rad

  double hip_roll_mass = 1.29;    ///< kg
  double hip_yaw_mass = 1.42;     ///< kg
  double thigh_mass = 3.89;       ///< kg
  double shin_mass = 0.556;       ///< kg
  double tarsus_mass = 0.743;     ///< kg
  double foot_mass = 0.334;       ///< kg
  double heel_rod_mass = 0.0314;  ///< kg
  double crank_mass = 0.0091;     ///< kg
  double plantar_mass = 0.024;    ///< kg
  double crank_spread = 0.06;     ///< between two cranks (SpringLegToe::PitchRoll), m
  double toe_cross_mass = 0.05;   ///< between its two axes, kg
  double armature = 0.01;         ///< of a motor behind its gear, kg m^2

  double shin_stiffness = 0;  ///< of the leaf between knee and shin, N m/rad; 0: rigid
  double heel_stiffness = 0;  ///< of the leaf between tarsus and heel, N m/rad; 0: rigid

  double carriage_mass = 0;  ///< that bears a leg alone on a vertical rail, kg; 0: the hip is fixed
};

void describe(OptionFields& fields, SpringLegParameters& parameters);
/// \param armature  its help
void describeSpringLeg(OptionFields& fields, SpringLegParameters& parameters, const std::string& armature);

/// \throws InputError when a parameter is outside its bounds, a rod does not reach, or the crank is beyond the toe
Model makeSpringLeg(const SpringLegParameters& parameters = {});

enum class SpringLegToe {
  Pitch,     ///< joint toe_joint, moved by one crank
  PitchRoll  ///< joints toe_joint and toe_roll, moved by two cranks side by side, their rods with balls at the toe
};

/// Where a leg hangs.
struct SpringLegMount {
  std::string base = "world";       ///< link that carries the roll joint
  std::string suffix;               ///< of all names
  Vector3d hip = Vector3d::Zero();  ///< middle of the roll axis, in the base, m
  double side = 1;                  ///< +1, or -1 for the mirror image
  SpringLegToe toe = SpringLegToe::Pitch;
};

/// Links, frames and closures of a leg; its motors are the caller's.
/// \throws InputError as makeSpringLeg()
void addSpringLeg(const std::string& robot, const SpringLegParameters& parameters, const SpringLegMount& mount,
                  ModelBuilder& builder);

/// The middle of the sole in the neutral configuration, from the middle of the roll axis, m.
Vector3d calcSolePlace(const std::string& robot, const SpringLegParameters& parameters);

}  // namespace bielle
