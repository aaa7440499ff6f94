#pragma once
/// \file A leg like Cassie's, its leaf springs taken rigid: tarsus and toe are moved by four-bars.
///
/// Hip roll, yaw and pitch, knee, tarsus and toe; the last four move the sagittal plane. With O the hip pitch axis, K the
/// knee, T the tarsus joint, P the toe pivot, H the heel on the tarsus, angles from straight down, forward positive:
///     K = O + l1 (sin a1, -cos a1),   T = K + l2 (sin a2, -cos a2),   P = T + l3 (sin a3, -cos a3),
///     H = T + h (-sin a1, cos a1),                                                                               (1)
/// so that O K T H is nearly a parallelogram: the heel rod from O to H keeps the tarsus (nearly) parallel to itself while
/// the knee bends. It has a universal joint at O and a ball at H: three rows on four joints. The toe's four-bar
/// (crank on the tarsus, plantar rod, lever of the toe) is closed by a hinge: five rows, rank two, on three joints.
/// Mobility 5, one per motor: hip_roll, hip_yaw, hip_pitch, knee, motor_toe.
///
/// Lengths in the manner of Cassie's public simulation model, rounded: thigh 0.12, shin 0.50 between its joints with the
/// springs at rest, tarsus 0.41, heel rod 0.50, plantar rod 0.35, crank 0.055 m. The lever is a little
/// longer than the crank: an exact parallelogram loses rank where all its rods are aligned. Masses and radii are ours.
#include "bielle/model/model.h"
#include "bielle/robots/parameter.h"

namespace bielle {

struct SpringLegParameters {
  double thigh_length = 0.12;   ///< l1, m
  double shin_length = 0.50;    ///< l2, m
  double tarsus_length = 0.41;  ///< l3, m
  double heel_length = 0.11;    ///< h, m
  double crank_length = 0.055;  ///< of the toe's crank, m
  double lever_length = 0.06;   ///< of its lever, m
  double crank_place = 0.06;    ///< of the crank along the tarsus, from T, m
  double toe_length = 0.16;     ///< of the foot, m
  double thigh_angle = 0.6;     ///< a1 in the neutral configuration, rad
  double shin_angle = -0.9;     ///< a2, rad
  double tarsus_angle = 0.9;    ///< a3, rad
  double motor_mass = 1.2;      ///< each of five, kg
  double link_density = 2;      ///< of thigh, shin and tarsus, kg/m
  double rod_density = 0.4;     ///< of heel rod, plantar rod and crank, kg/m
  double foot_mass = 0.15;      ///< kg
  double armature = 0.01;       ///< of a motor behind its gear, kg m^2
};

std::vector<Parameter> listParameters(SpringLegParameters& parameters);

/// \throws ModelError when a parameter is outside its bounds, or the crank beyond the toe
Model makeSpringLeg(const SpringLegParameters& parameters = {});

}  // namespace bielle
