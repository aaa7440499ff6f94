#pragma once
/// \file Clavel's delta: three arms with forearms that are parallelograms hold a platform parallel to its base.
///
/// All joints are hinges, as drawn in the textbook, so that there are many more rows than rank. Arm i at the azimuth
/// psi_i = 2 pi i / 3, radial direction d, tangent t = z x d: a motor about t at R d, the upper arm down to its elbow
///     e = R d + l1 (cos theta d - sin theta z),                                                                  (1)
/// a bar that turns about t there, two rods beside each other that turn about the normal n of the forearm's plane
/// (t and forearm), a bar between their lower ends, and the platform, hinged to it about t at r d of its centre. With
/// the platform in the middle its depth h is
///     h = l1 sin theta + sqrt(l2^2 - (R + l1 cos theta - r)^2).                                                  (2)
/// Spatial count (Gruebler) with 16 joints after cutting: 16 - 5 * 5 = -9. The platform has its three translations.
///
/// Lengths of the example in a widely read derivation of the delta's kinematics (triangles of 457.3 and 115 mm, arms of 112
/// and 232 mm), so that R = 457.3 / (2 sqrt 3) and r = 115 / (2 sqrt 3). Masses and radii are ours.
#include "bielle/model/model.h"
#include "bielle/robots/parameter.h"

namespace bielle {

struct DeltaParameters {
  double base_radius = 0.132011;      ///< R, m
  double platform_radius = 0.033198;  ///< r, m
  double upper_length = 0.112;        ///< l1, m
  double forearm_length = 0.232;      ///< l2, m
  double half_width = 0.03;           ///< of the parallelograms, m
  double arm_angle = 0.6;             ///< theta in the neutral configuration, below the horizontal, rad
  double rod_density = 0.3;           ///< kg/m
  double platform_mass = 0.2;         ///< kg
  double armature = 1e-4;             ///< of a motor, kg m^2
};

std::vector<Parameter> listParameters(DeltaParameters& parameters);

/// \throws ModelError when a parameter is outside its bounds, or the forearms do not reach the platform
Model makeDelta(const DeltaParameters& parameters = {});

}  // namespace bielle
