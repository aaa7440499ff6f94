#pragma once
/// \file Forward kinematics in world coordinates; centre of mass, momentum and energy.
#include "bielle/dynamics/workspace.h"

namespace bielle {

/// Placements, Jacobian columns and inertias at q (nq).
void updatePositions(const Model& model, Workspace& ws, ConstVectorRef q);

/// The placements X_WB at q alone: enough for getPlacement and closure residuals.
template <typename T>
void updatePlacements(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector q);

/// Jacobian columns and inertias at the placements of the workspace; with updatePlacements it makes up updatePositions.
template <typename T>
void updateColumns(const Model& model, WorkspaceOf<T>& ws);

/// Body velocities at v (nv); needs updatePositions.
template <typename T>
void updateVelocities(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector v);

/// Body accelerations at a (nv), gravity included; needs updateVelocities.
template <typename T>
void updateAccelerations(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector a);

/// Placement in the world of a frame fixed in a body.
inline SE3 getPlacement(const Workspace& ws, int body, const SE3& X_BF) { return ws.X_WB[body] * X_BF; }

/// Twist of a frame in its own coordinates (6).
inline Vector6d calcFrameVelocity(const Workspace& ws, int body, const SE3& X_BF) {
  requireBodyVelocities(ws, "calcFrameVelocity");
  return getPlacement(ws, body, X_BF).actInvMotion(ws.V[body]);
}

/// Jacobian (6 x nv) of the frame's twist in its own coordinates.
Matrix6Xd calcFrameJacobian(const Model& model, const Workspace& ws, int body, const SE3& X_BF);

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
/// Potential energy, J: of gravity, zero for a centre of mass at the origin, and of the springs and preloads of joints,
/// zero at their rest; needs updatePositions.
double calcPotentialEnergy(const Model& model, const Workspace& ws);

}  // namespace bielle
