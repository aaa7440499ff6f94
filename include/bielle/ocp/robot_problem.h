#pragma once
/// \file The shooting problem of a robot: constrained dynamics in steps, and costs.
///
/// A step of length h is made of kicks and drifts (StepRule). A kick changes the velocity by an acceleration, a drift
/// moves the robot with its velocity. With a(q, v) the constrained dynamics under the torques u,
///
///     Euler:     v <- v + h a(q, v),  drift h                                                                      (1)
///     midpoint:  drift h/2,  v <- v + h a(q, v + h/2 a(q, v)),  drift h/2                                          (2)
///
/// The midpoint step is of second order: both accelerations are taken half way, the first only to foresee the velocity
/// there. They have one mass matrix.
///
/// Full formulation (the paper): x = (q, v) of the spanning tree, tangent size 2 nv. A drift, with its derivatives (J_q,
/// J_d those of (+) at d = h v):
///
///     q+ = q (+) h v,    v+ = v,                 dq+ = J_q dq + h J_d dv,    dv+ = dv                              (3)
///
/// Reduced formulation (ours): every state is closed and its velocity keeps it closed; tangent size 2 (nv - rank), in
/// an orthonormal basis N(q) per node and loop cluster (reduction.h). Loops are eliminated from a without forming
/// full-size matrices. A drift follows the closures, and turns the velocity into them:
///
///     q+ = q (+) h w',    w' = v - W^{-1} J^T zeta  with q+ closed,    v+ = (I - J^+ J)(q+) w'                     (4)
///
/// The chord w' lies between the tangents of both ends, so that (4) follows a geodesic to second order. The derivatives
/// are in src/ocp/reduced/reduced_kernel.h. As h vanishes both formulations have the same optimum.
/// The running cost of a stage is h times the sum of its costs; the terminal cost is the sum itself.
/// Gauss-Newton: a residual r contributes J^T diag(hessian) J with J = dr/dq + dr/dlambda dlambda/dq, and likewise for
/// v and u.
#include <string>
#include <vector>

#include "bielle/dynamics/constrained.h"
#include "bielle/ocp/cost.h"
#include "bielle/solve/node_evaluator.h"

namespace bielle {

/// A stage is either a step of the dynamics, or a rigid impact (impact.h): (q, v) becomes (q, v+) in no time,
/// under the constraints in force afterwards. At an impact lambda holds impulses, motors have no effect, and the
/// running cost is the sum of the costs, without h.
enum class StageKind { Dynamics, Impact };

/// Eq. (1), the paper's, of first order; or Eq. (2), of second order.
enum class StepRule { Euler, Midpoint };
const char* getName(StepRule rule);

/// One stage of the horizon (or the terminal node, which uses neither kind, dt nor constraints).
struct StageSpec {
  StageKind kind = StageKind::Dynamics;
  StepRule step = StepRule::Euler;
  double dt = 0.015;  ///< s; 0 for an impact
  ConstraintSet constraints;
  StateCost state;
  ControlCost control;
  std::vector<Cost> costs;
  std::vector<PathConstraint> path_constraints;
  VectorXd effort_limits;  ///< bounds of |u|, nu, for solvers that enforce bounds; empty: those of the motors
};

/// Value of one cost at one node, for reports.
struct CostValue {
  std::string name;
  double value = 0;
};

/// The state space of a problem.
enum class Formulation { Full, Reduced };
const char* getName(Formulation formulation);

class Transcription;

/// A node of a robot's problem, with the accelerations and forces behind its next state. Those of a midpoint step belong
/// to (q_mid, v_mid), the point after half the drift with the velocity foreseen there.
struct RobotEvaluation : NodeEvaluation {
  VectorXd a;          ///< nv, accelerations; not used at an impact
  VectorXd q_mid;      ///< nq, of midpoint steps alone
  VectorXd v_mid;      ///< nv, likewise
  VectorXd lambda;     ///< rows of the constraints of the stage: forces (at an impact, impulses), each in its frame 1
  VectorXd residuals;  ///< of all costs and path constraints, concatenated in an order internal to the problem
  double state_cost = 0;  ///< before scaling by the time step
};

class RobotProblem : public ShootingProblem {
 public:
  /// \param model  must outlive the problem
  /// \param q0, v0  initial state; for the reduced formulation closed, with a velocity that keeps it closed
  /// \param stages  N running stages, then the terminal one
  /// \throws ModelError on sizes that do not match, or an open configuration in the reduced formulation
  RobotProblem(const Model& model, const VectorXd& q0, const VectorXd& v0, std::vector<StageSpec> stages,
               Formulation formulation = Formulation::Full);
  ~RobotProblem() override;

  int numStages() const override { return static_cast<int>(specs_.size()) - 1; }
  int stateSize() const override { return model_.nq() + model_.nv(); }
  int tangentSize(int node) const override;
  int controlSize(int) const override { return model_.nu(); }
  const VectorXd& initialState() const override { return x0_; }
  void getControlBounds(int stage, VectorRef lower, VectorRef upper) const override;
  int constraintSize(int node) const override;
  void getConstraintBounds(int node, VectorRef lower, VectorRef upper) const override;
  /// The name of the path constraint, with the row where it has several.
  std::string getConstraintName(int node, int row) const override;
  /// A RobotEvaluation.
  std::unique_ptr<NodeEvaluation> makeEvaluation() const override;
  std::unique_ptr<ProblemScratch> makeScratch() const override;
  void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const override;
  void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const override;
  void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const override;
  void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const override;
  int getBatchSize() const override;

  const Model& model() const { return model_; }
  Formulation formulation() const { return formulation_; }
  const StageSpec& spec(int node) const { return specs_[node]; }
  /// Costs by name at an evaluated node.
  std::vector<CostValue> getCosts(int node, const RobotEvaluation& at) const;

 private:
  const Model& model_;
  Formulation formulation_;
  std::vector<StageSpec> specs_;
  std::unique_ptr<Transcription> transcription_;
  VectorXd x0_;
};

/// NodeEvaluator for the problem of a robot.
class RobotEvaluator : public NodeEvaluator {
 public:
  explicit RobotEvaluator(const RobotProblem& problem) : NodeEvaluator(problem) {}
  const RobotEvaluation& evaluate(int node, const VectorXd& x, const VectorXd& u = VectorXd()) {
    return static_cast<const RobotEvaluation&>(NodeEvaluator::evaluate(node, x, u));
  }
};

}  // namespace bielle
