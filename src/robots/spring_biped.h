#pragma once
/// \file A biped like Cassie: legs with heel rods and leaf springs (robots/spring_leg.h), on soles.
///
/// Dimensions, masses, rotors, torques and stiffnesses are published ones of Cassie (Agility Robotics), from the model that the
/// Dynamic Robotics Laboratory of Oregon State University made of it (cassie-mujoco-sim, `cassie.xml`), with the point where
/// the heel rod ends on its leaf as in the controllers of DAIR Lab (dairlib). Simplified as SpringLegParameters says, and:
/// - leaves bend at knee and tarsus joint; Cassie's bend 77 and 33 mm beside them;
/// - Cassie's feet are narrow, roll with the leg, and each has one crank. Motions here stand on soles that lie flat, so that
///   these feet roll as those of Digit, by two cranks side by side, each with the motor of Cassie's and half of the masses.
/// Inertias are those of our solids. The heat of the motors is ours, too: about 500 W at their largest torques.
///
/// Closures of a leg: heel rod, 3 rows, and two plantar rods with balls at the toe, 3 each: 9 rows, rank 9. Of 12 joints along
/// the leg and beside it, heel rod and plantar rods counting 2: 8 without leaves (roll, yaw, pitch, knee, tarsus, toe 2 and
/// 2 cranks), so that the leg moves in 6 ways, one per motor, and each leaf adds one.
#include "robots/spring_leg.h"

namespace bielle {

struct SpringBipedParameters : SpringLegParameters {
  SpringBipedParameters();

  double trunk_mass = 10.33;      ///< kg
  double hip_offset = 0.135;      ///< of the roll axes from the middle plane, m
  double hip_place = 0.021;       ///< of their middles before the trunk's frame, m
  double trunk_place = 0.05066;   ///< of the trunk's centre of mass before its frame, m
  double trunk_height = 0.02841;  ///< of it over its frame, m
  double stand_height = 0.98;     ///< of the trunk's frame over the soles in the reference `half_sitting`, m
  double leg_armature = 0.09344;  ///< of the motors of hip pitch and knee, behind their gears, kg m^2
  double toe_armature = 0.01225;  ///< of each of the toe's, kg m^2
};

void describe(OptionFields& fields, SpringBipedParameters& parameters);

/// \throws InputError as makeSpringLeg()
Model makeSpringBiped(const SpringBipedParameters& parameters = {});

}  // namespace bielle
