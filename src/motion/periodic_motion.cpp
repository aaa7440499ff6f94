#include "motion/periodic_motion.h"

#include <algorithm>
#include <utility>

namespace bielle {

StateMap makeStateMap(const Motion& motion) {
  return [&model = motion.problem->model(), X = *motion.cycle](const VectorXd& x) { return carryState(model, x, X); };
}

std::unique_ptr<PeriodicProblem> makePeriodicProblem(const Motion& motion) {
  if (!motion.cycle) return nullptr;
  return std::make_unique<PeriodicProblem>(*motion.problem, makeStateMap(motion));
}

void setCyclicFeedback(Solution& solution) {
  const RobotProblem& problem = *solution.motion.problem;
  const Model& model = problem.model();
  std::vector<StageSpec> stages;
  for (int k = 0; k <= problem.numStages(); ++k) {
    stages.push_back(problem.spec(k));
    ConstraintSet& set = stages.back().constraints;
    for (size_t c = static_cast<size_t>(set.num_loops); c < set.closures.size(); ++c) set.closures[c].kp = 0;
  }
  const VectorXd& x0 = problem.initialState();
  const RobotProblem landed(model, x0.head(model.nq()), x0.tail(model.nv()), std::move(stages), problem.formulation());
  CyclicFeedback feedback = calcCyclicFeedback(landed, makeStateMap(solution.motion), solution.trajectory,
                                               {solution.multipliers.values, solution.summary.penalty});
  if (feedback.status != NumericalStatus::Ok) return;
  solution.gains = std::move(feedback.gains);
  solution.floquet_multiplier = std::abs(feedback.multipliers[0]);
}

double calcClosingError(const Model& model, const SE3& cycle, const VectorXd& first, const VectorXd& last) {
  const VectorXd wanted = carryState(model, first, cycle);
  const int nq = model.nq(), nv = model.nv();
  return std::max(model.difference(wanted.head(nq), last.head(nq)).lpNorm<Eigen::Infinity>(),
                  (last.segment(nq, nv) - wanted.segment(nq, nv)).lpNorm<Eigen::Infinity>());
}

}  // namespace bielle
