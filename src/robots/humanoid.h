#pragma once
/// \file A humanoid: the legs of leg_biped with serial knees and ankles of two rods (RSU), two arms, and grippers whose fingers
/// mimic each other.
///
/// Conventions are those of leg_biped.h. Per arm, from the shoulder: armpitch (y), armroll (x), elbow (y, negative: bent forward),
/// each with a motor. The hand points down in the neutral configuration. Of its two fingers of two links each one joint has the
/// motor; the others follow by couplers, which a URDF writes as <mimic>:
///     finger2 = -finger1,    fingertip1 = -r finger1,    fingertip2 = r finger1                                    (1)
/// with r = 1 the tips stay parallel, as those of a parallel gripper. Mobility 18 + 2 (3 + 1) = 26.
///
/// Robots like it: Talos and its kin, whose grippers are loops of such mimic joints, with ankles of two rods. All dimensions and
/// masses are ours, and no such robot was built.
#include "robots/leg_biped.h"

namespace bielle {

struct HumanoidParameters : LegBipedParameters {
  double shoulder_height = 0.16;   ///< over the trunk's frame, m
  double shoulder_offset = 0.23;   ///< from the middle plane, m
  double upper_arm_length = 0.17;  ///< shoulder to elbow, m
  double forearm_length = 0.15;    ///< elbow to the hand, m
  double finger_length = 0.05;     ///< of each link, m
  double finger_ratio = 1;         ///< r of (1)
  double arm_density = 2;          ///< of upper arm and forearm, kg/m
  double arm_motor_mass = 0.4;     ///< of each motor of an arm, kg
  double finger_mass = 0.03;       ///< of each link, kg
  double finger_armature = 1e-4;   ///< of the gripper's motor, kg m^2
};
void describe(OptionFields& fields, HumanoidParameters& parameters);

/// \throws InputError as makeRsuBiped() does
Model makeHumanoid(const HumanoidParameters& parameters = {});

}  // namespace bielle
