#pragma once
/// \file A biped with serial hips and knees and ankles of two RSU chains (revolute crank, spherical rod ends).
///
/// x forward, y left, z up; s = +1 for the left leg, -1 for the right one. All frames are parallel in the neutral
/// configuration, which is closed: legs straight. Joints of a leg, all angles about x, y, z of these frames: hipz,
/// hipx, hipy in one point, knee (positive: bent), ankley, anklex in one point.
///
/// Ankle: two motors on the shank at the height h over the ankle and at +-w beside it, cranks of length c backward and
/// up by the angle delta; rods run down from their ends, with a universal joint there, to balls at the heel
///     (-a cos delta, +-w, a sin delta)                                                                           (1)
/// of the foot, relative to the ankle. With c = a, rods and shank form parallelograms: the cranks turn with the pitch
/// of the foot, and in opposition when it rolls. Their dead points are a quarter turn from where the arms are
/// perpendicular to the shank: ankley = -delta. Each chain leaves the ankle's two freedoms: per leg, with the two
/// hinges of the ankle, 6 bodies and 36 - 2 5 - 2 (5 + 4 + 3) = 2.
///
/// The architecture is common. Distance of the hips, soles, height of the trunk in half_sitting and total mass are
/// those of robots/bipetto; all other dimensions and masses are ours, and no such robot was built.
#include "robots/biped_parts.h"

namespace bielle {

struct RsuBipedParameters : SerialBipedParameters {
  double ankle_arm = 0.05;         ///< a, m
  double ankle_crank = 0.05;       ///< c, m
  double ankle_half_width = 0.06;  ///< w, m
  double motor_height = 0.17;      ///< h, m
  double arm_angle = 0.6;          ///< delta, rad
  double rod_density = 0.5;        ///< of cranks and rods, kg/m
};

std::vector<Parameter> listParameters(RsuBipedParameters& parameters);

/// \throws ModelError when a parameter is outside its bounds, or the legs do not reach from hip_height to the ground
Model makeRsuBiped(const RsuBipedParameters& parameters = {});

}  // namespace bielle
