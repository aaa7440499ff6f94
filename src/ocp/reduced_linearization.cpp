// Derivatives of the reduced step: Eqs. (b) and (g) of reduced_node.h, from what reduced_lanes.h has prepared.
#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "reduced_node.h"

namespace bielle {
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
  return shapePadded(work_->dlambda, model_.nu() + 2 * reduction_.size, contact_rows_);
}

// Derivatives of y' by (u, dy, dy_v), one column per coordinate; before linearizeDynamics() the right-hand sides.
PaddedMap ReducedNode::shapeAccelerationDerivatives(LaneView& view) const {
  return shapePadded(view.dydd, model_.nu() + 2 * reduction_.size, reduction_.size);
}

// The right-hand sides of the contact rows.
void ReducedNode::loadContactDerivatives(const LaneView& view) {
  ReducedWork& work = *work_;
  const int nr = reduction_.size, nu = model_.nu();
  const ConstraintSet& set = spec_.constraints;
  PaddedMap dlambda = shapeForceDerivatives();
  dlambda.setZero();
  clearPadding(dlambda);
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const int row = set.offsets[c] - loop_rows_, n = getRows(set.closures[c].kind);
    const int slot = contact_slots_[c - num_loops_];
    const LaneView::Contact& contact = view.contacts[slot];
    const std::vector<int>& outer = work.lanes.getOuter(slot);
    for (size_t o = 0; o < outer.size(); ++o) {
      dlambda.row(nu + outer[o]).segment(row, n) = selectRows<double>(set.closures[c], contact.dy.col(o)).transpose();
      dlambda.row(nu + nr + outer[o]).segment(row, n) =
          selectRows<double>(set.closures[c], contact.dv.col(o)).transpose();
    }
  }
}

// Derivatives of y' and lambda_c.
void ReducedNode::linearizeDynamics(LaneView& view) {
  ReducedWork& work = *work_;
  PaddedMap dydd = shapeAccelerationDerivatives(view);
  dydd.topRows(model_.nu()).setZero();
  addMotorRows(dydd);
  loadContactDerivatives(view);
  work.contacts.at(contact_rows_).saddle_point.solveDerivatives(factors_, dydd, shapeForceDerivatives());
}

// The first nu rows of out (x size) += -(N^T B)^T
void ReducedNode::addMotorRows(PaddedMap out) const {
  for (size_t m = 0; m < work_->motors.size(); ++m) {
    const auto& [block, row] = work_->motors[m];
    if (block < 0) {
      out(m, row) -= 1;
    } else {
      const LoopBlock& loop = blocks_[block].loop;
      out.row(m).segment(loop.offset, loop.size) -= blocks_[block].at.N.row(row);
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
  assembleStep(shapeAccelerationDerivatives(view), out);
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
  work.motion.Z = view.Z;  // for residuals
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

// Columns of F^T, from those of y' and what each unit makes of them: h^2 and h times these for a coordinate of its own.
void ReducedNode::assembleStep(PaddedMap dydd, StageModel& out) const {
  const Eigen::Index nr = reduction_.size, nu = model_.nu(), rows = dydd.rows();
  const double h = spec_.dt;
  PaddedMap Ft = out.Ft();
  const auto add = [&](const auto& derivative, Eigen::Index row, Eigen::Index col) {
    Ft.block(nu + row, col, derivative.cols(), derivative.rows()) += derivative.transpose();
  };
  const auto multiply = [&](const auto& derivative, Eigen::Index from, Eigen::Index to) {
    const Eigen::Index n = derivative.rows();
    setProduct(rows, n, n, pad(dydd, 0, from), {derivative.data(), derivative.outerStride(), 1}, pad(Ft, 0, to));
  };
  for (const FreeJoint& free : work_->free_joints) {
    const Eigen::Index o = free.offset, n = free.q_a.rows();
    if (isCurved(model_.joints()[free.joint]))
      multiply(free.q_a, o, o);
    else
      Ft.middleCols(o, n) = (h * h) * dydd.middleCols(o, n);
    Ft.middleCols(nr + o, n) = h * dydd.middleCols(o, n);
    add(free.q_y, o, o);
    add(free.q_v, nr + o, o);
    Ft.block(nu + nr + o, nr + o, n, n).diagonal().array() += 1;
  }
  for (const Block& b : blocks_) {
    const Eigen::Index o = b.loop.offset;
    multiply(b.work->q_a, o, o);
    multiply(b.work->v_a, o, nr + o);
    add(b.work->q_y, o, o);
    add(b.work->q_v, nr + o, o);
    add(b.work->v_y, o, nr + o);
    add(b.work->v_v, nr + o, nr + o);
  }
}

void ReducedNode::linearizeState() {
  restore();
  state_model_ = nullptr;
  updateCompositeInertias(model_, work_->ws);
  for (Block& b : blocks_) {
    const auto view = getPlacedView(b.loop, work_->ws);
    updateTwists(view, b.at, b.work->motion);
    updateVelocityLift(view, b.work->motion);
  }
  storeChart();
}

}  // namespace bielle
