#pragma once
/// \file Rigid impact: a foot lands and stops instantly, without bouncing.
///
/// Forces are impulses Lambda and the configuration stays; the velocity v becomes v+ with
///     M (v+ - v) = J^T Lambda,     J v+ = 0                                                                        (1)
/// J being the rows of all closures and of the contacts in force afterwards: the system of saddle_point.h with f = M v,
/// g = 0. Its derivatives take, at fixed v+ and Lambda,
///     dID = d(M (v+ - v) - J^T Lambda)/dq dq - M dv,     dc = d(J v+)/dq dq                                        (2)
/// the first by inverse dynamics at rest under the accelerations v+ - v, less the terms of gravity. The energy lost is
/// that of the change, 1/2 (v+ - v)^T M (v+ - v).
#include "bielle/dynamics/constrained.h"

namespace bielle {

/// Memory of one impact; sized at first use and then reused without allocation.
struct ImpactWorkspace {
  explicit ImpactWorkspace(const Model& model);

  MatrixXd J;                         ///< rows x nv
  VectorXd v_plus;                    ///< nv
  VectorXd impulse;                   ///< rows, each in its frame 1, N s and N m s
  MatrixXd dv_dq, dv_dv;              ///< nv x nv, of v+ with respect to q (tangent) and v
  MatrixXd dimpulse_dq, dimpulse_dv;  ///< rows x nv

  // Intermediate
  Workspace ws;
  SaddlePointMemory saddle_point;
  VectorXd momentum, change, zero;  ///< nv: M v, v+ - v, 0
  std::vector<Vector6d> f_ext;      ///< nb
};

/// Eq. (1) at (q, v) for a constraint set, whose stabilisation is ignored. Ok, Singular or NotFinite.
NumericalStatus updateImpact(const Model& model, ImpactWorkspace& iws, const ConstraintSet& constraints,
                             ConstVectorRef q, ConstVectorRef v);

/// Eq. (2), to be called after updateImpact. Ok or NotFinite.
NumericalStatus updateImpactDerivatives(const Model& model, ImpactWorkspace& iws, const ConstraintSet& constraints);

}  // namespace bielle
