#include "bielle/ocp/robot_problem.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "bielle/dynamics/reduction.h"
#include "bielle/model/error.h"
#include "node_model.h"

namespace bielle {
namespace {

void checkSpec(const Model& model, const StageSpec& spec, size_t index) {
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
  for (const Cost& cost : spec.costs)
    require(
        cost.residual && cost.activation.weights.size() == cost.residual->size(),
        "cost '" + cost.name + "' has " + std::to_string(cost.activation.weights.size()) + " weights for another size",
        "give one weight per row of the residual");
}

// What the costs of a running stage are multiplied by.
double getScale(const StageSpec& spec) { return spec.kind == StageKind::Impact ? 1 : spec.dt; }

// As allFinite(), but vectorized: a value that is not finite makes the sum one too.
bool isFinite(ConstMatrixRef A) { return (0 * A).sum() == 0; }
// Of what is no number in a sum of squares, something is in the diagonal.
bool isFinite(const StageModel& model) { return isFinite(model.Ft()) && model.H().diagonal().allFinite(); }

}  // namespace

const char* getName(Formulation formulation) { return formulation == Formulation::Full ? "full" : "reduced"; }

// The point a node was last evaluated at, its dynamics and its stacked residuals.
struct RobotProblem::Node {
  VectorXd x, u;
  bool valid = false;     // dynamics (kinematics at the terminal node) are there
  bool has_cost = false;  // and so are the residuals of the stack and their cost
  double cost = 0;
  std::unique_ptr<NodeModel> dynamics;
  ResidualStack stack;
  std::vector<int> rows;  // of each cost, its first in the stack
};

RobotProblem::RobotProblem(const Model& model, const VectorXd& q0, const VectorXd& v0, std::vector<StageSpec> stages,
                           Formulation formulation)
    : model_(model), formulation_(formulation), specs_(std::move(stages)) {
  if (specs_.empty())
    throw ModelError(model.name(), "shooting problem", "it has no stage", "give at least the terminal one");
  if (q0.size() != model.nq() || v0.size() != model.nv())
    throw ModelError(model.name(), "shooting problem", "the initial state has a wrong size", "q0: nq, v0: nv");
  for (size_t k = 0; k < specs_.size(); ++k) checkSpec(model, specs_[k], k);
  if (formulation == Formulation::Reduced) reduction_ = std::make_unique<Reduction>(makeReduction(model, q0));
  std::shared_ptr<ReducedWorkPool> pool;
  if (reduction_) pool = makeReducedWorkPool(model, *reduction_, specs_);
  nodes_.resize(specs_.size());
  for (size_t k = 0; k < specs_.size(); ++k) {
    const StageSpec& spec = specs_[k];
    Node& node = nodes_[k];
    node.dynamics = reduction_ ? makeReducedNode(model, *reduction_, spec, pool) : makeFullNode(model, spec);
    node.rows.resize(spec.costs.size());
    int row = 0;
    for (bool motion : {true, false}) {
      for (size_t c = 0; c < spec.costs.size(); ++c) {
        if (spec.costs[c].residual->needsMotion() != motion) continue;
        node.rows[c] = row;
        row += spec.costs[c].residual->size();
      }
      if (motion) node.stack.motion_rows = row;
    }
    for (VectorXd* v : {&node.stack.r, &node.stack.gradient, &node.stack.hessian}) v->setZero(countResidualRows(spec));
  }
  tangent_size_ = nodes_.front().dynamics->tangentSize();
  x0_.resize(stateSize());
  x0_ << q0, v0;
}

RobotProblem::~RobotProblem() = default;

void RobotProblem::integrate(int node, ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) const {
  nodes_[node].dynamics->integrate(x, dx, x_out);
}

// Reduced nodes together, as their steps.
void RobotProblem::integrateNodes(const std::vector<IntegrateTask>& tasks) const {
  std::array<NodeModel::Integration, kLane> together;
  for (size_t first = 0; first < tasks.size(); first += kLane) {
    const int count = static_cast<int>(std::min<size_t>(tasks.size() - first, kLane));
    for (int i = 0; i < count; ++i) {
      const IntegrateTask& task = tasks[first + i];
      together[i] = {nodes_[task.node].dynamics.get(), task.x, task.dx, task.x_out};
    }
    together.front().node->integrateNodes(together.data(), count);
  }
}

void RobotProblem::difference(int node, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const {
  nodes_[node].dynamics->difference(x0, x1, dx);
}

bool RobotProblem::isEvaluated(int stage, ConstVectorRef x, ConstVectorRef u) const {
  const Node& node = nodes_[stage];
  return node.valid && node.x == x && node.u == u;
}

// Dynamics and next state at (x, u), unless they are already there. `previous` is the node whose next state x is, if any.
StepStatus RobotProblem::evaluate(int stage, ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) {
  if (isEvaluated(stage, x, u)) return StepStatus::Ok;
  return finishEvaluation(stage, startEvaluation(stage, x, u) && nodes_[stage].dynamics->updateStep(x, u, previous));
}

bool RobotProblem::startEvaluation(int stage, ConstVectorRef x, ConstVectorRef u) {
  Node& node = nodes_[stage];
  node.valid = node.has_cost = false;
  node.x = x;
  node.u = u;
  return x.allFinite() && u.allFinite();
}

StepStatus RobotProblem::finishEvaluation(int stage, bool ok) {
  Node& node = nodes_[stage];
  node.valid = ok && node.dynamics->x_next().allFinite();
  return node.valid ? StepStatus::Ok : StepStatus::Failed;
}

StepStatus RobotProblem::step(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) {
  if (evaluate(stage, x, u) != StepStatus::Ok) return StepStatus::Failed;
  return finishStep(stage, x_next, cost);
}

StepStatus RobotProblem::continueStep(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) {
  if (evaluate(stage, x, u, nodes_[stage - 1].dynamics.get()) != StepStatus::Ok) return StepStatus::Failed;
  return finishStep(stage, x_next, cost);
}

// Reduced steps are taken together, unless there is but one.
void RobotProblem::stepStages(std::vector<StepTask>& tasks) {
  if (tasks.size() == 1 || formulation_ == Formulation::Full) return ShootingProblem::stepStages(tasks);
  for (size_t first = 0; first < tasks.size(); first += kLane) {
    const int count = static_cast<int>(std::min<size_t>(tasks.size() - first, kLane));
    evaluateTogether(&tasks[first], count,
                     [this](StepTask& task) { task.status = finishStep(task.stage, *task.x_next, task.cost); });
    calcDeviations(&tasks[first], count);
  }
}

void RobotProblem::calcDeviations(const StepTask* tasks, int num_tasks) {
  std::array<NodeModel::Difference, kLane> wanted;
  int count = 0;
  for (int i = 0; i < num_tasks; ++i) {
    const StepTask& task = tasks[i];
    if (task.deviation && task.status == StepStatus::Ok)
      wanted[count++] = {nodes_[task.stage + 1].dynamics.get(), task.origin, task.x_next, task.deviation};
  }
  if (count > 0) wanted.front().node->calcDifferences(wanted.data(), count);
}

// evaluate() of at most kLane stages at once, and `finish` of those that went through, while their workspaces show them. What
// does not go with others, or fails with them, is tried alone.
template <typename Finish>
void RobotProblem::evaluateTogether(StepTask* tasks, int num_tasks, const Finish& finish) {
  std::array<NodeModel*, kLane> together;
  std::array<StepTask*, kLane> of;
  std::array<bool, kLane> ok;
  const auto evaluateAlone = [&](StepTask& task, const NodeModel* previous) {
    task.status = evaluate(task.stage, *task.x, *task.u, previous);
    if (task.status == StepStatus::Ok) finish(task);
  };
  int count = 0;
  for (int i = 0; i < num_tasks; ++i) {
    StepTask& task = tasks[i];
    NodeModel* node = nodes_[task.stage].dynamics.get();
    const NodeModel* previous = task.continues ? nodes_[task.stage - 1].dynamics.get() : nullptr;
    if (startEvaluation(task.stage, *task.x, *task.u) && node->startStep(*task.x, *task.u, previous)) {
      of[count] = &task;
      together[count++] = node;
    } else {
      evaluateAlone(task, previous);
    }
  }
  if (count > 0) together.front()->finishSteps(together.data(), count, ok.data());
  for (int i = 0; i < count; ++i) {
    if (!ok[i]) continue;
    together[i]->showStep(i);
    of[i]->status = finishEvaluation(of[i]->stage, true);
    if (of[i]->status == StepStatus::Ok) finish(*of[i]);
  }
  for (int i = 0; i < count; ++i)
    if (!ok[i]) evaluateAlone(*of[i], nullptr);
}

StepStatus RobotProblem::finishStep(int stage, VectorRef x_next, double& cost) {
  x_next = nodes_[stage].dynamics->x_next();
  cost = getScale(specs_[stage]) * sumCosts(stage);
  return std::isfinite(cost) ? StepStatus::Ok : StepStatus::Failed;
}

StepStatus RobotProblem::calcTerminalCost(ConstVectorRef x, double& cost) {
  Node& node = nodes_.back();
  if (!x.allFinite()) return StepStatus::Failed;
  if (!node.valid || node.x != x) {
    node.x = x;
    node.has_cost = false;
    node.valid = node.dynamics->updateState(x);
    if (!node.valid) return StepStatus::Failed;
  }
  cost = sumCosts(numStages());
  return std::isfinite(cost) ? StepStatus::Ok : StepStatus::Failed;
}

double RobotProblem::sumCosts(int index, std::vector<CostValue>* values) {
  Node& node = nodes_[index];
  if (node.has_cost) {
    if (!values) return node.cost;
    node.dynamics->restore();
  }
  const StageSpec& spec = specs_[index];
  double sum = 0;
  const auto add = [&](const std::string& name, double value) {
    sum += value;
    if (values) values->push_back({name, value});
  };
  if (spec.state.weight != 0) add("state", node.dynamics->calcStateCost());
  if (spec.control.weight != 0 && node.u.size())
    add("control", 0.5 * spec.control.weight * (node.u - spec.control.reference).cwiseAbs2().dot(spec.control.weights));
  const NodeView view{model_, node.dynamics->workspace(), spec.constraints, node.u, node.dynamics->lambda()};
  for (size_t c = 0; c < spec.costs.size(); ++c) {
    const Cost& cost = spec.costs[c];
    auto r = node.stack.r.segment(node.rows[c], cost.residual->size());
    cost.residual->calc(view, r);
    add(cost.name, cost.weight * cost.activation.calc(r));
  }
  node.cost = sum;
  node.has_cost = true;
  return sum;
}

StepStatus RobotProblem::linearize(int stage, ConstVectorRef x, ConstVectorRef u, ConstVectorRef x_next_node,
                                   StageModel& out) {
  if (evaluate(stage, x, u) != StepStatus::Ok) return StepStatus::Failed;
  NodeModel* node = nodes_[stage].dynamics.get();
  const NodeModel::Linearization alone{node, x_next_node.data(), nullptr};
  node->prepareLinearization(&alone, 1);
  return finishLinearization(stage, u, x_next_node, out);
}

// evaluate() of those of at most kLane stages that need it, together if that pays.
void RobotProblem::evaluateStages(int begin, int end, const std::vector<VectorXd>& xs,
                                  const std::vector<VectorXd>& us) {
  if (formulation_ == Formulation::Full) return;
  std::array<StepTask, kLane> tasks;
  int count = 0;
  for (int k = begin; k < end; ++k) {
    if (isEvaluated(k, xs[k], us[k])) continue;
    tasks[count].stage = k;
    tasks[count].x = &xs[k];
    tasks[count++].u = &us[k];
  }
  if (count > 1) evaluateTogether(tasks.data(), count, [](const StepTask&) {});
}

void RobotProblem::linearizeStages(int begin, int end, const std::vector<VectorXd>& xs, const std::vector<VectorXd>& us,
                                   std::vector<StageModel>& models, std::vector<StepStatus>& statuses) {
  for (int first = begin; first < end; first += kLane) {
    const int last = std::min<int>(end, first + kLane);
    evaluateStages(first, last, xs, us);
    std::array<NodeModel::Linearization, kLane> together;
    int count = 0;
    for (int k = first; k < last; ++k) statuses[k] = evaluate(k, xs[k], us[k]);
    for (int k = first; k < last; ++k) {
      if (statuses[k] != StepStatus::Ok || specs_[k].kind != StageKind::Dynamics) continue;
      // The node behind the last one may be another thread's.
      const bool has_next = k + 1 < last && statuses[k + 1] == StepStatus::Ok;
      together[count++] = {nodes_[k].dynamics.get(), xs[k + 1].data(),
                           has_next ? nodes_[k + 1].dynamics.get() : nullptr};
    }
    if (count > 0) together.front().node->prepareLinearization(together.data(), count);
    for (int k = first; k < last; ++k)
      if (statuses[k] == StepStatus::Ok) statuses[k] = finishLinearization(k, us[k], xs[k + 1], models[k]);
  }
}

// From prepareLinearization() on.
StepStatus RobotProblem::finishLinearization(int stage, ConstVectorRef u, ConstVectorRef x_next_node, StageModel& out) {
  if (!out.hasSizes(tangent_size_, model_.nu(), tangent_size_)) out.resize(tangent_size_, model_.nu(), tangent_size_);
  if (!nodes_[stage].dynamics->linearizeStep(x_next_node, out)) return StepStatus::Failed;
  const double h = getScale(specs_[stage]);
  out.cost = h * sumCosts(stage);
  differentiateCosts(stage, h, out);
  const ControlCost& control = specs_[stage].control;
  if (control.weight != 0) {
    const double w = h * control.weight;
    out.lu += w * control.weights.cwiseProduct(u - control.reference);
    out.luu().diagonal() += w * control.weights;
  }
  return isFinite(out) ? StepStatus::Ok : StepStatus::Failed;
}

StepStatus RobotProblem::linearizeTerminal(ConstVectorRef x, StageModel& out) {
  double cost = 0;
  if (calcTerminalCost(x, cost) != StepStatus::Ok) return StepStatus::Failed;
  if (!out.hasSizes(tangent_size_, 0, 0)) out.resize(tangent_size_, 0, 0);
  nodes_.back().dynamics->linearizeState();
  out.cost = cost;
  differentiateCosts(numStages(), 1, out);
  return isFinite(out) ? StepStatus::Ok : StepStatus::Failed;
}

// Gradient and Hessian of the residual costs, the residuals being those of the last sumCosts(), and of the state cost.
void RobotProblem::differentiateCosts(int index, double scale, StageModel& out) {
  Node& node = nodes_[index];
  const StageSpec& spec = specs_[index];
  differentiateResiduals(index, scale, out);
  if (spec.state.weight != 0) node.dynamics->addStateCost(scale, out);
}

void RobotProblem::differentiateResiduals(int index, double scale, StageModel& out) {
  Node& node = nodes_[index];
  const StageSpec& spec = specs_[index];
  if (spec.costs.empty()) {
    for (VectorXd* gradient : {&out.lx, &out.lu}) gradient->setZero();
    out.H().setZero();
    return;
  }
  const NodeView view{model_, node.dynamics->workspace(), spec.constraints, node.u, node.dynamics->lambda()};
  ResidualStack& stack = node.stack;
  ResidualJacobians& jacobians = node.dynamics->startResiduals(stack);
  for (size_t c = 0; c < spec.costs.size(); ++c) {
    const Cost& cost = spec.costs[c];
    const int n = cost.residual->size(), row = node.rows[c];
    auto gradient = stack.gradient.segment(row, n), hessian = stack.hessian.segment(row, n);
    cost.activation.calcDerivatives(stack.r.segment(row, n), gradient, hessian);
    gradient *= scale * cost.weight;
    hessian *= scale * cost.weight;
    if (gradient.isZero(0) && hessian.isZero(0)) continue;  // bounds that are kept, for one
    cost.residual->calcJacobian(view, jacobians.getRows(row, n, spec.constraints.rows));
  }
  node.dynamics->setResiduals(stack, index < numStages(), out);
}

std::string RobotProblem::getFailure(int node) const { return nodes_[node].dynamics->failure(); }

void RobotProblem::getControlBounds(int stage, VectorRef lower, VectorRef upper) const {
  const VectorXd& limits = specs_[stage].effort_limits;
  for (int m = 0; m < model_.nu(); ++m) {
    upper[m] = limits.size() ? limits[m] : model_.motors()[m].effort_limit;
    lower[m] = -upper[m];
  }
}

StepStatus RobotProblem::calcDynamics(int stage, ConstVectorRef x, ConstVectorRef u, VectorXd& a, VectorXd& lambda) {
  Workspace ws(model_);
  ConstrainedWorkspace cws;
  if (updateConstrainedDynamics(model_, ws, cws, specs_[stage].constraints, x.head(model_.nq()), x.tail(model_.nv()),
                                calcMotorForces(model_, u)) != DynamicsStatus::Ok)
    return StepStatus::Failed;
  a = cws.a;
  lambda = cws.lambda;
  return StepStatus::Ok;
}

std::vector<CostValue> RobotProblem::calcCosts(int node, ConstVectorRef x, ConstVectorRef u) {
  std::vector<CostValue> values;
  double cost = 0;
  const bool running = node < numStages();
  if ((running ? evaluate(node, x, u) : calcTerminalCost(x, cost)) == StepStatus::Ok) sumCosts(node, &values);
  return values;
}

}  // namespace bielle
