#pragma once
/// \file Clavel's delta: three arms with forearms that are parallelograms hold a platform parallel to its base.
///
/// All joints are hinges, as in textbooks, so that there are many more rows than rank. Arm i at the azimuth
/// psi_i = 2 pi i / 3, radial direction d, tangent t = z x d: a motor about t at R d, the upper arm down to its elbow
///     e = R d + l1 (cos theta d - sin theta z),                                                                  (1)
/// a bar that turns about t there, two rods beside each other that turn about the normal n of the forearm's plane
/// (t and forearm), a bar between their lower ends, and the platform, hinged to it about t at r d of its centre. With
/// the platform in the middle its depth h is
///     h = l1 sin theta + sqrt(l2^2 - (R + l1 cos theta - r)^2).                                                  (2)
/// Spatial count (Gruebler) with 16 joints after cutting: 16 - 5 * 5 = -9. The platform has its three translations.
///
/// Lengths of an industrial robot, ABB's IRB 360-1/1600, from R. L. Williams II (The Delta Parallel Robot: Kinematics
/// Solutions, Ohio University, 2016): sides of base and platform triangles 0.567 and 0.076 m, whose inscribed and
/// circumscribed circles are R = 0.567 / (2 sqrt 3) and r = 0.076 / sqrt 3; arms of 0.524 and 1.244 m, parallelograms
/// 0.131 m wide. Neutral posture, masses and radii are ours.
#include "bielle/model/model.h"
#include "robots/check_parameters.h"

namespace bielle {

struct DeltaParameters {
  double base_radius = 0.163679;      ///< R, m
  double platform_radius = 0.043879;  ///< r, m
  double upper_length = 0.524;        ///< l1, m
  double forearm_length = 1.244;      ///< l2, m
  double half_width = 0.0655;         ///< of the parallelograms, m
  double arm_angle = 0.3;             ///< theta in the neutral configuration, below the horizontal, rad
  double rod_density = 0.3;           ///< kg/m
  double platform_mass = 0.5;         ///< kg
  double armature = 0.01;             ///< of a motor behind its gear, kg m^2
};

void describe(OptionFields& fields, DeltaParameters& parameters);

/// \throws InputError when a parameter is outside its bounds, or the forearms do not reach the platform
Model makeDelta(const DeltaParameters& parameters = {});

}  // namespace bielle
