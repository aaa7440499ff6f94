#pragma once
/// \file The reduction ratio between motors and joints of a linkage (linkage.h) at a configuration, along the motion of a
/// joint, and over the ranges of two joints (the paper's figure of the reduction ratio).
///
/// With q_M and q_J the coordinates of m motors and m joints, N a basis of the tangent space at a closed configuration and
/// N_M, N_J its rows of the motors and of the joints,
///     v_M = R v_J,    R = N_M N_J^{-1}    (m x m),        tau_J = R^T u_M    (virtual work)                        (1)
/// R is the paper's reduction ratio (its section IV-A), the speed of the motor over that of the joint. It does not
/// depend on the basis. Along the tangent T = N N_J^{-1}, which has unit joint speeds, the second derivatives follow
/// from the drift of the closures, J a + gamma(v) = 0, with a_J = 0:
///     d^2 q_M / dt^2 = a_M(w),    a(w) = -(I - T P_J) J^+ gamma(T w),    w = v_J constant                          (2)
/// where P_J selects the joints' rows. a_M is quadratic in w, so that its polarization gives the derivative of R:
///     dR_ij / dq_J,k = (a_M,i(e_j + e_k) - a_M,i(e_j) - a_M,i(e_k)) / 2.                                           (3)
/// At a dead point of the output N_J is singular: a combination of the joints stands still while the motors move, R is
/// infinite, motor torques do not reach the joint, and joint torques are carried by the rods. At a dead point of the
/// motors N_M is singular: so is R, and the motors cannot hold the joint.
///
/// Sweeping one joint while the other joints of the linkage stand still gives a curve q(s) of closed configurations, s
/// its length over all dofs of the cluster (rad and m alike). With C a unit vector that keeps the held joints still,
/// N_held C = 0,
///     dq/ds = N C.                                                                                                 (4)
/// The curve is followed by steps along (4), corrected onto the closures and the held angles, in both directions from
/// the start until a joint reaches its limit, the closures lose rank or do not close, or the linkage comes back to its
/// start after a full turn. It passes smoothly through dead points, which are roots along s of
///     output:  v_j(s) = N_j C,       motors:  det N_M(s),                                                          (5)
/// found by bracketing; N is oriented along the curve, det(N(s)^T N(s')) > 0 from step to step. At a dead point of the output the angle reverses, and another branch of the ratio as a function
/// of the joint angle begins. Branch 0 contains the start.
#include <optional>
#include <string>
#include <vector>

#include "bielle/dynamics/linkage.h"

namespace bielle {

struct LinkageRatio {
  MatrixXd R;                ///< m x m, Eq. (1): row of the motor, column of the joint; rad/rad, or m where prismatic
  std::vector<MatrixXd> dR;  ///< m, derivative of R with respect to each joint, Eq. (3)
  double condition = 1;      ///< largest over smallest singular value of R
};

struct RatioSample {
  double s = 0;        ///< length along the curve from the start
  int branch = 0;      ///< counted by dead points of the output from the start
  VectorXd joints;     ///< m, angles of the linkage's joints (m where prismatic), not wrapped
  VectorXd motors;     ///< m
  LinkageRatio ratio;  ///< at a dead point of the output: infinite R and condition, zero dR
  DeadPointKind dead = DeadPointKind::None;
  std::optional<DeadPoint> nearest;  ///< from addDistances(): with the other joints free to move
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

  std::vector<RatioSample> deadPoints() const;
};

/// \param q  closed configuration of the whole model to start from
/// \param joint  which joint of the linkage is swept; the others keep their angles of q
/// \throws InputError when the start is a dead point of the swept joint
RatioSweep sweepRatio(const Model& model, const Linkage& linkage, ConstVectorRef q, int joint = 0,
                      const SweepOptions& options = {});

/// Sets RatioSample::nearest (linkage.h); at a dead point the distance is 0. \param q  as for sweepRatio()
void addDistances(const Model& model, const Linkage& linkage, ConstVectorRef q, RatioSweep& sweep);

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
