#pragma once
/// \file Closures and contacts: residual, velocity, Jacobian, acceleration and their derivatives (the paper's section
/// III).
///
/// With world spatial vectors, nu_c = V_1 - V_2 and a_c = A_1 - A_2 + V_1 x V_2 (the paper's eqs. 8 and 9), read in
/// frame 1. For a dof k that moves frame 1 only (s = +1) or frame 2 only (s = -1), in the coordinates of frame 1,
///     d a_c/dq_k  = s (dA_k - (V_1 + V_2) x dV_k + J_k x A_2 - V_1 x (J_k x V_2))                                  (1)
///     d a_c/dv_k  = s (dJ_k + dV_k - (V_1 + V_2) x J_k)                                                            (2)
///     d nu_c/dq_k = s (dV_k + J_k x V_2)                                                                           (3)
///     d nu_c/dv_k = d a_c/da_k = s J_k                                                                             (4)
/// where dV, dA, dJ are those of rnea.h; a dof that moves both frames changes nothing. (1) gathers the derivatives of
/// the paper's gamma_1, gamma_2 and gamma_3 (its eqs. 11 to 15): gamma_1 gives dA_k - V_1 x dV_k, gamma_2 gives dA_k -
/// V_2 x dV_k and, as frame 1 turns, J_k x A_2; the rest is gamma_3.
///
/// A coupler of the polynomials p_k has J_k = p_k', and its force acts on the coordinates alone, p_k' lambda each: it has no
/// wrench. Of a linear term, the derivatives
///     d a_c/dq_k = p_k'' a_k + p_k''' v_k^2,  d a_c/dv_k = 2 p_k'' v_k,  d nu_c/dq_k = p_k'' v_k                  (6)
///     d (J^T lambda)_k/dq_k = p_k'' lambda                                                                        (7)
/// vanish.
///
/// The rows of the other closures are constant projections of the full vectors, but for a distance of length L. In frame 1,
/// with the vector p from point 1 to point 2 and the linear and angular parts nu_l, nu_w of the full velocity,
///     nu = p . nu_l / L,    a = (p . a_l + p' . nu_l) / L,    p' = -(nu_l + nu_w x p)                              (8)
/// which is polynomial, and exact also when open. A displacement D of frame 1 against frame 2 that changes the full velocity and
/// acceleration by dnu and da, as (1) to (4) say, changes them by
///     d nu = (p . dnu_l + dp . nu_l) / L,    d a = (p . da_l + dp . a_l + p' . dnu_l + dp' . nu_l) / L,
///     dp = -(D_l + D_w x p),    dp' = -(dnu_l + dnu_w x p + nu_w x dp)                                             (9)
/// and its force lambda p / L on body 1 turns in frame 1 by lambda dp / L.
#include "bielle/dynamics/workspace.h"

namespace bielle {

/// A vector of at most six rows, without allocation.
template <typename T>
using VectorUpTo6 = Eigen::Matrix<T, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;
using RowVectorUpTo6 = VectorUpTo6<double>;
using RowsBy6 = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::ColMajor, 6, 6>;

/// A foot on the ground (or on a step) at a given place.
struct ContactTarget {
  int contact = 0;  ///< index into Model::contacts()
  SE3 X_WT;         ///< where the contact frame belongs; matters only with kp > 0
  double kp = 0;    ///< 1/s^2
  double kd = 0;    ///< 1/s
};

/// The closures in force: those of the model, then contacts as closures to the world, in the order given.
struct ConstraintSet {
  std::vector<Closure> closures;
  std::vector<int> contacts;  ///< indices into Model::contacts() of the contacts, in their order
  std::vector<int> offsets;   ///< first row of each closure
  int rows = 0;
  int num_loops = 0;  ///< the first num_loops closures are the model's

  /// Index into Model::contacts() of closure c >= num_loops.
  int getContact(int c) const { return contacts[c - num_loops]; }
};
ConstraintSet makeConstraintSet(const Model& model, const std::vector<ContactTarget>& contacts = {});

/// Selects the rows of a closure, but not of a distance, from a twist-like vector (6) in frame 1; of a coupler, the first entry.
template <typename T>
VectorUpTo6<T> selectRows(const Closure& closure, const Vector6<T>& full);
/// Wrench in frame 1 of forces on the rows. The force of a coupler, which has no wrench, and the tension of a distance, which
/// is one along its rod, become the first entry.
Vector6d expandRows(const Closure& closure, ConstVectorRef lambda);
template <typename T>
Vector6<T> expandRows(const Closure& closure, const VectorUpTo6<T>& lambda);

/// Closing error, m and rad: zero if and only if closed; of a coupler offset - sum p_k(q_k), of a distance
/// (|p|^2 - L^2) / (2 L). The angle part of a hinge is as long
/// as the angle between its axes, up to pi; where they are opposite, its direction is the first of the two normals.
template <typename T>
VectorUpTo6<T> calcClosureResidual(const WorkspaceOf<T>& ws, const Closure& closure);
/// The same for the placement X_12 of frame 2 in frame 1.
template <typename T>
VectorUpTo6<T> calcClosureResidual(const Closure& closure, const SE3Of<T>& X_12);
/// Norms of the residual: of its part in m, for a distance by how much it is too long or short, and of that in rad, to which
/// couplers belong.
struct ClosureGap {
  double position = 0, angle = 0;
};
ClosureGap calcClosureGap(const Workspace& ws, const Closure& closure);
/// Matrix R (rows x 6) with d residual/dt = R nu_c for the full velocity nu_c in frame 1, exact also when open (but within
/// 1e-6 rad of opposite axes of a hinge, where it is bounded); zero for couplers, which have no frames.
RowsBy6 calcClosureResidualRate(const Workspace& ws, const Closure& closure);
/// The same for the placement X_12 of frame 2 in frame 1.
RowsBy6 calcClosureResidualRate(const Closure& closure, const SE3& X_12);
/// Jacobian of the residual, R times that of nu_c, written to the columns closure.dofs of H (rows x nv); needs
/// updatePositions.
void calcClosureResidualJacobian(const Workspace& ws, const Closure& closure, MatrixRef H);

/// Velocity rows; needs updateVelocities.
RowVectorUpTo6 calcClosureVelocity(const Workspace& ws, const Closure& closure);
/// Acceleration rows for the accelerations held by the workspace (those of a = 0 after updateBias), without
/// stabilisation.
template <typename T>
VectorUpTo6<T> calcClosureAcceleration(const WorkspaceOf<T>& ws, const Closure& closure);
/// Right-hand offset of the stabilised constraint, kd nu_c - kp r (zero gains: zero).
RowVectorUpTo6 calcClosureStabilization(const Workspace& ws, const Closure& closure);

/// Jacobian rows, written to the columns closure.dofs of J (rows x nv), Eq. (4); other columns are left alone.
template <typename T>
void calcClosureJacobian(const WorkspaceOf<T>& ws, const Closure& closure, typename ArgumentsOf<T>::Matrix J);
/// Derivatives of the acceleration rows without stabilisation, Eqs. (1), (2) and (6), to the columns closure.dofs; needs
/// updateAccelerations.
void calcClosureDerivatives(const Workspace& ws, const Closure& closure, MatrixRef da_dq, MatrixRef da_dv);
/// Adds those of calcClosureStabilization, likewise; needs updateVelocities.
void addStabilizationDerivatives(const Workspace& ws, const Closure& closure, MatrixRef ds_dq, MatrixRef ds_dv);

/// Derivative of the velocity rows with respect to q at fixed v, Eqs. (3) and (6), to the columns closure.dofs; needs
/// updateVelocities.
void calcClosureVelocityDerivative(const Workspace& ws, const Closure& closure, MatrixRef dnu_dq);

/// World wrench of a closure force on body 1, that of a distance along its rod; zero for a coupler.
template <typename T>
Vector6<T> calcClosureWrench(const WorkspaceOf<T>& ws, const Closure& closure,
                             typename ArgumentsOf<T>::ConstVector lambda);
/// Adds to dID_dq what updateInverseDynamicsDerivatives omits of the closure force lambda: the wrench W on body 2 moves
/// with frame 1 (the paper's eq. 19),
///     d ID_j/dq_k += s J_j . (J_k x* W)   for j in the support of body 2, k in closure.dofs, (5)
/// for a distance what its turning adds, Eq. (9); and a coupler has Eq. (7), with a minus.
void addClosureForceDerivative(const Model& model, const Workspace& ws, const Closure& closure, ConstVectorRef lambda,
                               MatrixRef dID_dq);

}  // namespace bielle
