#pragma once
/// \file Centre of mass, momentum and energy.
#include "bielle/dynamics/workspace.h"

namespace bielle {

/// Centre of mass in the world, m; needs updatePositions.
Vector3d calcCom(const Model& model, const Workspace& ws);

/// Velocity of the centre of mass, m/s; needs updateVelocities.
Vector3d calcComVelocity(const Model& model, const Workspace& ws);

/// Jacobian of the centre of mass, 3 x nv (derivative with respect to the tangent of q, and of its velocity with
/// respect to v); needs updateMassMatrix (composite inertias).
void calcComJacobian(const Model& model, const Workspace& ws, Eigen::Ref<Eigen::Matrix3Xd> J);

/// Derivative of the velocity of the centre of mass with respect to q, 3 x nv; needs updateVelocities, and
/// updateMassMatrix.
void calcComVelocityDerivative(const Model& model, const Workspace& ws, Eigen::Ref<Eigen::Matrix3Xd> dv_dq);

/// Momentum about the centre of mass in world axes (linear, angular), kg m/s and kg m^2/s; needs updateVelocities.
Vector6d calcCentroidalMomentum(const Model& model, const Workspace& ws);

/// Kinetic energy of bodies and rotors, J; needs updateVelocities.
double calcKineticEnergy(const Model& model, const Workspace& ws);
/// Potential energy of gravity, zero for a centre of mass at the origin, J; needs updatePositions.
double calcPotentialEnergy(const Model& model, const Workspace& ws);

}  // namespace bielle
