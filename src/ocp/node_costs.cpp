#include "ocp/node_costs.h"

#include <algorithm>
#include <cmath>

namespace bielle {

NodeCosts::NodeCosts(const StageSpec& spec, bool running) : spec_(&spec), first_rows_(spec.costs.size()) {
  step_ = running && spec.kind == StageKind::Dynamics;
  const auto add = [this](const Residual& residual, const Cost* cost, const PathConstraint* constraint, int row) {
    blocks_.push_back({&residual, cost, constraint, rows_, row});
    rows_ += residual.size();
    needs_controls_ |= residual.needsControls();
    needs_speeds_ |= residual.needsSpeeds();
  };
  for (bool motion : {true, false}) {
    for (size_t c = 0; c < spec.costs.size(); ++c) {
      if (spec.costs[c].residual->needsMotion() != motion) continue;
      first_rows_[c] = rows_;
      add(*spec.costs[c].residual, &spec.costs[c], nullptr, 0);
    }
    int row = 0;
    for (const PathConstraint& constraint : spec.path_constraints) {
      if (constraint.residual->needsMotion() == motion) add(*constraint.residual, nullptr, &constraint, row);
      row += constraint.residual->size();
    }
    constraint_rows_ = row;
  }
}

double NodeCosts::calcControlCost(const VectorXd& u) const {
  const ControlCost& control = spec_->control;
  return 0.5 * control.weight * (u.head(control.reference.size()) - control.reference).cwiseAbs2().dot(control.weights);
}

// Visits the costs in turn, unscaled.
template <typename Add>
void NodeCosts::visitValues(const RobotEvaluation& at, const Add& add) const {
  static const std::string kTime = "time", kState = "state", kControl = "control";
  if (step_ && spec_->time_weight != 0) add(kTime, spec_->time_weight);
  if (spec_->state.weight != 0) add(kState, at.state_cost);
  if (spec_->control.weight != 0 && at.u.size() > 0) add(kControl, calcControlCost(at.u));
  for (size_t c = 0; c < spec_->costs.size(); ++c) {
    const Cost& cost = spec_->costs[c];
    const auto r = at.residuals.segment(first_rows_[c], cost.residual->size());
    add(cost.name, cost.weight * cost.activation.calc(r));
  }
}

void NodeCosts::calc(const NodeView& node, RobotEvaluation& at) const {
  for (const Block& block : blocks_) {
    const int n = block.residual->size();
    auto r = at.residuals.segment(block.row, n);
    block.residual->calc(node, r);
    if (block.constraint) at.constraints.segment(block.constraint_row, n) = r.cwiseQuotient(block.constraint->scale);
  }
  double sum = 0;
  visitValues(at, [&](const std::string&, double value) { sum += value; });
  at.cost = getScale(at) * sum;
}

std::string NodeCosts::describeNotFinite(const RobotEvaluation& at) const {
  if (std::isfinite(at.cost) && at.constraints.allFinite()) return "";
  std::string found;
  const auto look = [&](const char* kind, const std::string& name, double value) {
    if (found.empty() && !std::isfinite(value))
      found = kind + (" '" + name) + (std::isnan(value) ? "' is not a number" : "' is infinite");
  };
  for (const Block& block : blocks_)
    if (block.constraint)
      for (const double value : at.constraints.segment(block.constraint_row, block.residual->size()))
        look("constraint", block.constraint->name, value);
  visitValues(at, [&](const std::string& name, double value) { look("cost", name, value); });
  return found.empty() ? "the cost is not finite" : found;
}

std::vector<CostValue> NodeCosts::getValues(const RobotEvaluation& at) const {
  std::vector<CostValue> values;
  visitValues(at, [&](const std::string& name, double value) { values.push_back({name, value}); });
  return values;
}

void NodeCosts::selectRows(const RobotEvaluation& at, const std::vector<char>* wanted, CountedRows& rows) const {
  const double scale = getScale(at);
  rows.blocks.clear();
  rows.rows = rows.motion_rows = 0;
  for (const Block& block : blocks_) {
    const int n = block.residual->size();
    auto gradient = rows.gradient.segment(rows.rows, n), hessian = rows.hessian.segment(rows.rows, n);
    const auto numbers = rows.constraints.begin() + rows.rows;
    if (block.cost) {
      std::fill_n(numbers, n, -1);
      block.cost->activation.calcDerivatives(at.residuals.segment(block.row, n), gradient, hessian);
      gradient *= scale * block.cost->weight;
      hessian *= scale * block.cost->weight;
      if (gradient.isZero(0) && hessian.isZero(0)) continue;
    } else {
      int found = 0;
      for (int i = 0, row = block.constraint_row; wanted && i < n; ++i, ++row) {
        found += (*wanted)[row];
        numbers[i] = (*wanted)[row] ? row : -1;
      }
      if (found == 0) continue;
      gradient.setZero();
      hessian.setZero();
      rows.unit.segment(rows.rows, n) = block.constraint->scale;
    }
    rows.blocks.push_back({block.residual, rows.rows, n, !block.cost || block.cost->activation.isSquare()});
    rows.rows += n;
    if (block.residual->needsMotion()) rows.motion_rows = rows.rows;
  }
}

void NodeCosts::differentiate(const NodeView& node, const CountedRows& rows, ResidualJacobians& jacobians) const {
  for (const auto& [residual, row, n, square] : rows.blocks)
    residual->calcJacobian(node,
                           {jacobians.q.middleRows(row, n), jacobians.v.middleRows(row, n),
                            jacobians.lambda.block(row, 0, n, spec_->constraints.rows), jacobians.u.middleRows(row, n),
                            jacobians.speeds.middleRows(row, n), jacobians.s.segment(row, n)});
}

void NodeCosts::addControlCost(const RobotEvaluation& at, StageModel& out) const {
  const ControlCost& control = spec_->control;
  if (control.weight == 0) return;
  const double w = getScale(at) * control.weight;
  const Eigen::Index nu = control.reference.size();
  out.lu.head(nu) += w * control.weights.cwiseProduct(at.u.head(nu) - control.reference);
  out.luu().diagonal().head(nu) += w * control.weights;
}

}  // namespace bielle
