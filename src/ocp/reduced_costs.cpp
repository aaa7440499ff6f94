// Costs in the coordinates of reduced_node.h.
#include "bielle/math/lane_product.h"
#include "reduced_node.h"

namespace bielle {

// Gradient and Hessian of a state cost with respect to the dofs of one joint.
void ReducedNode::calcJointCost(const StateCost& state, const VectorXd& difference, double w, const Joint& joint,
                                JointVector& gradient, JointMatrix& hessian) {
  const int n = joint.nv;
  const JointVector weights = w * state.weights.segment(joint.idx_v, n), d = difference.segment(joint.idx_v, n);
  if (!isCurved(joint)) {
    gradient = weights.cwiseProduct(d);
    hessian = weights.asDiagonal();
    return;
  }
  JointMatrix J(n, n);
  calcJointDifferenceJacobian(joint, d, J);
  const JointMatrix WJ = weights.asDiagonal() * J;
  gradient.noalias() = WJ.transpose().lazyProduct(d);
  hessian.noalias() = J.transpose().lazyProduct(WJ);
}

void ReducedNode::addStateCost(const StateCost& state, const VectorXd& difference, double scale, StageModel& out) {
  const int nv = model_.nv(), nr = reduction_.size;
  const double w = scale * state.weight;
  JointVector gradient;
  JointMatrix hessian;
  for (const FreeJoint& free : work_->free_joints) {
    const Joint& joint = model_.joints()[free.joint];
    const int o = free.offset, n = joint.nv, k = joint.idx_v;
    calcJointCost(state, difference, w, joint, gradient, hessian);
    out.lx.segment(o, n) += gradient;
    out.lxx().block(o, o, n, n) += hessian;
    const JointVector weights = w * state.weights.segment(nv + k, n);
    out.lx.segment(nr + o, n) += weights.cwiseProduct(v_.segment(k, n) - state.v_ref.segment(k, n));
    out.lxx().block(nr + o, nr + o, n, n).diagonal() += weights;
  }
  for (Block& b : blocks_) {
    // Changes of q are N dy, of v N dy_v + Z dy: gradients by dof, and Hessians times N and Z.
    const int o = b.loop.offset, r = b.loop.size;
    const MatrixXd& N = b.at.N;
    VectorXd &weights_q = b.work->d, &weights_v = b.work->w;
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) {
      const int dof = b.loop.dofs[k];
      weights_q[k] = w * state.weights[dof];
      weights_v[k] = w * state.weights[nv + dof];
      b.work->gradient_q[k] = weights_q[k] * difference[dof];
      b.work->gradient_v[k] = weights_v[k] * (v_[dof] - state.v_ref[dof]);
    }
    for (int c = 0; c < r; ++c) {
      b.work->HN.col(c) = weights_q.cwiseProduct(N.col(c));
      b.work->wy.col(c) = weights_v.cwiseProduct(b.work->motion.Z.col(c));
      b.work->wv.col(c) = weights_v.cwiseProduct(N.col(c));
    }
    for (size_t j = 0; j < b.loop.joints.size(); ++j) {
      const Joint& joint = model_.joints()[b.loop.joints[j]];
      if (!isCurved(joint)) continue;
      const int at = b.loop.model.joints()[j + 1].idx_v, n = joint.nv;
      calcJointCost(state, difference, w, joint, gradient, hessian);
      b.work->gradient_q.segment(at, n) = gradient;
      b.work->HN.middleRows(at, n) = hessian.lazyProduct(N.middleRows(at, n));
    }
    addSmallProductTransposed(N, b.work->gradient_q, out.lx.segment(o, r));
    addSmallProductTransposed(b.work->motion.Z, b.work->gradient_v, out.lx.segment(o, r));
    addSmallProductTransposed(N, b.work->gradient_v, out.lx.segment(nr + o, r));
    addSmallProductTransposed(N, b.work->HN, out.lxx().block(o, o, r, r));
    addSmallProductTransposed(b.work->motion.Z, b.work->wy, out.lxx().block(o, o, r, r));
    addSmallProductTransposed(b.work->wv, b.work->motion.Z, out.lxx().block(nr + o, o, r, r));
    addSmallProductTransposed(N, b.work->wv, out.lxx().block(nr + o, nr + o, r, r));
  }
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
