#pragma once
/// \file Forward kinematics in world coordinates.
#include "bielle/dynamics/workspace.h"

namespace bielle {

/// Placements, Jacobian columns and inertias at q (nq).
void updatePositions(const Model& model, Workspace& ws, ConstVectorRef q);

/// The placements X_WB at q alone: enough for getPlacement and closure residuals.
template <typename T>
void updatePlacements(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector q);

/// Jacobian columns and inertias at the placements of the workspace: what updatePositions adds to updatePlacements.
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

}  // namespace bielle
