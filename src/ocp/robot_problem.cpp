#include "bielle/ocp/robot_problem.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "ocp/transcription.h"

namespace bielle {
namespace {

void checkSpec(const Model& model, const StageSpec& spec, size_t index, bool terminal) {
  const std::string element = "stage " + std::to_string(index);
  const auto require = [&](bool ok, const std::string& what, const std::string& remedy) {
    if (!ok) throw ModelError(model.name(), element, what, remedy);
  };
  if (spec.kind == StageKind::Impact)
    require(spec.dt == 0, "an impact that takes time", "give it a time step of 0");
  else
    require(spec.dt > 0 && std::isfinite(spec.dt), "its time step is not positive", "give seconds, e.g. 0.015");
  if (spec.state.weight != 0)
    require(spec.state.q_ref.size() == model.nq() && spec.state.v_ref.size() == model.nv() &&
                spec.state.weights.size() == 2 * model.nv(),
            "the state cost has wrong sizes", "q_ref: nq, v_ref: nv, weights: 2 nv");
  if (spec.control.weight != 0)
    require(spec.control.reference.size() == model.nu() && spec.control.weights.size() == model.nu(),
            "the control cost has wrong sizes", "reference and weights: nu");
  require(spec.effort_limits.size() == 0 || spec.effort_limits.size() == model.nu(),
          "its effort limits have a wrong size", "effort_limits: nu, or empty");
  const auto requireForces = [&](const Residual& residual, const std::string& name) {
    require(!terminal || !(residual.needsForces() || residual.needsControls()),
            name + " is about forces or controls, of which the terminal node has none", "leave it out there");
  };
  for (const Cost& cost : spec.costs) {
    require(cost.residual && cost.activation.hasSize(cost.residual->size()),
            "cost '" + cost.name + "': weights or bounds do not have the size of the residual",
            "give one weight per row of the residual and, for a barrier, one lower and one upper bound");
    requireForces(*cost.residual, "cost '" + cost.name + "'");
  }
  for (const PathConstraint& constraint : spec.path_constraints) {
    const std::string name = "path constraint '" + constraint.name + "'";
    require(constraint.residual && constraint.hasSize(constraint.residual->size()),
            name + ": bounds or scale do not have the size of the residual", "give one of each per row");
    require((constraint.scale.array() > 0).all(), name + ": a scale is not positive",
            "give what counts as a violation of 1");
    require((constraint.lower.array() <= constraint.upper.array()).all(), name + ": a lower bound exceeds the upper",
            "exchange them");
    requireForces(*constraint.residual, name);
  }
}

}  // namespace

const char* getName(StepRule rule) { return rule == StepRule::Euler ? "euler" : "midpoint"; }

const char* getName(Formulation formulation) { return formulation == Formulation::Full ? "full" : "reduced"; }

bool startEvaluation(const Model& model, const EvaluateTask& task, const StageSpec& spec, bool running,
                     const NodeCosts& costs, RobotEvaluation& at) {
  at.x = *task.x;
  at.u.resize(running ? model.nu() : 0);
  if (running) at.u = *task.u;
  at.x_next.resize(running ? at.x.size() : 0);
  at.a.resize(running ? model.nv() : 0);
  at.lambda.resize(running ? spec.constraints.rows : 0);
  const bool midpoint = running && spec.kind == StageKind::Dynamics && spec.step == StepRule::Midpoint;
  at.q_mid.resize(midpoint ? model.nq() : 0);
  at.v_mid.resize(midpoint ? model.nv() : 0);
  at.residuals.resize(costs.rows());
  at.constraints.resize(costs.constraintRows());
  at.state_cost = 0;
  at.status = StepStatus::Failed;
  at.failure.clear();
  return at.x.allFinite() && at.u.allFinite();
}

// As allFinite(), but vectorized: a value that is not finite makes the sum NaN. The Hessian is a sum of squares, so any
// NaN shows on its diagonal.
bool isFinite(const StageModel& model) { return (0 * model.Ft()).sum() == 0 && model.hessian().diagonal().allFinite(); }

RobotProblem::RobotProblem(const Model& model, const VectorXd& q0, const VectorXd& v0, std::vector<StageSpec> stages,
                           Formulation formulation)
    : model_(model), formulation_(formulation), specs_(std::move(stages)) {
  if (specs_.empty())
    throw ModelError(model.name(), "shooting problem", "it has no stage", "give at least the terminal one");
  if (q0.size() != model.nq() || v0.size() != model.nv())
    throw ModelError(model.name(), "shooting problem", "the initial state has a wrong size", "q0: nq, v0: nv");
  for (size_t k = 0; k < specs_.size(); ++k) checkSpec(model, specs_[k], k, k + 1 == specs_.size());
  transcription_ = formulation == Formulation::Full ? makeFullTranscription(model, specs_)
                                                    : makeReducedTranscription(model, q0, specs_);
  x0_.resize(stateSize());
  x0_ << q0, v0;
}

RobotProblem::~RobotProblem() = default;

int RobotProblem::tangentSize(int) const { return transcription_->tangentSize(); }
int RobotProblem::getBatchSize() const { return transcription_->getBatchSize(); }
std::unique_ptr<NodeEvaluation> RobotProblem::makeEvaluation() const { return transcription_->makeEvaluation(); }
std::unique_ptr<ProblemScratch> RobotProblem::makeScratch() const { return transcription_->makeScratch(); }

namespace {

// Calls work(tasks, count) for batches of tasks.
template <typename Task, typename Work>
void visitBatches(Task* tasks, int count, int size, const Work& work) {
  for (int first = 0; first < count; first += size) work(tasks + first, std::min(size, count - first));
}

}  // namespace

void RobotProblem::evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const {
  visitBatches(tasks, count, getBatchSize(),
               [&](EvaluateTask* batch, int size) { transcription_->evaluate(batch, size, scratch); });
}

void RobotProblem::linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const {
  visitBatches(tasks, count, getBatchSize(),
               [&](LinearizeTask* batch, int size) { transcription_->linearize(batch, size, scratch); });
}

void RobotProblem::integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const {
  visitBatches(tasks, count, getBatchSize(),
               [&](const IntegrateTask* batch, int size) { transcription_->integrate(batch, size, scratch); });
}

void RobotProblem::difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const {
  visitBatches(tasks, count, getBatchSize(),
               [&](const DifferenceTask* batch, int size) { transcription_->difference(batch, size, scratch); });
}

void RobotProblem::getControlBounds(int stage, VectorRef lower, VectorRef upper) const {
  const VectorXd& limits = specs_[stage].effort_limits;
  for (int m = 0; m < model_.nu(); ++m) {
    upper[m] = limits.size() ? limits[m] : model_.motors()[m].effort_limit;
    lower[m] = -upper[m];
  }
}

int RobotProblem::constraintSize(int node) const {
  int size = 0;
  for (const PathConstraint& constraint : specs_[node].path_constraints) size += constraint.residual->size();
  return size;
}

void RobotProblem::getConstraintBounds(int node, VectorRef lower, VectorRef upper) const {
  int row = 0;
  for (const PathConstraint& constraint : specs_[node].path_constraints) {
    const int n = constraint.residual->size();
    lower.segment(row, n) = constraint.lower.cwiseQuotient(constraint.scale);
    upper.segment(row, n) = constraint.upper.cwiseQuotient(constraint.scale);
    row += n;
  }
}

std::string RobotProblem::getConstraintName(int node, int row) const {
  for (const PathConstraint& constraint : specs_[node].path_constraints) {
    const int n = constraint.residual->size();
    if (row < n) return constraint.name + (n > 1 ? ", row " + std::to_string(row) : "");
    row -= n;
  }
  return ShootingProblem::getConstraintName(node, row);
}

std::vector<CostValue> RobotProblem::getCosts(int node, const RobotEvaluation& at) const {
  return NodeCosts(specs_[node], node < numStages()).getValues(at);
}

}  // namespace bielle
