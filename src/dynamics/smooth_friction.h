#pragma once
/// \file Friction that steps of a length can follow.
///
/// Below its friction_speed v_c, the friction tau_c of a joint (model.h) is a damper of tau_c / v_c. With N as in modes.h,
/// N^T M N = 1, and the dampers D of the joints, motions near rest decay at the rates
///
///     r = eigenvalues of N^T D N,                                                                                  (1)
///
/// which explicit steps of the length h bear up to r h = 2; faster ones make them grow.
#include <vector>

#include "bielle/dynamics/constrained.h"

namespace bielle {

struct SmoothFriction {
  double rate = 0;    ///< the fastest of Eq. (1), 1/s, of dampers and friction
  double damped = 0;  ///< of dampers alone
  int joint = 0;      ///< with the largest part in that
  /// Those whose friction_speed has to be larger, and is here, for friction alone to have rates up to 1/h; two digits.
  std::vector<JointForce> raised;
};

/// At rest at a closed q, under these constraints. \param h  s
SmoothFriction calcSmoothFriction(const Model& model, const ConstraintSet& constraints, ConstVectorRef q, double h);

}  // namespace bielle
