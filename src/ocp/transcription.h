#pragma once
// A formulation behind RobotProblem: it defines the state space of a node and discretizes its dynamics. The functions
// are those of ShootingProblem, except that differences and sums leave out the time scale; count is at most the batch
// size.
#include "bielle/ocp/robot_problem.h"
#include "ocp/node_costs.h"

namespace bielle {

// The most that any node of a problem needs of memory that belongs to a thread.
struct NodeSizes {
  int rows = 0, blocks = 0, constraint_rows = 0;  // of NodeCosts; of the constraints of the dynamics
  void include(const StageSpec& spec, const NodeCosts& costs);
  // \throws std::invalid_argument when a node needs more
  void require(const StageSpec& spec, const NodeCosts& costs) const;
};

// The nodes of a problem. They outlive the transcription.
struct NodeList {
  const std::vector<StageSpec>& specs;
  const std::vector<TimeScalePlace>& places;
};

class Transcription {
 public:
  virtual ~Transcription() = default;
  // After the spec of a node has been replaced. \throws std::invalid_argument as RobotProblem::replaceStage() does
  virtual void updateStage(int node);
  // After the state cost of a node has changed.
  virtual void updateStateCost(int) {}
  virtual int tangentSize() const = 0;  // without a time scale
  virtual int batchSize() const = 0;
  virtual std::unique_ptr<RobotEvaluation> makeEvaluation() const = 0;
  virtual std::unique_ptr<ProblemScratch> makeScratch() const = 0;
  virtual void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const = 0;
  virtual void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const = 0;
  virtual void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const = 0;
  virtual void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const = 0;
  // RobotProblem's Eq. (7).
  virtual void mapGains(const RobotEvaluation& at, const RowMatrixXd& K, RowMatrixXd& gains) const = 0;

 protected:
  Transcription(const Model& model, const NodeList& nodes);

  bool isRunning(int node) const { return node + 1 < static_cast<int>(specs_.size()); }
  bool isImpact(int node) const { return isRunning(node) && specs_[node].kind == StageKind::Impact; }
  bool isStep(int node) const { return isRunning(node) && !isImpact(node); }
  bool isMidpoint(int node) const { return isStep(node) && specs_[node].step == StepRule::Midpoint; }
  // Gives `at` the sizes, the state, the controls and the length of a task, and the status Failed. False if they are not
  // finite, or the time scale is not positive.
  bool startEvaluation(const EvaluateTask& task, RobotEvaluation& at) const;

  // The last of an evaluation: the status of what the costs and the constraints have become.
  void finishEvaluation(int node, RobotEvaluation& at) const;

  Model model_;
  const NodeList nodes_;
  const std::vector<StageSpec>& specs_;
  std::vector<NodeCosts> costs_;
  NodeSizes sizes_;
};

// \throws InputError when q0 is open
std::unique_ptr<Transcription> makeReducedTranscription(const Model& model, const VectorXd& q0, const NodeList& nodes);
// Null, unless a library has entered it (model/missing_part.h).
using FullTranscriptionMaker = std::unique_ptr<Transcription> (*)(const Model& model, const NodeList& nodes);
FullTranscriptionMaker& getFullTranscriptionMaker();

int countControls(const Model& model, const TimeScalePlace& place);
double getTimeScale(const TimeScalePlace& place, const VectorXd& x, const VectorXd& u);

// The number of rows of F^T before those of (dq, dv): torques and, last, a free time scale.
inline int countLeading(const Model& model, const TimeScalePlace& place) {
  return model.nu() + (place.isFree() ? 1 : 0);
}

// The speeds of the motors of a step, whose state and, if it is a midpoint step, v_mid are up to date.
void updateSpeeds(const Model& model, RobotEvaluation& at);

// The time scale of the next state, and its difference to that of the node's state.
void setNextTimeScale(const TimeScalePlace& place, const RobotEvaluation& at, const VectorXd& x_next_node,
                      StageModel& out);

// Adds the derivatives of the running cost by its factor s, robot_problem.h Eq. (6), to those at fixed s.
// \param no_squares  by (u, s, dq, dv), the part of the gradient that is not due to squares: that of energies
void addTimeScaleCost(int leading, const RobotEvaluation& at, ConstVectorRef no_squares, StageModel& out);

// False if an entry of a model that the solver reads is not finite.
bool isFinite(const StageModel& model);

// Joints whose configuration is not a vector: their blocks of the manifold Jacobians differ from the identity.
inline bool isCurved(const Joint& joint) {
  return joint.kind == JointKind::Spherical || joint.kind == JointKind::Planar || joint.kind == JointKind::FreeFlyer;
}

// Small matrices of one joint, without allocation.
template <typename T>
using JointMatrixOf = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
using JointMatrix = JointMatrixOf<double>;
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;

}  // namespace bielle
