#pragma once
/// \file Friction that is larger at rest (Stribeck's curve), as the sum of two forces of one joint (model.h).
///
/// With the smooth sign S(v; s) = v / sqrt(v^2 + s^2), the level of sliding tau_c and that at rest tau_s >= tau_c,
///
///     tau = -tau_s S(v; v_c) + (tau_s - tau_c) S(v; v_s),   v_c < v_s                                              (1)
///
/// is -tau_s v / v_c next to rest, about -tau_s between v_c and v_s, and tends to -tau_c as (tau_s - tau_c) v_s^2 / (2 v^2):
/// Hess and Soom's curve ("Friction at a lubricated line contact operating at oscillating sliding velocities", 1990) in a form
/// without an absolute value. Its second term is a JointForce of negative friction, which follows the one that it belongs to.
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// The force of a joint; its friction is tau_c, its friction_speed v_c.
struct WholeJointForce {
  JointForce force;
  double stiction = 0;          ///< tau_s, N m or N; that of sliding where there is no more
  double stribeck_speed = 0.1;  ///< v_s, rad/s or m/s

  bool sticks() const { return stiction > force.friction; }
};

/// Eq. (1): one force, or two if there is stiction.
std::vector<JointForce> splitJointForce(const WholeJointForce& whole);
/// One of each joint that has forces, in their order: what files and tables show.
std::vector<WholeJointForce> joinJointForces(const Model& model);

}  // namespace bielle
