// Derivatives of the reduced step: Eqs. (b) and (g) of reduced_node.h, from what reduced_lanes.h has prepared.
#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "reduced_node.h"

namespace bielle {

void ReducedNode::prepareLinearization(const Linearization* items, int count) {
  takeWork();
  work_->lanes.linearize(items, count);
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
    const auto& [cluster, row] = work_->motors[m];
    if (cluster < 0) {
      out(m, row) -= 1;
    } else {
      const ReducedCluster& loop = clusters_[cluster].loop;
      out.row(m).segment(loop.offset, loop.size) -= clusters_[cluster].at.N.row(row);
    }
  }
}

bool ReducedNode::linearizeStep(ConstVectorRef x_next_node, StageModel& out) {
  takeWork();
  LaneView& view = work_->lanes.getView(work_->lanes.findLane(this));
  showView(view);
  linearizeDynamics(view);
  for (size_t i = 0; i < clusters_.size(); ++i)
    if (!linearizeCluster(i, view.clusters[i], x_next_node, out)) return false;
  differenceFree(x_next_node, x_next_, out.gap);
  for (FreeJoint& free : work_->free_joints)
    if (free.curved) linearizeFreeJoint(free, out);
  assembleStep(view, out);
  storeChart();
  return true;
}

// What costs need of a cluster, and its gap.
bool ReducedNode::linearizeCluster(size_t i, LaneView::Cluster& view, ConstVectorRef x_next_node, StageModel& out) {
  Cluster& b = clusters_[i];
  b.work->motion.basis = &b.at;
  b.work->motion.Z.swap(view.Z);
  if (!view.turned) {
    failure_ = "closure '" + b.loop.closures.closures.front().name + "': the step turns its loops too far";
    return false;
  }
  if (!view.placed) {
    gatherConfiguration(model_, b.loop, x_next_node.head(model_.nq()), b.work->q);
    b.work->point.update(b.loop, b.work->scratch, b.work->q);
    return fail(b, b.work->point);
  }
  out.gap.segment(b.loop.offset, b.loop.size) = view.gap;
  out.gap.segment(reduction_.size + b.loop.offset, b.loop.size) = view.gap_v;
  return true;
}

// Eq. (g) for a curved joint outside all loops, where N and J^T vanish.
void ReducedNode::linearizeFreeJoint(FreeJoint& free, const StageModel& out) const {
  const Joint& joint = model_.joints()[free.joint];
  const int n = joint.nv;
  const double h = spec_.dt;
  JointMatrix Jq(n, n), Jd(n, n), Jdiff(n, n);
  const JointVector d = h * x_next_.segment(model_.nq() + joint.idx_v, n), gap = out.gap.segment(free.offset, n);
  calcJointIntegrateJacobians(joint, d, Jq, Jd);
  free.q_y = Jq;
  free.q_v = h * Jd;
  if (gap.isZero(0)) return;
  calcJointDifferenceJacobian(joint, gap, Jdiff);
  free.q_y = Jdiff.lazyProduct(Jq);
  free.q_v = h * Jdiff.lazyProduct(Jd);
}

// Columns of F^T, from those of dv = dy_v + h dy' and what each reduced joint makes of dv and dy.
void ReducedNode::assembleStep(LaneView& view, StageModel& out) const {
  const Eigen::Index nr = reduction_.size, nu = model_.nu();
  const double h = spec_.dt;
  PaddedMap Ft = out.Ft(), dv = shapeAccelerationDerivatives(view);
  dv *= h;
  dv.bottomRows(nr).diagonal().array() += 1;
  const auto multiply = [&](const auto& derivative, Eigen::Index from, Eigen::Index to) {
    const Eigen::Index n = derivative.rows();
    setProduct(dv.rows(), n, n, pad(dv, 0, from), {derivative.data(), derivative.outerStride(), 1}, pad(Ft, 0, to));
  };
  const auto add = [&](const auto& derivative, Eigen::Index from, Eigen::Index to) {
    const Eigen::Index n = derivative.rows();
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index k = 0; k < n; ++k) Ft(nu + from + k, to + i) += derivative(i, k);
  };
  for (const FreeJoint& free : work_->free_joints) {
    const Eigen::Index o = free.offset, n = free.size;
    Ft.middleCols(nr + o, n) = dv.middleCols(o, n);
    if (free.curved) {
      multiply(free.q_v, o, o);
      add(free.q_y, o, o);
    } else {
      Ft.middleCols(o, n) = h * dv.middleCols(o, n);
      Ft.block(nu + o, o, n, n).diagonal().array() += 1;
    }
  }
  for (size_t i = 0; i < clusters_.size(); ++i) {
    const LaneView::Cluster& b = view.clusters[i];
    const Eigen::Index o = clusters_[i].loop.offset;
    multiply(b.q_v, o, o);
    multiply(b.v_v, o, nr + o);
    add(b.q_y, o, o);
    add(b.v_y, o, nr + o);
  }
}

void ReducedNode::linearizeState() {
  restore();
  state_model_ = nullptr;
  updateCompositeInertias(model_, work_->ws);
  for (Cluster& b : clusters_) {
    const auto view = getPlacedView(b.loop, work_->ws);
    updateTwists(view, b.at, b.work->motion);
    updateVelocityLift(view, b.work->motion);
  }
  storeChart();
}

}  // namespace bielle
