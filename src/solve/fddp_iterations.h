#pragma once
// What the iterations of solve() and of Receding have in common (docs/solver.md): evaluations, models and sweeps in
// fddp_iterations.cpp, the search for a step in fddp_search.cpp. Each of the two has a loop of its own.
#include <algorithm>
#include <optional>

#include "solve/backward_pass.h"
#include "solve/rollout.h"
#include "solve/stopwatch.h"

namespace bielle {

/// Memory of a solve, which can be kept from solve to solve. Evaluations are kept as long as the problem has the same id().
struct FddpMemory {
  NodeEvaluations evaluations;
  AugmentedLagrangian lagrangian;
  BackwardPass backward;
  std::vector<VectorXd> dx, du;  // the models' full step
  Rollout rollout;
  std::vector<ControlBox> bounds;  // of u, N or none
  std::vector<ControlBox> boxes;   // of du, N or none
  std::vector<char> open;          // N: whether the gap after a stage counts as open
  std::vector<IntegrateTask> integrations;
  Team team;

  void resize(const ShootingProblem& problem, const IterationOptions& options, int most_segments, int threads);
};

/// The numbers of the current iterate and of the step searched from it.
class FddpIterations {
 protected:
  /// Reason for ending the iterations, if they end.
  using End = std::optional<FddpTermination>;
  static constexpr double kClose = 0.03;  // violations below this are near to none

  FddpIterations(const IterationOptions& options, int max_iterations, const ShootingProblem& problem,
                 ShootingTrajectory& trajectory, const FddpObserver& observer, FddpMemory& memory)
      : options_(options),
        max_iterations_(max_iterations),
        problem_(problem),
        trajectory_(trajectory),
        observer_(observer),
        memory_(memory) {}

  // What the models promise.
  struct Foreseen {
    double slope = 0, curvature = 0;  // Eq. (1)
    double excess = 0;                // of rows held by Eq. (15)
    double calcChange(double alpha) const { return alpha * slope + 0.5 * alpha * alpha * curvature + excess; }
  };

  // The parts of an iteration, in their order.
  void start(int most_segments);  // of rollouts
  // Then, for all nodes but the first: evaluations, multipliers, models and sweep. What follows it begins with resume().
  void prepare();
  void resume();
  End evaluate();
  End updateModels();
  End updateStep();
  void acceptStep();
  End checkProgress();
  void adaptRegularization();
  void finish(FddpTermination termination);

  // Whether the iterate is the optimum.
  bool isOptimal();
  // After no step was acceptable: either nothing but rounding is left to gain, or the regularization grows.
  End raiseRegularizationOrStall();
  End raiseRegularization(const char* reason);
  void resetRegularization();
  // The end after multipliers and penalties could not reduce the violations.
  FddpTermination endViolated();

  // Searches: false if no step is acceptable.
  RolloutInput startSearch();
  Trial& rollOut(const RolloutInput& input, double alpha, int segments);
  bool searchInOnePiece(const RolloutInput& input);
  bool tryClosed(const RolloutInput& input, int segments);
  bool accept(Trial& trial);
  double findMinimum(const Trial& trial) const;
  bool vanishesNext() const;
  bool closesTwice(int segments) const;
  bool isRounding() const;
  double calcRounding() const;

  bool isInterrupted() const { return observer_.interrupt && observer_.interrupt->load(); }
  // \param shortest  stages
  int getNumSegments(int shortest = 6) const { return std::max(1, std::min(options_.rollout_segments, N_ / shortest)); }
  bool isDamped() const { return regularization_ > options_.min_regularization; }
  bool isClosed() const { return line_.gap <= options_.gap_tolerance; }
  bool isStationary() const { return isClosed() && (stalled_ || line_.gradient <= options_.gradient_tolerance); }
  const EvaluationList& getIterate() const { return memory_.evaluations.getIterate(); }
  // Decrease by a full step.
  double calcForeseen() const { return -foreseen_.calcChange(1); }
  double calcReal(const Trial& trial) const { return calcMerit() - trial.merit - trial.closing_cost; }
  // By how much less than foreseen the merit decreases in a trial.
  double calcModelError(const Trial& trial) const { return -foreseen_.calcChange(trial.alpha) - calcReal(trial); }
  double calcMerit() const { return line_.cost + memory_.lagrangian.getValue(); }

  const IterationOptions& options_;
  const int max_iterations_;
  const ShootingProblem& problem_;
  ShootingTrajectory& trajectory_;
  const FddpObserver& observer_;
  FddpMemory& memory_;

  int N_ = 0;
  FddpIteration line_;                                    // the iteration under way
  double regularization_ = 0, first_regularization_ = 0;  // the latter of the first sweep of an iteration
  bool updated_ = false;                                  // multipliers are new in this iteration
  bool swept_ = false;                                    // a sweep is still to be looked at
  bool prepared_ = false;                                 // the models of all nodes but the first
  bool stalled_ = false;                                  // the merit cannot be seen to decrease, because of rounding
  Trial* accepted_ = nullptr;                             // the trial that ends a line search
  std::optional<double> closed_merit_;                    // after a full step under the same multipliers, with Eq. (8)
  std::optional<double> model_error_;                     // of the decrease by the last step, if it was a full one
  Foreseen foreseen_;                                     // by the sweep
  double first_step_ = 1, last_step_ = 1;  // alpha that the next line search starts with; of the iteration before
  double gap_weight_ = 0, least_gap_weight_ = 0;  // nu of Eq. (5), and the least that the next search takes
  FddpSummary summary_;

 private:
  void begin();
  void updateBoxes();
  BackwardInput getBackwardInput() const;
  End linearize();
  End checkModels(int failed);
  void updateGaps();
  double calcGradient() const;
  void chooseFirstStep();
  bool isAcceptable(const Trial& trial) const;

  Clock::time_point start_ = Clock::now();
  int threads_ = 1;
  std::optional<Team::Shift> shift_;
  double gap_sum_ = 0;  // c, of the gaps that count as open
  double accepted_merit_ = 0, last_gradient_ = 0;
  int failed_node_ = -1;  // where the first failed trial of a line search failed, and why
  std::string failure_;
};

}  // namespace bielle
