#include "bielle/ocp/robot_problem.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bielle/model/error.h"
#include "model/missing_part.h"
#include "ocp/transcription.h"

namespace bielle {
namespace {

bool isWeight(double weight) { return weight >= 0 && std::isfinite(weight); }
bool areWeights(const VectorXd& weights) { return std::all_of(weights.begin(), weights.end(), isWeight); }

void checkSpec(const Model& model, const StageSpec& spec, size_t index, bool terminal) {
  // Messages are put together when they are needed: a problem has thousands of these.
  const auto refuse = [&](const std::string& what, const char* remedy) {
    throw InputError(model.name(), "stage " + std::to_string(index), what, remedy);
  };
  const auto require = [&](bool ok, const char* what, const char* remedy) {
    if (!ok) refuse(what, remedy);
  };
  const auto requireOf = [&](bool ok, const char* kind, const std::string& name, const char* what, const char* remedy) {
    if (!ok) refuse(std::string(kind) + " '" + name + "'" + what, remedy);
  };
  if (spec.kind == StageKind::Impact)
    require(spec.dt == 0, "an impact that takes time", "give it a time step of 0");
  else
    require(spec.dt > 0 && std::isfinite(spec.dt), "its time step is not positive", "give seconds, e.g. 0.015");
  const FreeTiming& timing = spec.timing;
  if (timing.phase >= 0) {
    require(spec.kind == StageKind::Dynamics && !terminal, "an impact or the terminal node cannot have a free duration",
            "put only dynamic steps into a phase of free duration");
    require(timing.lower > 0 && timing.lower <= timing.upper && std::isfinite(timing.upper),
            "the bounds of its time scale are not positive, or in the wrong order", "e.g. 0.6 and 1.6");
  }
  constexpr const char* kRemedy = "give finite numbers of 0 or more";
  require(isWeight(spec.time_weight), "its cost per second is negative or not finite", kRemedy);
  require(isWeight(spec.state.weight) && areWeights(spec.state.weights),
          "a weight of the state cost is negative or not finite", kRemedy);
  require(isWeight(spec.control.weight) && areWeights(spec.control.weights),
          "a weight of the control cost is negative or not finite", kRemedy);
  if (spec.state.weight != 0)
    require(spec.state.q_ref.size() == model.nq() && spec.state.v_ref.size() == model.nv() &&
                spec.state.weights.size() == 2 * model.nv(),
            "the state cost has the wrong size", "q_ref: nq, v_ref: nv, weights: 2 nv");
  if (spec.control.weight != 0)
    require(spec.control.reference.size() == model.nu() && spec.control.weights.size() == model.nu(),
            "the control cost has the wrong size", "reference and weights: nu");
  require(spec.armature.size() == 0 || (spec.armature.size() == model.nv() && areWeights(spec.armature)),
          "its armature has the wrong size, or is negative or not finite", "armature: nv, or empty");
  require(spec.effort_limits.size() == 0 || spec.effort_limits.size() == model.nu(),
          "its effort limits have the wrong size", "effort_limits: nu, or empty");
  const auto requireForces = [&](const Residual& residual, const char* kind, const std::string& name) {
    requireOf(!terminal || !(residual.needsForces() || residual.needsControls()), kind, name,
              " depends on forces or controls, which the terminal node does not have", "leave it out there");
    requireOf(spec.kind == StageKind::Dynamics || !residual.needsSpeeds(), kind, name,
              " depends on speeds under torques, which an impact does not have", "leave it out there");
  };
  for (const Cost& cost : spec.costs) {
    requireOf(cost.residual && cost.activation.hasSize(cost.residual->size()), "cost", cost.name,
              ": weights or bounds do not have the size of the residual",
              "give one weight per row of the residual and, for a barrier, one lower and one upper bound");
    requireOf(isWeight(cost.weight) && areWeights(cost.activation.weights), "cost", cost.name,
              ": a weight is negative or not finite", kRemedy);
    requireForces(*cost.residual, "cost", cost.name);
  }
  for (const PathConstraint& constraint : spec.path_constraints) {
    const auto requireIt = [&](bool ok, const char* what, const char* remedy) {
      requireOf(ok, "path constraint", constraint.name, what, remedy);
    };
    requireIt(constraint.residual && constraint.hasSize(constraint.residual->size()),
              ": bounds or scale do not have the size of the residual", "give one of each per row");
    requireIt((constraint.scale.array() > 0).all(), ": a scale is not positive",
              "give the value that counts as a violation of 1");
    requireIt((constraint.lower.array() <= constraint.upper.array()).all(), ": a lower bound exceeds the upper",
              "exchange them");
    requireForces(*constraint.residual, "path constraint", constraint.name);
  }
}

std::vector<TimeScalePlace> placeTimeScales(const Model& model, const std::vector<StageSpec>& specs) {
  std::vector<TimeScalePlace> places(specs.size());
  std::vector<int> ended;
  for (size_t k = 0; k + 1 < specs.size(); ++k) {
    const FreeTiming &timing = specs[k].timing, &next = specs[k + 1].timing;
    if (timing.phase < 0) continue;
    if (!places[k].in_state) places[k].in_controls = true;
    const std::string element = "stage " + std::to_string(k);
    if (std::find(ended.begin(), ended.end(), timing.phase) != ended.end())
      throw InputError(model.name(), element, "its phase of free duration ended earlier", "give it a separate number");
    if (next.phase != timing.phase) {
      ended.push_back(timing.phase);
      continue;
    }
    if (next.lower != timing.lower || next.upper != timing.upper)
      throw InputError(model.name(), element, "the next step of its phase has different bounds of the time scale",
                       "give all steps of the phase the same bounds");
    places[k].in_next = places[k + 1].in_state = true;
  }
  return places;
}

std::unique_ptr<Transcription> makeTranscription(const Model& model, const VectorXd& q0, const NodeList& nodes,
                                                 Formulation formulation) {
  if (formulation == Formulation::Reduced) return makeReducedTranscription(model, q0, nodes);
  if (!getFullTranscriptionMaker()) throw MissingPart("the full formulation");
  return getFullTranscriptionMaker()(model, nodes);
}

}  // namespace

FullTranscriptionMaker& getFullTranscriptionMaker() {
  static FullTranscriptionMaker make = nullptr;
  return make;
}

const char* getName(StepRule rule) { return rule == StepRule::Euler ? "euler" : "midpoint"; }

const char* getName(Formulation formulation) { return formulation == Formulation::Full ? "full" : "reduced"; }

RobotProblem::RobotProblem(const Model& model, const VectorXd& q0, const VectorXd& v0, std::vector<StageSpec> stages,
                           Formulation formulation)
    : model_(model), formulation_(formulation), specs_(std::move(stages)) {
  if (specs_.empty())
    throw InputError(model.name(), "shooting problem", "it has no stages", "give at least the terminal stage");
  if (q0.size() != model.nq() || v0.size() != model.nv())
    throw InputError(model.name(), "shooting problem", "the initial state has the wrong size", "q0: nq, v0: nv");
  for (size_t k = 0; k < specs_.size(); ++k) checkSpec(model, specs_[k], k, k + 1 == specs_.size());
  places_ = placeTimeScales(model, specs_);
  transcription_ = makeTranscription(model, q0, {specs_, places_}, formulation);
  const bool free = std::any_of(places_.begin(), places_.end(), [](const TimeScalePlace& p) { return p.isFree(); });
  x0_.setOnes(model.nq() + model.nv() + (free ? 1 : 0));
  x0_.head(model.nq()) = q0;
  x0_.segment(model.nq(), model.nv()) = v0;
}

RobotProblem::~RobotProblem() = default;

void RobotProblem::replaceStage(int stage, StageSpec spec) {
  checkSpec(model_, spec, stage, false);
  if (spec.timing.phase >= 0 || places_[stage].isFree())
    throw std::invalid_argument("RobotProblem: the duration of stage " + std::to_string(stage) + " is free");
  specs_[stage] = std::move(spec);
  transcription_->updateStage(stage);
}

void RobotProblem::acceptNumbers(int stage) {
  checkSpec(model_, specs_[stage], stage, stage == numStages());
  transcription_->updateStateCost(stage);
}

void RobotProblem::setTerminalReference(ConstVectorRef q, ConstVectorRef v) {
  specs_.back().state.q_ref = q;
  specs_.back().state.v_ref = v;
  transcription_->updateStateCost(numStages());
}

int RobotProblem::tangentSize(int node) const {
  return transcription_->tangentSize() + (places_[node].in_state ? 1 : 0);
}
int RobotProblem::controlSize(int stage) const { return countControls(model_, places_[stage]); }
double RobotProblem::getTimeScale(int stage, const VectorXd& x, const VectorXd& u) const {
  return bielle::getTimeScale(places_[stage], x, u);
}
int RobotProblem::batchSize() const { return transcription_->batchSize(); }
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
  visitBatches(tasks, count, batchSize(),
               [&](EvaluateTask* batch, int size) { transcription_->evaluate(batch, size, scratch); });
}

void RobotProblem::linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const {
  visitBatches(tasks, count, batchSize(),
               [&](LinearizeTask* batch, int size) { transcription_->linearize(batch, size, scratch); });
}

void RobotProblem::integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const {
  visitBatches(tasks, count, batchSize(),
               [&](const IntegrateTask* batch, int size) { transcription_->integrate(batch, size, scratch); });
  if (!hasFreeTimings()) return;
  const Eigen::Index last = stateSize() - 1;
  for (const IntegrateTask* task = tasks; task != tasks + count; ++task)
    (*task->x_out)[last] = task->at->x[last] + (places_[task->node].in_state ? (*task->dx)[0] : 0);
}

void RobotProblem::difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const {
  visitBatches(tasks, count, batchSize(),
               [&](const DifferenceTask* batch, int size) { transcription_->difference(batch, size, scratch); });
  if (!hasFreeTimings()) return;
  const Eigen::Index last = stateSize() - 1;
  for (const DifferenceTask* task = tasks; task != tasks + count; ++task)
    if (places_[task->node].in_state) (*task->dx)[0] = (*task->x1)[last] - task->at->x[last];
}

void RobotProblem::mapGains(const RobotEvaluation& at, const RowMatrixXd& K, RowMatrixXd& gains) const {
  transcription_->mapGains(at, K, gains);
}

void RobotProblem::getControlBounds(int stage, VectorRef lower, VectorRef upper) const {
  const VectorXd& limits = specs_[stage].effort_limits;
  for (int m = 0; m < model_.nu(); ++m) {
    upper[m] = limits.size() ? limits[m] : model_.motors()[m].effort_limit;
    lower[m] = -upper[m];
  }
  if (!places_[stage].in_controls) return;
  lower[model_.nu()] = specs_[stage].timing.lower;
  upper[model_.nu()] = specs_[stage].timing.upper;
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
