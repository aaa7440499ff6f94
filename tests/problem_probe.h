#pragma once
// One node of a problem at a time, with plain numbers in and out, for comparison with finite differences.
#include "bielle/ocp/robot_problem.h"

namespace bielle::testing {

class ProblemProbe {
 public:
  explicit ProblemProbe(const RobotProblem& problem)
      : problem_(problem), stage_(problem), point_(problem), next_(problem) {}

  const RobotProblem& problem() const { return problem_; }
  const Model& model() const { return problem_.model(); }
  const StageSpec& spec(int node) const { return problem_.spec(node); }
  int numStages() const { return problem_.numStages(); }
  int stateSize() const { return problem_.stateSize(); }
  int tangentSize(int node) const { return problem_.tangentSize(node); }
  const VectorXd& initialState() const { return problem_.initialState(); }

  StepStatus step(int stage, const VectorXd& x, const VectorXd& u, VectorXd& x_next, double& cost) {
    const RobotEvaluation& at = stage_.evaluate(stage, x, u);
    if (at.status != StepStatus::Ok) return StepStatus::Failed;
    x_next = at.x_next;
    cost = at.cost;
    return StepStatus::Ok;
  }
  StepStatus calcTerminalCost(const VectorXd& x, double& cost) {
    const RobotEvaluation& at = stage_.evaluate(numStages(), x);
    cost = at.cost;
    return at.status;
  }
  StepStatus calcDynamics(int stage, const VectorXd& x, const VectorXd& u, VectorXd& a, VectorXd& lambda) {
    const RobotEvaluation& at = stage_.evaluate(stage, x, u);
    a = at.a;
    lambda = at.lambda;
    return at.status;
  }
  // Why the last step failed.
  const std::string& failure() const { return stage_.evaluation().failure; }

  StepStatus linearize(int stage, const VectorXd& x, const VectorXd& u, const VectorXd& x_next_node, StageModel& out) {
    if (stage_.evaluate(stage, x, u).status != StepStatus::Ok) return StepStatus::Failed;
    if (next_.evaluate(numStages(), x_next_node).status != StepStatus::Ok) return StepStatus::Failed;
    return stage_.linearize(&next_.evaluation(), out);
  }
  StepStatus linearizeTerminal(const VectorXd& x, StageModel& out) {
    if (stage_.evaluate(numStages(), x).status != StepStatus::Ok) return StepStatus::Failed;
    return stage_.linearize(nullptr, out);
  }
  // Tangent spaces depend on the state alone, so that any node will do.
  VectorXd integrate(const VectorXd& x, const VectorXd& dx) {
    point_.evaluate(numStages(), x);
    return point_.integrate(dx);
  }
  VectorXd difference(const VectorXd& x0, const VectorXd& x1) {
    point_.evaluate(numStages(), x0);
    return point_.difference(x1);
  }

 private:
  const RobotProblem& problem_;
  RobotEvaluator stage_, point_, next_;
};

}  // namespace bielle::testing
