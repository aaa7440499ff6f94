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
void assembleRows(Size size, const double* __restrict q_a, const double* __restrict v_a, int offset, ConstMatrixRef dydd,
                  MatrixXd& F) {
  for (Eigen::Index c = 0; c < F.cols(); ++c) {
    const double* ydd = dydd.data() + c * dydd.outerStride() + offset;
    double *__restrict q = &F(offset, c), *__restrict v = q + F.rows() / 2;
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
                                  b.K.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  point.selectIndependent(b.K, b.K_r);
  b.X.setZero();
  addSmallProduct(b.K_r, point.basis().N, b.X);
  applyPlus(point, b.X, Z);
}

// d_y and d_v of Eq. (c).
void ReducedNode::updateBlockDerivatives(Block& b) {
  calcVelocityLift(b, b.at, b.Z);
  gatherVelocity(b.loop, a_, b.a);
  updateAccelerations(b.loop.model, b.at.workspace(), b.a);
  const ConstraintSet& set = b.loop.closures;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const int row = set.offsets[c], n = getRows(set.closures[c].kind);
    calcClosureDerivatives(b.at.workspace(), set.closures[c], b.Cq.middleRows(row, n), b.Cv.middleRows(row, n));
  }
  b.at.selectIndependent(b.Cq, b.Cq_r);
  b.at.selectIndependent(b.Cv, b.Cv_r);
  b.X.setZero();
  addSmallProduct(b.Cq_r, b.at.basis().N, b.X);
  addSmallProduct(b.Cv_r, b.Z, b.X);
  applyPlus(b.at, b.X, b.dy);
  b.X.setZero();
  addSmallProduct(b.Cv_r, b.at.basis().N, b.X);
  applyPlus(b.at, b.X, b.dv);
}

// Loop forces, and the wrenches of loops and contacts on the bodies.
void ReducedNode::updateForces() {
  force_ = ws_.b - tau_;
  force_.noalias() += ws_.M * a_;
  force_.noalias() -= Jc_.transpose() * lambda_c_;
  const ConstraintSet& set = spec_.constraints;
  for (Block& b : blocks_) {
    gatherVelocity(b.loop, force_, b.d);
    b.independent.noalias() = b.at.basis().JW * b.d;
    b.at.solveGram(b.independent);
    updateForceDerivative(b, b.at, b.independent);
  }
  for (Vector6d& f : f_ext_) f.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const Closure& contact = set.closures[c];
    f_ext_[contact.body1] += calcClosureWrench(ws_, contact, lambda_.segment(set.offsets[c], getRows(contact.kind)));
  }
}

// H = d(J^T f)/dq at a point of the block, for forces f on its independent rows.
void ReducedNode::updateForceDerivative(Block& b, const BlockPoint& point, const VectorXd& force) {
  expandIndependent(point.basis(), force, b.rows);
  b.H.setZero();
  const ConstraintSet& set = b.loop.closures;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const Closure& closure = set.closures[c];
    const Vector6d W =
        calcClosureWrench(point.workspace(), closure, b.rows.segment(set.offsets[c], getRows(closure.kind)));
    addGeneralizedForceDerivative(b.loop.model, point.workspace(), closure, W, b.H);
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
    lifts_[i] = {&b.at.basis().N, &b.Z, &b.dy, &b.dv, &b.H};
  }
  derivatives_.update(ws_, f_ext_, lifts_, dydd_.leftCols(nr), dydd_.middleCols(nr, nr));
  const ConstraintSet& set = spec_.constraints;
  dydd_.rightCols(model_.nu()).setZero();
  addMotorColumns(dydd_.rightCols(model_.nu()));
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
  saddle_point_.solveDerivatives(dydd_, dlambda_);
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
  const int nr = reduction_.size, nu = model_.nu(), r = loop.size, o = loop.offset;
  const double h = spec_.dt;
  const BlockBasis &base = b.at.basis(), &next = b.next.basis();
  const MatrixXd &N = base.N, &Nn = next.N, &WNn = next.WN;

  b.zeta = b.next.zeta() / h;  // close() moves by h w', so its zeta is h times that of Eq. (3)
  updateForceDerivative(b, b.at, b.zeta);
  b.HN.setZero();
  addSmallProduct(b.H, N, b.HN);
  b.WHN = b.loop.metric.cwiseInverse().asDiagonal() * b.HN;
  updateForceDerivative(b, b.next, b.mu);
  b.HnNn.setZero();
  addSmallProduct(b.H, Nn, b.HnNn);

  // J_q and J_d are the identity but for the blocks of curved joints. EN: e = EN dy + h J_d dw.
  b.EN = N - h * b.WHN;
  b.G = base.JW;  // J W^{-1} J_d^T
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const JointVector d = b.next.step().segment(i, n);
    JointMatrix Jq(n, n), Jd(n, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    b.Jd.block(i, i, n, n) = Jd;
    b.EN.middleRows(i, n) = Jq.lazyProduct(N.middleRows(i, n)) - h * Jd.lazyProduct(b.WHN.middleRows(i, n));
    b.G.middleCols(i, n) = base.JW.middleCols(i, n).lazyProduct(Jd.transpose());
  }
  // Y = A^{-T} [J W^{-1} J_d^T W N', J W^{-1} W N'], with A^T = h J W^{-1} J_d^T J'^T
  b.At.setZero();
  addSmallProduct(b.G, next.J.transpose(), b.At, h);
  b.Y.setZero();
  addSmallProduct(b.G, WNn, b.Y.leftCols(r));
  addSmallProduct(base.JW, WNn, b.Y.rightCols(r));
  if (!factorizeSmall(b.At, b.pivots)) {
    failure_ = "closure '" + loop.closures.closures.front().name + "': the step turns its loops too far";
    return false;
  }
  solveFactorized(b.At, b.pivots, b.Y);
  // dy+ = L^T e, and T^T = N'^T J^T A^{-1} J'
  b.L = WNn;
  addSmallProductTransposed(next.J, b.Y.leftCols(r), b.L, -h);
  b.T.setZero();
  addSmallProductTransposed(next.J, b.Y.rightCols(r), b.T);
  // h J_d^T L and beta = N' - h J_d^T T
  b.LJ = h * b.L;
  b.beta = WNn - h * b.T;
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const auto Jd = b.Jd.block(i, i, n, n);
    b.LJ.middleRows(i, n) = h * Jd.transpose().lazyProduct(b.L.middleRows(i, n));
    b.beta.middleRows(i, n) = WNn.middleRows(i, n) - h * Jd.transpose().lazyProduct(b.T.middleRows(i, n));
  }
  // dw = (N + h d_v) dy_v + (Z + h d_y) dy + h N dy'
  b.wy = b.Z + h * b.dy;
  b.wv = N + h * b.dv;
  MatrixXd &q_y = b.q_y, &q_v = b.q_v, &q_a = b.q_a, &v_y = b.v_y, &v_v = b.v_v, &v_a = b.v_a, &S = b.S;
  for (MatrixXd* m : {&q_y, &q_v, &q_a, &v_y, &v_v, &v_a, &S}) m->setZero();
  addSmallProductTransposed(Nn, b.HnNn, S);
  addSmallProductTransposed(b.L, b.EN, q_y);
  addSmallProductTransposed(b.LJ, b.wy, q_y);
  addSmallProductTransposed(b.LJ, b.wv, q_v);
  addSmallProductTransposed(b.LJ, N, q_a, h);
  addSmallProductTransposed(b.beta, b.wy, v_y);
  addSmallProductTransposed(Nn, b.HN, v_y, -1);
  addSmallProductTransposed(b.T, b.EN, v_y, -1);
  addSmallProductTransposed(b.beta, b.wv, v_v);
  addSmallProductTransposed(b.beta, N, v_a, h);
  addSmallProduct(S, q_y, v_y, -1);
  addSmallProduct(S, q_v, v_v, -1);
  addSmallProduct(S, q_a, v_a, -1);

  // About the node state, where a gap is open.
  gatherConfiguration(model_, loop, x_next_node.head(model_.nq()), b.q);
  gatherVelocity(loop, x_next_node.tail(model_.nv()), b.d);
  if (b.q != next.q || b.d != b.v_next) return moveToNodeState(b, out);
  out.gap.segment(o, r).setZero();
  out.gap.segment(nr + o, r).setZero();
  return true;
}

// The gap of a block to the node state (b.q, b.d), and its derivatives read there.
bool ReducedNode::moveToNodeState(Block& b, StageModel& out) {
  const LoopBlock& loop = b.loop;
  const int nr = reduction_.size, r = loop.size, o = loop.offset;
  if (!b.scratch.update(loop, b.q)) return fail(b, b.scratch);
  const MatrixXd &WN = b.scratch.basis().WN, &Nn = b.next.basis().N;
  updateVelocities(loop.model, b.next.workspace(), b.v_next);
  calcVelocityLift(b, b.next, b.T);
  loop.model.difference(b.q, b.next.basis().q, b.a);
  b.w = b.v_next - b.d;
  b.L = Nn;  // becomes J_diff N'
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    JointMatrix Jdiff(n, n);
    calcJointDifferenceJacobian(joint, b.a.segment(i, n), Jdiff);
    b.L.middleRows(i, n) = Jdiff.lazyProduct(Nn.middleRows(i, n));
  }
  out.gap.segment(o, r).setZero();
  out.gap.segment(nr + o, r).setZero();
  addSmallProductTransposed(WN, b.a, out.gap.segment(o, r));
  addSmallProductTransposed(WN, b.w, out.gap.segment(nr + o, r));
  for (MatrixXd* P : {&b.Pq, &b.Pv, &b.Pz}) P->setZero();
  addSmallProductTransposed(WN, b.L, b.Pq);
  addSmallProductTransposed(WN, Nn, b.Pv);
  addSmallProductTransposed(WN, b.T, b.Pz);
  const std::pair<MatrixXd*, MatrixXd*> derivatives[] = {{&b.q_y, &b.v_y}, {&b.q_v, &b.v_v}, {&b.q_a, &b.v_a}};
  for (const auto& [dq, dv] : derivatives) {
    b.S.setZero();
    addSmallProduct(b.Pv, *dv, b.S);
    addSmallProduct(b.Pz, *dq, b.S);
    dv->swap(b.S);
    b.S.setZero();
    addSmallProduct(b.Pq, *dq, b.S);
    dq->swap(b.S);
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
  const auto state = dydd_.leftCols(2 * nr), control = dydd_.rightCols(model_.nu());
  for (const FreeJoint& free : free_joints_) {
    assembleUnit(free.q_a, free.v_a, free.offset, state, out.Fx);
    assembleUnit(free.q_a, free.v_a, free.offset, control, out.Fu);
  }
  for (const Block& b : blocks_) {
    assembleUnit(b.q_a, b.v_a, b.loop.offset, state, out.Fx);
    assembleUnit(b.q_a, b.v_a, b.loop.offset, control, out.Fu);
  }
  for (const FreeJoint& free : free_joints_) {
    const int n = static_cast<int>(free.q_v.rows()), o = free.offset;
    out.Fx.block(o, o, n, n) += free.q_y;
    out.Fx.block(o, nr + o, n, n) += free.q_v;
    out.Fx.block(nr + o, nr + o, n, n).diagonal().array() += 1;
  }
  for (const Block& b : blocks_) {
    const int o = b.loop.offset, r = b.loop.size;
    out.Fx.block(o, o, r, r) += b.q_y;
    out.Fx.block(o, nr + o, r, r) += b.q_v;
    out.Fx.block(nr + o, o, r, r) += b.v_y;
    out.Fx.block(nr + o, nr + o, r, r) += b.v_v;
  }
}

void ReducedNode::linearizeState() {
  for (Block& b : blocks_) calcVelocityLift(b, b.at, b.Z);
  storeChart();
}

}  // namespace bielle
