#pragma once
/// \file Cleobot, a biped whose legs are parallel mechanisms throughout: the paper's second robot, with our dimensions.
///
/// All frames are parallel to the world in the neutral configuration, which is closed: the robot stands on flat feet.
/// x forward, y left, z up; s = +1 for the left leg, -1 for the right one, its mirror image.
///
/// Lower leg, 3-RRS: three limbs i, each a motor at b_i under the thigh, an upper rod of length l1, a knee with an axis
/// parallel to that of the motor, a shank of length l2 and a ball at s_i of the foot. A limb moves in the vertical
/// plane (at the neutral configuration) through b_i of heading psi_i; its knee is bent towards d_i = (cos psi_i, sin
/// psi_i, 0):
///     limb 1, rear:           b_1 = (-r, 0, 0),                              psi_1 = pi                          (1)
///     limb 2, 3, front:       b   = (r cos beta, +-s r sin beta, 0),         psi   = +-s alpha    (outer, inner)
///     s_i = b_i - inset d_i - (0, 0, height of the lower leg)                                                   (2)
/// Foot and thigh have three relative freedoms: leg length, pitch and roll. The balls stay in the three planes, which
/// constrains x, y and yaw of the foot unless the three normals, as lines through the s_i, meet in a common point:
/// hence alpha > 0. With the motors locked, the forces along the shanks constrain the rest, except where a limb is
/// stretched (knee straight), where a shank lies in the plane of the balls, or where the foot turns so far that the
/// lines meet.
///
/// Hip: a ball between trunk and thigh, turned by three chains of a motor on the trunk, a crank of length c, a rod with
/// a universal joint at the crank and a ball at the thigh. With the centre of the hip as origin:
///     chain 1, 2: ends on the thigh (-a, +-s w, 0) (outer, inner), vertical rods of length l up to the cranks,
///                 which point backward: moving together they pitch the leg, in opposition they roll it;           (3)
///     chain 3:    end on the thigh (0, s e, 0), rod of length k forward, crank down from the motor: yaw.          (4)
/// Arms of the rods about the hip are a (pitch), w (roll) and e (yaw) at the neutral configuration. A chain is at a
/// dead point where its crank and rod are aligned; the hip is singular where the moments of the three rods are
/// dependent.
#include "bielle/model/model.h"
#include "robots/check_parameters.h"

namespace bielle {

struct CleobotParameters {
  double hip_height = 0.50;    ///< of the hips over the soles, standing, m
  double hip_offset = 0.125;   ///< of a hip from the middle plane, m
  double trunk_height = 0.10;  ///< of the trunk's frame over the hips, m

  double hip_arm = 0.06;         ///< a, m
  double hip_half_width = 0.05;  ///< w, m
  double hip_rod = 0.12;         ///< l, m
  double hip_crank = 0.07;       ///< c of chains 1 and 2, m
  double yaw_arm = 0.07;         ///< e, m
  double yaw_rod = 0.12;         ///< k, m
  double yaw_crank = 0.07;       ///< c of chain 3, m

  double thigh_length = 0.05;    ///< from the hip down to the motors of the lower leg, m
  double base_radius = 0.08;     ///< r, m
  double base_angle = 0.785398;  ///< beta, rad
  double limb_heading = 0.3;     ///< alpha, rad
  double upper_length = 0.185;   ///< l1, m
  double shank_length = 0.285;   ///< l2, m
  double platform_inset = 0.01;  ///< of the balls of the foot from under the motors, towards the middle, m
  double ankle_height = 0.06;    ///< of the balls over the sole, m
  double sole_length = 0.10, sole_width = 0.10;  ///< m

  double trunk_mass = 8.6;      ///< without motors, kg
  double hip_motor_mass = 0.8;  ///< each, on the trunk, kg
  double leg_motor_mass = 0.8;  ///< each, on the thigh, kg
  double thigh_mass = 0.6;      ///< without motors, kg
  double limb_density = 1.1;    ///< of upper rods and shanks, kg/m
  double rod_density = 0.5;     ///< of the rods and cranks of the hip, kg/m
  double foot_mass = 0.6;       ///< kg
  double armature = 1e-3;       ///< of every motor, kg m^2
};

void describe(OptionFields& fields, CleobotParameters& parameters);

/// \throws InputError when a parameter is outside its bounds, or the limbs do not reach the foot
Model makeCleobot(const CleobotParameters& parameters = {});

}  // namespace bielle
