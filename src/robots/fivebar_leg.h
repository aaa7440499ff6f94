#pragma once
/// \file A five-bar leg with coaxial motors on a vertical rail, in the plane x-z: a direct-drive leg.
///
/// Two motors on one axis turn the upper rods (length l1), one to the front, one to the back; the lower rods (l2) meet
/// in the foot, a pin. With phi the angle of both upper rods from straight down, the foot is right under the motors at
///     l1 cos phi + sqrt(l2^2 - l1^2 sin^2 phi).                                                                  (1)
/// The pin is a hinge closure: five rows, of which a planar loop needs two. Rail and four hinges less two: mobility 3.
/// The neutral configuration stands on the ground by (1), all frames parallel.
///
/// Lengths of the Minitaur robot: l1 = 0.1 m, l2 = 0.2 m (Kenneally, De, Koditschek, "Design principles for a family of
/// direct-drive legged robots", IEEE Robotics and Automation Letters 1, 2016). Masses and radii are ours.
#include "bielle/model/model.h"
#include "robots/check_parameters.h"

namespace bielle {

struct FiveBarLegParameters {
  double upper_length = 0.1;  ///< l1, m
  double lower_length = 0.2;  ///< l2, m
  double stand_angle = 1.2;   ///< phi in the neutral configuration, rad
  double body_mass = 1.0;     ///< on the rail, without motors, kg
  double motor_mass = 0.25;   ///< each, kg
  double rod_density = 0.5;   ///< kg/m
  double foot_mass = 0.03;    ///< kg
  double armature = 1e-4;     ///< of a motor, kg m^2
};

void describe(OptionFields& fields, FiveBarLegParameters& parameters);

/// \throws InputError when a parameter is outside its bounds, or the lower rods do not meet
Model makeFiveBarLeg(const FiveBarLegParameters& parameters = {});

}  // namespace bielle
