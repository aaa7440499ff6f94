#include "ocp/node_costs.h"

#include <cmath>

namespace bielle {

NodeCosts::NodeCosts(const StageSpec& spec, bool running) : spec_(spec), first_rows_(spec.costs.size()) {
  if (running && spec.kind == StageKind::Dynamics) scale_ = spec.dt;
  for (bool motion : {true, false}) {
    for (size_t c = 0; c < spec.costs.size(); ++c) {
      if (spec.costs[c].residual->needsMotion() != motion) continue;
      first_rows_[c] = rows_;
      rows_ += spec.costs[c].residual->size();
    }
    if (motion) motion_rows_ = rows_;
  }
}

double NodeCosts::calcControlCost(const VectorXd& u) const {
  const ControlCost& control = spec_.control;
  return 0.5 * control.weight * (u - control.reference).cwiseAbs2().dot(control.weights);
}

// Visits the costs in turn, unscaled.
template <typename Add>
void NodeCosts::visitValues(const RobotEvaluation& at, const Add& add) const {
  static const std::string kState = "state", kControl = "control";
  if (spec_.state.weight != 0) add(kState, at.state_cost);
  if (spec_.control.weight != 0 && at.u.size() > 0) add(kControl, calcControlCost(at.u));
  for (size_t c = 0; c < spec_.costs.size(); ++c) {
    const Cost& cost = spec_.costs[c];
    const auto r = at.residuals.segment(first_rows_[c], cost.residual->size());
    add(cost.name, cost.weight * cost.activation.calc(r));
  }
}

void NodeCosts::calc(const NodeView& node, RobotEvaluation& at) const {
  for (size_t c = 0; c < spec_.costs.size(); ++c) {
    const Residual& residual = *spec_.costs[c].residual;
    residual.calc(node, at.residuals.segment(first_rows_[c], residual.size()));
  }
  double sum = 0;
  visitValues(at, [&](const std::string&, double value) { sum += value; });
  at.cost = scale_ * sum;
}

std::vector<CostValue> NodeCosts::getValues(const RobotEvaluation& at) const {
  std::vector<CostValue> values;
  visitValues(at, [&](const std::string& name, double value) { values.push_back({name, value}); });
  return values;
}

void NodeCosts::differentiate(const NodeView& node, const RobotEvaluation& at, ResidualWeights& weights,
                              ResidualJacobians& jacobians) const {
  for (size_t c = 0; c < spec_.costs.size(); ++c) {
    const Cost& cost = spec_.costs[c];
    const int n = cost.residual->size(), row = first_rows_[c];
    auto gradient = weights.gradient.segment(row, n), hessian = weights.hessian.segment(row, n);
    cost.activation.calcDerivatives(at.residuals.segment(row, n), gradient, hessian);
    gradient *= scale_ * cost.weight;
    hessian *= scale_ * cost.weight;
    if (gradient.isZero(0) && hessian.isZero(0)) continue;  // for example bounds that are satisfied
    cost.residual->calcJacobian(node, {jacobians.q.middleRows(row, n), jacobians.v.middleRows(row, n),
                                       jacobians.lambda.block(row, 0, n, spec_.constraints.rows)});
  }
}

void NodeCosts::addControlCost(const VectorXd& u, StageModel& out) const {
  const ControlCost& control = spec_.control;
  if (control.weight == 0) return;
  const double w = scale_ * control.weight;
  out.lu += w * control.weights.cwiseProduct(u - control.reference);
  out.luu().diagonal() += w * control.weights;
}

}  // namespace bielle
