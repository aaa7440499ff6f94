#pragma once
// One node of a problem at a time, with plain numbers in and out, for comparison with finite differences.
#include "bielle/ocp/robot_problem.h"

namespace bielle::testing {

class ProblemProbe {
 public:
  explicit ProblemProbe(const RobotProblem& problem)
      : problem_(problem), stage_(problem), next_(problem), points_{Point(problem), Point(problem)} {}

  const RobotProblem& problem() const { return problem_; }
  const Model& model() const { return problem_.model(); }
  const StageSpec& spec(int node) const { return problem_.spec(node); }
  int numStages() const { return problem_.numStages(); }
  int stateSize() const { return problem_.stateSize(); }
  int tangentSize(int node) const { return problem_.tangentSize(node); }
  const VectorXd& initialState() const { return problem_.initialState(); }

  NumericalStatus step(int stage, const VectorXd& x, const VectorXd& u, VectorXd& x_next, double& cost) {
    const RobotEvaluation& at = stage_.evaluate(stage, x, u);
    if (at.status != NumericalStatus::Ok) return NumericalStatus::Failed;
    x_next = at.x_next;
    cost = at.cost;
    return NumericalStatus::Ok;
  }
  NumericalStatus calcTerminalCost(const VectorXd& x, double& cost) {
    const RobotEvaluation& at = stage_.evaluate(numStages(), x);
    cost = at.cost;
    return at.status;
  }
  NumericalStatus calcDynamics(int stage, const VectorXd& x, const VectorXd& u, VectorXd& a, VectorXd& lambda) {
    const RobotEvaluation& at = stage_.evaluate(stage, x, u);
    a = at.a;
    lambda = at.lambda;
    return at.status;
  }
  // Why the last step failed.
  const std::string& failure() const { return stage_.evaluation().failure; }

  NumericalStatus linearize(int stage, const VectorXd& x, const VectorXd& u, const VectorXd& x_next_node,
                            StageModel& out) {
    if (stage_.evaluate(stage, x, u).status != NumericalStatus::Ok) return NumericalStatus::Failed;
    if (next_.evaluate(numStages(), x_next_node).status != NumericalStatus::Ok) return NumericalStatus::Failed;
    return stage_.linearize(&next_.evaluation(), out);
  }
  NumericalStatus linearizeTerminal(const VectorXd& x, StageModel& out) {
    if (stage_.evaluate(numStages(), x).status != NumericalStatus::Ok) return NumericalStatus::Failed;
    return stage_.linearize(nullptr, out);
  }
  VectorXd integrate(const VectorXd& x, const VectorXd& dx) { return evaluateAt(x).integrate(dx); }
  VectorXd difference(const VectorXd& x0, const VectorXd& x1) { return evaluateAt(x0).difference(x1); }

 private:
  struct Point {
    explicit Point(const RobotProblem& problem) : evaluator(problem) {}
    RobotEvaluator evaluator;
    VectorXd x;  // where it was evaluated
  };

  // Tangent spaces depend on the state alone, so that any node will do. Differences move the same two states again and again:
  // the one before the step and that of the next node.
  RobotEvaluator& evaluateAt(const VectorXd& x) {
    for (Point& point : points_)
      if (point.x.size() == x.size() && point.x == x) return point.evaluator;
    turn_ = 1 - turn_;
    Point& point = points_[turn_];
    point.x = x;
    point.evaluator.evaluate(numStages(), x);
    return point.evaluator;
  }

  const RobotProblem& problem_;
  RobotEvaluator stage_, next_;
  Point points_[2];
  int turn_ = 0;
};

}  // namespace bielle::testing
