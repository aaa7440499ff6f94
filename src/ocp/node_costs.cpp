#include "ocp/node_costs.h"

#include <cmath>

namespace bielle {

NodeCosts::NodeCosts(const StageSpec& spec, bool running)
    : spec_(spec), first_rows_(spec.costs.size()), first_constraint_rows_(spec.path_constraints.size()) {
  if (running && spec.kind == StageKind::Dynamics) scale_ = spec.dt;
  const auto place = [this](const auto& elements, bool motion, std::vector<int>& first_rows) {
    for (size_t i = 0; i < elements.size(); ++i) {
      if (elements[i].residual->needsMotion() != motion) continue;
      first_rows[i] = rows_;
      rows_ += elements[i].residual->size();
      needs_controls_ |= elements[i].residual->needsControls();
    }
  };
  for (bool motion : {true, false}) {
    place(spec.costs, motion, first_rows_);
    place(spec.path_constraints, motion, first_constraint_rows_);
    if (motion) motion_rows_ = rows_;
  }
  for (const PathConstraint& constraint : spec.path_constraints) constraint_rows_ += constraint.residual->size();
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
  int row = 0;
  for (size_t c = 0; c < spec_.path_constraints.size(); ++c) {
    const PathConstraint& constraint = spec_.path_constraints[c];
    const int n = constraint.residual->size();
    auto r = at.residuals.segment(first_constraint_rows_[c], n);
    constraint.residual->calc(node, r);
    at.constraints.segment(row, n) = r.cwiseQuotient(constraint.scale);
    row += n;
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

void NodeCosts::addJacobian(const NodeView& node, const Residual& residual, int row, const ResidualWeights& weights,
                            ResidualJacobians& jacobians) const {
  const int n = residual.size();
  if (weights.gradient.segment(row, n).isZero(0) && weights.hessian.segment(row, n).isZero(0))
    return;  // bounds that are kept
  residual.calcJacobian(
      node, {jacobians.q.middleRows(row, n), jacobians.v.middleRows(row, n),
             jacobians.lambda.block(row, 0, n, spec_.constraints.rows), jacobians.u.block(row, 0, n, node.u.size())});
}

void NodeCosts::differentiate(const NodeView& node, const RobotEvaluation& at, const ConstraintWeights* constraints,
                              ResidualWeights& weights, ResidualJacobians& jacobians) const {
  for (size_t c = 0; c < spec_.costs.size(); ++c) {
    const Cost& cost = spec_.costs[c];
    const int n = cost.residual->size(), row = first_rows_[c];
    auto gradient = weights.gradient.segment(row, n), hessian = weights.hessian.segment(row, n);
    cost.activation.calcDerivatives(at.residuals.segment(row, n), gradient, hessian);
    gradient *= scale_ * cost.weight;
    hessian *= scale_ * cost.weight;
    addJacobian(node, *cost.residual, row, weights, jacobians);
  }
  int constraint_row = 0;
  for (size_t c = 0; c < spec_.path_constraints.size(); ++c) {
    const PathConstraint& constraint = spec_.path_constraints[c];
    const int n = constraint.residual->size(), row = first_constraint_rows_[c];
    auto gradient = weights.gradient.segment(row, n), hessian = weights.hessian.segment(row, n);
    gradient.setZero();
    hessian.setZero();
    if (constraints) {
      gradient = constraints->gradient.segment(constraint_row, n).cwiseQuotient(constraint.scale);
      hessian = constraints->hessian.segment(constraint_row, n).cwiseQuotient(constraint.scale.cwiseAbs2());
    }
    addJacobian(node, *constraint.residual, row, weights, jacobians);
    constraint_row += n;
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
