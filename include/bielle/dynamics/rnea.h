#pragma once
/// \file Inverse dynamics and its analytic derivatives (RNEA, CRBA), after Carpentier and Mansard, "Analytical
/// derivatives of rigid body dynamics algorithms" (RSS 2018), extended to axes that do not move with their joint
/// (universal joint).
///
/// Everything is written in world coordinates about the world origin. For a dof k, let w-_k, a-_k be the velocity and
/// acceleration of the side that its coordinate does not move (the parent body; for the second axis of a universal
/// joint, the parent plus the first axis) and w_k the velocity of the side that carries its axis (the child body; for a
/// universal joint, w_k = w-_k):
///     V_i = sum_{k <= i} J_k v_k,    dJ_k/dt = w_k x J_k,    A_i = -g + sum_{k <= i} (J_k a_k + dJ_k v_k)         (1)
/// A change of q_k moves everything after it rigidly by J_k. In the coordinates of body i, which hide that motion,
///     dV_i/dq_k = dV_k,                dV_k = w-_k x J_k                                                          (2)
///     dA_i/dq_k = dA_k - V_i x dV_k,   dA_k = a-_k x J_k + w-_k x dV_k                                            (3)
///     dV_i/dv_k = J_k,                 dA_i/dv_k = dJ_k + dV_k - V_i x J_k                                        (4)
/// so that the force f_i = Y_i A_i + V_i x* Y_i V_i - f_ext,i varies in those coordinates by
///     df_i/dq_k = Y_i dA_k + B_i dV_k,   df_i/dv_k = Y_i (dJ_k + dV_k) + B_i J_k                                  (5)
///     B x = -Y (V x x) + x x* (Y V) + V x* (Y x)                                                                  (6)
/// where columns no longer depend on i: Y and B are summed over subtrees (index c). With F_i the subtree sum of f:
///     tau_j = J_j . F_j
///     dtau_j/dq_k = J_j . (Yc_j dA_k + Bc_j dV_k)                  J_j moves with k (k before j, or same joint)   (7)
///     dtau_j/dq_k = J_j . (Yc_k dA_k + Bc_k dV_k + J_k x* F_k)     k after j                                      (8)
///     dtau_j/dv_k = J_j . (Yc_m (dJ_k + dV_k) + Bc_m J_k)          m the later of j and k                         (9)
///     M_jk = J_j . Yc_m J_k                                                                                      (10)
/// With Y = (m 1, -m c^; m c^, I) and the momentum (p, l) = Y V about the world origin, hats for cross products, most
/// of B cancels:
///     B = (0, -2 p^; 0, B_a),    B_a = w^ I - I w^ - m (c v^T + v c^T) + 2 m (c.v) 1 - l^                         (11)
/// Joint forces of the model depend on the coordinate of their own joint alone: -dtau/dq and -dtau/dv add to entry
/// (k, k) of (7) and (9). A spring between two points is a wrench on both bodies that counts among f_ext, and whose change in
/// the coordinates of the bodies is added to both ends: Eq. (4) of dynamics/point_spring.h.
/// External forces f_ext are taken as fixed in their body's coordinates; the caller adds any other dependence on q.
#include "bielle/dynamics/workspace.h"

namespace bielle {

/// Mass matrix by composite inertias, Eq. (10), armature on its diagonal; needs updatePositions.
void updateMassMatrix(const Model& model, Workspace& ws);

/// Composite inertias and momenta of the dofs (fields Yc, YJ) alone; needs updatePositions.
template <typename T>
void updateCompositeInertias(const Model& model, WorkspaceOf<T>& ws);

/// Bias b(q, v), gravity and joint forces included; needs updateVelocities.
void updateBias(const Model& model, Workspace& ws);

/// Accelerations (field A) for a = 0 alone; needs updateVelocities.
template <typename T>
void updateDrift(const Model& model, WorkspaceOf<T>& ws);

/// M a + b(q, v) in the field b, and the accelerations for a (nv); needs updateVelocities.
template <typename T>
void updateInverseDynamics(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector a);

/// Generalized forces of the motion (q, v, a), all given (updates positions, velocities and accelerations).
VectorXd calcInverseDynamics(const Model& model, Workspace& ws, ConstVectorRef q, ConstVectorRef v, ConstVectorRef a);

/// The per-dof factors of Eqs. (7) to (9) and the subtree sums behind them (fields F, Yc, Bc, YJ, BtJ, Gq, Gv,
/// stiffness, resistance); needs updateAccelerations.
/// \param f_ext per body (nb), world wrenches that move with their body, or empty
template <typename T>
void updateInverseDynamicsFactors(const Model& model, WorkspaceOf<T>& ws,
                                  const typename ArgumentsOf<T>::Wrenches& f_ext);

/// Derivatives of ID(q, v, a) - sum_i J_i^T f_ext,i with respect to q (tangent) and v, at the state and acceleration of
/// the workspace; needs updateAccelerations. Arguments as above.
void updateInverseDynamicsDerivatives(const Model& model, Workspace& ws, const std::vector<Vector6d>& f_ext);

/// Entry (j, k) of the derivatives with respect to q and v, for dofs of one path to the root (or one joint), from the
/// factors.
template <typename T>
struct DerivativeEntry {
  T q, v;
};
template <typename T>
DerivativeEntry<T> calcDerivativeEntry(const Model& model, const WorkspaceOf<T>& ws, int j, int k) {
  const Dof &dj = model.dofs()[j], &dk = model.dofs()[k];
  const bool moves = dj.joint == dk.joint ? !(dj.first_of_universal && dk.second_of_universal) : k < j;
  if (j == k)
    return {ws.YJ.col(k).dot(ws.dA.col(k)) + ws.BtJ.col(k).dot(ws.dV.col(k)) + ws.stiffness[k],
            ws.YJ.col(k).dot(ws.dJ.col(k) + ws.dV.col(k)) + ws.BtJ.col(k).dot(ws.J.col(k)) + ws.resistance[k]};
  if (moves)
    return {ws.YJ.col(j).dot(ws.dA.col(k)) + ws.BtJ.col(j).dot(ws.dV.col(k)),                 // Eq. (7)
            ws.YJ.col(j).dot(ws.dJ.col(k) + ws.dV.col(k)) + ws.BtJ.col(j).dot(ws.J.col(k))};  // Eq. (9)
  return {ws.J.col(j).dot(ws.Gq.col(k)), ws.J.col(j).dot(ws.Gv.col(k))};                      // Eqs. (8), (9)
}

}  // namespace bielle
