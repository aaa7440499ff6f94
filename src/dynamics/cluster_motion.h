#pragma once
/// \file First-order motion of a loop cluster with its reduced coordinates.
///
/// A change (dy, dy_v) of the reduced state of a cluster moves its dofs by
///     dq = N dy,   dv = N dy_v + Z dy,   Z = -J^+ d(J v)/dq N                                                      (1)
/// since J v = 0 is maintained, and its accelerations, at fixed reduced accelerations, by
///     da = d_y dy + d_v dy_v,   d_y = -J^+ (C_q N + C_v Z),   d_v = -J^+ C_v N                                     (2)
/// with C_q, C_v the derivatives of the closure accelerations. With the columns of rnea.h summed over the path to a
/// dof,
///     J~ = sum J_k N_k,                          dV~ = sum dV_k N_k + J_k Z_k,
///     dA~ = sum dA_k N_k + (dJ + dV)_k Z_k + J_k d_y,k,      dW~ = sum (dJ + dV)_k N_k + J_k d_v,k                 (3)
/// is the effect of the coordinate on everything after that dof, in the coordinates of the bodies it moves. A dof acts
/// on a closure through the frame that it moves: the derivatives of closure.h, Eqs. (1) to (3), along a coordinate are
/// those of its columns with J_k, dV_k, .. replaced by the difference of (3) between body 1 and body 2. So the effort
/// is linear in the number of dofs, not quadratic.
#include "dynamics/closure_change.h"
#include "dynamics/reduction.h"

namespace bielle {

/// A cluster in the workspace of the whole model or in its own.
template <typename T>
struct ClusterViewOf {
  const WorkspaceOf<T>& ws;
  const std::vector<Closure>& closures;  ///< with the bodies of the workspace
  const std::vector<int>& dofs;          ///< n, in the workspace
};
template <typename T>
ClusterViewOf<T> getPlacedView(const ReducedCluster& cluster, const WorkspaceOf<T>& whole) {
  return {whole, cluster.placed, cluster.dofs};
}
template <typename T>
ClusterViewOf<T> getOwnView(const ReducedCluster& cluster, const WorkspaceOf<T>& own) {
  return {own, cluster.closures.closures, cluster.own_dofs};
}

/// First-order motion of a cluster; n dofs, r reduced coordinates. Column n c + k of a sum (3) belongs to coordinate c
/// at dof k; all dofs of a group have the sum over the group.
template <typename T>
struct ClusterMotionOf {
  explicit ClusterMotionOf(const ReducedCluster& cluster);
  const ReducedCluster& cluster;
  const ClusterBasisOf<T>* basis = nullptr;
  MatrixX<T> Z, dy, dv;       ///< n x r, Eqs. (1), (2)
  Matrix6X<T> J, dV, dA, dW;  ///< 6 x (n r), Eq. (3)
  MatrixX<T> C_q, C_v;        // m x r, derivatives of the closure rows
  MatrixX<T> X;               // rank x r
};
using ClusterMotion = ClusterMotionOf<double>;

/// N and J~ at the bases of a point; needs the positions of the view.
template <typename T>
void updateTwists(const ClusterViewOf<T>& view, const ClusterBasisOf<T>& basis, ClusterMotionOf<T>& motion);
/// Z and dV~; needs updateTwists and the velocities of the view.
template <typename T>
void updateVelocityLift(const ClusterViewOf<T>& view, ClusterMotionOf<T>& motion);
/// d_y, d_v, dA~ and dW~; needs updateVelocityLift and the accelerations of the view.
template <typename T>
void updateAccelerationLift(const ClusterViewOf<T>& view, ClusterMotionOf<T>& motion);
/// out (n x r) = d(J^T f)/dq N for forces f on all rows (m), fixed in their frames 1 but for those of distances, which turn by
/// Eq. (9) of closure.h; needs updateTwists. With the wrench W of a closure and its dofs j and k, and with Eq. (7) of closure.h
/// for couplers,
///     d (J^T f)_j/dq_k = s_j J_j . (J_k x* W) ([k moves frame 1] - [k moves axis j])
template <typename T>
void calcGeometricStiffness(const ClusterViewOf<T>& view, const ClusterMotionOf<T>& motion,
                            typename ArgumentsOf<T>::ConstVector forces, typename ArgumentsOf<T>::Matrix out);
/// Drift of the independent closure rows (rank) for the accelerations held by the view.
/// \param changes  of the whole model's closures (closure_change.h), or empty
template <typename T>
void calcClusterDrift(const ClusterViewOf<T>& view, const ReducedCluster& cluster, const ClusterBasisOf<T>& basis,
                      typename ArgumentsOf<T>::Vector rows, typename ArgumentsOf<T>::Vector drift,
                      const std::vector<ClosureChangeOf<T>>& changes = {});

}  // namespace bielle
