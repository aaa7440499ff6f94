#pragma once
/// \file Configuration manifolds and motion subspaces of the joints.
///
/// Every joint is treated as a sequence of axes ("dofs"). The motion subspace S (6 x nv, child frame) is constant for
/// all kinds except the universal joint, whose first axis turns in the child frame when its second angle changes:
///     universal:  R = Exp(a1 q1) Exp(a2 q2),   S = [0, 0; Exp(a2 q2)^T a1, a2].
#include "bielle/model/model.h"
#include "math/lanes.h"

namespace bielle {

/// Placement of the child in the joint frame; q is the joint's own segment (nq).
SE3 calcJointPlacement(const Joint& joint, ConstVectorRef q);
/// Here and below, the template is the same for Lanes, or for either.
template <typename T>
SE3Of<T> calcJointPlacement(const Joint& joint, typename ArgumentsOf<T>::ConstVector q);

/// Motion subspace in the child frame, written to the first nv columns of S (6 x nv).
void calcJointSubspace(const Joint& joint, ConstVectorRef q, Eigen::Ref<Matrix6Xd> S);

/// q_out = q (+) dv (segments of the joint). Quaternions are normalised.
void integrateJoint(const Joint& joint, ConstVectorRef q, ConstVectorRef dv, VectorRef q_out);
template <typename T>
void integrateJoint(const Joint& joint, typename ArgumentsOf<T>::ConstVector q, typename ArgumentsOf<T>::ConstVector dv,
                    typename ArgumentsOf<T>::Vector q_out);
/// dv with q0 (+) dv = q1.
void calcJointDifference(const Joint& joint, ConstVectorRef q0, ConstVectorRef q1, VectorRef dv);
void calcJointDifference(const Joint& joint, ArgumentsOf<Lanes>::ConstVector q0, ArgumentsOf<Lanes>::ConstVector q1,
                         ArgumentsOf<Lanes>::Vector dv);
/// Jacobians of (q, dv) -> q (+) dv in tangent coordinates: of the result with respect to q and to dv (nv x nv each).
void calcJointIntegrateJacobians(const Joint& joint, ConstVectorRef dv, MatrixRef J_q, MatrixRef J_dv);
/// Jacobian of dv = q1 (-) q0 with respect to q1, as a function of dv (nv x nv): the inverse of J_dv above.
void calcJointDifferenceJacobian(const Joint& joint, ConstVectorRef dv, MatrixRef J_q1);
void calcJointDifferenceJacobian(const Joint& joint, ArgumentsOf<Lanes>::ConstVector dv,
                                 ArgumentsOf<Lanes>::Matrix J_q1);
/// Neutral configuration of a joint kind, written to q (nq).
void setNeutral(JointKind kind, VectorRef q);

/// Axes of the plane of a planar joint with unit normal n: right-handed (e1, e2, n), (x, y, z) for n = z.
Matrix3d makePlaneBasis(const Vector3d& normal);

}  // namespace bielle
