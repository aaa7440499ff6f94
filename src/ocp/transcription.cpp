#include "ocp/transcription.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bielle {

int countControls(const Model& model, const TimeScalePlace& place) { return model.nu() + (place.in_controls ? 1 : 0); }

double getTimeScale(const TimeScalePlace& place, const VectorXd& x, const VectorXd& u) {
  return place.in_controls ? u[u.size() - 1] : place.in_state ? x[x.size() - 1] : 1;
}

Transcription::Transcription(const Model& model, const NodeList& nodes)
    : model_(model), nodes_(nodes), specs_(nodes.specs) {
  for (const StageSpec& spec : specs_) {
    costs_.emplace_back(spec, &spec != &specs_.back());
    sizes_.include(spec, costs_.back());
  }
}

void Transcription::updateStage(int node) {
  costs_[node] = NodeCosts(specs_[node], true);
  sizes_.require(specs_[node], costs_[node]);
}

bool Transcription::startEvaluation(const EvaluateTask& task, RobotEvaluation& at) const {
  const StageSpec& spec = specs_[task.node];
  const TimeScalePlace& place = nodes_.places[task.node];
  const NodeCosts& costs = costs_[task.node];
  const bool running = isRunning(task.node), midpoint = isMidpoint(task.node);
  at.x = *task.x;
  at.u.resize(running ? countControls(model_, place) : 0);
  if (running) at.u = *task.u;
  at.time_scale = getTimeScale(place, at.x, at.u);
  at.dt = running && spec.kind == StageKind::Dynamics ? at.time_scale * spec.dt : 0;
  at.x_next.resize(running ? at.x.size() : 0);
  if (running && at.x.size() > model_.nq() + model_.nv())
    at.x_next[at.x.size() - 1] = place.in_next ? at.time_scale : 1;
  at.a.resize(running ? model_.nv() : 0);
  at.lambda.resize(running ? spec.constraints.rows : 0);
  at.q_mid.resize(midpoint ? model_.nq() : 0);
  at.v_mid.resize(midpoint ? model_.nv() : 0);
  at.residuals.resize(costs.rows());
  at.constraints.resize(costs.constraintRows());
  at.state_cost = 0;
  at.status = NumericalStatus::Failed;
  at.failure.clear();
  if (place.isFree() && !(at.time_scale > 0)) at.failure = "the time scale is not positive";
  return at.x.allFinite() && at.u.allFinite() && at.failure.empty();
}

void Transcription::finishEvaluation(int node, RobotEvaluation& at) const {
  at.failure = costs_[node].describeNotFinite(at);
  at.status = at.failure.empty() && at.x_next.allFinite() ? NumericalStatus::Ok : NumericalStatus::NotFinite;
}

void updateSpeeds(const Model& model, RobotEvaluation& at) {
  at.speeds.resize(model.nu());
  for (int m = 0; m < model.nu(); ++m) {
    const int dof = model.motors()[m].dof;
    at.speeds[m] = at.v_mid.size() > 0 ? at.v_mid[dof] : at.x[model.nq() + dof];
  }
}

void setNextTimeScale(const TimeScalePlace& place, const RobotEvaluation& at, const VectorXd& x_next_node,
                      StageModel& out) {
  if (!place.in_next) return;
  MatrixMap Ft = out.Ft();
  Ft.col(0).setZero();
  Ft(at.u.size() - (place.in_controls ? 1 : 0), 0) = 1;
  out.gap[0] = at.time_scale - x_next_node[x_next_node.size() - 1];
}

void addTimeScaleCost(int leading, const RobotEvaluation& at, ConstVectorRef no_squares, StageModel& out) {
  const double s = at.time_scale;
  const Eigen::Index row = leading - 1, nu = out.lu.size(), size = nu + out.lx.size();
  const auto getGradient = [&](Eigen::Index i) -> double& { return i < nu ? out.lu[i] : out.lx[i - nu]; };
  MatrixMap H = out.hessian();
  const double implicit = getGradient(row) - no_squares[row];
  for (Eigen::Index i = 0; i < size; ++i) {
    if (i == row) continue;
    H(std::max(i, row), std::min(i, row)) += (getGradient(i) - no_squares[i]) / (2 * s);
  }
  H(row, row) += implicit / s + std::max(0.0, at.cost) / (2 * s * s);
  getGradient(row) += at.cost / s;
}

void NodeSizes::include(const StageSpec& spec, const NodeCosts& costs) {
  rows = std::max(rows, costs.rows());
  blocks = std::max(blocks, costs.numBlocks());
  constraint_rows = std::max(constraint_rows, spec.constraints.rows);
}

void NodeSizes::require(const StageSpec& spec, const NodeCosts& costs) const {
  if (costs.rows() > rows || costs.numBlocks() > blocks || spec.constraints.rows > constraint_rows)
    throw std::invalid_argument(
        "RobotProblem: a stage has more costs or constraints than any stage had at construction");
}

// As allFinite(), but vectorized: a value that is not finite makes the sum NaN. The Hessian is a sum of squares, so any
// NaN shows on its diagonal.
bool isFinite(const StageModel& model) { return (0 * model.Ft()).sum() == 0 && model.hessian().diagonal().allFinite(); }

}  // namespace bielle
