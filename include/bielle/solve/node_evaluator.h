#pragma once
/// \file Evaluates one node of a shooting problem at a time, outside a solver.
#include "bielle/solve/shooting_problem.h"

namespace bielle {

/// Owns an evaluation and its scratch. No allocation after the first node of the same sizes.
class NodeEvaluator {
 public:
  /// The problem must outlive it.
  explicit NodeEvaluator(const ShootingProblem& problem);

  /// Dynamics and cost of a node at (x, u), kept until the next call; u is not read at the terminal node.
  const NodeEvaluation& evaluate(int node, const VectorXd& x, const VectorXd& u = VectorXd());
  /// Quadratic model about the last evaluation, which must be Ok.
  /// \param next  evaluation of the next node; null at the terminal node
  StepStatus linearize(const NodeEvaluation* next, StageModel& out);
  /// x (+) dx and x1 (-) x about the state x of the last evaluation.
  VectorXd integrate(const VectorXd& dx);
  VectorXd difference(const VectorXd& x1);

  const NodeEvaluation& evaluation() const { return *at_; }

 private:
  const ShootingProblem& problem_;
  std::unique_ptr<NodeEvaluation> at_;
  std::unique_ptr<ProblemScratch> scratch_;
  int node_ = 0;
};

}  // namespace bielle
