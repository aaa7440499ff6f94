// Costs in the coordinates of reduced_node.h.
#include "bielle/math/lane_product.h"
#include "reduced_node.h"

namespace bielle {

double ReducedNode::calcStateCost() {
  if (!has_state_value_) {
    loadStateCost();
    state_value_ = work_->state_cost.update(q_, v_);
    state_difference_ = work_->state_cost.difference;
    has_state_value_ = true;
  }
  return state_value_;
}

// The reference and the weights.
void ReducedNode::loadStateCost() {
  takeWork();
  ReducedStateCostOf<double>& cost = work_->state_cost;
  cost.q_ref = state_cost_->q_ref;
  cost.v_ref = state_cost_->v_ref;
  cost.weights = state_cost_->weight * state_cost_->weights;
}

void ReducedNode::addStateCost(double scale, StageModel& out) {
  if (state_model_) return addStateCostModel(model_, reduction_, *state_model_, scale, out);
  loadStateCost();
  work_->state_cost.difference = state_difference_;
  addStateCostModel(model_, reduction_, work_->state_cost.differentiate(v_, work_->lifts), scale, out);
}

// Rt = (dr/d(u, dy, dy_v))^T, one column per residual: Rt diag(hessian) Rt^T is all second derivatives at once.
void ReducedNode::setResiduals(const ResidualStack& stack, bool running, StageModel& out) {
  ReducedWork& work = *work_;
  const int nr = reduction_.size, nu = running ? model_.nu() : 0, columns = nu + 2 * nr;
  const int rows = static_cast<int>(stack.r.size()), motion_rows = stack.motion_rows;
  PaddedMap Rt = shapePadded(work.Rt, columns, rows), scaled = shapePadded(work.Rt_scaled, columns, rows);
  Rt.setZero();
  const auto q = work.jacobians.q.topRows(motion_rows), v = work.jacobians.v.topRows(motion_rows);
  addColumns(q, Lift::N, Rt.block(nu, 0, nr, motion_rows));
  addColumns(v, Lift::Z, Rt.block(nu, 0, nr, motion_rows));
  addColumns(v, Lift::N, Rt.block(nu + nr, 0, nr, motion_rows));
  if (running && contact_rows_ > 0) {
    const PaddedMap by_forces = shapeForceDerivatives();
    const auto lambda = work.jacobians.lambda.block(0, loop_rows_, rows, contact_rows_);
    for (int j = 0; j < contact_rows_; ++j)
      for (int i = 0; i < rows; ++i)
        if (lambda(i, j) != 0) Rt.col(i) += lambda(i, j) * by_forces.col(j);
  }
  clearPadding(Rt);
  for (int i = 0; i < rows; ++i) scaled.col(i) = stack.hessian[i] * Rt.col(i);
  clearPadding(scaled);
  setLowerProduct(rows, pad(scaled), pad(Rt), out.H());
  out.lx.setZero();
  out.lu.setZero();
  for (int i = 0; i < rows; ++i) {
    out.lx += stack.gradient[i] * Rt.col(i).tail(2 * nr);
    if (running) out.lu += stack.gradient[i] * Rt.col(i).head(nu);
  }
}

}  // namespace bielle
