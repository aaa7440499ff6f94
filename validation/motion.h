#pragma once
/// \file The same free motion of a closed chain integrated by Bielle and by Simbody.
///
/// Ours: at every step of length h, with q = q_n (+) d, the classical Runge-Kutta scheme of order 4 on
///     d' = J_dv(d)^{-1} v,    v' = a(q_n (+) d, v) (1)
/// (Munthe-Kaas; J_dv of calcJointIntegrateJacobians), then q and v are projected back on the closures, which keeps the
/// order.
#include "bielle/dynamics/constrained.h"

namespace bielle::validation {

/// Newton steps from q back onto all closures of the set, including contacts (at their targets).
/// \return largest remaining residual, m or rad
double retract(const Model& model, Workspace& ws, const ConstraintSet& constraints, VectorXd& q);

struct MotionOptions {
  double duration = 2;              ///< s
  double step = 1e-3;               ///< h of ours, s
  double simbody_accuracy = 1e-10;  ///< relative
};

struct MotionReport {
  bool ok = false;                  ///< false if a solve failed
  double distance = 0;              ///< largest of |q_ours (-) q_simbody| at the end, m or rad
  double energy_error = 0;          ///< largest |E(t) - E(0)| of ours over the motion, J
  double energy_error_simbody = 0;  ///< |E(end) - E(0)| of Simbody's, J
  double kinetic_energy = 0;        ///< largest over our motion, J
  double travelled = 0;             ///< largest of |q(end) (-) q(0)|, the scale of the distance
  double gap = 0;                   ///< largest residual of a closure on our motion, m or rad
  VectorXd q, v;                    ///< our final state
};

/// From (q, v), closed, under gravity and no motor torque. The model must be free of armature
/// (makeModelWithoutArmature).
MotionReport compareMotion(const Model& model, ConstVectorRef q, ConstVectorRef v, const MotionOptions& options = {});

}  // namespace bielle::validation
