#pragma once
/// \file A linkage: motors, what they move, and the loops between them; its transmission, and how far it is from its dead
/// points.
///
/// A linkage is a loop cluster with as many motors as mobility m (up to 6), not counting what is idle: motions that move neither
/// motors nor output, as the spin of a rod on two balls. N (n x m) is an orthonormal basis of its other closed motions, N_M its
/// rows of the motors, and O N the motion of what the linkage is there for, its output: its
/// serial joints, where there are m of them; else the bodies that carry other joints, soles or (if there are none of
/// these) frames and do not spin idly, by their twists relative to the body that carries the linkage, with lengths over the
/// size of the linkage. Of the volumes
///     s_M = |det N_M|,    s_O = sqrt(det (O N)^T (O N))                                                            (1)
/// the first vanishes at dead points of the motors, where the linkage moves though its motors stand, and the second at
/// dead points of the output, which stands still while motors move. With T = N N_M^{-1} and Q = O T, the transmission
/// is
///     rho = +-s_O / s_M = +-sqrt(det Q^T Q), over that at a reference,                                             (2)
/// with the sign of det Q_0^T Q: 1 at the reference, 0 at a dead point of the output, infinite at one of the motors.
/// J T = 0 and T_M = 1 hold everywhere, so that with J' and O' the changes of the closure Jacobian and of O
///     dT = -(I - T P_M) J^+ J' T,    drho = rho tr(Q^+ dQ) = rho sum_j (Q^+ O' - y^T J')_j t_j,
///     y_j^T = e_j^T Q^+ O (I - T P_M) J^+,                                                                         (3)
/// t_j being the columns of T and P_M the selection of the motors' rows. None of this depends on the basis or on the metric.
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct ReducedCluster;

/// A loop cluster with its motors and its output. It does not change, copies share the cluster, and functions may be called
/// from several threads at once.
struct Linkage {
  std::shared_ptr<const ReducedCluster> cluster;  ///< metric of ones, no idle spins; without joints if isDirect()
  int index = 0;                                  ///< of the cluster among those of the robot
  std::vector<int> motors;                        ///< indices into Model::motors()
  std::vector<int> joints;                        ///< indices in the whole model; none where the output is bodies
  std::vector<std::string> motor_names, joint_names;
  std::vector<int> motor_dofs, joint_dofs;            ///< velocity coordinates of the cluster
  std::vector<int> motor_positions, joint_positions;  ///< entries of its q; -1 of joints of several coordinates
  std::string output;                                 ///< names of the joints, or of the bodies
  int idle = 0;                                       ///< motions that move neither motors nor output

  std::vector<Closure> bodies;  ///< of the output, as closures to the root: their velocity rows are the bodies' twists
  double length = 1;            ///< m, the size of the linkage
  MatrixXd reference;           ///< Q_0; empty where there is no reference
  double reference_volume = 1;  ///< +-sqrt(det Q_0^T Q_0): transmissions are over it

  int size() const { return static_cast<int>(motors.size()); }
  bool isDirect() const;  ///< the motor sits on the joint
};

/// The linkages of all loop clusters with as many motors as mobility (less what is idle), with their serial joints or bodies as
/// output.
/// \param q_reference  nq, closed   \throws InputError when it is open or a dead point
std::vector<Linkage> listLinkages(const Model& model, ConstVectorRef q_reference);
/// A loop cluster that moves and is not among them.
struct LinkageLeftOut {
  std::string name;         ///< of its serial joints, or "closure NAME"
  std::string why;          ///< "1 motor for a mobility of 2"
  bool has_motors = false;  ///< otherwise it is passive, and has no transmission
};
/// \param q_reference  nq, closed   \throws InputError when it is open
std::vector<LinkageLeftOut> listLinkagesLeftOut(const Model& model, ConstVectorRef q_reference);
/// The linkage that drives the joints, without a reference. When the linkage has more mobility than joints are named, the
/// other serial joints of the model in it are added. A joint outside all loops with its own motor is a linkage too.
/// \param q  nq, closed: where the mobility of the linkages is evaluated
/// \throws InputError when a joint is unknown, has several coordinates, is not driven, or when mobility, joints and
/// motors of the linkage do not match
Linkage makeLinkage(const Model& model, ConstVectorRef q, const std::vector<std::string>& joints);

/// Eq. (2) at a closed configuration (nq); 0 where the closures lose rank, and where both volumes vanish.
double calcTransmission(const Linkage& linkage, const Model& model, ConstVectorRef q);

enum class DeadPointKind {
  None,
  Output,  ///< the output stands still while the motors move
  Motors   ///< the motors stand still while the output moves
};
/// "", "output", "motors"
const char* getName(DeadPointKind kind);

struct DeadPoint {
  DeadPointKind kind = DeadPointKind::None;
  /// The largest way of a motor or of a joint of the output to there, rad (m where prismatic); where the output is bodies,
  /// of any hinge or slider. Infinite if there is none within kFarthestDeadPoint.
  double distance = std::numeric_limits<double>::infinity();
};
inline constexpr double kFarthestDeadPoint = 0.5;
/// "0.26", or "over 0.5", rad or m.
std::string formatDistance(const DeadPoint& point);
/// Nearer than this, motors turn far for little motion of the joint, or the other way round.
inline constexpr double kNearDeadPoint = 0.1;

/// The nearest dead point from a closed configuration (nq), found by Newton's method on the volumes (1) along closed
/// configurations: both ways with a mobility of one, else along the steepest descent of each.
DeadPoint findDeadPoint(const Linkage& linkage, const Model& model, ConstVectorRef q);

/// Dead points next to a linkage along a motion.
struct DeadPointTrace {
  std::string output;             ///< of the linkage
  std::vector<int> nodes;         ///< where they were looked for, in increasing order
  std::vector<DeadPoint> points;  ///< of these nodes
  int nearest = 0;                ///< index of the least distance

  const DeadPoint& getNearest() const { return points[nearest]; }
  int getNearestNode() const { return nodes[nearest]; }
};
/// Of all linkages of listLinkages(). A search takes a millisecond or two: there is one where the transmission of a linkage
/// is least or largest, four of each at most, and at both ends.
/// \param qs  nodes x nq; none are traced unless it is finite and its first node closed   \param samples  further nodes,
/// evenly spread
std::vector<DeadPointTrace> traceDeadPoints(const Model& model, const RowMatrixXd& qs, int samples = 0);

}  // namespace bielle
