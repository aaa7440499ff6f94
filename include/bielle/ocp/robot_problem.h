#pragma once
/// \file The shooting problem of a robot: constrained dynamics under Euler steps, and costs.
///
/// Full formulation (the paper): x = (q, v) of the spanning tree, tangent size 2 nv. One step of length h:
///
///     a = constrained dynamics (q, v, u),    v+ = v + h a,    q+ = q (+) h v+                                        (1)
///
/// with derivatives (J_q, J_d those of (+) at d = h v+)
///
///     dv+ = dv + h da,                       dq+ = J_q dq + h J_d dv+                                                (2)
///
/// Reduced formulation (ours): every state is closed and its velocity keeps it so; tangent size 2 (nv - rank), about an
/// orthonormal basis N(q) per node and loop cluster (reduction.h). With a as in (1), loops eliminated before anything
/// of full size,
///
///     w = v + h a,    q+ = q (+) h w',  w' = w - W^{-1} J^T zeta with q+ closed,    v+ = (I - J^+ J)(q+) w'          (3)
///
/// Its derivatives stand in reduced_node.cpp. As h vanishes both formulations have the same optimum.
/// Running cost of a stage: h times the sum of its costs; the terminal node has no h.
/// Gauss-Newton: a residual r contributes J^T diag(hessian) J with J = dr/dq + dr/dlambda dlambda/dq, and so on.
#include <string>
#include <vector>

#include "bielle/dynamics/constrained.h"
#include "bielle/ocp/cost.h"
#include "bielle/ocp/shooting_problem.h"

namespace bielle {

/// What a stage does: an Euler step of the dynamics, or a rigid impact (impact.h): (q, v) becomes (q, v+) in no time, the
/// constraints being those in force afterwards. At an impact lambda is impulses, motors have no say, and the running cost
/// is the sum of the costs as it stands.
enum class StageKind { Dynamics, Impact };

/// One stage of the horizon (or the terminal node, where kind, dt and constraints are not used).
struct StageSpec {
  StageKind kind = StageKind::Dynamics;
  double dt = 0.015;  ///< s; 0 for an impact
  ConstraintSet constraints;
  StateCost state;
  ControlCost control;
  std::vector<Cost> costs;
  VectorXd effort_limits;  ///< of |u|, nu, for solvers that enforce bounds; empty: those of the motors
};

/// Value of one cost at one node, for reports.
struct CostValue {
  std::string name;
  double value = 0;
};

/// The state space of a problem.
enum class Formulation { Full, Reduced };
const char* getName(Formulation formulation);

class NodeModel;
struct ResidualStack;
struct Reduction;

class RobotProblem : public ShootingProblem {
 public:
  /// \param q0, v0 initial state; closed, with a velocity that keeps it closed, for the reduced formulation
  /// \param stages N running stages and the terminal one at the end. The model must outlive the problem.
  /// \throws ModelError on sizes that do not fit, or an open configuration for the reduced formulation
  RobotProblem(const Model& model, const VectorXd& q0, const VectorXd& v0, std::vector<StageSpec> stages,
               Formulation formulation = Formulation::Full);
  ~RobotProblem() override;

  int numStages() const override { return static_cast<int>(specs_.size()) - 1; }
  int stateSize() const override { return model_.nq() + model_.nv(); }
  int tangentSize(int) const override { return tangent_size_; }
  int controlSize(int) const override { return model_.nu(); }
  const VectorXd& initialState() const override { return x0_; }
  void integrate(int node, ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) const override;
  void integrateNodes(const std::vector<IntegrateTask>& tasks) const override;
  void difference(int node, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const override;
  StepStatus step(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) override;
  StepStatus continueStep(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) override;
  void stepStages(std::vector<StepTask>& tasks) override;
  StepStatus calcTerminalCost(ConstVectorRef x, double& cost) override;
  StepStatus linearize(int stage, ConstVectorRef x, ConstVectorRef u, ConstVectorRef x_next_node,
                       StageModel& out) override;
  void linearizeStages(int begin, int end, const std::vector<VectorXd>& xs, const std::vector<VectorXd>& us,
                       std::vector<StageModel>& models, std::vector<StepStatus>& statuses) override;
  int getBatchSize() const override { return formulation_ == Formulation::Reduced ? static_cast<int>(kLane) : 1; }
  StepStatus linearizeTerminal(ConstVectorRef x, StageModel& out) override;
  void getControlBounds(int stage, VectorRef lower, VectorRef upper) const override;
  std::string getFailure(int node) const override;

  const Model& model() const { return model_; }
  Formulation formulation() const { return formulation_; }
  const StageSpec& spec(int node) const { return specs_[node]; }
  /// Accelerations (nv) and constraint forces (rows) of a stage at (x, u).
  StepStatus calcDynamics(int stage, ConstVectorRef x, ConstVectorRef u, VectorXd& a, VectorXd& lambda);
  /// Costs by name at a node (u empty at the terminal node).
  std::vector<CostValue> calcCosts(int node, ConstVectorRef x, ConstVectorRef u);

 private:
  struct Node;
  bool isEvaluated(int stage, ConstVectorRef x, ConstVectorRef u) const;
  bool startEvaluation(int stage, ConstVectorRef x, ConstVectorRef u);
  StepStatus finishEvaluation(int stage, bool ok);
  StepStatus evaluate(int stage, ConstVectorRef x, ConstVectorRef u, const NodeModel* previous = nullptr);
  template <typename Finish>
  void evaluateTogether(StepTask* tasks, int num_tasks, const Finish& finish);
  void calcDeviations(const StepTask* tasks, int num_tasks);
  void evaluateStages(int begin, int end, const std::vector<VectorXd>& xs, const std::vector<VectorXd>& us);
  StepStatus finishStep(int stage, VectorRef x_next, double& cost);
  StepStatus finishLinearization(int stage, ConstVectorRef u, ConstVectorRef x_next_node, StageModel& out);
  double sumCosts(int node_index, std::vector<CostValue>* values = nullptr);
  void differentiateCosts(int node_index, double scale, StageModel& out);
  void differentiateResiduals(int node_index, double scale, StageModel& out);

  const Model& model_;
  Formulation formulation_;
  std::vector<StageSpec> specs_;
  std::unique_ptr<Reduction> reduction_;
  std::vector<Node> nodes_;
  int tangent_size_ = 0;
  VectorXd x0_;
};

}  // namespace bielle
