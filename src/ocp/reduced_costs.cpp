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

// Residuals of other nodes were here before. In full lanes, for which there is room.
ResidualJacobians& ReducedNode::startResiduals(const ResidualStack& stack) {
  ResidualJacobians& jacobians = work_->jacobians;
  for (Eigen::Index i = 0; i < stack.motion_rows; i += kLane) {
    jacobians.q.middleRows<kLane>(i).setZero();
    jacobians.v.middleRows<kLane>(i).setZero();
  }
  for (Eigen::Index i = 0; i < stack.r.size(); i += kLane)
    jacobians.lambda.middleRows<kLane>(i).middleCols(loop_rows_, contact_rows_).setZero();
  return jacobians;
}

// Rt = (dr/d(u, dy, dy_v))^T, one column per residual: Rt diag(hessian) Rt^T is all second derivatives at once.
void ReducedNode::setResiduals(const ResidualStack& stack, bool running, StageModel& out) {
  ReducedWork& work = *work_;
  const int nr = reduction_.size, nu = running ? model_.nu() : 0, columns = nu + 2 * nr;
  const int rows = static_cast<int>(stack.r.size());
  PaddedMap Rt = shapePadded(work.Rt, columns, rows), scaled = shapePadded(work.Rt_scaled, columns, rows);
  updateResidualDerivatives(stack, running, Rt);
  auto gradient = work.gradient.head(columns);
  gradient.setZero();
  int counting = 0;  // rows so far that have a weight here
  for (int i = 0; i < rows; ++i) {
    if (!stack.counts(i)) continue;
    gradient += stack.gradient[i] * Rt.col(i);
    if (counting < i) Rt.col(counting) = Rt.col(i);
    scaled.col(counting++) = stack.hessian[i] * Rt.col(i);
  }
  clearPadding(shapePadded(work.Rt, columns, counting));
  clearPadding(shapePadded(work.Rt_scaled, columns, counting));
  setLowerProduct(counting, pad(scaled), pad(Rt), out.H());
  out.lu = gradient.head(nu);
  out.lx = gradient.tail(2 * nr);
}

void ReducedNode::updateResidualDerivatives(const ResidualStack& stack, bool running, PaddedMap Rt) {
  const int nr = reduction_.size, nu = running ? model_.nu() : 0, rows = static_cast<int>(stack.r.size()),
            motion_rows = stack.motion_rows;
  const ResidualJacobians& jacobians = work_->jacobians;
  Rt.setZero();
  const auto q = jacobians.q.topRows(motion_rows), v = jacobians.v.topRows(motion_rows);
  addColumns(q, Lift::N, Rt.block(nu, 0, nr, motion_rows));
  addColumns(v, Lift::Z, Rt.block(nu, 0, nr, motion_rows));
  addColumns(v, Lift::N, Rt.block(nu + nr, 0, nr, motion_rows));
  if (!running || contact_rows_ == 0) return;
  const PaddedMap by_forces = shapeForceDerivatives();
  const auto lambda = jacobians.lambda.block(0, loop_rows_, rows, contact_rows_);
  for (int i = 0; i < rows; ++i) {
    if (!stack.counts(i)) continue;
    for (int j = 0; j < contact_rows_; ++j)
      if (lambda(i, j) != 0) Rt.col(i) += lambda(i, j) * by_forces.col(j);
  }
}

}  // namespace bielle
