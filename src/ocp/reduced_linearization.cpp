// Derivatives of the reduced step: Eqs. (a) to (g) of reduced_node.h.
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "reduced_node.h"

namespace bielle {
namespace {

// Rows of a unit with `size` coordinates from `offset` on: q_a and v_a (size x size) times the derivatives of y'. Sizes
// known to the compiler make a few instructions of a column.
template <typename Size>
void assembleRows(Size size, const double* __restrict q_a, const double* __restrict v_a, int offset,
                  ConstMatrixRef dydd, MatrixXd& F) {
  for (Eigen::Index c = 0; c < F.cols(); ++c) {
    const double* __restrict ydd = dydd.data() + c * dydd.outerStride() + offset;
    double* __restrict q = &F(offset, c), * __restrict v = q + F.rows() / 2;
    for (int i = 0; i < size; ++i) q[i] = v[i] = 0;
    for (int k = 0; k < size; ++k) {
      const double y = ydd[k];
      for (int i = 0; i < size; ++i) {
        q[i] += q_a[k * size + i] * y;
        v[i] += v_a[k * size + i] * y;
      }
    }
  }
}

// The same where v_a is h times the identity, and q_a h^2 times it but for joints whose configuration is no vector.
void assembleFreeJoint(const FreeJoint& free, double h, bool curved, ConstMatrixRef dydd, MatrixXd& F) {
  const int o = free.offset, n = static_cast<int>(free.q_a.rows()), half = static_cast<int>(F.rows() / 2);
  F.middleRows(half + o, n) = h * dydd.middleRows(o, n);
  if (!curved) {
    F.middleRows(o, n) = (h * h) * dydd.middleRows(o, n);
    return;
  }
  F.middleRows(o, n).setZero();
  addSmallProduct(free.q_a, dydd.middleRows(o, n), F.middleRows(o, n));
}

void assembleBlock(const MatrixXd& q_a, const MatrixXd& v_a, int offset, ConstMatrixRef dydd, MatrixXd& F) {
  const auto assemble = [&](auto size) { assembleRows(size, q_a.data(), v_a.data(), offset, dydd, F); };
  switch (q_a.rows()) {
    case 1:
      return assemble(std::integral_constant<int, 1>());
    case 2:
      return assemble(std::integral_constant<int, 2>());
    case 3:
      return assemble(std::integral_constant<int, 3>());
    default:
      return assemble(static_cast<int>(q_a.rows()));
  }
}

}  // namespace

// H N of the loop forces, and the wrenches of the contacts on the bodies. The forces that the loops are left with are
// those through their joints.
void ReducedNode::updateForces() {
  ReducedWork& work = *work_;
  const ConstraintSet& set = spec_.constraints;
  for (Vector6d& f : work.f_ext) f.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const Closure& contact = set.closures[c];
    work.f_ext[contact.body1] +=
        calcClosureWrench(work.ws, contact, lambda_.segment(set.offsets[c], getRows(contact.kind)));
  }
  updateInverseDynamicsFactors(model_, work.ws, work.f_ext);
  for (Block& b : blocks_) {
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) {
      const int dof = b.loop.dofs[k];
      const double left =
          work.ws.J.col(dof).dot(work.ws.F[model_.dofs()[dof].joint]) + model_.armature()[dof] * a_[dof] - tau_[dof];
      b.work->d[k] = b.loop.inverse_metric[k] * left;
    }
    b.work->independent.setZero();
    addSmallProduct(b.at.J, b.work->d, b.work->independent);
    solveGram(b.at, b.work->independent);
    expandIndependent(b.at, b.work->independent, b.work->rows);
    calcForceLift(getPlacedView(b.loop, work.ws), b.work->motion, b.work->rows, b.work->HN);
  }
}

// Eq. (c): the right-hand sides of the contact rows.
void ReducedNode::calcContactDerivatives() {
  ReducedWork& work = *work_;
  const int nr = reduction_.size;
  const ConstraintSet& set = spec_.constraints;
  auto dlambda = work.dlambda.topRows(contact_rows_);
  dlambda.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const Closure& contact = set.closures[c];
    const int row = set.offsets[c] - loop_rows_, n = getRows(contact.kind);
    const SE3 X_WF = getPlacement(work.ws, contact.body1, contact.X_B1);
    const Vector6d &V1 = work.ws.V[contact.body1], &A2 = work.ws.A[contact.body2];
    const ReducedTree::Columns& tip = work.tree.getTip(contact_tips_[c - num_loops_]);
    RowsBy6 rate;
    if (contact.kp != 0) rate = calcClosureResidualRate(work.ws, contact);
    for (size_t o = 0; o < tip.outer.size(); ++o) {
      const Vector6d J = tip.J.col(o), dV = tip.dV.col(o);
      const Vector6d dq = tip.dA.col(o) - crossMotion(V1, dV) + crossMotion(J, A2) + contact.kd * dV;
      const Vector6d dv = tip.dW.col(o) - crossMotion(V1, J) + contact.kd * J;
      auto da_dy = dlambda.col(tip.outer[o]).segment(row, n);
      da_dy = selectRows(contact, X_WF.actInvMotion(dq));
      if (contact.kp != 0) da_dy -= contact.kp * (rate * X_WF.actInvMotion(J));
      dlambda.col(nr + tip.outer[o]).segment(row, n) = selectRows(contact, X_WF.actInvMotion(dv));
    }
  }
}

// Derivatives of y' and lambda_c.
void ReducedNode::linearizeDynamics() {
  ReducedWork& work = *work_;
  const int nr = reduction_.size;
  updateAccelerations(model_, work.ws, a_);
  for (Block& b : blocks_) {
    const BlockView view = getPlacedView(b.loop, work.ws);
    updateTwists(view, b.at, b.work->motion);
    updateVelocityLift(view, b.work->motion);
    updateAccelerationLift(view, b.work->motion);
  }
  updateForces();
  work.tree.updateDerivatives(work.ws, work.lifts, work.dydd.leftCols(nr), work.dydd.middleCols(nr, nr));
  work.dydd.rightCols(model_.nu()).setZero();
  addMotorColumns(work.dydd.rightCols(model_.nu()));
  calcContactDerivatives();
  SaddlePoint& saddle_point = work.contacts.at(contact_rows_).saddle_point;
  saddle_point.factorize(M_, JcN_);
  saddle_point.updateInverse();
  saddle_point.solveDerivatives(work.dydd, work.dlambda.topRows(contact_rows_));
}

// out (size x nu) += -N^T B
void ReducedNode::addMotorColumns(MatrixRef out) const {
  for (int m = 0; m < model_.nu(); ++m) {
    const int dof = model_.motors()[m].dof;
    for (const FreeJoint& free : free_joints_) {
      const Joint& joint = model_.joints()[free.joint];
      if (dof >= joint.idx_v && dof < joint.idx_v + joint.nv) out(free.offset + dof - joint.idx_v, m) -= 1;
    }
    for (const Block& b : blocks_)
      for (size_t k = 0; k < b.loop.dofs.size(); ++k)
        if (b.loop.dofs[k] == dof) out.col(m).segment(b.loop.offset, b.loop.size) -= b.at.N.row(k).transpose();
  }
}

bool ReducedNode::linearizeStep(ConstVectorRef x_next_node, StageModel& out) {
  restore();
  linearizeDynamics();
  for (Block& b : blocks_)
    if (!linearizeBlock(b, x_next_node, out)) return false;
  differenceFree(x_next_node, x_next_, out.gap);
  for (FreeJoint& free : free_joints_) linearizeFreeJoint(free, out);
  assembleStep(out);
  storeChart();
  return true;
}

// Eqs. (d) to (g) for one block, rows [offset, offset + size) of Fx, Fu and gap.
bool ReducedNode::linearizeBlock(Block& b, ConstVectorRef x_next_node, StageModel& out) {
  const LoopBlock& loop = b.loop;
  BlockWork& work = *b.work;
  const int nr = reduction_.size, o = loop.offset, r = loop.size;
  const double h = spec_.dt;
  const BlockBasis &base = b.at, &next = b.next.basis();

  work.zeta = b.next.zeta() / h;  // close() moves by h w', so its zeta is h times that of Eq. (3)
  expandIndependent(base, work.zeta, work.rows);
  calcForceLift(getPlacedView(loop, work_->ws), work.motion, work.rows, work.HN);
  b.next.load(loop, work.scratch);
  const BlockView ahead = getOwnView(loop, work.scratch.ws);
  updateTwists(ahead, next, work.ahead);
  work.independent.setZero();  // mu
  addSmallProduct(next.J, b.next.step(), work.independent, 1 / h);
  solveGram(next, work.independent);
  expandIndependent(next, work.independent, work.rows);
  calcForceLift(ahead, work.ahead, work.rows, work.HnNn);

  // J_q N, J_d^{-T} W N and J_d^{-T} W N': the identity but for the blocks of curved joints.
  work.JqN = base.N;
  work.P = base.WN;
  work.Pn = next.WN;
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const JointVector d = b.next.step().segment(i, n);
    JointMatrix Jq(n, n), Jd(n, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    work.JqN.middleRows(i, n) = Jq.lazyProduct(base.N.middleRows(i, n));
    calcJointDifferenceJacobian(joint, d, Jd);  // the inverse of J_d
    work.P.middleRows(i, n) = Jd.transpose().lazyProduct(base.WN.middleRows(i, n));
    work.Pn.middleRows(i, n) = Jd.transpose().lazyProduct(next.WN.middleRows(i, n));
  }
  // Eq. (g)
  MatrixXd &X = work.X, &Xn = work.Xn, &E = work.E, &En = work.En;
  for (MatrixXd* m : {&work.mixed, &work.mixed_next, &E, &En, &work.S}) m->setZero();
  addSmallProductTransposed(work.P, next.N, work.mixed);
  addSmallProductTransposed(work.Pn, next.N, work.mixed_next);
  addSmallProductTransposed(work.P, work.JqN, E);
  addSmallProductTransposed(base.N, work.HN, E, -h);
  addSmallProductTransposed(work.Pn, work.JqN, En);
  addSmallProductTransposed(next.N, work.HnNn, work.S);
  X.setIdentity();
  if (!factorizeSmall(work.mixed, work.mixed_pivots)) {
    failure_ = "closure '" + loop.closures.closures.front().name + "': the step turns its loops too far";
    return false;
  }
  solveFactorized(work.mixed, work.mixed_pivots, X);
  Xn = work.mixed_next.lazyProduct(X);
  work.q_y = X.lazyProduct(E);
  work.q_v = h * X;
  work.q_a = (h * h) * X;
  work.v_y = (Xn.lazyProduct(E) - En) / h - work.S.lazyProduct(work.q_y);
  work.v_v = Xn - work.S.lazyProduct(work.q_v);
  work.v_a = h * work.v_v;

  // About the node state, where a gap is open.
  gatherConfiguration(model_, loop, x_next_node.head(model_.nq()), work.q);
  gatherVelocity(loop, x_next_node.tail(model_.nv()), work.d);
  if (work.q != next.q || work.d != b.v_next) return moveToNodeState(b, out);
  out.gap.segment(o, r).setZero();
  out.gap.segment(nr + o, r).setZero();
  return true;
}

// The gap of a block to the node state (b.work->q, b.work->d), and its derivatives read there.
bool ReducedNode::moveToNodeState(Block& b, StageModel& out) {
  const LoopBlock& loop = b.loop;
  const int nr = reduction_.size, r = loop.size, o = loop.offset;
  // Of the point ahead, whose positions are in the scratch.
  updateVelocities(loop.model, b.work->scratch.ws, b.v_next);
  updateVelocityLift(getOwnView(loop, b.work->scratch.ws), b.work->ahead);
  if (!b.work->point.update(loop, b.work->scratch, b.work->q)) return fail(b, b.work->point);
  const MatrixXd &WN = b.work->point.basis().WN, &Nn = b.next.basis().N;
  loop.model.difference(b.work->q, b.next.basis().q, b.work->a);
  b.work->w = b.v_next - b.work->d;
  b.work->diff_N = Nn;  // becomes J_diff N'
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    JointMatrix Jdiff(n, n);
    calcJointDifferenceJacobian(joint, b.work->a.segment(i, n), Jdiff);
    b.work->diff_N.middleRows(i, n) = Jdiff.lazyProduct(Nn.middleRows(i, n));
  }
  out.gap.segment(o, r).setZero();
  out.gap.segment(nr + o, r).setZero();
  addSmallProductTransposed(WN, b.work->a, out.gap.segment(o, r));
  addSmallProductTransposed(WN, b.work->w, out.gap.segment(nr + o, r));
  for (MatrixXd* P : {&b.work->Pq, &b.work->Pv, &b.work->Pz}) P->setZero();
  addSmallProductTransposed(WN, b.work->diff_N, b.work->Pq);
  addSmallProductTransposed(WN, Nn, b.work->Pv);
  addSmallProductTransposed(WN, b.work->ahead.Z, b.work->Pz);
  const std::pair<MatrixXd*, MatrixXd*> derivatives[] = {
      {&b.work->q_y, &b.work->v_y}, {&b.work->q_v, &b.work->v_v}, {&b.work->q_a, &b.work->v_a}};
  for (const auto& [dq, dv] : derivatives) {
    b.work->S.setZero();
    addSmallProduct(b.work->Pv, *dv, b.work->S);
    addSmallProduct(b.work->Pz, *dq, b.work->S);
    dv->swap(b.work->S);
    b.work->S.setZero();
    addSmallProduct(b.work->Pq, *dq, b.work->S);
    dq->swap(b.work->S);
  }
  return true;
}

// The same for a joint outside all loops, where N and J^T vanish.
void ReducedNode::linearizeFreeJoint(FreeJoint& free, const StageModel& out) const {
  const Joint& joint = model_.joints()[free.joint];
  const int n = joint.nv;
  const double h = spec_.dt;
  free.q_y.setIdentity(n, n);
  free.q_v = h * JointMatrix::Identity(n, n);
  if (isCurved(joint)) {
    JointMatrix Jq(n, n), Jd(n, n), Jdiff(n, n);
    const JointVector d = h * x_next_.segment(model_.nq() + joint.idx_v, n), gap = out.gap.segment(free.offset, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    calcJointDifferenceJacobian(joint, gap, Jdiff);
    free.q_y.noalias() = Jdiff * Jq;
    free.q_v.noalias() = h * Jdiff * Jd;
  }
  free.q_a = h * free.q_v;
}

// Fx and Fu out of the derivatives of y' and what each unit makes of them.
void ReducedNode::assembleStep(StageModel& out) const {
  const int nr = reduction_.size;
  const auto state = work_->dydd.leftCols(2 * nr), control = work_->dydd.rightCols(model_.nu());
  for (const FreeJoint& free : free_joints_) {
    const bool curved = isCurved(model_.joints()[free.joint]);
    assembleFreeJoint(free, spec_.dt, curved, state, out.Fx);
    assembleFreeJoint(free, spec_.dt, curved, control, out.Fu);
  }
  for (const Block& b : blocks_) {
    assembleBlock(b.work->q_a, b.work->v_a, b.loop.offset, state, out.Fx);
    assembleBlock(b.work->q_a, b.work->v_a, b.loop.offset, control, out.Fu);
  }
  for (const FreeJoint& free : free_joints_) {
    const int n = static_cast<int>(free.q_v.rows()), o = free.offset;
    out.Fx.block(o, o, n, n) += free.q_y;
    out.Fx.block(o, nr + o, n, n) += free.q_v;
    out.Fx.block(nr + o, nr + o, n, n).diagonal().array() += 1;
  }
  for (const Block& b : blocks_) {
    const int o = b.loop.offset, r = b.loop.size;
    out.Fx.block(o, o, r, r) += b.work->q_y;
    out.Fx.block(o, nr + o, r, r) += b.work->q_v;
    out.Fx.block(nr + o, o, r, r) += b.work->v_y;
    out.Fx.block(nr + o, nr + o, r, r) += b.work->v_v;
  }
}

void ReducedNode::linearizeState() {
  restore();
  updateCompositeInertias(model_, work_->ws);
  for (Block& b : blocks_) {
    const BlockView view = getPlacedView(b.loop, work_->ws);
    updateTwists(view, b.at, b.work->motion);
    updateVelocityLift(view, b.work->motion);
  }
  storeChart();
}

}  // namespace bielle
