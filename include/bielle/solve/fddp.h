#pragma once
/// \file Feasibility-driven differential dynamic programming (FDDP) with bounds and constraints: from a guess to an optimum.
///
/// Mastalli et al., "Crocoddyl: An Efficient and Versatile Framework for Multi-Contact Optimal Control", ICRA 2020; the
/// bounds after Tassa, Mansard, Todorov, "Control-Limited Differential Dynamic Programming", ICRA 2014. Derivations, and the
/// equations that are missing here, are in docs/solver.md; src/solve/receding.h has the same iterations for a moving horizon.
///
/// One iteration, from node states xs and controls us that need not satisfy the dynamics, linearizes every stage, with
/// gap_k = difference(xs_{k+1}, f_k(xs_k, us_k)), solves the linear-quadratic problem by a sweep, and rolls the nonlinear
/// dynamics out, x'_0 = xs_0, all tangent vectors in the coordinates of xs:
///        u'_k = us_k + alpha k_k + K_k dx_k               (projected on the bounds of the controls)                (2)
///        dx_{k+1} = difference(xs_{k+1}, f_k(x'_k, u'_k)) + (alpha - 1) gap_k,   x'_{k+1} = xs_{k+1} (+) dx_{k+1} (3)
/// The largest alpha = 1, 1/2, ... is taken for which the merit, the cost J plus a multiple of sum_k |gap_k|_1, falls by a
/// share of what the models foresee. A full step closes the gaps, others leave (1 - alpha) of them.
///
/// Stationarity is measured by the projected gradient, with [lower, upper] the bounds of du (infinite if there are none):
///     gradient = sum_k | clamp(-Qu_k, lower_k, upper_k) |^2. (6)
///
/// Constraints lower <= c_k <= upper are met by an augmented Lagrangian: with multipliers y_k and a penalty rho, J is
/// everywhere replaced by
///     J + sum_k (rho/2 |d_k|^2 - |y_k|^2 / (2 rho)),   d_k = z_k - clamp(z_k, lower, upper),   z_k = c_k + y_k / rho,  (10)
/// and once it can hardly fall,
///     y_k <- rho d_k.                                                                                                (12)
/// Converged means that the gaps are closed, the gradient has vanished and no row is violated by more than the tolerance; y_k
/// is then the multiplier of c_k in
///     L = J + sum_k y_k . c_k,  positive at upper bounds, negative at lower ones,  and  y_i (bound_i - c_i) vanishes.   (13)
/// Where violations cannot be reduced, to first order, the problem is called locally infeasible.
#include <atomic>
#include <functional>
#include <iosfwd>
#include <string>

#include "bielle/math/types.h"
#include "bielle/solve/shooting_problem.h"

namespace bielle {

/// Feedback of one stage, as a sweep finds it, about node state xs_k and control us_k:  u = us_k + k + K dx,  dx = difference(xs_k, x). K is added: where it resists a
/// deviation, its sign is that of a negative feedback. At an optimum k vanishes. Rows of controls at their bounds are zero.
struct Gains {
  VectorXd k;     ///< nu_k, the unit of the control
  RowMatrixXd K;  ///< nu_k x ndx_k, in the tangent space of the problem at xs_k
  VectorXd x;     ///< xs_k, as solve() gives it; empty in a sweep
};

/// How constraints are enforced; without effect on problems that have none.
struct ConstraintOptions {
  double tolerance = 1e-8;       ///< largest violation of a converged solve, in the units of c
  double initial_penalty = 0.1;  ///< rho, in the unit of the cost over that of c squared
  double penalty_increase = 10;  ///< factor when the violation falls too slowly, or is small
  double max_penalty = 1e8;
  bool multipliers = true;  ///< false: y_k stays zero and rho grows at every update, to compare with penalties alone
};

/// y of Eq. (10), node by node, and rho.
struct Multipliers {
  std::vector<VectorXd> values;  ///< N + 1, constraintSize each
  double penalty = 0;
};

/// What governs the iterations of solve() and of Receding (src/solve/receding.h).
struct IterationOptions {
  /// Converged if Eq. (6) is below this, in (units of cost per unit of control)^2, and the gaps are closed.
  double gradient_tolerance = 1e-9;
  /// The gaps are closed if the norm of each is below this, in units of the tangent space.
  double gap_tolerance = 1e-10;
  /// Also converged if a full step at the smallest regularization changes J by less than this times |J|; 0: never. It
  /// also converges if no such step decreases J and (1) predicts less than the rounding of all nodes, N 1e-14 |J|.
  double cost_tolerance = 1e-13;

  double initial_regularization = 1e-9;  ///< mu_u of the first sweep; from a guess far from the optimum start higher
  double min_regularization = 1e-9;
  double max_regularization = 1e9;        ///< the solve gives up above this
  double regularization_increase = 10;    ///< factor after a failed sweep or line search or a short step
  double regularization_decrease = 10;    ///< divisor after a long step
  double state_regularization_ratio = 1;  ///< mu_x / mu_u
  double long_step = 0.5;                 ///< alpha is long above this
  double short_step = 0.01;               ///< alpha is short up to this

  int num_step_lengths = 10;  ///< alpha = 1, 1/2, ..., 2^(1 - num_step_lengths); Receding: 1, 1/4, ...
  double acceptance = 0.1;    ///< share of Eq. (4) by which the merit must actually fall, in (0, 1)

  ConstraintOptions constraints;
  /// Largest number of segments that a rollout is cut into near the optimum, to run at the same time; none is shorter than 6
  /// stages. Results
  /// depend on it, within the tolerances, so it is independent of the number of threads.
  int rollout_segments = 16;
  int threads = 0;  ///< 0: all; at most 1024. Results are bitwise independent of it.
};

struct FddpOptions : IterationOptions {
  int max_iterations = 300;  ///< at most 1000000; the last one closes the gaps
  /// Whether steps are rolled out stage by stage (multiple shooting) until the gaps of the guess are closed, for 20 iterations at
  /// most: for guesses that jump about. Otherwise steps far from the optimum are rolled out in one piece once one was shortened.
  bool multiple_shooting = false;
  /// Share of J; 0: never. If J has stayed within it for 20 iterations and violations below 0.03, constraints are closed
  /// where the trajectory is, and it ends as Converged and `acceptable`: within the constraints, but not stationary.
  double acceptable_decrease = 0;
};

/// One line of the log: the iterate that the iteration started from and the step it took.
struct FddpIteration {
  int iteration = 0;
  double cost = 0;            ///< J before the step, without what Eq. (10) adds
  double violation = 0;       ///< largest of the constraints before the step
  double gap = 0;             ///< max_k |gap_k| before the step
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
  double gap = 0;           ///< max_k |gap_k| of the returned trajectory (after a last step alpha < 1: by Eq. 3)
  int iterations = 0;
  // Of constraints, at the returned trajectory if it ended as Converged, RegularizationMax or Infeasible, else before the last step.
  double violation = 0;        ///< the largest, in the units of c
  double complementarity = 0;  ///< largest |y_i (bound_i - c_i)|, Eq. (13)
  double multiplier = 0;       ///< largest |y_i|
  double penalty = 0;          ///< rho; 0 if there are no constraints
  int multiplier_updates = 0;  ///< Eq. (12)
  // What was done for that: linearizations of single nodes, one an iterate, and another where constraints get weights that had
  // none; sweeps; rollouts of a step in segments; searches, each of steps of several lengths in one piece.
  int linearizations = 0, sweeps = 0, rollouts = 0, searches = 0;
  double seconds = 0;
  // Time by part, s, summed over the threads: with one thread they add up to almost `seconds`. Searches are rollouts, too.
  double evaluate_seconds = 0, linearize_seconds = 0, sweep_seconds = 0, rollout_seconds = 0, search_seconds = 0;
  std::vector<FddpIteration> log;
};

enum class FddpAction { Continue, Stop };

/// Observes and stops a solve.
struct FddpObserver {
  /// Called after each iteration, with the new iterate.
  std::function<FddpAction(const FddpIteration&, const ShootingTrajectory& iterate)> callback;
  /// Polled before each sweep and each rollout, so that a signal handler can set it.
  const std::atomic<bool>* interrupt = nullptr;
};

struct FddpResult {
  ShootingTrajectory trajectory;  ///< the last iterate; of a solve that was stopped, the best one so far
  Multipliers multipliers;        ///< of the constraints there, Eq. (13)
  /// N, of the last sweep; empty if there was none. They are about the trajectory if the solve converged without a last
  /// step, i.e. summary.log.back().step is 0, else about the iterate before: Gains::x has its states.
  std::vector<Gains> gains;
  FddpSummary summary;
};

/// Solves a problem, within the bounds of its controls. \param guess  its xs_0 is replaced by the initial state, and its
/// controls are projected on their bounds   \param start  multipliers and penalty to start from; without values: zero, and
/// the initial penalty. An iteration after the first allocates nothing. integrate() and difference() of the problem are only
/// called about evaluations of the current iterate. Exceptions of problem and observer leave it.
/// \throws std::invalid_argument naming invalid options, or when sizes do not match the problem, a lower bound exceeds the
/// upper one, or the penalty of `start` is not positive
FddpResult solve(const ShootingProblem& problem, ShootingTrajectory guess, const FddpOptions& options = {},
                 const FddpObserver& observer = {}, const Multipliers& start = {});

/// Print the log as a table: its header, and one line per iteration. makeFddpPrinter() returns a callback that does
/// both.
void printFddpHeader(std::ostream& out);
void printFddpIteration(std::ostream& out, const FddpIteration& line);
std::function<FddpAction(const FddpIteration&, const ShootingTrajectory&)> makeFddpPrinter(std::ostream& out);

}  // namespace bielle
