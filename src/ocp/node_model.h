#pragma once
// The state space and the step of one node, behind RobotProblem: FullNode (the paper's spanning tree) or ReducedNode
// (closed configurations only). A node owns all memory that lasts, so that different nodes may work at the same time.
#include <memory>
#include <string>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/reduction.h"
#include "bielle/ocp/robot_problem.h"

namespace bielle {

// Stacked residuals of a node and the weights that the activations give them; first those that depend on q or v.
struct ResidualStack {
  VectorXd r, gradient, hessian;
  int motion_rows = 0;
  bool counts(int row) const { return gradient[row] != 0 || hessian[row] != 0; }
};

// Partial derivatives of stacked residuals, rows x nv, nv, constraint rows; with room for those of other nodes.
struct ResidualJacobians {
  MatrixXd q, v, lambda;
  ResidualRows getRows(int row, int rows, int constraint_rows) {
    return {q.middleRows(row, rows), v.middleRows(row, rows), lambda.block(row, 0, rows, constraint_rows)};
  }
};

int countResidualRows(const StageSpec& spec);

class NodeModel {
 public:
  NodeModel(const Model& model, const StageSpec& spec);
  virtual ~NodeModel() = default;

  virtual int tangentSize() const = 0;
  virtual void integrate(ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) = 0;
  virtual void difference(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) = 0;

  // Of several nodes of this kind, by one thread.
  struct Integration {
    NodeModel* node;
    const VectorXd *x, *dx;
    VectorXd* x_out;
  };
  virtual void integrateNodes(const Integration* items, int count) {
    for (int i = 0; i < count; ++i) items[i].node->integrate(*items[i].x, *items[i].dx, *items[i].x_out);
  }
  struct Difference {
    NodeModel* node;
    const VectorXd *x0, *x1;
    VectorXd* dx;
  };
  virtual void calcDifferences(const Difference* items, int count) {
    for (int i = 0; i < count; ++i) items[i].node->difference(*items[i].x0, *items[i].x1, *items[i].dx);
  }

  // Kinematics at x alone (terminal node).
  virtual bool updateState(ConstVectorRef x) = 0;
  // Dynamics at (x, u) and the next state, in x_next(). `previous`, if any, is a node of the same kind that may have x as
  // its next state.
  virtual bool updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) = 0;
  // Brings workspace() back to the last update, if other nodes have used it since.
  virtual void restore() = 0;
  // Kinematics of the last function called, until another node of the same thread is worked on.
  virtual const Workspace& workspace() const = 0;
  // Where the derivatives of this node's residuals are to be written, before setResiduals(): zero so far.
  virtual ResidualJacobians& startResiduals(const ResidualStack& stack) = 0;
  // updateStep() of at most kLane nodes of this kind at once, by one thread: startStep() of each, then finishSteps() of one
  // of them, and showStep() of each for its workspace(). Nodes that do not go with others return false from startStep().
  virtual bool startStep(ConstVectorRef /*x*/, ConstVectorRef /*u*/, const NodeModel* /*previous*/) { return false; }
  virtual void finishSteps(NodeModel* const* /*nodes*/, int /*count*/, bool* /*ok*/) {}
  virtual void showStep(int /*index*/) {}
  // Before linearizeStep() of at most kLane nodes of this kind, by the same thread: does at once what they have in common.
  struct Linearization {
    NodeModel* node;
    const double* x_next_node;
    const NodeModel* next;  // the node of this kind whose state that is, where it may be looked at; or null
  };
  virtual void prepareLinearization(const Linearization* /*items*/, int /*count*/) {}
  // Fx, Fu and gap about the last updateStep(); the derivatives that setResiduals() needs.
  virtual bool linearizeStep(ConstVectorRef x_next_node, StageModel& out) = 0;
  // To be called after updateState() at the terminal node in place of linearizeStep().
  virtual void linearizeState() = 0;
  // The state cost of the stage at the last update; then scale times its derivatives there.
  virtual double calcStateCost() = 0;
  virtual void addStateCost(double scale, StageModel& out) = 0;
  // Gauss-Newton terms, whatever `out` held; at a running stage forces and controls take part. Derivatives of rows
  // that do not count need not be there.
  virtual void setResiduals(const ResidualStack& stack, bool running, StageModel& out) = 0;

  const VectorXd& lambda() const { return lambda_; }
  const VectorXd& x_next() const { return x_next_; }
  // Why the last function that failed did so; empty after one of the update functions went through.
  const std::string& failure() const { return failure_; }

 protected:
  const Model& model_;
  const StageSpec& spec_;
  VectorXd lambda_;  // rows of the constraints; the reduced node leaves those of loops at zero
  VectorXd x_next_;
  std::string failure_;
};

// Of the kind that the stage says.
std::unique_ptr<NodeModel> makeFullNode(const Model& model, const StageSpec& spec);
// Memory that the reduced nodes of a problem share, one piece for each thread; the reduction must outlive it.
class ReducedWorkPool;
std::shared_ptr<ReducedWorkPool> makeReducedWorkPool(const Model& model, const Reduction& reduction,
                                                     const std::vector<StageSpec>& specs);
std::unique_ptr<NodeModel> makeReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
                                           std::shared_ptr<ReducedWorkPool> pool);

// Joints whose configuration is not a vector: their clusters of the manifold Jacobians differ from the identity.
inline bool isCurved(const Joint& joint) {
  return joint.kind == JointKind::Spherical || joint.kind == JointKind::Planar || joint.kind == JointKind::FreeFlyer;
}

// Small square matrices of one joint, without allocation.
using JointMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;

}  // namespace bielle
