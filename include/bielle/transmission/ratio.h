#pragma once
/// \file The linkage between motors and joints, and its reduction ratio at a configuration, along the motion of a
/// joint, and over the ranges of two joints (the paper's figure of the reduction ratio).
///
/// A loop cluster of mobility m has m motors and m chosen joints, with coordinates q_M and q_J. With N a basis of the
/// tangent space at a closed configuration and N_M, N_J the rows of the motors and of the joints,
///     v_M = R v_J,    R = N_M N_J^{-1}    (m x m),        tau_J = R^T u_M    (virtual work)                        (1)
/// R is the paper's reduction ratio (its section IV-A), the speed of the motor over that of the joint. It does not
/// depend on the basis. Along the tangent T = N N_J^{-1}, which has unit joint speeds, the second derivatives follow
/// from the drift of the closures, J a + gamma(v) = 0, with a_J = 0:
///     d^2 q_M / dt^2 = a_M(w),    a(w) = -(I - T P_J) J^+ gamma(T w),    w = v_J constant                          (2)
/// where P_J selects the joints' rows. a_M is quadratic in w, so that its polarization gives the derivative of R:
///     dR_ij / dq_J,k = (a_M,i(e_j + e_k) - a_M,i(e_j) - a_M,i(e_k)) / 2.                                           (3)
/// At a dead point of the joint N_J is singular: a combination of the joints stands still while the motors move, R is
/// infinite, motor torques do not reach the joint, and joint torques are carried by the rods. At a dead point of the
/// motor N_M is singular: so is R, and the motors cannot hold the joint.
///
/// Sweeping one joint while the other joints of the linkage stand still gives a curve q(s) of closed configurations, s
/// its length over all dofs of the cluster (rad and m alike). With C a unit vector that keeps the held joints still,
/// N_held C = 0,
///     dq/ds = N C.                                                                                                 (4)
/// The curve is followed by steps along (4), corrected onto the closures and the held angles, in both directions from
/// the start until a joint reaches its limit, the closures lose rank or do not close, or the linkage comes back to its
/// start after a full turn. It passes smoothly through dead points, which are roots along s of
///     joint:  v_j(s) = N_j C,        motor:  det [N_M C, N_M H](s),   N_held H = I,                                (5)
/// found by bracketing. At a dead point of the joint the angle reverses, and another branch of the ratio as a function
/// of the joint angle begins. Branch 0 contains the start.
#include <memory>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct ReducedCluster;

/// Motors and joints of one loop cluster, as many as its mobility; or a joint outside all loops with its own motor.
struct Linkage {
  std::vector<int> joints;                            ///< m, indices in the whole model, the requested ones first
  std::vector<int> motors;                            ///< m, indices into Model::motors()
  std::vector<int> joint_dofs, motor_dofs;            ///< m each, velocity coordinates of the cluster
  std::vector<int> joint_positions, motor_positions;  ///< m each, entries of the cluster's q
  std::vector<std::string> joint_names, motor_names;
  std::shared_ptr<const ReducedCluster> cluster;  ///< with a metric of ones; no joints for a joint outside all loops

  int size() const { return static_cast<int>(joints.size()); }
  bool isDirect() const;  ///< the motor sits on the joint: R = 1 everywhere
};

/// The linkage that drives the joints. When the linkage has more mobility than joints are named, the other serial
/// joints of the model in it are added.
/// \param q  nq, closed: where the mobility of the linkages is evaluated
/// \throws ModelError when a joint is unknown, has several coordinates, is not driven, or when mobility, joints and
/// motors of the linkage do not match
Linkage makeLinkage(const Model& model, ConstVectorRef q, const std::vector<std::string>& joints);

struct LinkageRatio {
  MatrixXd R;                ///< m x m, Eq. (1): row of the motor, column of the joint; rad/rad, or m where prismatic
  std::vector<MatrixXd> dR;  ///< m, derivative of R with respect to each joint, Eq. (3)
  double condition = 1;      ///< largest over smallest singular value of R
};

enum class DeadPointKind { None, Joint, Motor };
/// "", "joint", "motor"
const char* getName(DeadPointKind kind);

struct RatioSample {
  double s = 0;        ///< length along the curve from the start
  int branch = 0;      ///< counted by dead points of the joint from the start
  VectorXd joints;     ///< m, angles of the linkage's joints (m where prismatic), not wrapped
  VectorXd motors;     ///< m
  LinkageRatio ratio;  ///< at a dead point of the joint: infinite R and condition, zero dR
  DeadPointKind dead = DeadPointKind::None;
  bool loses_rank = false;  ///< the loops can continue in several ways; the ratio is that of the branch followed so far
  VectorXd q;               ///< configuration of the cluster; empty for a direct linkage
};

/// q (nq of the whole model) with the linkage as in the sample.
VectorXd carryLinkage(const Model& model, const Linkage& linkage, const RatioSample& sample, ConstVectorRef q);

struct SweepOptions {
  double step = 0.02;        ///< largest step along the curve, rad or m (norm over all dofs of the cluster)
  double length = 200;       ///< largest length of the curve
  double tolerance = 1e-12;  ///< of dead points and limits, along the curve
};

struct RatioSweep {
  int joint = 0;                     ///< which joint of the linkage is swept
  std::vector<RatioSample> samples;  ///< in increasing s, dead points included
  std::string begin, end;            ///< why the curve ends there
  bool full_turn = false;            ///< both ends are the same configuration

  std::vector<RatioSample> getDeadPoints() const;
};

/// \param q  closed configuration of the whole model to start from
/// \param joint  which joint of the linkage is swept; the others keep their angles of q
/// \throws ModelError when the start is a dead point of the swept joint
RatioSweep sweepRatio(const Model& model, const Linkage& linkage, ConstVectorRef q, int joint = 0,
                      const SweepOptions& options = {});

/// R over the ranges of both joints of a linkage of mobility two, as far as they can be reached without crossing a dead
/// point: rows of equal angle of the first joint, along each of which the second joint is swept.
struct RatioMap {
  std::vector<double> first, second;  ///< angles of the grid
  std::vector<std::vector<RatioSample>>
      rows;                              ///< per angle of `first`, in increasing angle of the second, as far as reached
  std::vector<RatioSample> dead_points;  ///< ends of the rows, and of the path from row to row
};
/// \param count  angles of the first joint; those of the second have the same spacing
RatioMap mapRatio(const Model& model, const Linkage& linkage, ConstVectorRef q, int count = 25,
                  const SweepOptions& options = {});

/// Deviation of the constrained dynamics of the whole robot from Eq. (1): at rest, a unit torque of each motor is
/// balanced by -R^T of it on the joints, in addition to the torques that hold gravity. Returns the largest remaining
/// acceleration relative to those of either side, or of a unit torque of a joint, alone (at a dead point of the motor
/// both sides give none).
/// \param q  nq of the whole model, closed, with the cluster at the configuration where R was taken
double calcBalanceError(const Model& model, const Linkage& linkage, ConstVectorRef q, const MatrixXd& R);

}  // namespace bielle
