#pragma once
// A formulation behind RobotProblem: it defines the state space of a node and discretizes its dynamics. The functions
// are those of ShootingProblem; count is at most the batch size.
#include "bielle/ocp/robot_problem.h"
#include "ocp/node_costs.h"

namespace bielle {

class Transcription {
 public:
  virtual ~Transcription() = default;
  virtual int tangentSize() const = 0;
  virtual int getBatchSize() const = 0;
  virtual std::unique_ptr<RobotEvaluation> makeEvaluation() const = 0;
  virtual std::unique_ptr<ProblemScratch> makeScratch() const = 0;
  virtual void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const = 0;
  virtual void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const = 0;
  virtual void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const = 0;
  virtual void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const = 0;
};

// The specs and costs are those of the nodes; both, like the model, outlive the transcription.
std::unique_ptr<Transcription> makeFullTranscription(const Model& model, const std::vector<StageSpec>& specs);
// \throws ModelError when q0 is open
std::unique_ptr<Transcription> makeReducedTranscription(const Model& model, const VectorXd& q0,
                                                        const std::vector<StageSpec>& specs);

// Gives `at` the sizes, the state and the controls of a task, and the status Failed. False if they are not finite.
bool startEvaluation(const Model& model, const EvaluateTask& task, const StageSpec& spec, bool running,
                     const NodeCosts& costs, RobotEvaluation& at);

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
