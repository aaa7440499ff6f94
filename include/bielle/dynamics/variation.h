#pragma once
/// \file First-order change of the dynamics with the mechanism (its lengths, attachments of closures, inertias) and
/// its motion.
///
/// A direction is a change of the model and of its motion. Forward through the tree, in world coordinates, with D_i
/// the displacement of body i (a twist), D_0 = 0, p its parent and X_WJ the placement of the joint's frame in the
/// world:
///     D_i   = D_p + X_WJ xi_i + sum_k J_k dq_k                                                                     (1)
///     dJ_k  = D x J_k                                                                                              (2)
///     dV_i  = dV_p + sum_k (J_k dv_k + dJ_k v_k)                                                                   (3)
///     dA_i  = dA_p + sum_k (J_k da_k + dJ_k a_k + (w_k x J_k) dv_k + (dw_k x J_k + w_k x dJ_k) v_k)                (4)
/// where xi_i is the twist by which the joint's frame moves in the body that carries it, k runs over the dofs of joint
/// i, and D, w_k, dw_k are the displacement, the velocity and its change on the side that carries axis k: body i, or
/// for a universal joint the side before the axis. So the placement of a joint acts like the coordinate of a joint in
/// front of it that does not move. The forces Y A + V x* Y V follow with
///     dY = [D x*] Y - Y [D x] + X_WB (dY in the body) X_WB^*                                                       (5)
/// and a closure force, fixed in frame 1, turns with it: with D_1 = D_b1 + X_W1 xi_1 (D_2 likewise),
///     dW = D_1 x* W,    dtau_k = dJ_k . F + J_k . dF                                                               (6)
/// F being the sums over subtrees. For the closures, in frame 1 (notation.h),
///     d residual = R (D_1 - D_2),    d nu_c = dV_1 - dV_2 - D_1 x (V_1 - V_2)                                      (7)
///     d a_c = dA_1 - dA_2 + dV_1 x V_2 + V_1 x dV_2 - D_1 x (A_1 - A_2 + V_1 x V_2)                                (8)
/// A coupler of polynomials p_k with the offset c_0 has, with dp_k the polynomials of the changes of coefficients,
///     d residual = dc_0 - sum dp_k + p_k' dq_k,   d nu_c = sum dp_k' v_k + p_k'' v_k dq_k + p_k' dv_k              (9)
///     d a_c = sum dp_k' a_k + dp_k'' v_k^2 + (p_k'' a_k + p_k''' v_k^2) dq_k + 2 p_k'' v_k dv_k + p_k' da_k
/// and its force on coordinate k, p_k' lambda, changes by (dp_k' + p_k'' dq_k) lambda. The rows of a distance, and its force,
/// change as well as its direction p / L turns, by Eqs. (8) and (9) of closure.h with the displacement D_1 - D_2, and as L changes.
/// The force f u of a point spring (model.h) changes, with dp_i the displacement of its point and dp'_i the change of the
/// velocity of that, with r = p_2 - p_1 and u = r / l, by
///     dl = u . dr,   du = (dr - u dl) / l,   dl' = du . r' + u . dr'
///     d(f u) = (k dl + c dl' + dk (l - rest) - k d rest + d preload + dc l') u + f du                             (10)
/// and the force tau of a spring, damper and friction on a joint (model.h), with s(v) the smooth sign, by
///     dtau = d preload - dk (q - rest) + k d rest - dc v - d friction s(v)                                        (11)
/// beside its changes with q and v.
/// Forward dynamics change by Eq. (5) of saddle_point.h. With redundant rows, this holds for changes that keep them
/// redundant: any other change would alter the rank.
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/distance.h"

namespace bielle {

/// Of a joint's force: by stiffness, rest, preload, damping and friction.
using Vector5d = Eigen::Matrix<double, 5, 1>;

/// Change of a shape: twist of its frame, and of its sizes.
struct ShapeVariation {
  Vector6d frame = Vector6d::Zero();  ///< of Shape::X_BS
  Vector3d half = Vector3d::Zero();
  double radius = 0;
};

/// A direction in which a model changes, per unit of a length or number. Twists are those of a frame in its own
/// coordinates: X exp6(t twist). Initially zero.
struct ModelVariation {
  explicit ModelVariation(const Model& model);

  std::vector<Vector6d> joints;   ///< nb, of Joint::X_PJ
  std::vector<Vector6d> frames1;  ///< per closure of the model, of Closure::X_B1
  std::vector<Vector6d> frames2;  ///< and X_B2
  /// Per closure of the model, of the coefficients of its terms (rows) of q, q^2, .. (columns).
  std::vector<MatrixXd> coefficients;
  std::vector<double> offsets;           ///< and Closure::offset
  std::vector<double> lengths;           ///< and Closure::length
  std::vector<Vector3d> points1;         ///< per point spring of the model, of PointSpring::point1
  std::vector<Vector3d> points2;         ///< and point2
  std::vector<Eigen::Vector4d> springs;  ///< and of its stiffness, rest, preload and damping
  std::vector<Vector5d> joint_forces;    ///< per joint force of the model
  std::vector<Vector6d> contacts;        ///< per contact of the model, of ContactFrame::X_BF
  std::vector<ShapeVariation> shapes;    ///< per shape of the model
  std::vector<Matrix6d> inertias;        ///< nb, of Inertia::toMatrix() in the body's frame
  VectorXd armature;                     ///< nv
};

/// Changes of configuration (tangent), velocity and acceleration, nv each. Initially zero.
struct MotionVariation {
  explicit MotionVariation(const Model& model);
  VectorXd q, v, a;
};

/// Eqs. (1) to (4) for one direction, and memory for Eqs. (5) to (8).
struct VariationWorkspace {
  explicit VariationWorkspace(const Model& model);
  std::vector<Vector6d> D, dV, dA;  ///< nb, displacements, and changes of V and A in the world
  Matrix6Xd dJ;                     ///< 6 x nv, in the world
  std::vector<Vector6d> F, dF;      ///< nb, forces of subtrees and their changes
  MotionVariation motion;           ///< of the direction
};

/// Eqs. (1) to (4); needs updateAccelerations.
void updateVariation(const Model& model, const Workspace& ws, const ModelVariation& change,
                     const MotionVariation& motion, VariationWorkspace& variation);

/// Change (nv) of M a + b - J^T lambda at fixed lambda (rows), Eqs. (5) and (6); needs updateVariation.
VectorXd calcInverseDynamicsVariation(const Model& model, const Workspace& ws, const ConstraintSet& constraints,
                                      ConstVectorRef lambda, const ModelVariation& change,
                                      const MotionVariation& motion, VariationWorkspace& variation);

/// Changes (rows) of residuals, velocities and stabilised accelerations of all closures of the set, Eqs. (7) and (8);
/// need updateVariation. Contacts are found in the model by name.
VectorXd calcResidualVariation(const Workspace& ws, const ConstraintSet& constraints, const ModelVariation& change,
                               const VariationWorkspace& variation);
VectorXd calcVelocityVariation(const Workspace& ws, const ConstraintSet& constraints, const ModelVariation& change,
                               const VariationWorkspace& variation);
VectorXd calcAccelerationVariation(const Workspace& ws, const ConstraintSet& constraints, const ModelVariation& change,
                                   const VariationWorkspace& variation);

/// Accelerations and forces of forward dynamics, one column per direction.
struct DynamicsVariation {
  MatrixXd a;       ///< nv x directions
  MatrixXd lambda;  ///< rows x directions; with redundant rows determined up to the null space of J^T
};

/// Changes at fixed torques and, where `motions` is empty, at fixed (q, v); else motions[i].q and .v go with
/// changes[i]. To be called after updateConstrainedDynamics.
DynamicsVariation calcConstrainedVariation(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                           const ConstraintSet& constraints, const std::vector<ModelVariation>& changes,
                                           const std::vector<MotionVariation>& motions = {});

/// Change of the distance between shapes a and b of the model, given by their indices, by Eq. (3) of distance.h; needs
/// updateVariation.
double calcDistanceVariation(const Model& model, const Workspace& ws, int a, int b, const ShapeDistance& distance,
                             const ModelVariation& change, const VariationWorkspace& variation);

}  // namespace bielle
