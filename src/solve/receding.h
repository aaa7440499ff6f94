#pragma once
/// \file FDDP for a receding horizon: a few iterations per step, each about as long as the last, on a window that moves.
///
/// Iterations are those of fddp.h, with five differences. Each tries only a few step lengths, 1, 1/4, 1/16 and 1/64: where the
/// gaps that a push leaves are large, only short ones succeed, and more regularization does not shorten the others. If none is
/// acceptable, the trajectory and its multipliers stay as they are, and the next iteration, in this step() or after advance(),
/// is regularized more. None closes the gaps for its own sake: steps of all lengths are rolled out in segments, which run at
/// the same time, and what they leave open is left to the next step. Multipliers are new, fddp.h Eq. (12), before every
/// linearization, which is made once; those of a search in vain are taken back, or the same violations would count once more
/// with every search. And since Eq. (10) is not at its minimum there, rows with y_k != 0 are then held at
/// their bounds, like equations (a primal-dual active set: Hintermueller, Ito, Kunisch, SIAM Journal on Optimization 13,
/// 2002): in Eq. (10) they have
///     d_k = z_k - upper (y_k > 0) or z_k - lower (y_k < 0).                                                          (14)
/// With Eq. (10) alone a violated row moves inside by as much as it was violated. There it is free, since it is farther from
/// its bound than y_k / rho, and is then violated again: in a walk's window, wrench cones by 0.5 in every other iteration.
/// The weight of gaps falls by a tenth at most from one search to the next, until the horizon starts anew:
///     nu <- max(Eq. (5), 0.9 nu).                                                                                  (15)
/// What a foot leaves that landed early is cheaper with its gaps than without. Eq. (5) alone, which asks for a descent direction
/// only, is then zero, and steps that close gaps were cut to a quarter for as long as a whole swing.
#include <functional>
#include <memory>

#include "bielle/solve/fddp.h"

namespace bielle {

struct FddpMemory;

/// For a constant penalty set constraints.penalty_increase to 1, for a constant regularization the least one to the initial.
struct RecedingOptions : IterationOptions {
  int iterations = 1;  ///< per step, at most 1000000, those without an acceptable step included; fewer if it converges

  RecedingOptions() { num_step_lengths = 4; }  // 1 to 1/64
};

/// What a node of a window that has moved takes over from a node of the last window.
struct NodeSource {
  int node = 0;       ///< of the last window
  double share = 1;   ///< of its multipliers; none where the numbers of constraints differ
  bool same = false;  ///< its evaluation, too: problem, state and control are what they were
};

/// What the first stages of a window become by the full step of the models, which is known before it is rolled out.
struct Foresight {
  int stages = 0;            ///< at most those of the window
  ShootingTrajectory nodes;  ///< xs_k (+) dx_k, stages + 1 of them, and us_k + du_k, within the bounds
  /// Called once they are there and finite: after the first sweep of the last iteration that step() may make.
  std::function<void()> use;
};

/// Keeps its memory and multipliers from step to step: an iteration after the first allocates nothing.
class Receding {
 public:
  /// \param problem  of the window; must outlive it and may change between steps, sizes included
  /// \throws std::invalid_argument naming invalid options
  explicit Receding(const ShootingProblem& problem, const RecedingOptions& options = {});
  ~Receding();
  Receding(Receding&&) noexcept;
  Receding& operator=(Receding&&) noexcept;

  /// Improves the trajectory of the window: on entry, like the guess of solve(), then the last iterate. Multipliers start
  /// from zero unless advance() or setMultipliers() came after the last step. Exceptions of the problem leave it, with the
  /// current iterate in the trajectory. \throws std::invalid_argument like solve()
  /// \param foresight  if any, is filled on the way; getGains() and getLinearized() are then of the same sweep
  /// \return valid until the next step() or prepare()
  const FddpSummary& step(ShootingTrajectory& trajectory, const FddpObserver& observer = {},
                          Foresight* foresight = nullptr);

  /// All of the next step() for which the initial state of the window need not be known: evaluations of all nodes but the first,
  /// their multipliers, models and sweep. The step does the rest, with the same result. Until then nothing but that state may
  /// change; move(), advance() and setMultipliers() discard what was prepared.
  /// \throws std::invalid_argument like step(), and if the penalty is not constant
  void prepare(ShootingTrajectory& trajectory);

  /// Moves on by one stage: the trajectory of the last step(), its multipliers and the evaluations of its nodes. Node k of
  /// the problem must now be the previous node k + 1; the next step() evaluates only nodes 0, N - 1 and N. Until then no
  /// other node of the trajectory may change, or it throws std::invalid_argument. The last state and control are repeated.
  void advance(ShootingTrajectory& trajectory);
  /// Moves on to any other window of as many stages, whose trajectory is the caller's to make. Nodes that are the same must not
  /// change until the next step(), or it throws std::invalid_argument; the others are evaluated.
  /// \param sources  for each node, the terminal one included; none of two nodes that are both the same
  /// \throws std::invalid_argument when their number is not that of the last window's nodes, or a node appears twice
  void move(const std::vector<NodeSource>& sources);

  /// Those at the end of the last step(), moved on by advance() or move(); and those from which the next one starts, with all its nodes
  /// evaluated again. \throws std::invalid_argument when the penalty is not positive
  Multipliers multipliers() const;
  void setMultipliers(const Multipliers& multipliers);

  /// Of a stage of the last sweep, about the iterate linearized last; valid until the next step() or prepare().
  const Gains& getGains(int stage) const;
  /// Of a node of that iterate, whose tangent space is that of the gains; valid likewise, until advance() or move().
  const NodeEvaluation& getLinearized(int node) const;
  /// Of a node of the trajectory that the last step() ended with, or null if it was not evaluated last; valid likewise.
  const NodeEvaluation* getEvaluation(int node) const;
  /// The same to keep, in exchange for one by makeEvaluation() of the problem; nothing happens where it would be null.
  void exchangeEvaluation(int node, std::unique_ptr<NodeEvaluation>& other);

 private:
  const ShootingProblem* problem_;
  RecedingOptions options_;
  std::unique_ptr<FddpMemory> memory_;
  std::vector<NodeSource> sources_;  // of advance()
  FddpSummary summary_;              // of the last step()
  double regularization_ = 0;        // that the last step ended with
  double gap_weight_ = 0;            // nu of its last search
  bool advanced_ = false;            // since then
  bool prepared_ = false;            // the next one
};

}  // namespace bielle
