#pragma once
/// \file The shooting problem of a robot: constrained dynamics in steps, and costs.
///
/// A step of length h is made of kicks and drifts (StepRule). A kick changes the velocity by an acceleration, a drift
/// moves the robot with its velocity. With a(q, v) the constrained dynamics under the torques u,
///
///     Euler:     v <- v + h a(q, v),  drift h                                                                      (1)
///     midpoint:  drift h/2,  v <- v + h a(q, v + h/2 a(q, v)),  drift h/2                                          (2)
///
/// The midpoint step is of second order: both accelerations are evaluated at the midpoint, the first only to predict
/// the velocity there. They share one mass matrix. The stabilisation of contacts and closures (closure.h) is that of
/// the node's state in both rules: at the midpoint, after a straight drift, even a standing foot is off its place, and
/// moves. The predicting acceleration has no stabilisation.
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
///
/// The duration of a phase, i.e. of consecutive steps, may be a variable: its time scale s, bounded, with
///
///     h_k = s dt_k    for all steps k of the phase                                                                 (5)
///
/// The first step of the phase has s among its controls, after the torques. The others have it in their state, where it
/// does not change: after (q, v) in x, but before them in the tangent space, so that (u, s, dq, dv) is the order of the
/// variables of a stage in both cases. Derivatives by s are exact. The running cost l = s dt sum_i 1/2 w_i r_i^2 counts
/// as a sum of squares of sqrt(s) r_i, so that, with g its gradient at a fixed factor s, its Hessian receives
///     l_ss += l / (2 s^2) + g_s / s,    l_sz += g_z / (2 s)                                                        (6)
/// where g_s is due to residuals that depend on s: references of velocities, and forces of midpoint steps. Costs that
/// are not squares count in l and its gradient, but not in g.
///
/// The speeds of the motors belong to the velocity that a is taken at: v, or v + h/2 a of a midpoint step.
///
/// A step too long for a spring of stiffness k makes it grow: with the mass m, if h^2 k > 4 m. With the armature h^2 k / 4
/// added,
///     (m + h^2 k / 4) a = f - k q_mid    is    m a = f - k (q + q+) / 2,                                             (7)
/// the implicit midpoint step of that spring, which is of second order and stable for any h.
///
/// Gauss-Newton: a residual r contributes J^T diag(hessian) J with J = dr/dq + dr/dlambda dlambda/dq, and likewise for
/// v and u.
#include <memory>
#include <string>
#include <vector>

#include "bielle/dynamics/constrained.h"
#include "bielle/ocp/cost.h"
#include "bielle/solve/shooting_problem.h"

namespace bielle {

/// A stage is either a step of the dynamics, or a rigid impact (impact.h): (q, v) becomes (q, v+) in no time,
/// under the constraints in force afterwards. At an impact lambda holds impulses, motors have no effect, and the
/// running cost is the sum of the costs, without h.
enum class StageKind { Dynamics, Impact };

/// Eq. (1), the paper's, of first order; or Eq. (2), of second order, the default of all motions.
enum class StepRule { Euler, Midpoint };
const char* getName(StepRule rule);

/// Membership of a step in a phase whose time scale is a variable, Eq. (5).
struct FreeTiming {
  int phase = -1;               ///< the same for all steps of the phase, which follow one another; -1: dt is fixed
  double lower = 1, upper = 1;  ///< bounds of s, likewise
};

/// What a foot that moves does in a stage: it follows its path in the air, or it lands where the stage begins. The others stand,
/// those of the constraints in force.
enum class FootRole { Swing, Landing };

/// A foot that moves, and what was made of it: so predictive control finds a foot whose ground is not where it was planned.
struct FootTask {
  int contact = 0;
  FootRole role = FootRole::Swing;
  double room = 0;  ///< of a landing: largest distance from its place along each horizontal axis of that, m
  /// Residuals of its place and its velocity, in the costs of a swing or the path constraints of a landing, and of its clearance
  /// over the ground, and of a landing in the costs, by which it is drawn to its place; null where the stage has none.
  std::shared_ptr<const Residual> place{}, velocity{}, clearance{}, aim{};
};

/// One stage of the horizon (or the terminal node, which uses neither kind, dt nor constraints).
struct StageSpec {
  StageKind kind = StageKind::Dynamics;
  StepRule step = StepRule::Euler;
  double dt = 0.015;  ///< s, at time scale 1; 0 for an impact
  FreeTiming timing;
  double time_weight = 0;  ///< cost per second, not negative
  ConstraintSet constraints;
  std::vector<FootTask> feet;  ///< those that move
  StateCost state;
  ControlCost control;
  std::vector<Cost> costs;
  std::vector<PathConstraint> path_constraints;
  VectorXd effort_limits;  ///< bounds of |u|, nu; empty: those of the motors
  /// Of a step, kg m^2 or kg, added to that of the model, nv; empty: none. Springs of stiffness k with h^2 k / 4 have Eq. (7).
  VectorXd armature;
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

/// Where the time scale of a node is, Eq. (5).
struct TimeScalePlace {
  bool in_controls = false, in_state = false;  ///< neither: the length of the step is fixed
  bool in_next = false;                        ///< part of the next state
  bool isFree() const { return in_controls || in_state; }
};

/// A node of a robot's problem, with the accelerations and forces behind its next state. Those of a midpoint step belong
/// to (q_mid, v_mid), the point after half the drift with the predicted velocity.
struct RobotEvaluation : NodeEvaluation {
  double time_scale = 1;  ///< s of Eq. (5)
  double dt = 0;          ///< length of the step, s; 0 at an impact and at the terminal node
  VectorXd a;             ///< nv, accelerations; not used at an impact
  VectorXd q_mid;         ///< nq, of midpoint steps alone
  VectorXd v_mid;         ///< nv, likewise
  VectorXd speeds;        ///< nu, of the motors, at v_mid or v; where a residual needs them
  VectorXd lambda;     ///< rows of the constraints of the stage: forces (at an impact, impulses), each in its frame 1
  VectorXd residuals;  ///< of all costs and path constraints, concatenated in an order internal to the problem
  double state_cost = 0;  ///< before scaling by the time step
};

class RobotProblem : public ShootingProblem {
 public:
  /// \param q0, v0  initial state; for the reduced formulation closed, with a velocity that keeps it closed
  /// \param stages  N running stages, then the terminal one
  /// \throws InputError on sizes that do not match, a weight that is negative or not finite, or an open
  /// configuration in the reduced formulation
  RobotProblem(const Model& model, const VectorXd& q0, const VectorXd& v0, std::vector<StageSpec> stages,
               Formulation formulation = Formulation::Reduced);
  ~RobotProblem() override;

  int numStages() const override { return static_cast<int>(specs_.size()) - 1; }
  /// nq + nv, and 1 if some time scale is free; that number is 1 in states without a time scale.
  int stateSize() const override { return static_cast<int>(x0_.size()); }
  int tangentSize(int node) const override;
  /// nu, and 1 at the first step of a phase whose time scale is free.
  int controlSize(int stage) const override;
  const VectorXd& initialState() const override { return x0_; }
  /// Those of the torques and of the time scale.
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
  int batchSize() const override;
  /// Gains on deviations of a robot whose loops need not be closed, from gains K on the tangent space at the state x_k of an
  /// evaluation,
  ///     K d(x (-) x_k)/d(dq, dv) at x = x_k,                                                                        (7)
  /// which projects such a state on the closed ones in the reduced formulation.
  /// \param K  rows x tangent size   \param gains  rows x 2 nv; nothing is allocated if it has that size
  void mapGains(const RobotEvaluation& at, const RowMatrixXd& K, RowMatrixXd& gains) const;

  const Model& model() const { return model_; }
  Formulation formulation() const { return formulation_; }
  const StageSpec& spec(int node) const { return specs_[node]; }
  /// Replaces a stage, for endless receding horizons. Evaluations of other nodes stay valid; no solve may be running.
  /// \throws InputError as the constructor does   \throws std::invalid_argument when the duration of the stage is free,
  /// or it has more costs, constraints or rows of them than any stage of the constructor had, or other bodies in
  /// contact
  void replaceStage(int stage, StageSpec spec);
  /// Changes numbers of a stage where they are: its step, its armature, references, weights, scales, gains of its constraints. Its
  /// functions, their order, and the bodies in contact stay, so that nothing is allocated. Otherwise like replaceStage().
  /// \param change  change(StageSpec&)   \throws InputError as the constructor does, of the numbers as they then are
  template <typename Change>
  void changeNumbers(int stage, const Change& change) {
    change(specs_[stage]);
    acceptNumbers(stage);
  }
  /// Changes the reference of the terminal state cost: the target of a receding horizon.
  /// \param q  nq   \param v  nv
  void setTerminalReference(ConstVectorRef q, ConstVectorRef v);
  bool hasFreeTimings() const { return stateSize() > model_.nq() + model_.nv(); }
  /// Time scale of a stage, 1 where it is fixed.
  double getTimeScale(int stage, const VectorXd& x, const VectorXd& u) const;
  /// Costs by name at an evaluated node.
  std::vector<CostValue> getCosts(int node, const RobotEvaluation& at) const;

 private:
  void acceptNumbers(int stage);

  Model model_;
  Formulation formulation_;
  std::vector<StageSpec> specs_;
  std::vector<TimeScalePlace> places_;  // per node
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
