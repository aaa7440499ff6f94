#pragma once
// The loop of solve(), with memory that can be kept from solve to solve.
#include "solve/fddp_iterations.h"

namespace bielle {

class FddpSolve : private FddpIterations {
 public:
  /// \param trajectory  the guess, then the current iterate
  FddpSolve(const FddpOptions& options, const ShootingProblem& problem, ShootingTrajectory& trajectory,
            const FddpObserver& observer, FddpMemory& memory)
      : FddpIterations(options, options.max_iterations, problem, trajectory, observer, memory),
        acceptable_decrease_(options.acceptable_decrease),
        shoots_(options.multiple_shooting) {}

  FddpSummary run();

 private:
  static constexpr int kCreeping = 20;  // iterations in which the cost must have hardly changed

  FddpTermination iterate();
  End linearize();
  bool isCreeping() const;
  void settle();
  End findStep();
  bool hasSettledMerit() const;
  bool mustUpdateMultipliers() const;
  End updateMultipliers();
  End searchLine();
  bool tryFullStep(int segments);
  bool tryShorterStep(int segments);
  bool tryShorterSteps(int segments);
  bool hasViolatedFreeRows();
  End tryHolding(int segments);
  End sweepAgain();
  bool mustClose() const;
  bool isOvershooting(const Trial& trial) const;

  bool renewed_ = false;  // multipliers, by a line search

  const double acceptable_decrease_;
  bool shoots_ = false;            // segments are single stages
  bool closing_ = false;           // the next step must close the gaps, since the constraints are infeasible
  int settling_ = 0;               // steps left in which constraints are closed where the trajectory is
  int next_settling_ = kCreeping;  // iterations before the next such steps
};

}  // namespace bielle
