// Derivatives of the reduced step: Eqs. (a) to (g) of reduced_node.h.
#include "bielle/dynamics/kinematics.h"
#include "reduced_node.h"

namespace bielle {
namespace {

// out = -J^+ X; X is overwritten.
void applyPlus(const BlockPoint& point, MatrixXd& X, MatrixXd& out) {
  point.solveGram(X);
  out.setZero();
  addSmallProductTransposed(point.basis().JW, X, out, -1);
}

// Rows of a unit with `size` coordinates from `offset` on: q_a and v_a (size x size) times the derivatives of y'. Sizes
// known to the compiler make a few instructions of a column.
template <typename Size>
void assembleRows(Size size, const double* __restrict q_a, const double* __restrict v_a, int offset,
                  ConstMatrixRef dydd, MatrixXd& F) {
  for (Eigen::Index c = 0; c < F.cols(); ++c) {
    const double* ydd = dydd.data() + c * dydd.outerStride() + offset;
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

template <typename Matrix>
void assembleUnit(const Matrix& q_a, const Matrix& v_a, int offset, ConstMatrixRef dydd, MatrixXd& F) {
  const auto assemble = [&](auto size) { assembleRows(size, q_a.data(), v_a.data(), offset, dydd, F); };
  switch (q_a.rows()) {
    case 1:
      return assemble(std::integral_constant<int, 1>());
    case 2:
      return assemble(std::integral_constant<int, 2>());
    case 3:
      return assemble(std::integral_constant<int, 3>());
    case 6:
      return assemble(std::integral_constant<int, 6>());
    default:
      return assemble(static_cast<int>(q_a.rows()));
  }
}

}  // namespace

// Z of Eq. (a) at a point of the block whose velocities are there.
void ReducedNode::calcVelocityLift(Block& b, BlockPoint& point, MatrixXd& Z) {
  const ConstraintSet& set = b.loop.closures;
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureVelocityDerivative(point.workspace(), set.closures[c],
                                  b.work->K.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  point.selectIndependent(b.work->K, b.work->K_r);
  b.work->X.setZero();
  addSmallProduct(b.work->K_r, point.basis().N, b.work->X);
  applyPlus(point, b.work->X, Z);
}

// d_y and d_v of Eq. (c).
void ReducedNode::updateBlockDerivatives(Block& b) {
  calcVelocityLift(b, b.at, b.work->Z);
  gatherVelocity(b.loop, a_, b.work->a);
  updateAccelerations(b.loop.model, b.at.workspace(), b.work->a);
  const ConstraintSet& set = b.loop.closures;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const int row = set.offsets[c], n = getRows(set.closures[c].kind);
    calcClosureDerivatives(b.at.workspace(), set.closures[c], b.work->Cq.middleRows(row, n),
                           b.work->Cv.middleRows(row, n));
  }
  b.at.selectIndependent(b.work->Cq, b.work->Cq_r);
  b.at.selectIndependent(b.work->Cv, b.work->Cv_r);
  b.work->X.setZero();
  addSmallProduct(b.work->Cq_r, b.at.basis().N, b.work->X);
  addSmallProduct(b.work->Cv_r, b.work->Z, b.work->X);
  applyPlus(b.at, b.work->X, b.work->dy);
  b.work->X.setZero();
  addSmallProduct(b.work->Cv_r, b.at.basis().N, b.work->X);
  applyPlus(b.at, b.work->X, b.work->dv);
}

// Loop forces, and the wrenches of loops and contacts on the bodies.
void ReducedNode::updateForces() {
  force_ = ws_.b - tau_;
  force_.noalias() += ws_.M * a_;
  force_.noalias() -= Jc_.transpose() * lambda_c_;
  const ConstraintSet& set = spec_.constraints;
  for (Block& b : blocks_) {
    gatherVelocity(b.loop, force_, b.work->d);
    b.work->independent.noalias() = b.at.basis().JW * b.work->d;
    b.at.solveGram(b.work->independent);
    updateForceDerivative(b, b.at, b.work->independent);
  }
  for (Vector6d& f : f_ext_) f.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const Closure& contact = set.closures[c];
    f_ext_[contact.body1] += calcClosureWrench(ws_, contact, lambda_.segment(set.offsets[c], getRows(contact.kind)));
  }
}

// H = d(J^T f)/dq at a point of the block, for forces f on its independent rows.
void ReducedNode::updateForceDerivative(Block& b, const BlockPoint& point, const VectorXd& force) {
  expandIndependent(point.basis(), force, b.work->rows);
  b.work->H.setZero();
  const ConstraintSet& set = b.loop.closures;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const Closure& closure = set.closures[c];
    const Vector6d W =
        calcClosureWrench(point.workspace(), closure, b.work->rows.segment(set.offsets[c], getRows(closure.kind)));
    addGeneralizedForceDerivative(b.loop.model, point.workspace(), closure, W, b.work->H);
  }
}

// Eqs. (c), (d) and the derivatives of y' and lambda_c.
void ReducedNode::linearizeDynamics() {
  const int nr = reduction_.size;
  updateAccelerations(model_, ws_, a_);
  for (Block& b : blocks_) updateBlockDerivatives(b);
  updateForces();
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const Block& b = blocks_[i];
    work_->lifts[i] = {&b.at.basis().N, &b.work->Z, &b.work->dy, &b.work->dv, &b.work->H};
  }
  work_->derivatives.update(ws_, f_ext_, work_->lifts, work_->dydd.leftCols(nr), work_->dydd.middleCols(nr, nr));
  const ConstraintSet& set = spec_.constraints;
  work_->dydd.rightCols(model_.nu()).setZero();
  addMotorColumns(work_->dydd.rightCols(model_.nu()));
  dlambda_.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const int row = set.offsets[c] - loop_rows_, n = getRows(set.closures[c].kind);
    calcClosureDerivatives(ws_, set.closures[c], Cc_q_.middleRows(row, n), Cc_v_.middleRows(row, n));
  }
  addColumns(Cc_q_, &BlockBasisN, dlambda_.leftCols(nr));
  addColumns(Cc_v_, &BlockZ, dlambda_.leftCols(nr));
  addColumns(Jc_, &BlockDy, dlambda_.leftCols(nr));
  addColumns(Cc_v_, &BlockBasisN, dlambda_.middleCols(nr, nr));
  addColumns(Jc_, &BlockDv, dlambda_.middleCols(nr, nr));
  saddle_point_.updateInverse();
  saddle_point_.solveDerivatives(work_->dydd, dlambda_);
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
        if (b.loop.dofs[k] == dof) out.col(m).segment(b.loop.offset, b.loop.size) -= b.at.basis().N.row(k).transpose();
  }
}

bool ReducedNode::linearizeStep(ConstVectorRef x_next_node, StageModel& out) {
  takeWork();
  linearizeDynamics();
  for (Block& b : blocks_)
    if (!linearizeBlock(b, x_next_node, out)) return false;
  differenceFree(x_next_node, x_next_, out.gap);
  for (FreeJoint& free : free_joints_) linearizeFreeJoint(free, out);
  assembleStep(out);
  storeChart();
  return true;
}

// Eqs. (e) to (g) for one block, rows [offset, offset + size) of Fx, Fu and gap.
bool ReducedNode::linearizeBlock(Block& b, ConstVectorRef x_next_node, StageModel& out) {
  const LoopBlock& loop = b.loop;
  const int nr = reduction_.size, r = loop.size, o = loop.offset;
  const double h = spec_.dt;
  const BlockBasis &base = b.at.basis(), &next = b.next.basis();
  const MatrixXd &N = base.N, &Nn = next.N, &WNn = next.WN;

  b.work->zeta = b.next.zeta() / h;  // close() moves by h w', so its zeta is h times that of Eq. (3)
  updateForceDerivative(b, b.at, b.work->zeta);
  b.work->HN.setZero();
  addSmallProduct(b.work->H, N, b.work->HN);
  b.work->WHN = b.loop.metric.cwiseInverse().asDiagonal() * b.work->HN;
  updateForceDerivative(b, b.next, b.mu);
  b.work->HnNn.setZero();
  addSmallProduct(b.work->H, Nn, b.work->HnNn);

  // J_q and J_d are the identity but for the blocks of curved joints. EN: e = EN dy + h J_d dw.
  b.work->EN = N - h * b.work->WHN;
  b.work->G = base.JW;  // J W^{-1} J_d^T
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const JointVector d = b.next.step().segment(i, n);
    JointMatrix Jq(n, n), Jd(n, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    b.work->Jd.block(i, i, n, n) = Jd;
    b.work->EN.middleRows(i, n) = Jq.lazyProduct(N.middleRows(i, n)) - h * Jd.lazyProduct(b.work->WHN.middleRows(i, n));
    b.work->G.middleCols(i, n) = base.JW.middleCols(i, n).lazyProduct(Jd.transpose());
  }
  // Y = A^{-T} [J W^{-1} J_d^T W N', J W^{-1} W N'], with A^T = h J W^{-1} J_d^T J'^T
  b.work->At.setZero();
  addSmallProduct(b.work->G, next.J.transpose(), b.work->At, h);
  b.work->Y.setZero();
  addSmallProduct(b.work->G, WNn, b.work->Y.leftCols(r));
  addSmallProduct(base.JW, WNn, b.work->Y.rightCols(r));
  if (!factorizeSmall(b.work->At, b.work->pivots)) {
    failure_ = "closure '" + loop.closures.closures.front().name + "': the step turns its loops too far";
    return false;
  }
  solveFactorized(b.work->At, b.work->pivots, b.work->Y);
  // dy+ = L^T e, and T^T = N'^T J^T A^{-1} J'
  b.work->L = WNn;
  addSmallProductTransposed(next.J, b.work->Y.leftCols(r), b.work->L, -h);
  b.work->T.setZero();
  addSmallProductTransposed(next.J, b.work->Y.rightCols(r), b.work->T);
  // h J_d^T L and beta = N' - h J_d^T T
  b.work->LJ = h * b.work->L;
  b.work->beta = WNn - h * b.work->T;
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const auto Jd = b.work->Jd.block(i, i, n, n);
    b.work->LJ.middleRows(i, n) = h * Jd.transpose().lazyProduct(b.work->L.middleRows(i, n));
    b.work->beta.middleRows(i, n) = WNn.middleRows(i, n) - h * Jd.transpose().lazyProduct(b.work->T.middleRows(i, n));
  }
  // dw = (N + h d_v) dy_v + (Z + h d_y) dy + h N dy'
  b.work->wy = b.work->Z + h * b.work->dy;
  b.work->wv = N + h * b.work->dv;
  MatrixXd &q_y = b.work->q_y, &q_v = b.work->q_v, &q_a = b.work->q_a, &v_y = b.work->v_y, &v_v = b.work->v_v,
           &v_a = b.work->v_a, &S = b.work->S;
  for (MatrixXd* m : {&q_y, &q_v, &q_a, &v_y, &v_v, &v_a, &S}) m->setZero();
  addSmallProductTransposed(Nn, b.work->HnNn, S);
  addSmallProductTransposed(b.work->L, b.work->EN, q_y);
  addSmallProductTransposed(b.work->LJ, b.work->wy, q_y);
  addSmallProductTransposed(b.work->LJ, b.work->wv, q_v);
  addSmallProductTransposed(b.work->LJ, N, q_a, h);
  addSmallProductTransposed(b.work->beta, b.work->wy, v_y);
  addSmallProductTransposed(Nn, b.work->HN, v_y, -1);
  addSmallProductTransposed(b.work->T, b.work->EN, v_y, -1);
  addSmallProductTransposed(b.work->beta, b.work->wv, v_v);
  addSmallProductTransposed(b.work->beta, N, v_a, h);
  addSmallProduct(S, q_y, v_y, -1);
  addSmallProduct(S, q_v, v_v, -1);
  addSmallProduct(S, q_a, v_a, -1);

  // About the node state, where a gap is open.
  gatherConfiguration(model_, loop, x_next_node.head(model_.nq()), b.work->q);
  gatherVelocity(loop, x_next_node.tail(model_.nv()), b.work->d);
  if (b.work->q != next.q || b.work->d != b.v_next) return moveToNodeState(b, out);
  out.gap.segment(o, r).setZero();
  out.gap.segment(nr + o, r).setZero();
  return true;
}

// The gap of a block to the node state (b.work->q, b.work->d), and its derivatives read there.
bool ReducedNode::moveToNodeState(Block& b, StageModel& out) {
  const LoopBlock& loop = b.loop;
  const int nr = reduction_.size, r = loop.size, o = loop.offset;
  if (!b.work->scratch.update(loop, b.work->q)) return fail(b, b.work->scratch);
  const MatrixXd &WN = b.work->scratch.basis().WN, &Nn = b.next.basis().N;
  updateVelocities(loop.model, b.next.workspace(), b.v_next);
  calcVelocityLift(b, b.next, b.work->T);
  loop.model.difference(b.work->q, b.next.basis().q, b.work->a);
  b.work->w = b.v_next - b.work->d;
  b.work->L = Nn;  // becomes J_diff N'
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    JointMatrix Jdiff(n, n);
    calcJointDifferenceJacobian(joint, b.work->a.segment(i, n), Jdiff);
    b.work->L.middleRows(i, n) = Jdiff.lazyProduct(Nn.middleRows(i, n));
  }
  out.gap.segment(o, r).setZero();
  out.gap.segment(nr + o, r).setZero();
  addSmallProductTransposed(WN, b.work->a, out.gap.segment(o, r));
  addSmallProductTransposed(WN, b.work->w, out.gap.segment(nr + o, r));
  for (MatrixXd* P : {&b.work->Pq, &b.work->Pv, &b.work->Pz}) P->setZero();
  addSmallProductTransposed(WN, b.work->L, b.work->Pq);
  addSmallProductTransposed(WN, Nn, b.work->Pv);
  addSmallProductTransposed(WN, b.work->T, b.work->Pz);
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

// The same for a joint outside all loops, where N and J^T vanish from Eqs. (e) to (g).
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
  free.v_a = h * JointMatrix::Identity(n, n);
}

// Fx and Fu out of the derivatives of y' and what each unit makes of them.
void ReducedNode::assembleStep(StageModel& out) const {
  const int nr = reduction_.size;
  const auto state = work_->dydd.leftCols(2 * nr), control = work_->dydd.rightCols(model_.nu());
  for (const FreeJoint& free : free_joints_) {
    assembleUnit(free.q_a, free.v_a, free.offset, state, out.Fx);
    assembleUnit(free.q_a, free.v_a, free.offset, control, out.Fu);
  }
  for (const Block& b : blocks_) {
    assembleUnit(b.work->q_a, b.work->v_a, b.loop.offset, state, out.Fx);
    assembleUnit(b.work->q_a, b.work->v_a, b.loop.offset, control, out.Fu);
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
  takeWork();
  for (Block& b : blocks_) calcVelocityLift(b, b.at, b.work->Z);
  storeChart();
}

}  // namespace bielle
