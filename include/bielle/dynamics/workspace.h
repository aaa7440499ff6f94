#pragma once
/// \file The caller-owned memory of all dynamics functions, one per thread or shooting node.
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// How far a workspace has been filled for the present (q, v, a). Each update* function sets its stage, and a function
/// that needs an earlier stage calls requireStage(), which throws std::logic_error naming the missing call.
/// Bodies: X_WB, V and hc are filled, but not the columns (J, dJ, dV, ..) or anything that follows from them.
enum class WorkspaceStage { Empty, Placement, Bodies, Position, Velocity, Acceleration };

/// T is double, or Lanes for several nodes at once (inside the library).
/// All spatial quantities are in world coordinates about the world origin, so that recursions only add.
/// Shapes: nb = numBodies (world first), nv = velocity coordinates. "Writer" is the function that fills a field.
template <typename T>
struct WorkspaceOf {
  explicit WorkspaceOf(const Model& model);

  WorkspaceStage stage = WorkspaceStage::Empty;

  VectorX<T> armature;  ///< nv, that of the model unless the caller changes it

  // Writer: updatePositions
  VectorX<T> q;                ///< nq
  std::vector<SE3Of<T>> X_WB;  ///< nb, placements of the bodies
  Matrix6X<T> J;               ///< 6 x nv, twist per unit of each velocity coordinate
  std::vector<Matrix6<T>> Y;   ///< nb, spatial inertias

  // Writer: updateVelocities. For dof k, w_k is the velocity of the side that carries its axis and w-_k that of the
  // side that its coordinate does not move (rnea.h); dJ and dV differ for spherical, planar and free-flyer joints only.
  VectorX<T> v;                ///< nv
  std::vector<Vector6<T>> V;   ///< nb, body velocities
  Matrix6X<T> w_minus;         ///< 6 x nv
  Matrix6X<T> dJ;              ///< 6 x nv, dJ_k/dt = w_k x J_k
  Matrix6X<T> dV;              ///< 6 x nv, w-_k x J_k
  std::vector<Vector6<T>> h;   ///< nb, momenta Y V
  std::vector<Vector6<T>> hc;  ///< nb, their sums over subtrees

  // Writers: updateAccelerations, and updateDrift and updateInverseDynamics of all but dA. Gravity is included: the
  // world accelerates at -g.
  VectorX<T> a;               ///< nv
  std::vector<Vector6<T>> A;  ///< nb, body accelerations minus g
  Matrix6X<T> dA;             ///< 6 x nv, see rnea.h

  // Writers: updateMassMatrix, updateBias
  MatrixX<T> M;                ///< nv x nv, armature included
  VectorX<T> b;                ///< nv, Coriolis, centrifugal and gravity terms, less the joint forces of the model
  std::vector<Matrix6<T>> Yc;  ///< nb, composite inertias of the subtrees

  // Writer: updateInverseDynamicsDerivatives
  std::vector<Vector6<T>> F;    ///< nb, force through each joint (subtree sums)
  std::vector<Matrix3<T>> Bc;   ///< nb, subtree sums of the angular blocks of B (see rnea.h)
  Matrix6X<T> YJ, BtJ, Gq, Gv;  ///< 6 x nv, per dof factors of the derivatives
  VectorX<T> stiffness;         ///< nv, of joint forces: -dtau/dq
  VectorX<T> resistance;        ///< nv, of joint forces: -dtau/dv
  MatrixX<T> dID_dq, dID_dv;    ///< nv x nv
};

using Workspace = WorkspaceOf<double>;

/// Throws std::logic_error naming `call` unless the workspace has reached the stage.
template <typename T>
void requireStage(const WorkspaceOf<T>& ws, WorkspaceStage stage, const char* function, const char* call);
/// The same for functions that read only the velocities of bodies: Bodies, or Velocity and later.
void requireBodyVelocities(const Workspace& ws, const char* function);

}  // namespace bielle
