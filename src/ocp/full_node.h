#pragma once
// The full formulation: robot_problem.h Eqs. (1) and (2), x = (q, v) of the spanning tree.
#include "node_model.h"

namespace bielle {

class FullNode : public NodeModel {
 public:
  FullNode(const Model& model, const StageSpec& spec);

  int tangentSize() const override { return 2 * model_.nv(); }
  void integrate(ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) override;
  void difference(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) override;
  bool updateState(ConstVectorRef x) override;
  bool updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) override;
  void restore() override {}
  const Workspace& workspace() const override { return ws_; }
  ResidualJacobians& startResiduals(const ResidualStack& stack) override;
  bool linearizeStep(ConstVectorRef x_next_node, StageModel& out) override;
  void linearizeState() override {}
  double calcStateCost() override;
  void addStateCost(double scale, StageModel& out) override;
  void setResiduals(const ResidualStack& stack, bool running, StageModel& out) override;

 protected:
  Workspace ws_;
  ConstrainedWorkspace cws_;

 private:
  ResidualJacobians jacobians_;
  VectorXd tau_, displacement_, difference_;  // the last one of q to the reference of the state cost
  MatrixXd Rx_, Ru_, scaled_, Ru_scaled_;     // total derivatives of the residuals; the same times the Hessian
};

}  // namespace bielle
