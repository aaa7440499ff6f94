#pragma once
/// \file The caller-owned memory of all dynamics functions, one per thread or shooting node.
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// How far a workspace has been filled for the present (q, v, a). Each update* function sets its stage, and a function
/// that needs an earlier stage calls requireStage(), which throws std::logic_error naming the missing call.
enum class WorkspaceStage { Empty, Placement, Position, Velocity, Acceleration };

/// All spatial quantities are in world coordinates about the world origin, so that recursions only add.
/// Shapes: nb = numBodies (world first), nv = velocity coordinates. "Writer" is the function that fills a field.
struct Workspace {
  explicit Workspace(const Model& model);

  WorkspaceStage stage = WorkspaceStage::Empty;

  // Writer: updatePositions
  VectorXd q;               ///< nq
  std::vector<SE3> X_WB;    ///< nb, placements of the bodies
  Matrix6Xd J;              ///< 6 x nv, twist per unit of each velocity coordinate
  std::vector<Matrix6d> Y;  ///< nb, spatial inertias

  // Writer: updateVelocities. Per dof k, w_k is the velocity of what carries its axis and w-_k that of what its
  // coordinate leaves still; they differ for spherical, planar and free-flyer joints only (see rnea.h).
  VectorXd v;                ///< nv
  std::vector<Vector6d> V;   ///< nb, body velocities
  Matrix6Xd w_minus;         ///< 6 x nv
  Matrix6Xd dJ;              ///< 6 x nv, dJ_k/dt = w_k x J_k
  Matrix6Xd dV;              ///< 6 x nv, w-_k x J_k
  std::vector<Vector6d> h;   ///< nb, momenta Y V
  std::vector<Vector6d> hc;  ///< nb, their sums over subtrees

  // Writer: updateAccelerations. Gravity is included: the world accelerates at -g.
  VectorXd a;               ///< nv
  std::vector<Vector6d> A;  ///< nb, body accelerations minus g
  Matrix6Xd dA;             ///< 6 x nv, see rnea.h

  // Writers: updateMassMatrix, updateBias
  MatrixXd M;                ///< nv x nv, armature included
  VectorXd b;                ///< nv, Coriolis, centrifugal and gravity terms
  std::vector<Matrix6d> Yc;  ///< nb, composite inertias of the subtrees

  // Writer: updateInverseDynamicsDerivatives
  std::vector<Vector6d> F;    ///< nb, force through each joint (subtree sums)
  std::vector<Matrix3d> Bc;   ///< nb, subtree sums of the angular blocks of B (see rnea.h)
  Matrix6Xd YJ, BtJ, Gq, Gv;  ///< 6 x nv, per dof factors of the derivatives
  MatrixXd dID_dq, dID_dv;    ///< nv x nv
};

/// Throws std::logic_error naming `call` unless the workspace has reached the stage.
void requireStage(const Workspace& ws, WorkspaceStage stage, const char* function, const char* call);

}  // namespace bielle
