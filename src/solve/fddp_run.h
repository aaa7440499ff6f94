#pragma once
// The iterations of fddp.h: the main loop in fddp_run.cpp, the search for a step in fddp_search.cpp.
#include <algorithm>
#include <optional>

#include "solve/backward_pass.h"
#include "solve/rollout.h"
#include "solve/stopwatch.h"

namespace bielle {

struct Fddp::Workspace {
  NodeEvaluations evaluations;
  AugmentedLagrangian lagrangian;
  BackwardPass backward;
  std::vector<VectorXd> dx, du;  // the models' full step
  Rollout rollout;
  std::vector<ControlBox> bounds;  // of u, N or none
  std::vector<ControlBox> boxes;   // of du, N or none
  std::vector<char> open;          // N: whether the gap after a stage counts as open

  void resize(const ShootingProblem& problem, const FddpOptions& options, int threads);
};

/// One call of solve(): the numbers of the current iterate and of the step searched from it.
class FddpRun {
 public:
  FddpRun(const FddpOptions& options, const ShootingProblem& problem, ShootingTrajectory& trajectory,
          const FddpObserver& observer, Fddp::Workspace& work)
      : options_(options), problem_(problem), trajectory_(trajectory), observer_(observer), work_(work) {}

  FddpSummary solve();

 private:
  static constexpr int kShortestSegment = 6;  // stages
  static constexpr int kCreeping = 20;        // iterations in which the cost must have hardly changed

  /// Reason for ending the iterations, if they end.
  using End = std::optional<FddpTermination>;

  void start();
  End linearize();
  // Whether the constraints nearly hold and the cost has hardly changed for a while, although models promise more.
  bool isCreeping() const;
  void settle();
  End evaluate();
  End linearizeAndSweep();
  void updateGaps();
  End findStep();
  End updateStep();
  End updateMultipliers();
  bool searchLine();
  bool tryFullStep(const RolloutInput& input, int segments, double nu);
  bool searchInSegments(const RolloutInput& input, int segments, double nu);
  bool accept(Trial& trial, double nu);
  bool mustUpdateMultipliers() const;
  bool mustClose() const;
  bool closesTwice(int segments) const;
  bool isOvershooting(const Trial& trial) const;
  bool isRounding() const;
  double calcRounding() const;
  bool isAcceptable(const Trial& trial, double nu) const;
  void chooseFirstStep();
  void acceptStep();
  void resetRegularization();
  End raiseRegularization(const char* reason);
  End checkProgress();
  FddpSummary finish(FddpTermination termination);

  // Whether multipliers are updated before every linearization, so that no iteration linearizes twice.
  bool recedes() const { return options_.last_rollout == LastRollout::Segments; }
  bool isInterrupted() const { return observer_.interrupt && observer_.interrupt->load(); }
  int getNumSegments() const { return std::max(1, std::min(options_.rollout_segments, N_ / kShortestSegment)); }
  bool isClosed() const { return line_.gap <= options_.gap_tolerance; }
  bool isStationary() const { return isClosed() && (stalled_ || line_.gradient <= options_.gradient_tolerance); }
  // Decrease by a full step.
  double calcForeseen() const { return -slope_ - 0.5 * curvature_; }
  double calcMerit() const { return line_.cost + work_.lagrangian.getValue(); }
  double calcGradient() const;

  const FddpOptions& options_;
  const ShootingProblem& problem_;
  ShootingTrajectory& trajectory_;
  const FddpObserver& observer_;
  Fddp::Workspace& work_;

  int N_ = 0;
  Clock::time_point start_ = Clock::now();
  FddpIteration line_;                                    // the iteration under way
  double gap_sum_ = 0;                                    // c, of the gaps that count as open
  double slope_ = 0, curvature_ = 0;                      // Eq. (1)
  double regularization_ = 0, first_regularization_ = 0;  // the latter of the first sweep of an iteration
  int threads_ = 1;
  bool swept_ = false;             // a sweep is still to be looked at
  bool updated_ = false;           // multipliers are new in this iteration
  bool closing_ = false;           // the next step must close the gaps, since the constraints are infeasible
  int settling_ = 0;               // steps left in which constraints are closed where the trajectory is
  int next_settling_ = kCreeping;  // iterations before the next such steps
  bool stalled_ = false;           // the merit cannot be seen to decrease, because of rounding
  Trial* accepted_ = nullptr;      // the trial that ends a line search
  int failed_node_ = -1;           // where the first failed trial of a line search failed, and why
  std::string failure_;
  double accepted_merit_ = 0;
  std::optional<double> closed_merit_;        // after a full step under the same multipliers, with Eq. (8)
  double first_step_ = 1;                     // alpha that the next line search starts with
  double last_gradient_ = 0, last_step_ = 1;  // of the iteration before
  FddpSummary summary_;
};

}  // namespace bielle
