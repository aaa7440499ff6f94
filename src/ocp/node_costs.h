#pragma once
// The costs and path constraints of one node, their residuals stacked: first those that depend on q or v, then those of forces
// alone.
#include "bielle/ocp/robot_problem.h"

namespace bielle {

// Rows of a node that count: those of costs whose weights do not all vanish and of constraints that are wanted, residual by
// residual, first those that depend on q or v.
struct CountedRows {
  struct Block {
    const Residual* residual;
    int row, size;
    bool square;  // a constraint, or a cost that is a sum of squares
  };
  std::vector<Block> blocks;
  VectorXd gradient, hessian;    // weights of costs
  std::vector<int> constraints;  // by row: its number, or -1
  VectorXd unit;                 // of constraints
  int rows = 0, motion_rows = 0;

  void reserve(int num_blocks, int num_rows) {
    blocks.reserve(num_blocks);
    for (VectorXd* v : {&gradient, &hessian, &unit}) v->setZero(num_rows);
    constraints.resize(num_rows);
  }
  bool counts(int row) const { return gradient[row] != 0 || hessian[row] != 0 || constraints[row] >= 0; }
  // Calls work(row, unit, column of C^T) for each constraint.
  template <typename Work>
  void visitConstraints(StageModel& out, const Work& work) const {
    for (int i = 0; i < rows; ++i)
      if (constraints[i] >= 0) work(i, unit[i], out.Ct().col(constraints[i]));
  }
};

// Partial derivatives of stacked residuals, rows x nv, nv, constraint rows, nu, nu, 1; they may be larger than one node
// needs.
struct ResidualJacobians {
  MatrixXd q, v, lambda, u, speeds;
  VectorXd s;
};

class NodeCosts {
 public:
  // The spec must outlive it.
  NodeCosts(const StageSpec& spec, bool running);

  int rows() const { return rows_; }
  int numBlocks() const { return static_cast<int>(blocks_.size()); }
  int constraintRows() const { return constraint_rows_; }
  // Whether a residual depends on the controls.
  bool needsControls() const { return needs_controls_; }
  // Whether a residual depends on the speeds of the motors.
  bool needsSpeeds() const { return needs_speeds_; }
  // Factor of the sum of the costs: the length of a step; 1 at an impact and at the terminal node.
  double getScale(const RobotEvaluation& at) const { return step_ ? at.dt : 1; }

  // Computes the residuals, the scaled cost and the scaled constraints; the state cost of `at` must be up to date.
  void calc(const NodeView& node, RobotEvaluation& at) const;
  // What calc() has made not finite, by name: "constraint 'knee' is not a number"; "" if all is finite.
  std::string describeNotFinite(const RobotEvaluation& at) const;
  // Computes scaled weights, and with them which rows count. \param wanted  constraints, may be null
  void selectRows(const RobotEvaluation& at, const std::vector<char>* wanted, CountedRows& rows) const;
  // Computes the Jacobians of the counted rows, which must be zero before.
  void differentiate(const NodeView& node, const CountedRows& rows, ResidualJacobians& jacobians) const;
  // Adds the derivatives of the control cost.
  void addControlCost(const RobotEvaluation& at, StageModel& out) const;
  std::vector<CostValue> getValues(const RobotEvaluation& at) const;

 private:
  double calcControlCost(const VectorXd& u) const;  // of u with or without a time scale
  template <typename Add>
  void visitValues(const RobotEvaluation& at, const Add& add) const;

  const StageSpec* spec_;
  // Of one cost or one path constraint, in the order of the stacked residuals.
  struct Block {
    const Residual* residual;
    const Cost* cost;                  // or null
    const PathConstraint* constraint;  // or null
    int row;
    int constraint_row;  // among the constraints
  };
  std::vector<Block> blocks_;
  std::vector<int> first_rows_;  // of each cost
  int rows_ = 0, constraint_rows_ = 0;
  bool needs_controls_ = false, needs_speeds_ = false;
  bool step_ = false;
};

}  // namespace bielle
