#pragma once
/// \file The linkage between motors and joints, and its reduction ratio.
///
/// A loop cluster of mobility m, m motors in it and m of its joints, with coordinates q_M and q_J. With N a basis of the
/// tangent space at a closed configuration (reduction.h) and N_M, N_J the rows of the motors and of the joints,
///     v_M = R v_J,    R = N_M N_J^{-1}    (m x m),        tau_J = R^T u_M    (virtual work)                           (1)
/// R is what the paper calls the reduction ratio (its section IV-A), the speed of the motor over that of the joint. It
/// does not depend on the basis. Along the tangent T = N N_J^{-1}, which has unit joint speeds, the second derivatives
/// follow from the drift of the closures, J a + gamma(v) = 0, with a_J = 0:
///     d^2 q_M / dt^2 = a_M(w),    a(w) = -(I - T P_J) J^+ gamma(T w),    w = v_J constant                             (2)
/// where P_J picks the joints' rows. a_M is quadratic in w, so that its polarization gives the derivative of R:
///     dR_ij / dq_J,k = (a_M,i(e_j + e_k) - a_M,i(e_j) - a_M,i(e_k)) / 2.                                              (3)
/// A dead point of the joint is where N_J is singular: some joint motion stands still while the motors move, R is
/// infinite, motor torques do not reach the joint but joint torques are carried by the rods. A dead point of the motor is
/// where N_M is singular: R is, and the motors cannot hold the joint.
#include <string>
#include <vector>

#include "bielle/dynamics/reduction.h"

namespace bielle {

/// Motors and joints of one loop cluster, as many as it has mobility; or a joint outside all loops with its own motor.
struct Linkage {
  ReducedCluster cluster;                   ///< with a metric of ones; no joints for a joint outside all loops
  std::vector<int> joints;                  ///< m, indices in the whole model, those asked for first
  std::vector<int> motors;                  ///< m, indices into Model::motors()
  std::vector<int> joint_dofs, motor_dofs;  ///< m each, velocity coordinates of the cluster
  std::vector<int> joint_positions, motor_positions;  ///< m each, entries of the cluster's q
  std::vector<std::string> joint_names, motor_names;

  int size() const { return static_cast<int>(joints.size()); }
  bool isDirect() const { return cluster.joints.empty(); }  ///< the motor sits on the joint: R = 1 everywhere
};

/// The linkage that drives the joints. When the linkage has more mobility than joints are named, the other serial joints
/// of the model in it are added.
/// \throws ModelError when a joint is unknown, has several coordinates, is driven by nothing, or when mobility, joints and
/// motors of the linkage do not match
Linkage makeLinkage(const Model& model, const Reduction& reduction, const std::vector<std::string>& joints);

struct LinkageRatio {
  MatrixXd R;                ///< m x m, Eq. (1): row of the motor, column of the joint; rad/rad, or m where prismatic
  std::vector<MatrixXd> dR;  ///< m, derivative of R with respect to each joint, Eq. (3)
  double condition = 1;      ///< largest over smallest singular value of R
};

/// Eqs. (1) to (3) at a point of the cluster. False at a dead point of the joint, where R is not finite.
bool calcLinkageRatio(const Linkage& linkage, ClusterPoint& point, LinkageRatio& out);

/// Velocities and accelerations of all dofs of the cluster (n) that go with those of its joints (m each): v = T v_J and, by
/// Eq. (2), a = T a_J + a(v_J). False at a dead point of the joint.
bool calcLinkageMotion(const Linkage& linkage, ClusterPoint& point, ConstVectorRef v_J, ConstVectorRef a_J, VectorXd& v,
                       VectorXd& a);

/// Tangent T = N N_J^{-1} (n x m) of unit joint speeds. False at a dead point of the joint.
/// \param margin  smallest singular value of N_J: the least that the joints move in a unit motion of the cluster; zero at a dead
/// point of the joint
bool calcLinkageTangent(const Linkage& linkage, const ClusterPoint& point, MatrixXd& T, double* margin = nullptr);

/// How far the constrained dynamics of the whole robot are from Eq. (1): at rest, a unit torque of each motor is balanced by
/// -R^T of it on the joints, on top of what holds gravity. Returns the largest acceleration that remains over those that
/// either side, or a unit torque of a joint, would give alone (at a dead point of the motor neither side gives any).
/// \param q  nq of the whole model, closed, with the cluster at the configuration where R was taken
double calcBalanceError(const Model& model, const Linkage& linkage, ConstVectorRef q, const MatrixXd& R);

}  // namespace bielle
