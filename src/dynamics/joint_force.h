#pragma once
// The force of springs, dampers and friction on a joint (model.h) and its derivatives.
#include <cmath>

#include "bielle/dynamics/workspace.h"

namespace bielle {

/// v / sqrt(v^2 + s^2), the sign of v made smooth, and its derivative s^2 / (v^2 + s^2)^(3/2).
template <typename T>
struct SmoothSign {
  T value, slope;
};
template <typename T>
SmoothSign<T> calcSmoothSign(const T& v, double s) {
  using std::sqrt;
  const T square = v * v + s * s, size = sqrt(square);
  return {v / size, s * s / (square * size)};
}

/// The part of damper and friction at the rate v.
template <typename T>
T calcDissipativeForce(const JointForce& force, const T& v) {
  T tau = -force.damping * v;
  if (force.friction != 0) tau -= force.friction * calcSmoothSign(v, force.friction_speed).value;
  return tau;
}

template <typename T>
T calcJointForce(const JointForce& force, const WorkspaceOf<T>& ws) {
  const T spring = force.preload - force.stiffness * (ws.q[force.idx_q] - force.rest);
  return spring + calcDissipativeForce<T>(force, ws.v[force.dof]);
}

/// -dtau/dv at the rate v; -dtau/dq is the stiffness.
template <typename T>
T calcResistance(const JointForce& force, const T& v) {
  T out = force.damping;
  if (force.friction != 0) out += force.friction * calcSmoothSign(v, force.friction_speed).slope;
  return out;
}
inline bool isDissipative(const JointForce& force) { return force.damping != 0 || force.friction != 0; }

/// Derivatives of the force by stiffness, rest, preload, damping and friction: Eq. (11) of variation.h.
inline Eigen::Matrix<double, 5, 1> calcJointForceSlopes(const JointForce& force, const Workspace& ws) {
  const double v = ws.v[force.dof];
  Eigen::Matrix<double, 5, 1> slopes;
  slopes << force.rest - ws.q[force.idx_q], force.stiffness, 1, -v, -calcSmoothSign(v, force.friction_speed).value;
  return slopes;
}

}  // namespace bielle
