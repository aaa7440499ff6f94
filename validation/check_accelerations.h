#pragma once
/// \file The recorded accelerations against Simbody's own, Eqs. (4) and (5) of check.h.
#include "check_input.h"
#include "simbody_bridge.h"

namespace bielle::validation {

struct AccelerationTrace {
  VectorXd a;        ///< nv, Simbody's, with the stabilisation of Eq. (5) that brings it nearest to the recorded a
  double size = 0;   ///< sqrt(a^T M a)
  double error = 0;  ///< the same norm of the recorded accelerations less a
};

/// sqrt(a^T M a)
double calcInertialNorm(const MatrixXd& M, const VectorXd& a);

/// What stabilisations act on: residuals and velocities of loops and feet at a node, in rows of notation.h.
struct ClosureErrors {
  VectorXd residual, velocity;
};
/// \param simbody at the state of the node   \param v  its velocities (nv)
ClosureErrors calcClosureErrors(const SimbodyBridge& simbody, const VectorXd& v);

/// \param simbody at the point of the accelerations and with the motor forces; its closures are the loops and then
/// `contacts`
/// \param M  mass matrix at that point   \param errors  at the node   \param recorded  accelerations (nv)
/// \param stabilised_loops  whether loops are stabilised like feet: in the full formulation
AccelerationTrace traceAccelerations(const SimbodyBridge& simbody, const MatrixXd& M, const ClosureErrors& errors,
                                     const VectorXd& recorded, double time_step, bool stabilised_loops);

}  // namespace bielle::validation
