#pragma once
// The costs and path constraints of one node, their residuals stacked: first those that depend on q or v, then those of forces
// alone.
#include "bielle/ocp/robot_problem.h"

namespace bielle {

// Weights that the activations give to stacked residuals.
struct ResidualWeights {
  VectorXd gradient, hessian;  // rows
  bool counts(int row) const { return gradient[row] != 0 || hessian[row] != 0; }
};

// Partial derivatives of stacked residuals, rows x nv, nv, constraint rows, nu; they may be larger than one node needs.
struct ResidualJacobians {
  MatrixXd q, v, lambda, u;
};

class NodeCosts {
 public:
  // The spec must outlive it.
  NodeCosts(const StageSpec& spec, bool running);

  int rows() const { return rows_; }
  int motionRows() const { return motion_rows_; }
  int constraintRows() const { return constraint_rows_; }
  // Whether a residual depends on the controls.
  bool needsControls() const { return needs_controls_; }
  // Factor of the sum of the costs: the time step of a running stage; 1 at an impact and at the terminal node.
  double scale() const { return scale_; }

  // Computes the residuals, the scaled cost and the scaled constraints; the state cost of `at` must be up to date.
  void calc(const NodeView& node, RobotEvaluation& at) const;
  // Computes scaled weights of the rows, and Jacobians of the rows that count, which must be zero before. `constraints` may be
  // null.
  void differentiate(const NodeView& node, const RobotEvaluation& at, const ConstraintWeights* constraints,
                     ResidualWeights& weights, ResidualJacobians& jacobians) const;
  // Adds the derivatives of the control cost.
  void addControlCost(const VectorXd& u, StageModel& out) const;
  std::vector<CostValue> getValues(const RobotEvaluation& at) const;

 private:
  double calcControlCost(const VectorXd& u) const;
  void addJacobian(const NodeView& node, const Residual& residual, int row, const ResidualWeights& weights,
                   ResidualJacobians& jacobians) const;
  template <typename Add>
  void visitValues(const RobotEvaluation& at, const Add& add) const;

  const StageSpec& spec_;
  std::vector<int> first_rows_, first_constraint_rows_;  // of each cost, of each path constraint
  int rows_ = 0, motion_rows_ = 0, constraint_rows_ = 0;
  bool needs_controls_ = false;
  double scale_ = 1;
};

}  // namespace bielle
