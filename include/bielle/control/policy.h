#pragma once
/// \file The policy of a solved motion: its torques, and the gains of the solver's last sweep about it.
///
///     u = u*(t) + K(t) [q (-) q*(t); v - v*(t)]                                                                     (1)
///
/// Stage k lasts from t_k to t_k + h_k. There q* goes from q_k to q_{k+1} along q_k (+) s (q_{k+1} (-) q_k), v* straight
/// from v_k to v_{k+1}, 0 <= s <= 1. The torque u_k belongs to the middle of its stage and K_k to its start; both are
/// interpolated linearly within a phase of constant contacts and held across its borders. The solver's gains refer to the
/// tangent space of the problem at x_k; those of (1) are
///
///     K_k = K_k^solver d(x (-) x_k)/d(dq, dv)                                                                       (2)
///
/// (nu x 2 nv): in the reduced formulation a state that is not closed is thus projected on the closed ones. After its end the
/// policy holds the last posture with the torques u_hold that carry it at rest, and with the gains of the first stage
/// of the last phase, because the last stages look ahead too little to correct the robot's position. Where springs do not
/// balance the weight in the last posture, another stage leads to one in which they do (settlePosture). Where torques act
/// later than the state was measured, u* and K are those of the time when they act, the deviation is that of the time
/// of the measurement.
#include <vector>

#include "bielle/control/controller.h"
#include "bielle/motion/solve.h"

namespace bielle {

class Policy : public Controller {
 public:
  /// One stage; impacts, which take no time, are omitted.
  struct Stage {
    double start = 0, duration = 0;  ///< t_k, h_k, s
    int phase = 0;                   ///< stages of different phases are not interpolated
    VectorXd q, v;                   ///< nq, nv: the node at its start
    VectorXd q_change, v_next;       ///< nv: q_{k+1} (-) q_k; v_{k+1}
    VectorXd u;                      ///< nu
    RowMatrixXd K;                   ///< nu x 2 nv; empty in all stages without feedback
  };

  /// \param stages  at least one, in the order of time
  /// \param u_hold  nu
  Policy(const Model& model, std::vector<Stage> stages, const VectorXd& u_hold);

  /// Stages that begin less than `duration` (s) before the end of their phase reuse K of the last earlier stage in the
  /// phase. Where a foot must land exactly, gains grow without bound towards the end of the phase, because they remove
  /// any deviation within the remaining time; estimated states are too noisy for them. 0, the default: no stage is
  /// replaced.
  void setLookAhead(double duration);

  void update(const Measurement& measurement, VectorRef u) override;
  /// Swaps stages and torques u_hold with others of the same number and sizes. Allocates nothing.
  void exchange(std::vector<Stage>& stages, VectorXd& u_hold);
  /// q* and v* of Eq. (1).
  void getReference(double time, VectorRef q, VectorRef v) const;
  double duration() const { return stages_.back().start + stages_.back().duration; }  ///< s
  const Model& model() const { return model_; }
  const std::vector<Stage>& stages() const { return stages_; }

 private:
  void findLastPhase();
  size_t findStage(double time) const;
  bool hasGains() const { return stages_.front().K.size() > 0; }
  void updateError(const Measurement& measurement);
  void addFeedback(size_t stage, double weight, VectorRef u) const;

  Model model_;
  std::vector<Stage> stages_;
  std::vector<size_t> gains_;  // per stage, that whose K is taken
  VectorXd u_hold_;            // nu
  size_t last_phase_ = 0;      // its first stage
  mutable VectorXd step_;      // nv
  VectorXd q_, error_;         // nq, 2 nv
};

/// The torques and states of a motion's trajectory, without feedback. The motion must not have free durations.
Policy makePolicy(const Motion& motion, const ShootingTrajectory& trajectory);
/// Those of a solution, with its gains. \throws std::invalid_argument when it has none
Policy makePolicy(const Solution& solution);

}  // namespace bielle
