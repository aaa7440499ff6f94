#pragma once
/// \file Predictive control: at every stage a new plan of about the next second, from the measured state.
///
/// The problem is the motion's, through a window of N nodes. The first nodes are stages of the motion. Later ones stand for up
/// to two, then four stages that are alike, more where stages are short, with the costs and constraints of the first of them and
/// a step as long as all of them (src/control/window_grid.h). Let stage k begin at t_k. From what is measured at t, at its
/// beginning or later (PredictiveOptions::lead), and the torques of that instant the model predicts the state when that begins,
///
///     x_{k+1} = x(t) projected on the closures, + (t_{k+1} - t) / (t_{k+1} - t_k) of the step f_k(x(t), u(t)),       (1)
///
/// with the acceleration of the whole step, and the window from k+1 on is solved from there until then, in one or a few iterations
/// that start from the last solution and its multipliers. The window ends near the state that the motion passes at that time. From
/// t_{k+1} on the first stages of the solution are a policy (policy.h, Eq. 1). If none is found, the previous policy, which extends
/// some stages farther, remains in force.
///
/// Most of a solve needs no measurement: the window moves on, and all nodes but the first are evaluated, linearized and
/// swept. That is prepared after the solve before, and between a measurement and its policy there is only the rest (the
/// preparation and the feedback phase of Diehl, Bock, Schloeder, SIAM Journal on Control and Optimization 43, 2005). Where
/// a foot lands early or late, or a stage has several solves, it is not known in time at which stage the window will
/// begin; after a late solve the next one begins at once. In these cases the solve does all of it. In a separate thread, the policy
/// is first that of the full step of the sweep, xs_k (+) dx_k and us_k + du_k within the bounds, which nothing has been rolled out for.
/// The rollout, which may shorten or reject that step, follows, and the policy of what has become of it replaces the first one.
///
/// Either update() waits for the solve: the same measurements then give the same torques, on any machine. Or, for a robot, solves run
/// in a separate thread, and update() never waits: a solution found after t_{k+1} takes effect on arrival, and the next solve begins
/// then, whatever the lead. With PredictiveOptions::solve_time solves begin with their stages; if a stage leaves
/// time for another one, that begins likewise, and replaces the first one's solution.
///
/// Early landing: a foot on the ground in the second half of its swing (Measurement::contacts) has landed. The motion
/// continues with the stage of its landing, and stays ahead of the plan by the time saved. Late landing: a foot still
/// in the air one stage after its planned landing, while another foot carries the robot, is lowered at 0.3 m/s, by 5 cm
/// at most, until it touches the ground. The last stages of its swing are rewritten and executed again, and the motion
/// stays behind the plan by the time lost. Meanwhile getPlanTime() is the instant of the landing.
///
/// Motors brake before dead points of their linkages, at every instant of control (src/control/dead_point_stop.h).
///
/// The motion is extended by copies of its last stage, as many as the longest window is long: the robot stands there.
///
/// Instead of a solved motion, a commanded walk (commanded_walk.h) may be given. Its stages are made when the window
/// reaches them; only the first window is solved beforehand. A window ends near the pose and velocity of the trunk on
/// the planned path of the centre of mass; joints have little weight there.
#include <memory>

#include "bielle/control/policy.h"
#include "bielle/motion/commanded_walk.h"

namespace bielle {

struct PredictiveOptions {
  int nodes = 48;                ///< N, 10 to 1000
  int fine_nodes = 30;           ///< at the beginning that are one stage long, at least 10; N or more: all are
  int iterations = 1;            ///< of the solver, at every stage
  double regularization = 1e-5;  ///< of its sweeps
  double penalty = 1;            ///< of violated constraints (solve/fddp.h, Eq. 10)
  /// Near the end of a contact phase, reuse the last gains computed at least this long before it, if necessary from an
  /// earlier solution (reason: Policy::setLookAhead()), s; 0: each stage has its own gains.
  double look_ahead = 0;
  /// Motors brake before the transmission of a linkage falls below this share of that at the start, or exceeds its reciprocal.
  /// Use a smaller value than the motion's margin (LimitOptions::dead_point_margin); 0: they do not brake.
  double dead_point_stop = 0.075;
  /// 0: all, or with own_thread all but one, which control has; at most 1024. Results are bitwise independent of it.
  int threads = 0;
  /// Solves run in a separate thread; results then depend on its speed.
  bool own_thread = false;
  /// Time that a solve is given, s, from its measurement on: another one begins in a stage that leaves so much. Without a
  /// separate thread policies come into force only when it has passed, as if solves took as long, on any machine. 0: there is
  /// one solve for each stage, and without a separate thread its policy is ready at once.
  double solve_time = 0;
  /// Time from the measurement to the stage that is solved for, s, or a little more, as instants of control come; less where the stage
  /// before is shorter. 0: the whole stage before. The longer it is, the later torques react; policies of solves that take longer come
  /// late. No effect with solve_time.
  double lead = 0;
  /// Weights of the difference between the end of the window and the motion there: of heading and place over the ground, of the
  /// other coordinates, of the velocities; 1/m^2 or 1, s^2/m^2 or s^2.
  double end_place = 1, end_posture = 100, end_velocity = 10;
};
void describe(OptionFields& fields, PredictiveOptions& options);

/// What one solve took.
struct PredictiveSolve {
  double time = 0;     ///< of its measurement, s
  double seconds = 0;  ///< from its measurement until its policy was ready, in a separate thread the first one
  double prepare = 0;  ///< before its measurement: what needs none of it
  /// Parts of both, s: the state for which it solves, those of the solver (FddpSummary), summed over the threads, and the policy.
  double predict = 0, evaluate = 0, linearize = 0, sweep = 0, rollout = 0, policy = 0;
  double step = 1;  ///< its shortest, alpha; 0: none was acceptable (the last solution was kept), or it failed
  double regularization = 0;  ///< the largest of its sweeps
  /// From its measurement to the one at which its policy came into force, s; negative: it did not, or not yet.
  double latency = -1;
};

/// Solves since the start.
struct PredictiveCounts {
  int stages = 0;  ///< that began
  int solves = 0;
  int failed = 0;  ///< the last policy stayed in force
  int early = 0;   ///< feet that landed in the second half of their swing
  int late = 0;    ///< feet that had not landed when they should have stood
  /// Without a separate thread, solves that took longer than their lead, or with their preparation longer than a stage: in real
  /// time, their policy would be late. With one or with PredictiveOptions::solve_time, stages that had no solve, because an earlier one lasted
  /// until their end.
  int missed = 0;
  std::vector<PredictiveSolve> last;  ///< 100000 solves

  /// The value that this share of the last solves did not exceed (a quantile), of those that have it; 0 if none has.
  double calcQuantile(double share, double PredictiveSolve::*value = &PredictiveSolve::seconds) const;
};

/// The motion that predictive control solves: `plan`, followed by copies of its last stage, as many as the longest window is
/// long, with terminal weights from PredictiveOptions.
/// \throws InputError as makeMotion() does
Motion makePredictiveMotion(const Model& model, MotionPlan plan, const ProblemOptions& problem,
                            const PredictiveOptions& options);

class PredictiveController : public Controller {
 public:
  /// \param motion  by makePredictiveMotion() with the same options, in the reduced formulation; its problem is copied
  /// \param plan  the solved motion, without the copies of its last stage: where windows end, and what the first one
  /// starts from   \throws InputError when motors brake and the start is a dead point
  PredictiveController(const Motion& motion, const ShootingTrajectory& plan, const PredictiveOptions& options);
  /// \param walk  of which no stage has been made yet   \throws InputError likewise
  PredictiveController(CommandedWalk walk, const PredictiveOptions& options);
  ~PredictiveController() override;

  /// At one instant of each stage it solves, which takes its time and allocates memory; at others, and with
  /// PredictiveOptions::own_thread at all of them, it does neither.
  void update(const Measurement& measurement, VectorRef u) override;
  double getPlanTime(double time) const override;
  /// Of the last solution: the first landing of each contact in its window.
  const std::vector<PredictedFoothold>& footholds() const override;
  const PredictiveCounts& counts() const;
  const Policy& policy() const;  ///< in force
  /// Until the solve under way in a thread of its own, if any, has ended, and the next one is prepared; its policy comes
  /// into force by update().
  void waitForSolve() const;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace bielle
