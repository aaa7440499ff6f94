#pragma once
/// \file Lifting a trajectory of the Approximate Serial model to the closed model (the paper's appendix).
///
/// Given serial states x_s* = (q_s*, v_s*), accelerations and foot forces, find closed states x_c and motor torques u
/// whose serial part is the same. The paper solves, node after node, with x_c^k known,
///     min_u 1/2 |q_s^{k+1} - q_s*^{k+1}|^2 + 1/2 |v_s^{k+1} - v_s*^{k+1}|^2    s.t.  x_c^{k+1} = f_k(x_c^k, u)     (1)
/// (LiftMethod::Nlopt; x_c^{k+1} is eliminated by a step of the closed dynamics, reduced formulation). With
/// LiftMethod::Newton every node is lifted separately: the loops are closed on the serial joints by Newton steps from
/// the previous node, v_c = T v_s and a_c follow from the linkages (ratio.h), and with lambda the foot forces
///     T^T (M a_c + b) = T^T B u + T^T J_c^T lambda                                                                 (2)
/// gives u, the loop forces being eliminated by T. Where feet share the load in several ways (double support), (2)
/// leaves lambda undetermined: the one nearest to the serial one is taken. The minimization of (1) starts from the same
/// u and does not move along directions that (1) leaves undetermined. In both cases the closed dynamics under u are
/// evaluated and compared with the serial motion.
///
/// A lift fails where the closed robot cannot follow: the posture is out of reach of a linkage, a linkage is at a dead
/// point of its joint, where joint speeds require infinite motor speeds, or the closed dynamics deviate too far.
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"
#include "bielle/motion/motion.h"
#include "bielle/motion/serial_model.h"

namespace bielle {

/// N stages, N + 1 nodes of the serial model.
struct SerialTrajectory {
  std::vector<VectorXd> q, v;              ///< N + 1, of the serial model
  std::vector<VectorXd> a;                 ///< N
  std::vector<double> dt;                  ///< N, s
  std::vector<ConstraintSet> constraints;  ///< N, the contacts of the serial model in force
  std::vector<VectorXd> forces;            ///< N, on the rows of the constraints
};

enum class LiftMethod { Newton, Nlopt };
const char* getName(LiftMethod method);

struct LiftOptions {
  LiftMethod method = LiftMethod::Newton;
  double singular = 1e-3;                ///< below this margin (calcLinkageTangent) a linkage is at a dead point
  double acceleration_tolerance = 1e-6;  ///< Newton: of the serial accelerations, relative to 1 rad/s^2 + the largest
  double position_tolerance = 1e-2;      ///< Nlopt: of the serial joints, rad and m
  double velocity_tolerance = 1e-1;      ///< Nlopt: rad/s and m/s
};

/// Errors are the largest of the serial coordinates.
struct LiftNode {
  /// NotClosed: the posture is out of reach; NearDeadPoint, or why the closed dynamics failed; Inaccurate
  NumericalStatus status = NumericalStatus::Ok;
  std::string message;  ///< why not lifted
  std::string joint;  ///< the joint at which the lift ended, or empty: out of reach, the joint of the linkage with the
                      ///< largest error; at a dead point, its first joint
  double position_error = 0;      ///< rad or m
  double velocity_error = 0;      ///< rad/s or m/s
  double acceleration_error = 0;  ///< of the closed dynamics under u, rad/s^2 or m/s^2
  double margin = 0;              ///< smallest over the linkages
  int evaluations = 0;            ///< of (1) by NLopt
};

struct LiftResult {
  std::vector<LiftNode> nodes;             ///< up to the first failure
  std::vector<ConstraintSet> constraints;  ///< loops and contacts in force at every lifted stage
  std::vector<double> dt;                  ///< of these stages, s
  ShootingTrajectory trajectory;           ///< of the closed model, as far as it was lifted

  bool lifted() const { return !nodes.empty() && nodes.back().status == NumericalStatus::Ok; }
};

/// The stages of a problem with these dynamics and without costs, terminal node included.
std::vector<StageSpec> makeStages(const std::vector<double>& dt, const std::vector<ConstraintSet>& constraints);

/// \throws InputError when the trajectory does not belong to the serial model
LiftResult lift(const Model& closed, const SerialModel& serial, const SerialTrajectory& trajectory,
                const LiftOptions& options = {});

}  // namespace bielle
