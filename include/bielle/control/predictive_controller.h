#pragma once
/// \file Predictive control: a plan of the next second or so, made anew at every stage from the measured state.
///
/// The problem is the motion's, through a window of N of its stages. Let stage k begin at t_k. From what is measured at t_k
/// and the torques of that instant the model predicts the state at the next stage,
///
///     x_{k+1} = f_k(x(t_k) projected on the closures, u(t_k))                                                       (1)
///
/// and while stage k lasts, the window from k+1 on is solved from there, in a few iterations that start from the last
/// solution, its multipliers moved on by a stage. The window ends near the state that the motion passes at t_{k+1+N}. From
/// t_{k+1} on the first stages of the solution are a policy (policy.h, Eq. 1). A solution thus takes one stage to come into
/// force, however fast it is found; if none is found the last policy, which reaches some stages farther, stays.
///
/// Either update() waits for the solve at the beginning of a stage: the same measurements then give the same torques, on any
/// machine. Or, for a robot, solves run in a thread of their own, and update() never waits: a solution that is found after t_{k+1}
/// comes into force when it is found, and stages that begin meanwhile are not solved for.
///
/// A foot that is on the ground in the second half of its swing (Measurement::contacts), where it may land, has landed: the
/// motion goes on with the stage of its landing, and stays ahead of the plan by what the swing was cut short. A foot that is not
/// on the ground one stage after its landing, while another one carries, is lowered at 0.3 m/s until it is, by 5 cm at most: the
/// last stages of its swing are rewritten and come into force again, and the motion stays behind the plan by as much. Meanwhile
/// getPlanTime() is the instant of the landing.
///
/// Motors brake before dead points of their linkages, at every instant of control (src/control/dead_point_stop.h).
///
/// After its last stage the motion is followed by as many copies of that stage as the window is long: the robot stands there.
///
/// In place of a solved motion, a walk by command (commanded_walk.h) may be given. Its stages are made when the window reaches
/// them; nothing is solved before but the first window. A window ends near the pose and the velocity of the trunk that the path
/// of the centre of mass foresees; joints hardly count there.
#include <memory>

#include "bielle/control/policy.h"
#include "bielle/motion/commanded_walk.h"

namespace bielle {

struct PredictiveOptions {
  int nodes = 100;               ///< N
  int iterations = 2;            ///< of the solver, at every stage
  double regularization = 1e-5;  ///< of its sweeps
  double penalty = 1;            ///< of violated constraints (fddp.h, Eq. 10)
  /// Stages that begin less than this before the end of their phase of contacts take the gains of the last stage before them
  /// that did not, if need be of an earlier solution (Policy::setLookAhead() says why), s; 0: each stage has its own.
  double look_ahead = 0;
  /// Motors brake before the transmission of a linkage falls below this share of that at the start, or exceeds its reciprocal.
  /// It should be less than the margin that the motion keeps (LimitOptions::dead_point_margin); 0: they do not brake.
  double dead_point_stop = 0.075;
  int threads = 0;  ///< 0: all. Results are bitwise independent of it.
  /// Solves run in a thread of their own; results then depend on how fast it is.
  bool own_thread = false;
  /// Weights of the difference between the end of the window and the motion there: of heading and place over the ground, of the
  /// other coordinates, of the velocities; 1/m^2 or 1, s^2/m^2 or s^2.
  double end_place = 1, end_posture = 100, end_velocity = 10;
};

/// Solves since the start.
struct PredictiveCounts {
  int solves = 0;
  int failed = 0;  ///< the last policy stayed in force
  int early = 0;   ///< feet that landed in the second half of their swing
  int late = 0;    ///< feet that had not landed when they should have stood
  /// Stages that began without their policy in real time: solves took longer than the stage before. Without a thread of
  /// their own it came into force all the same; with one the last policy stayed, and there was no solve in this stage.
  int missed = 0;
  std::vector<double> seconds;  ///< of the last 100000, until their policy was ready

  /// The least time that is not exceeded by this share of the solves, s; 0 if there are none.
  double calcQuantile(double share) const;
};

/// The motion that predictive control solves: `plan`, then as many copies of its last stage as the window is long, which ends
/// as the weights of PredictiveOptions say.
/// \throws ModelError as makeMotion() does
Motion makePredictiveMotion(const Model& model, MotionPlan plan, const ProblemOptions& problem,
                            const PredictiveOptions& options);

class PredictiveController : public Controller {
 public:
  /// \param motion  by makePredictiveMotion() with the same options, in the reduced formulation; its model must outlive this
  /// \param plan  the solved motion, without the copies of its last stage: where windows end, and what the first one
  /// starts from   \throws ModelError when motors brake and the start is a dead point
  PredictiveController(Motion motion, const ShootingTrajectory& plan, const PredictiveOptions& options);
  /// \param walk  of which no stage has been made yet; its model must outlive this   \throws ModelError likewise
  PredictiveController(CommandedWalk walk, const PredictiveOptions& options);
  ~PredictiveController() override;

  /// At the first instant of each stage it solves, which takes its time and allocates memory; at others, and with
  /// PredictiveOptions::own_thread at all of them, it does neither.
  void update(const Measurement& measurement, VectorRef u) override;
  double getPlanTime(double time) const override;
  /// Of the last solution: the first landing of each contact in its window.
  const std::vector<PredictedFoothold>& getFootholds() const override;
  const PredictiveCounts& getCounts() const;
  const Policy& getPolicy() const;  ///< in force
  /// Until the solve under way in a thread of its own, if any, has ended; its policy comes into force by update().
  void waitForSolve() const;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace bielle
