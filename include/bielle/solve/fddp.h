#pragma once
/// \file Feasibility-driven differential dynamic programming (FDDP) and its bounded variant.
///
/// Mastalli et al., "Crocoddyl: An Efficient and Versatile Framework for Multi-Contact Optimal Control", ICRA 2020; the
/// bounds after Tassa, Mansard, Todorov, "Control-Limited Differential Dynamic Programming", ICRA 2014.
///
/// One iteration, from node states xs and controls us that need not satisfy the dynamics:
/// 1. Evaluate and linearize every stage about (xs_k, us_k); gap_k = difference(xs_{k+1}, f_k(xs_k, us_k)).
/// 2. The LQ sweep (lq_sweep.h, its eqs. 2 to 7) gives k, K, and the predicted change of J for a step of length alpha,
///        change(alpha) = alpha slope + 1/2 alpha^2 curvature.                                                     (1)
/// 3. Nonlinear rollout with x'_0 = xs_0 and, for k = 0 .. N-1, all tangent vectors in the coordinates of xs:
///        u'_k = us_k + alpha k_k + K_k dx_k               (projected on the bounds when they are enforced)         (2)
///        dx_{k+1} = difference(xs_{k+1}, f_k(x'_k, u'_k)) + (alpha - 1) gap_k,   x'_{k+1} = xs_{k+1} (+) dx_{k+1} (3)
///    so that the gaps contract to (1 - alpha) gap_k (to first order on a curved manifold); a full step closes them and
///    x'_{k+1} = f_k(x'_k, u'_k) exactly. The paper integrates (alpha - 1) gap_k from f_k(x'_k, u'_k) instead: the same
///    on a vector space, but on a manifold it would apply the gap in the coordinates of another point.
/// 4. Line search over alpha on the merit J + nu c, with J the cost and c = sum_k |gap_k|_1, predicted to fall by
///        decrease(alpha) = -change(alpha) + nu alpha c,                                                            (4)
///    positive on the whole of (0, 1] for rho = 1/2 and
///        nu = max(0, (slope + 1/2 max(0, curvature)) / ((1 - rho) c)). (5)
///    alpha is accepted if the merit actually falls by `acceptance` times (4). As long as c falls in every iteration
///    (which it does, by alpha c, except after Eq. 7), nu may be chosen anew in each: the iterations cannot cycle.
///    A problem that processes several tasks at once is given several alphas together; the largest acceptable one is
///    taken.
/// 5. If no alpha is accepted, or a Quu is indefinite, the regularization grows and the sweep is repeated.
///
/// A rollout can be cut into segments that run at the same time. The segment that starts at node j starts from the
/// state that the models predict,
///     dx_j = alpha dx*_j,   x'_j = xs_j (+) dx_j,    dx* the full step of the sweep,                               (7)
/// and opens a new gap there, g_j = difference(xs_j, f_{j-1}(x'_{j-1}, u'_{j-1})) + (alpha - 1) gap_{j-1} - dx_j, of
/// second order in the step, which later iterations close like any other. It counts in c of the trial; and since the
/// value function predicts the cost of closing it, J of the trial is increased by
///     closing = sum_j Vx_j.g_j + (Vxx_j dx_j).g_j + 1/2 g_j.Vxx_j.g_j                                              (8)
/// (The penalty nu c alone would not suffice: gaps and decrease are both of second order, so that it would reject full
/// steps however close to the solution.) A trial for which (8) exceeds half of (4) is rejected, whatever its merit; after
/// another full step, so is one whose J + closing has not fallen from that of the last by `acceptance` times what the
/// models foresee between the two: with gaps of second order, (4) alone would accept steps that overshoot by their
/// whole length. A full step that is rejected in segments is tried again in one piece, and so are all shorter ones;
/// steps that follow a shortened one are rolled out in one piece. With LastRollout::Segments, for receding horizons,
/// steps of all lengths are rolled out in segments: then an iteration takes about the same time whatever its step.
///
/// The last step must close the gaps. If it is short it is rolled out twice, the second time from
///     dx'_j = e_j + (Fx + Fu K)_{j-1} .. (Fx + Fu K)_i (dx'_i - dx_i),                                             (9)
/// where e_j is the deviation at the end of the segment from node i to j in the first rollout: gaps of third order
/// remain. If the step is not short, or this did not close them, it is rolled out in one piece.
///
/// Stationarity is measured by the projected gradient, with [lower, upper] the bounds of du (infinite if ignored):
///     gradient = sum_k | clamp(-Qu_k, lower_k, upper_k) |^2. (6)
///
/// Constraints lower <= c_k <= upper are enforced by an augmented Lagrangian (Hestenes, Powell, Rockafellar; around a DDP as in
/// Howell, Jackson, Manchester, "ALTRO", IROS 2019): with multipliers y_k and a penalty rho, J is everywhere replaced by
///     J + sum_k (rho/2 |d_k|^2 - |y_k|^2 / (2 rho)),   d_k = z_k - clamp(z_k, lower, upper),   z_k = c_k + y_k / rho,  (10)
/// whose derivatives by c_k are, without those of the clamp's kinks,
///     gradient rho d_k,   Hessian rho in rows with d_k != 0 and in equations, 0 in others.                            (11)
/// Whenever the foreseen decrease has become a small part of the cost, or the gradient has vanished,
///     y_k <- rho d_k,                                                                                                (12)
/// and rho grows if the largest violation is more than a quarter of what it was the last time, and, for this solve alone,
/// whenever it is below 0.03, up to 1000 times the initial one, so that (12) converges faster. Converged means that the
/// gradient has vanished and no row is violated by more than the tolerance; y_k is then the multiplier of c_k in
///     L = J + sum_k y_k . c_k,  positive at upper bounds, negative at lower ones,  and  y_i (bound_i - c_i) vanishes.   (13)
/// If the violation no longer falls although rho is at its largest, or no step is acceptable, the violations are minimized on
/// their own, with rho so large that rho |d|^2 is a million times J, or at its largest. If they then stop falling and rho |d|^2 is
/// still a hundred times J, the problem is called locally infeasible: the trajectory is a point where, to first order, the
/// constraints cannot be violated less. Otherwise it ends as RegularizationMax.
///
/// Near an optimum that is flat along curved constraints steps become short, and the cost creeps. With acceptable_decrease, a cost
/// that has stayed within that share of itself for 20 iterations, with no violation above 0.03, is accepted: y is kept and rho
/// grows tenfold with each step, up to its largest; mu_u grows tenfold after each step alpha < 1, so that the trajectory moves
/// towards the constraints and hardly along them, and shrinks as much after a full step that has not halved the violation. If all
/// rows hold after at most 30 such steps, the solve ends as Converged, with FddpSummary::acceptable: within the constraints, but
/// not stationary. (An acceptable level, as in Waechter and Biegler, "On the implementation of an interior-point filter
/// line-search algorithm", Mathematical Programming 106, 2006.) Otherwise it goes on as before.
///
/// With LastRollout::Segments (12) comes before every linearization, where (10) is not at its minimum. Rows with y_k != 0 after it
/// are then held at their bounds, like equations (a primal-dual active set: Hintermueller, Ito, Kunisch, SIAM Journal on
/// Optimization 13, 2002): in (10) and (11) they have
///     d_k = z_k - upper (y_k > 0) or z_k - lower (y_k < 0).                                                          (14)
/// With (10) and (11) alone a violated row moves inside by as much as it was violated. There it is free, since it is
/// farther from its bound than y_k / rho, and is then violated again: in a walk's window, wrench cones by 0.5 in every
/// other iteration.
///
/// Models without second derivatives may be too flat along some directions, by a factor that stays the same from step to step.
/// After two steps alpha < 1 in a row, close to the constraints and with closed gaps, the curvature b of the merit along the
/// last one is taken from its values. Where it is more than 1.5 times the curvature a of (1), the next line search starts at
/// a / b instead of 1 (Barzilai and Borwein, "Two-point step size gradient methods", IMA Journal of Numerical Analysis 8,
/// 1988, in the metric of the models): such a direction then decays instead of only changing its sign.
#include <atomic>
#include <functional>
#include <iosfwd>
#include <memory>
#include <string>

#include "bielle/solve/shooting_problem.h"

namespace bielle {

class LqSweep;

enum class ControlBounds { Ignore, Enforce };

/// The last allowed iteration either closes the gaps or, in a receding horizon, leaves them to the next solve like other
/// iterations; all steps are then rolled out in segments, and Eq. (12) comes before every linearization, which is made once.
enum class LastRollout { Closed, Segments };

/// How constraints are enforced; without effect on problems that have none.
struct ConstraintOptions {
  double tolerance = 1e-8;       ///< largest violation of a converged solve, in the units of c
  double initial_penalty = 0.1;  ///< rho, in the unit of the cost over that of c squared
  double penalty_increase = 10;  ///< factor when the violation falls too slowly, or is small
  double max_penalty = 1e8;
};

/// y of Eq. (10), node by node, and rho.
struct Multipliers {
  std::vector<VectorXd> values;  ///< N + 1, constraintSize each
  double penalty = 0;
};

struct FddpOptions {
  int max_iterations = 300;  ///< at most 1000000
  /// Converged if Eq. (6) is below this, in (units of cost per unit of control)^2, and the gaps are closed.
  double gradient_tolerance = 1e-9;
  /// The gaps are closed if every entry is below this, in units of the tangent space.
  double gap_tolerance = 1e-10;
  /// Also converged if a full step at the smallest regularization changes J by less than this times |J|; 0: never. It
  /// also converges if no such step decreases J and (1) predicts less than the rounding of all nodes, N 1e-14 |J|.
  double cost_tolerance = 1e-13;

  /// Share of J; 0: never. Accepts a trajectory that satisfies all constraints once J hardly decreases.
  double acceptable_decrease = 0;

  double initial_regularization = 1e-9;  ///< mu_u of the first sweep; from a guess far from the optimum start higher
  double min_regularization = 1e-9;
  double max_regularization = 1e9;        ///< the solve gives up above this
  double regularization_increase = 10;    ///< factor after a failed sweep or line search or a short step
  double regularization_decrease = 10;    ///< divisor after a long step
  double state_regularization_ratio = 1;  ///< mu_x / mu_u
  double long_step = 0.5;                 ///< alpha is long above this
  double short_step = 0.01;               ///< alpha is short up to this

  int num_step_lengths = 10;  ///< alpha = 1, 1/2, ..., 2^(1 - num_step_lengths)
  double acceptance = 0.1;    ///< share of Eq. (4) by which the merit must actually fall, in (0, 1)

  ControlBounds bounds = ControlBounds::Ignore;
  ConstraintOptions constraints;
  /// Largest number of segments of a rollout, Eq. (7); none is shorter than 6 stages. Results depend on it, within the
  /// tolerances, so it is independent of the number of threads.
  int rollout_segments = 16;
  LastRollout last_rollout = LastRollout::Closed;
  int threads = 0;  ///< 0: all; at most 1024. Results are bitwise independent of it.
};

/// One line of the log: the iterate that the iteration started from and the step it took.
struct FddpIteration {
  int iteration = 0;
  double cost = 0;            ///< J before the step, without what Eq. (10) adds
  double violation = 0;       ///< largest of the constraints before the step
  double gap = 0;             ///< max_k |gap_k|_inf before the step
  double gradient = 0;        ///< Eq. (6)
  double step = 0;            ///< alpha; 0: none was taken, the iterate is the result
  double regularization = 0;  ///< mu_u of the sweep
  double seconds = 0;         ///< since the start
};

enum class FddpTermination {
  Converged,
  MaxIterations,
  RegularizationMax,  ///< no acceptable step even at the largest regularization
  /// The constraints cannot be violated less, to first order, or no step towards less can be evaluated; the message
  /// names the worst.
  Infeasible,
  Interrupted,  ///< by the flag or the callback
  Failed        ///< the problem failed, or returned values that are not finite, at the current iterate
};
const char* getName(FddpTermination termination);

struct FddpSummary {
  FddpTermination termination = FddpTermination::Failed;
  std::string message;
  bool acceptable = false;  ///< Converged by acceptable_decrease: the gradient has not vanished
  double cost = 0;          ///< J of the returned trajectory
  double gap = 0;           ///< max_k |gap_k|_inf of the returned trajectory (after a last step alpha < 1: by Eq. 3)
  int iterations = 0;
  // Of constraints, at the returned trajectory if it ended as Converged, RegularizationMax or Infeasible, else before the last step.
  double violation = 0;        ///< the largest, in the units of c
  double complementarity = 0;  ///< largest |y_i (bound_i - c_i)|, Eq. (13)
  double multiplier = 0;       ///< largest |y_i|
  double penalty = 0;          ///< rho; 0 if there are no constraints
  int multiplier_updates = 0;  ///< Eq. (12)
  double seconds = 0;
  // Time by part, s, summed over the threads: with one thread they add up to almost `seconds`.
  double linearize_seconds = 0, sweep_seconds = 0, rollout_seconds = 0;
  std::vector<FddpIteration> log;
};

enum class FddpAction { Continue, Stop };

/// Observes and stops a solve. Stopping leaves the current iterate, the best one so far, in the trajectory; the summary
/// has the gaps that are still open.
struct FddpObserver {
  /// Called after each iteration; the trajectory passed to solve() is then the new iterate.
  std::function<FddpAction(const FddpIteration&)> callback;
  /// Polled before each sweep and each rollout, so that a signal handler can set it.
  const std::atomic<bool>* interrupt = nullptr;
};

/// The solver owns its memory and can be kept from solve to solve: an iteration after the first allocates nothing.
/// Evaluations are kept as long as the problem has the same id(). The solver calls integrate() and difference() only
/// about evaluations of the current iterate. Exceptions of the problem leave solve(), with the current iterate in the
/// trajectory.
class Fddp {
 public:
  struct Workspace;  ///< memory of a solve, kept between solves

  /// Throws std::invalid_argument naming invalid options.
  explicit Fddp(const FddpOptions& options = {});
  ~Fddp();
  Fddp(Fddp&&) noexcept;
  Fddp& operator=(Fddp&&) noexcept;

  /// trajectory: on entry the initial guess, whose xs_0 is replaced by the initial state and whose controls are
  /// projected on enforced bounds; then the current iterate. Throws std::invalid_argument if its sizes do not match the
  /// problem.
  FddpSummary solve(const ShootingProblem& problem, ShootingTrajectory& trajectory, const FddpObserver& observer = {});

  /// Shifts a horizon by one stage: the trajectory that the last solve() returned and the evaluations of its nodes. The
  /// next solve(), of a problem with the same id() whose node k is the previous node k + 1, evaluates only nodes 0,
  /// N - 1 and N. Until then no other node of the trajectory may change, or that solve() throws std::invalid_argument.
  /// The last state and control are repeated.
  void advance(ShootingTrajectory& trajectory);

  /// The multipliers at the end of the last solve(); and those from which the next one starts, instead of zero, with
  /// all its nodes evaluated again. advance() moves them on. \throws std::invalid_argument when the penalty is not
  /// positive
  Multipliers getMultipliers() const;
  void setMultipliers(const Multipliers& multipliers);

  /// Gains and value function of the last sweep, about the trajectory linearized last.
  const LqSweep& getSweep() const;

 private:
  FddpOptions options_;
  std::unique_ptr<Workspace> work_;
};

/// Print the log as a table: its header, and one line per iteration. makeFddpPrinter() returns a callback that does
/// both.
void printFddpHeader(std::ostream& out);
void printFddpIteration(std::ostream& out, const FddpIteration& line);
std::function<FddpAction(const FddpIteration&)> makeFddpPrinter(std::ostream& out);

}  // namespace bielle
