// Derivatives of the reduced step: Eqs. (b) and (g) of reduced_node.h, from what reduced_lanes.h has prepared.
#include <algorithm>

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

void ReducedNode::prepareLinearization(NodeModel* const* nodes, int count) {
  takeWork();
  work_->lanes.linearize(nodes, count);
}

int ReducedNode::findContact(int slot) const {
  const auto found = std::find(contact_slots_.begin(), contact_slots_.end(), slot);
  return found == contact_slots_.end() ? -1 : num_loops_ + static_cast<int>(found - contact_slots_.begin());
}

bool ReducedNode::hasHinges() const {
  const std::vector<Closure>& closures = spec_.constraints.closures;
  return std::any_of(closures.begin() + num_loops_, closures.end(),
                     [](const Closure& c) { return c.kind == ClosureKind::Hinge5D; });
}

// The contact row of a row of a slot, -1 if this stage has none there.
int ReducedNode::findContactRow(size_t slot, int row) const {
  const int index = findContact(static_cast<int>(slot));
  if (index < 0 || row >= getRows(spec_.constraints.closures[index].kind)) return -1;
  return spec_.constraints.offsets[index] - loop_rows_ + row;
}

PaddedMap ReducedNode::shapeForceDerivatives() const {
  return shapePadded(work_->dlambda, 2 * reduction_.size + model_.nu(), contact_rows_);
}

// The right-hand sides of the contact rows.
void ReducedNode::loadContactDerivatives(const LaneView& view) {
  ReducedWork& work = *work_;
  const int nr = reduction_.size;
  const ConstraintSet& set = spec_.constraints;
  PaddedMap dlambda = shapeForceDerivatives();
  dlambda.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const int row = set.offsets[c] - loop_rows_, n = getRows(set.closures[c].kind);
    const int slot = contact_slots_[c - num_loops_];
    const LaneView::Contact& contact = view.contacts[slot];
    const std::vector<int>& outer = work.lanes.getOuter(slot);
    for (size_t o = 0; o < outer.size(); ++o) {
      dlambda.row(outer[o]).segment(row, n) = selectRows<double>(set.closures[c], contact.dy.col(o)).transpose();
      dlambda.row(nr + outer[o]).segment(row, n) = selectRows<double>(set.closures[c], contact.dv.col(o)).transpose();
    }
  }
}

// Derivatives of y' and lambda_c.
void ReducedNode::linearizeDynamics(LaneView& view) {
  ReducedWork& work = *work_;
  view.dydd.rightCols(model_.nu()).setZero();
  addMotorColumns(view.dydd.rightCols(model_.nu()));
  loadContactDerivatives(view);
  work.contacts.at(contact_rows_).saddle_point.solveDerivatives(factors_, view.dydd, shapeForceDerivatives());
}

// out (size x nu) += -N^T B
void ReducedNode::addMotorColumns(MatrixRef out) const {
  for (size_t m = 0; m < work_->motors.size(); ++m) {
    const auto& [block, row] = work_->motors[m];
    if (block < 0) {
      out(row, m) -= 1;
    } else {
      const LoopBlock& loop = blocks_[block].loop;
      out.col(m).segment(loop.offset, loop.size) -= blocks_[block].at.N.row(row).transpose();
    }
  }
}

bool ReducedNode::linearizeStep(ConstVectorRef x_next_node, StageModel& out) {
  takeWork();
  LaneView& view = work_->lanes.getView(work_->lanes.findLane(this));
  showView(view);
  linearizeDynamics(view);
  for (size_t i = 0; i < blocks_.size(); ++i)
    if (!linearizeBlock(blocks_[i], view.blocks[i], x_next_node, out)) return false;
  differenceFree(x_next_node, x_next_, out.gap);
  for (FreeJoint& free : work_->free_joints) linearizeFreeJoint(free, out);
  assembleStep(view.dydd, out);
  storeChart();
  return true;
}

// Eq. (g) for one block, rows [offset, offset + size) of Fx, Fu and gap.
bool ReducedNode::linearizeBlock(Block& b, LaneView::Block& view, ConstVectorRef x_next_node, StageModel& out) {
  const LoopBlock& loop = b.loop;
  BlockWork& work = *b.work;
  const int nr = reduction_.size, o = loop.offset, r = loop.size;
  const double h = spec_.dt;
  const BlockBasis& next = b.next.basis();
  work.motion.basis = &b.at;
  work.motion.Z = view.Z;  // for costs
  MatrixXd &X = work.X, &Xn = work.Xn;
  const MatrixXd &E = view.E, &S = view.S;
  X.setIdentity();
  if (!factorizeSmall(view.mixed, work.mixed_pivots)) {
    failure_ = "closure '" + loop.closures.closures.front().name + "': the step turns its loops too far";
    return false;
  }
  solveFactorized(view.mixed, work.mixed_pivots, X);
  Xn = view.mixed_next.lazyProduct(X);
  work.q_y = X.lazyProduct(E);
  work.q_v = h * X;
  work.q_a = (h * h) * X;
  work.v_y = (Xn.lazyProduct(E) - view.En) / h - S.lazyProduct(work.q_y);
  work.v_v = Xn - S.lazyProduct(work.q_v);
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
  b.next.load(loop, b.work->scratch);
  updateTwists(getOwnView(loop, b.work->scratch.ws), b.next.basis(), b.work->ahead);
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
    b.work->moved.setZero();
    addSmallProduct(b.work->Pv, *dv, b.work->moved);
    addSmallProduct(b.work->Pz, *dq, b.work->moved);
    dv->swap(b.work->moved);
    b.work->moved.setZero();
    addSmallProduct(b.work->Pq, *dq, b.work->moved);
    dq->swap(b.work->moved);
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
    free.q_y = Jq;
    free.q_v = h * Jd;
    if (!gap.isZero(0)) {
      calcJointDifferenceJacobian(joint, gap, Jdiff);
      free.q_y = Jdiff.lazyProduct(Jq);
      free.q_v = h * Jdiff.lazyProduct(Jd);
    }
  }
  free.q_a = h * free.q_v;
}

// Derivatives of the step by those of y' and what each unit makes of them: h^2 and h times these for a coordinate of its own.
void ReducedNode::assembleColumns(ConstMatrixRef dydd, MatrixXd& F) const {
  const int nr = reduction_.size;
  const double h = spec_.dt;
  for (Eigen::Index c = 0; c < F.cols(); ++c) {
    F.col(c).head(nr) = (h * h) * dydd.col(c);
    F.col(c).tail(nr) = h * dydd.col(c);
  }
  for (const FreeJoint& free : work_->free_joints) {
    if (!isCurved(model_.joints()[free.joint])) continue;
    const int o = free.offset, n = static_cast<int>(free.q_a.rows());
    F.middleRows(o, n).setZero();
    addSmallProduct(free.q_a, dydd.middleRows(o, n), F.middleRows(o, n));
  }
  for (const Block& b : blocks_) assembleBlock(b.work->q_a, b.work->v_a, b.loop.offset, dydd, F);
}

void ReducedNode::assembleStep(const MatrixXd& dydd, StageModel& out) const {
  const int nr = reduction_.size;
  assembleColumns(dydd.leftCols(2 * nr), out.Fx);
  assembleColumns(dydd.rightCols(model_.nu()), out.Fu);
  for (const FreeJoint& free : work_->free_joints) {
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
    const auto view = getPlacedView(b.loop, work_->ws);
    updateTwists(view, b.at, b.work->motion);
    updateVelocityLift(view, b.work->motion);
  }
  storeChart();
}

}  // namespace bielle
