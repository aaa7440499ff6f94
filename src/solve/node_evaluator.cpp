#include "bielle/solve/shooting_problem.h"

namespace bielle {

NodeEvaluator::NodeEvaluator(const ShootingProblem& problem)
    : problem_(problem), at_(problem.makeEvaluation()), scratch_(problem.makeScratch()) {}

const NodeEvaluation& NodeEvaluator::evaluate(int node, const VectorXd& x, const VectorXd& u) {
  node_ = node;
  EvaluateTask task;
  task.node = node;
  task.x = &x;
  task.u = &u;
  task.out = at_.get();
  problem_.evaluate(&task, 1, scratch_.get());
  return *at_;
}

NumericalStatus NodeEvaluator::linearize(const NodeEvaluation* next, StageModel& out) {
  const bool running = node_ < problem_.numStages();
  const int ndx = problem_.tangentSize(node_), nu = running ? problem_.controlSize(node_) : 0;
  const int ndx_next = running ? problem_.tangentSize(node_ + 1) : 0;
  const int rows = problem_.constraintSize(node_);
  if (!out.hasSizes(ndx, nu, ndx_next)) out.resize(ndx, nu, ndx_next);
  out.setRows(rows);
  rows_.assign(rows, true);
  LinearizeTask task;
  task.node = node_;
  task.at = at_.get();
  task.next = next;
  task.rows = &rows_;
  task.out = &out;
  problem_.linearize(&task, 1, scratch_.get());
  return task.status;
}

VectorXd NodeEvaluator::integrate(const VectorXd& dx) {
  VectorXd out(problem_.stateSize());
  const IntegrateTask task{node_, at_.get(), &dx, &out};
  problem_.integrate(&task, 1, scratch_.get());
  return out;
}

VectorXd NodeEvaluator::difference(const VectorXd& x1) {
  VectorXd out(problem_.tangentSize(node_));
  const DifferenceTask task{node_, at_.get(), &x1, &out};
  problem_.difference(&task, 1, scratch_.get());
  return out;
}

}  // namespace bielle
