// The reduced formulation behind RobotProblem: it passes batches of nodes to the kernel, and processes node by node the
// data whose sizes vary from node to node.
#include <algorithm>

#include "ocp/reduced/node_assembly.h"
#include "ocp/reduced/reduced_impact.h"

namespace bielle {
namespace {

struct ReducedScratch : ProblemScratch {
  ReducedScratch(const Model& model, const Reduction& reduction, const ReducedLayout& layout, const NodeSizes& sizes)
      : kernel(model, reduction, layout),
        views(kLane, LaneView(model, reduction, kernel.tree(), layout)),
        assembly(model, reduction, layout, sizes),
        impact(model, reduction) {}
  ReducedKernel kernel;
  std::vector<LaneView> views;  // one per lane
  NodeAssembly assembly;
  ReducedImpact impact;
};

// At most kLane items.
template <typename Item>
struct Batch {
  std::array<Item, kLane> items;
  std::array<int, kLane> tasks;  // which task each item is
  int count = 0;
  void add(const Item& item, int task) {
    items[count] = item;
    tasks[count++] = task;
  }
};

class ReducedTranscription : public Transcription {
 public:
  ReducedTranscription(const Model& model, const VectorXd& q0, const NodeList& nodes)
      : Transcription(model, nodes), reduction_(makeReduction(model, q0)), layout_(model, reduction_, specs_) {}

  void updateStage(int node) override {
    Transcription::updateStage(node);
    layout_.updateStage(node, specs_);
  }
  void updateStateCost(int node) override { layout_.updateStateCost(node, specs_); }

  int tangentSize() const override { return 2 * reduction_.size; }
  int batchSize() const override { return static_cast<int>(kLane); }
  std::unique_ptr<RobotEvaluation> makeEvaluation() const override {
    return std::make_unique<ReducedEvaluation>(model_, reduction_);
  }
  std::unique_ptr<ProblemScratch> makeScratch() const override {
    return std::make_unique<ReducedScratch>(model_, reduction_, layout_, sizes_);
  }

  void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const override;
  void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const override;
  void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const override {
    static_cast<ReducedScratch*>(scratch)->kernel.integrate(tasks, count);
  }
  void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const override {
    static_cast<ReducedScratch*>(scratch)->kernel.difference(tasks, count);
  }
  void mapGains(const RobotEvaluation& at, const RowMatrixXd& K, RowMatrixXd& gains) const override;

 private:
  void addCosts(int node, const LaneView& view, LinkageWorkspaces& linkages, RobotEvaluation& at) const;
  void finishLinearization(LinearizeTask& task, LaneView& view, ReducedScratch& scratch) const;

  const Reduction reduction_;
  ReducedLayout layout_;
};

void ReducedTranscription::evaluate(EvaluateTask* tasks, int count, ProblemScratch* memory) const {
  auto& scratch = static_cast<ReducedScratch&>(*memory);
  std::array<Batch<ReducedKernel::StepItem>, 2> steps;  // by rule
  Batch<ReducedKernel::StepItem> states;
  for (int i = 0; i < count; ++i) {
    const int node = tasks[i].node;
    auto& at = static_cast<ReducedEvaluation&>(*tasks[i].out);
    if (!startEvaluation(tasks[i], at)) continue;
    at.leading = isRunning(node) ? countLeading(model_, nodes_.places[node]) : 0;
    const int rows = layout_.contacts[node].rows;
    if (at.factors.D.size() != rows || at.factors.L.rows() != reduction_.size) at.factors.resize(reduction_.size, rows);
    const auto* previous = static_cast<const ReducedEvaluation*>(tasks[i].previous);
    if (isMidpoint(node)) {
      if (!at.midpoint) at.midpoint = std::make_unique<ReducedMidpoint>(model_, reduction_);
      at.midpoint->lambda.resize(at.lambda.size());
    }
    (isStep(node) ? steps[isMidpoint(node)] : states).add({node, &specs_[node], previous, &at}, i);
  }
  LinkageWorkspaces& linkages = scratch.assembly.linkages();
  for (Batch<ReducedKernel::StepItem>& batch : steps) {
    if (batch.count > 0) scratch.kernel.step(batch.items.data(), batch.count, scratch.views);
    for (int l = 0; l < batch.count; ++l) addCosts(batch.items[l].node, scratch.views[l], linkages, *batch.items[l].at);
  }
  if (states.count > 0) scratch.kernel.place(states.items.data(), states.count, scratch.views);
  for (int l = 0; l < states.count; ++l) {
    const ReducedKernel::StepItem& item = states.items[l];
    if (isImpact(item.node) && item.at->status == NumericalStatus::Ok) scratch.impact.update(item);
    addCosts(item.node, scratch.views[l], linkages, *item.at);
  }
}

// The differences of ReducedKernel are linear where they vanish: those of free joints are the identity there, dy = (W N)^T dq of
// a cluster.
void ReducedTranscription::mapGains(const RobotEvaluation& at, const RowMatrixXd& K, RowMatrixXd& gains) const {
  const auto& node = static_cast<const ReducedEvaluation&>(at);
  const int nv = model_.nv(), nr = reduction_.size;
  gains.resize(K.rows(), 2 * nv);
  for (int half = 0; half < 2; ++half) {  // of positions, then of velocities
    const auto reduced = K.middleCols(K.cols() - 2 * nr + half * nr, nr);
    auto whole = gains.middleCols(half * nv, nv);
    for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
      const Joint& joint = model_.joints()[reduction_.free_joints[i]];
      whole.middleCols(joint.idx_v, joint.nv) = reduced.middleCols(reduction_.free_offsets[i], joint.nv);
    }
    for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
      const ReducedCluster& cluster = reduction_.clusters[i];
      const MatrixXd& WN = node.clusters[i].at.WN;
      for (size_t k = 0; k < cluster.dofs.size(); ++k)
        whole.col(cluster.dofs[k]) =
            reduced.middleCols(cluster.offset, cluster.size).lazyProduct(WN.row(static_cast<int>(k)).transpose());
    }
  }
}

// Computes the costs after a successful step.
void ReducedTranscription::addCosts(int node, const LaneView& view, LinkageWorkspaces& linkages,
                                    RobotEvaluation& at) const {
  if (at.status != NumericalStatus::Ok) return;
  if (costs_[node].needsSpeeds()) updateSpeeds(model_, at);
  const NodeBases bases(reduction_, static_cast<const ReducedEvaluation&>(at));
  costs_[node].calc(
      {model_, view.ws, specs_[node].constraints, at.u, at.lambda, at.time_scale, &at.speeds, &bases, &linkages}, at);
  finishEvaluation(node, at);
}

void ReducedTranscription::linearize(LinearizeTask* tasks, int count, ProblemScratch* memory) const {
  auto& scratch = static_cast<ReducedScratch&>(*memory);
  std::array<Batch<ReducedKernel::LinearizeItem>, 2> steps;  // by rule
  Batch<ReducedKernel::LinearizeItem> states;
  for (int i = 0; i < count; ++i) {
    const int node = tasks[i].node;
    tasks[i].status = NumericalStatus::Failed;
    tasks[i].failure.clear();
    const auto* at = static_cast<const ReducedEvaluation*>(tasks[i].at);
    const auto* next = static_cast<const ReducedEvaluation*>(tasks[i].next);
    (isStep(node) ? steps[isMidpoint(node)] : states).add({node, &specs_[node], at, next, false, &tasks[i].failure}, i);
  }
  const auto finish = [&](Batch<ReducedKernel::LinearizeItem>& batch) {
    for (int l = 0; l < batch.count; ++l)
      if (batch.items[l].ok) finishLinearization(tasks[batch.tasks[l]], scratch.views[l], scratch);
  };
  for (Batch<ReducedKernel::LinearizeItem>& batch : steps) {
    if (batch.count > 0) scratch.kernel.linearizeSteps(batch.items.data(), batch.count, scratch.views);
    finish(batch);
  }
  if (states.count > 0) scratch.kernel.linearizeStates(states.items.data(), states.count, scratch.views);
  finish(states);
}

void ReducedTranscription::finishLinearization(LinearizeTask& task, LaneView& view, ReducedScratch& scratch) const {
  const int node = task.node;
  const TimeScalePlace& place = nodes_.places[node];
  auto& at = static_cast<ReducedEvaluation&>(*task.at);
  const auto* next = static_cast<const ReducedEvaluation*>(task.next);
  NodeAssembly& assembly = scratch.assembly;
  StageModel& out = *task.out;
  if (isStep(node)) {
    assembly.setStep(specs_[node], layout_.contacts[node], at, *next, view, out);
    if (costs_[node].needsSpeeds() && isMidpoint(node)) assembly.setSpeeds(at, view);
    setNextTimeScale(place, at, next->x, out);
  } else if (isImpact(node)) {
    const NumericalStatus status = scratch.impact.linearize(specs_[node].constraints, at, *next, view, assembly, out);
    if (status != NumericalStatus::Ok) {
      task.status = status;
      task.failure = getMessage(status);
      return;
    }
  }
  out.cost = at.cost;
  assembly.setResiduals(costs_[node], specs_[node], layout_.contacts[node], task.rows, at, view, out);
  if (specs_[node].state.weight != 0)
    addStateCostModel(model_, reduction_, view.state_cost, costs_[node].getScale(at), out);
  if (isRunning(node)) costs_[node].addControlCost(at, out);
  if (place.isFree()) addTimeScaleCost(at.leading, at, assembly.gradientOfNoSquares(), out);
  if (isFinite(out)) task.status = NumericalStatus::Ok;
}

}  // namespace

std::unique_ptr<Transcription> makeReducedTranscription(const Model& model, const VectorXd& q0, const NodeList& nodes) {
  return std::make_unique<ReducedTranscription>(model, q0, nodes);
}

}  // namespace bielle
