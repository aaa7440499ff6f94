// Costs in the coordinates of reduced_node.h.
#include "reduced_node.h"

namespace bielle {

// Gradient and Hessian of a state cost with respect to the dofs of one joint.
void ReducedNode::calcJointCost(const StateCost& state, double w, const Joint& joint, JointVector& gradient,
                                JointMatrix& hessian) const {
  const int n = joint.nv;
  const JointVector weights = w * state.weights.segment(joint.idx_v, n);
  JointVector d(n);
  calcJointDifference(joint, state.q_ref.segment(joint.idx_q, joint.nq), work_->ws.q.segment(joint.idx_q, joint.nq), d);
  if (!isCurved(joint)) {
    gradient = weights.cwiseProduct(d);
    hessian = weights.asDiagonal();
    return;
  }
  JointMatrix J(n, n);
  calcJointDifferenceJacobian(joint, d, J);
  const JointMatrix WJ = weights.asDiagonal() * J;
  gradient.noalias() = WJ.transpose() * d;
  hessian.noalias() = J.transpose() * WJ;
}

void ReducedNode::addStateCost(const StateCost& state, double scale, StageModel& out) {
  const int nv = model_.nv(), nr = reduction_.size;
  const double w = scale * state.weight;
  JointVector gradient;
  JointMatrix hessian;
  for (const FreeJoint& free : free_joints_) {
    const Joint& joint = model_.joints()[free.joint];
    const int o = free.offset, n = joint.nv, k = joint.idx_v;
    calcJointCost(state, w, joint, gradient, hessian);
    out.lx.segment(o, n) += gradient;
    out.lxx.block(o, o, n, n) += hessian;
    const JointVector weights = w * state.weights.segment(nv + k, n);
    out.lx.segment(nr + o, n) += weights.cwiseProduct(work_->ws.v.segment(k, n) - state.v_ref.segment(k, n));
    out.lxx.block(nr + o, nr + o, n, n).diagonal() += weights;
  }
  for (Block& b : blocks_) {
    // Changes of q are N dy, of v N dy_v + Z dy: gradients by dof, and Hessians times N and Z.
    const int o = b.loop.offset, r = b.loop.size;
    const MatrixXd& N = b.at.N;
    for (size_t j = 0; j < b.loop.joints.size(); ++j) {
      const Joint& joint = model_.joints()[b.loop.joints[j]];
      const int at = b.loop.model.joints()[j + 1].idx_v, n = joint.nv;
      calcJointCost(state, w, joint, gradient, hessian);
      b.work->gradient_q.segment(at, n) = gradient;
      b.work->HN.middleRows(at, n) = hessian.lazyProduct(N.middleRows(at, n));
    }
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) {
      const int dof = b.loop.dofs[k];
      const double weight = w * state.weights[nv + dof];
      b.work->gradient_v[k] = weight * (work_->ws.v[dof] - state.v_ref[dof]);
      b.work->wy.row(k) = weight * b.work->motion.Z.row(k);
      b.work->wv.row(k) = weight * N.row(k);
    }
    addSmallProductTransposed(N, b.work->gradient_q, out.lx.segment(o, r));
    addSmallProductTransposed(b.work->motion.Z, b.work->gradient_v, out.lx.segment(o, r));
    addSmallProductTransposed(N, b.work->gradient_v, out.lx.segment(nr + o, r));
    addSmallProductTransposed(N, b.work->HN, out.lxx.block(o, o, r, r));
    addSmallProductTransposed(b.work->motion.Z, b.work->wy, out.lxx.block(o, o, r, r));
    addSmallProductTransposed(b.work->motion.Z, b.work->wv, out.lxx.block(o, nr + o, r, r));
    addSmallProductTransposed(b.work->wv, b.work->motion.Z, out.lxx.block(nr + o, o, r, r));
    addSmallProductTransposed(N, b.work->wv, out.lxx.block(nr + o, nr + o, r, r));
  }
}

void ReducedNode::addResiduals(const ResidualStack& stack, bool running, StageModel& out) {
  const int nr = reduction_.size, rows = static_cast<int>(stack.r.size()), nu = model_.nu();
  const ResidualJacobians& jacobians = work_->jacobians;
  auto Rx = work_->Rx.topRows(rows), Ru = work_->Ru.topRows(rows);
  auto scaled = work_->scaled.topRows(rows), Ru_scaled = work_->Ru_scaled.topRows(rows);
  Rx.setZero();
  addColumns(jacobians.q.topRows(rows), Lift::N, Rx.leftCols(nr));
  addColumns(jacobians.v.topRows(rows), Lift::Z, Rx.leftCols(nr));
  addColumns(jacobians.v.topRows(rows), Lift::N, Rx.rightCols(nr));
  if (running && contact_rows_ > 0) {
    const auto by_forces = jacobians.lambda.block(0, loop_rows_, rows, contact_rows_);
    const auto dlambda = work_->dlambda.topRows(contact_rows_);
    Rx.noalias() += by_forces * dlambda.leftCols(2 * nr);
    Ru.noalias() = by_forces * dlambda.rightCols(nu);
  } else {
    Ru.setZero();
  }
  scaled = stack.hessian.asDiagonal() * Rx;
  out.lx.noalias() += Rx.transpose() * stack.gradient;
  out.lxx.triangularView<Eigen::Lower>() += Rx.transpose() * scaled;
  out.lxx.triangularView<Eigen::StrictlyUpper>() = out.lxx.transpose();
  if (!running) return;
  Ru_scaled = stack.hessian.asDiagonal() * Ru;
  out.lu.noalias() += Ru.transpose() * stack.gradient;
  out.luu.noalias() += Ru.transpose() * Ru_scaled;
  out.lux.noalias() += Ru.transpose() * scaled;
}

}  // namespace bielle
