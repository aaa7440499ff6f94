#include "ocp/reduced/node_assembly.h"

#include <algorithm>

#include "model/joint.h"

namespace bielle {

NodeAssembly::NodeAssembly(const Model& model, const Reduction& reduction, const ReducedLayout& layout,
                           const NodeSizes& sizes)
    : model_(model), reduction_(reduction), layout_(layout) {
  const int nv = model.nv(), nr = reduction.size, nu = model.nu();
  for (size_t i = 0; i < reduction.free_joints.size(); ++i) {
    const Joint& joint = model.joints()[reduction.free_joints[i]];
    free_joints_.push_back({&joint, reduction.free_offsets[i], joint.nv, isCurved(joint), {}, {}, {}, {}});
  }
  for (const bielle::Motor& motor : model.motors()) {
    for (const FreeJoint& free : free_joints_)
      if (free.joint == &model.joints()[motor.joint])
        motors_.push_back({-1, free.offset + motor.dof - free.joint->idx_v});
    for (size_t i = 0; i < reduction.clusters.size(); ++i) {
      const std::vector<int>& dofs = reduction.clusters[i].dofs;
      const auto dof = std::find(dofs.begin(), dofs.end(), motor.dof);
      if (dof != dofs.end()) motors_.push_back({static_cast<int>(i), static_cast<int>(dof - dofs.begin())});
    }
  }
  const Eigen::Index rows = roundUpToLane(sizes.rows), padded = roundUpToLane(2 * nr + nu + 1);
  for (MatrixXd* m : {&jacobians_.q, &jacobians_.v}) m->setZero(rows, nv);
  jacobians_.lambda.setZero(rows, layout.most_constraint_rows);
  for (MatrixXd* m : {&jacobians_.u, &jacobians_.speeds}) m->setZero(rows, nu);
  jacobians_.s.setZero(rows);
  counted_.reserve(sizes.blocks, sizes.rows);
  for (VectorXd* x : {&Rt_, &Rt_scaled_}) x->setZero(padded * sizes.rows);
  for (VectorXd* x : {&gradient_, &no_squares_}) x->setZero(2 * nr + nu + 1);
  for (VectorXd* x : {&y_, &y_s_, &y_v_s_}) x->setZero(nr);
  velocity_.setZero(nv);
  dlambda_.setZero(padded * layout.most_contact_rows);
  dspeeds_.setZero(padded * nu);
  by_velocity_.setZero(nr * std::max(nr, layout.most_contact_rows));
  int largest = 0;
  for (const ReducedCluster& cluster : reduction.clusters) largest = std::max(largest, cluster.size);
  column_.setZero(2 * largest);
  constexpr int kMost = 6;  // dofs of a joint
  turn_.setZero(roundUpToLane(2 * kMost) * kMost);
  turned_.setZero(roundUpToLane(2 * kMost) * std::max({nr, nu, layout.most_contact_rows}));
}

namespace {

bool isMidpoint(const StageSpec& spec) { return spec.step == StepRule::Midpoint; }

}  // namespace

// The columns of dw = dy_v + h dy' from the dynamics, then the effect of dw and dy on the step. Of a midpoint step both
// are those of the point half way, to which the first drift leads from the state.
void NodeAssembly::setStep(const StageSpec& spec, const ContactLayout& contacts, const ReducedEvaluation& at,
                           const ReducedEvaluation& next, LaneView& view, StageModel& out) {
  const int nr = reduction_.size, leading = at.leading;
  const double h = at.dt, drift = isMidpoint(spec) ? 0.5 * h : h;
  PaddedMap dydd = shapePadded(view.acceleration.dydd, leading + 2 * nr, nr);
  PaddedMap dlambda = shapePadded(dlambda_, leading + 2 * nr, contacts.rows);
  dydd.topRows(leading).setZero();
  addMotorRows(at, dydd);
  dlambda.setZero();
  if (isMidpoint(spec)) {
    addForeseenVelocity(h, contacts, at, view);
    updateFirstDrift(drift, at);
    if (isFree(at)) updateFirstDriftScale(drift, at, view);
    for (PaddedMap rows : {dydd, dlambda}) addFirstDrift(drift, at, view, rows);
    addContactDerivatives(at.leading, contacts, view.stabilizations, dlambda);
  } else {
    addContactDerivatives(at.leading, contacts, view.acceleration.contacts, dlambda);
  }
  clearPadding(dlambda);
  solveDerivatives(at.factors, dydd, dlambda, room_);
  auto gap = out.gap.tail(2 * nr);
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const ReducedCluster& cluster = reduction_.clusters[i];
    gap.segment(cluster.offset, cluster.size) = view.clusters[i].gap;
    gap.segment(nr + cluster.offset, cluster.size) = view.clusters[i].gap_v;
  }
  calcFreeGaps(at, next, gap);
  for (FreeJoint& free : free_joints_)
    if (free.curved) updateFreeJoint(drift, at, gap, free);
  dydd *= h;
  addVelocity(isMidpoint(spec), at, view, dydd);
  if (isFree(at)) addKickScale(spec, at, dydd);
  MatrixMap all = out.Ft();
  const Eigen::Index first = all.cols() - 2 * nr;  // after a time scale
  MatrixMap Ft(&all(0, first), all.rows(), 2 * nr, Eigen::OuterStride<>(all.outerStride()));
  setTransition(drift, isMidpoint(spec), at, view, dydd, Ft);
  if (isFree(at)) subtractVelocity(at, next, Ft);
}

// Right-hand sides of the acceleration half way: its velocity is that of reduced_kernel.h Eq. (h).
void NodeAssembly::addForeseenVelocity(double h, const ContactLayout& contacts, const ReducedEvaluation& at,
                                       LaneView& view) {
  const Eigen::Index nr = reduction_.size, leading = at.leading, columns = leading + 2 * nr;
  PaddedMap foreseen = shapePadded(view.foreseen.dydd, columns, nr),
            dydd = shapePadded(view.acceleration.dydd, columns, nr);
  PaddedMap dlambda = shapePadded(dlambda_, columns, contacts.rows);
  foreseen.topRows(leading).setZero();
  addMotorRows(at, foreseen);
  addContactDerivatives(at.leading, contacts, view.foreseen.contacts, dlambda);
  clearPadding(dlambda);
  solveDerivatives(at.factors, foreseen, dlambda, room_);
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const Eigen::Index o = reduction_.clusters[i].offset, r = reduction_.clusters[i].size;
    foreseen.block(leading + o, o, r, r) += view.clusters[i].T.transpose();
  }
  foreseen *= 0.5 * h;
  if (isFree(at)) addForeseenScale(at, foreseen);
  clearPadding(foreseen);
  dlambda.setZero();
  addContactDerivatives(at.leading, contacts, view.acceleration.contacts, dlambda);
  clearPadding(dlambda);
  // By the velocity: the last rows, whose own values the products must not change before they are read.
  const auto add = [&](PaddedMap out) {
    Eigen::Map<MatrixXd> by_velocity(by_velocity_.data(), nr, out.cols());
    by_velocity = out.bottomRows(nr);
    addProduct(columns, out.cols(), nr, 1, pad(foreseen), {by_velocity.data(), 1, nr}, pad(out));
  };
  add(dydd);
  if (contacts.rows > 0) add(dlambda);
}

// The first drift of joints outside all clusters.
void NodeAssembly::updateFirstDrift(double h, const ReducedEvaluation& at) {
  for (FreeJoint& free : free_joints_) {
    if (!free.curved) continue;
    const int n = free.size;
    const JointVector d = h * at.x.segment(model_.nq() + free.joint->idx_v, n);
    free.first_q_y.resize(n, n);
    free.first_q_v.resize(n, n);
    calcJointIntegrateJacobians(*free.joint, d, free.first_q_y, free.first_q_v);
    free.first_q_v *= h;
  }
}

// Of v^ = N (y_v + h/2 y'_0): what is foreseen, the velocity itself, and the turn of N; then the first drift.
void NodeAssembly::setSpeeds(const ReducedEvaluation& at, const LaneView& view) {
  const int nr = reduction_.size, leading = at.leading, columns = leading + 2 * nr;
  PaddedMap dspeeds = shapePadded(dspeeds_, columns, model_.nu());
  const ConstMatrixMap foreseen(view.foreseen.dydd.data(), columns, nr, Eigen::OuterStride<>(roundUpToLane(columns)));
  dspeeds.setZero();
  for (size_t m = 0; m < motors_.size(); ++m) {
    const auto& [index, row] = motors_[m];
    auto column = dspeeds.col(static_cast<Eigen::Index>(m));
    if (index < 0) {
      column = foreseen.col(row);
      column[leading + nr + row] += 1;
      continue;
    }
    const ReducedCluster& cluster = reduction_.clusters[index];
    const auto N = at.midpoint->clusters[index].basis.N.row(row);
    for (int c = 0; c < cluster.size; ++c) {
      column += N[c] * foreseen.col(cluster.offset + c);
      column[leading + cluster.offset + c] += view.clusters[index].Z_mid(row, c);
      column[leading + nr + cluster.offset + c] += N[c];
    }
  }
  addFirstDrift(at.dt / 2, at, view, dspeeds);
}

// Rows by (dy, dy_v) half way become rows by those of the state: reduced_kernel.h Eq. (g) with k = 0, transposed.
void NodeAssembly::addFirstDrift(double h, const ReducedEvaluation& at, const LaneView& view, PaddedMap rows) {
  const int nr = reduction_.size, leading = at.leading;
  if (isFree(at))
    for (int k = 0; k < nr; ++k)
      rows.row(leading - 1) += y_s_[k] * rows.row(leading + k) + y_v_s_[k] * rows.row(leading + nr + k);
  for (const FreeJoint& free : free_joints_) {
    const Eigen::Index n = free.size, o = leading + free.offset;
    if (!free.curved) {
      rows.middleRows(nr + o, n) += h * rows.middleRows(o, n);
      continue;
    }
    // Its velocity does not change, v_y = 0 and v_v = 1.
    PaddedMap turn = shapePadded(turn_, 2 * n, n), turned = shapePadded(turned_, 2 * n, rows.cols());
    turn.topRows(n) = free.first_q_y.transpose();
    turn.bottomRows(n) = free.first_q_v.transpose();
    clearPadding(turn);
    setProduct(2 * n, rows.cols(), n, pad(turn), {rows.data() + o, 1, rows.outerStride()}, pad(turned));
    rows.middleRows(o, n) = turned.topRows(n);
    rows.middleRows(nr + o, n) += turned.bottomRows(n);
  }
  // (q_y^T q + v_y^T v, q_v^T q + v_v^T v) of the rows q and v of a cluster, by columns.
  const auto turn = [&](auto fixed, const LaneView::Drift& drift, Eigen::Index offset) {
    constexpr int n = fixed;
    using Derivative = Eigen::Map<const Eigen::Matrix<double, n, n>>;
    const Eigen::Index r = drift.q_y.rows();
    const Derivative q_y(drift.q_y.data(), r, r), q_v(drift.q_v.data(), r, r), v_y(drift.v_y.data(), r, r),
        v_v(drift.v_v.data(), r, r);
    for (Eigen::Index c = 0; c < rows.cols(); ++c) {
      auto q = rows.col(c).template segment<n>(leading + offset, r),
           v = rows.col(c).template segment<n>(leading + nr + offset, r);
      auto before_q = column_.segment<n>(0, r), before_v = column_.segment<n>(r, r);
      before_q = q;
      before_v = v;
      q = q_y.transpose().lazyProduct(before_q) + v_y.transpose().lazyProduct(before_v);
      v = q_v.transpose().lazyProduct(before_q) + v_v.transpose().lazyProduct(before_v);
    }
  };
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const ReducedCluster& cluster = reduction_.clusters[i];
    const LaneView::Drift& drift = view.clusters[i].first;
    if (cluster.size == 1)
      turn(std::integral_constant<int, 1>(), drift, cluster.offset);
    else if (cluster.size == 2)
      turn(std::integral_constant<int, 2>(), drift, cluster.offset);
    else
      turn(std::integral_constant<int, Eigen::Dynamic>(), drift, cluster.offset);
  }
}

// dw += dy_v, of a midpoint step after its first drift.
void NodeAssembly::addVelocity(bool midpoint, const ReducedEvaluation& at, const LaneView& view, PaddedMap dw) const {
  const int nr = reduction_.size, leading = at.leading;
  if (!midpoint) {
    dw.bottomRows(nr).diagonal().array() += 1;
    return;
  }
  if (isFree(at)) dw.row(leading - 1) += y_v_s_.transpose();
  for (const FreeJoint& free : free_joints_)
    dw.block(leading + nr + free.offset, free.offset, free.size, free.size).diagonal().array() += 1;
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const LaneView::Drift& first = view.clusters[i].first;
    const Eigen::Index o = reduction_.clusters[i].offset, r = reduction_.clusters[i].size;
    dw.block(leading + o, o, r, r) += first.v_y.transpose();
    dw.block(leading + nr + o, o, r, r) += first.v_v.transpose();
  }
}

// The first nu rows of dydd (x size) -= (N^T B)^T
void NodeAssembly::addMotorRows(const ReducedEvaluation& at, PaddedMap dydd) const {
  for (size_t m = 0; m < motors_.size(); ++m) {
    const auto& [index, row] = motors_[m];
    if (index < 0) {
      dydd(m, row) -= 1;
    } else {
      const ReducedCluster& cluster = reduction_.clusters[index];
      const ClusterBasis& basis = at.q_mid.size() > 0 ? at.midpoint->clusters[index].basis : at.clusters[index].at;
      dydd.row(m).segment(cluster.offset, cluster.size) -= basis.N.row(row);
    }
  }
}

// Adds right-hand sides of the contact rows; `derivatives` are those of the slots.
void NodeAssembly::addContactDerivatives(int leading, const ContactLayout& contacts,
                                         const std::vector<LaneView::Contact>& derivatives, PaddedMap dlambda) const {
  const int nr = reduction_.size;
  for (const ContactLayout::Contact& contact : contacts.contacts) {
    const LaneView::Contact& columns = derivatives[contact.slot];
    const std::vector<int>& outer = layout_.outers[layout_.slots[contact.slot]];
    for (size_t o = 0; o < outer.size(); ++o) {
      const auto add = [&](int row, const Matrix6Xd& from) {
        dlambda.row(row).segment(contact.row, contact.rows) += from.col(o).head(contact.rows).transpose();
      };
      add(leading + outer[o], columns.dy);
      add(leading + nr + outer[o], columns.dv);
    }
  }
}

void NodeAssembly::calcFreeGaps(const ReducedEvaluation& at, const ReducedEvaluation& next, VectorRef gap) const {
  const int nq = model_.nq(), nr = reduction_.size;
  for (const FreeJoint& free : free_joints_) {
    const Joint& joint = *free.joint;
    const int k = nq + joint.idx_v;
    calcJointDifference(joint, next.x.segment(joint.idx_q, joint.nq), at.x_next.segment(joint.idx_q, joint.nq),
                        gap.segment(free.offset, free.size));
    gap.segment(nr + free.offset, free.size) = at.x_next.segment(k, free.size) - next.x.segment(k, free.size);
  }
}

// reduced_kernel.h Eq. (g) for a curved joint outside all clusters, where N = 1 and J^T vanishes.
void NodeAssembly::updateFreeJoint(double h, const ReducedEvaluation& at, ConstVectorRef gap, FreeJoint& free) const {
  const Joint& joint = *free.joint;
  const int n = free.size;
  JointMatrix Jq(n, n), Jd(n, n), Jdiff(n, n);
  const JointVector d = h * at.x_next.segment(model_.nq() + joint.idx_v, n), open = gap.segment(free.offset, n);
  calcJointIntegrateJacobians(joint, d, Jq, Jd);
  free.q_y = Jq;
  free.q_v = h * Jd;
  if (open.isZero(0)) return;
  calcJointDifferenceJacobian(joint, open, Jdiff);
  free.q_y = Jdiff.lazyProduct(Jq);
  free.q_v = h * Jdiff.lazyProduct(Jd);
}

// Columns of F^T, from those of dv and the derivatives of each reduced joint with respect to dv and dy. Those by dy of
// a midpoint step belong to the point half way, dy = q_y1 dy + q_v1 dy_v of the state.
void NodeAssembly::setTransition(double h, bool midpoint, const ReducedEvaluation& at, const LaneView& view,
                                 PaddedMap dv, MatrixMap Ft) const {
  const Eigen::Index nr = reduction_.size, leading = at.leading;
  const bool free_midpoint = midpoint && isFree(at);
  const auto multiply = [&](const auto& derivative, Eigen::Index from, Eigen::Index to) {
    const Eigen::Index n = derivative.rows();
    setProduct(dv.rows(), n, n, pad(dv, 0, from), {derivative.data(), derivative.outerStride(), 1}, pad(Ft, 0, to));
  };
  const auto add = [&](const auto& derivative, const auto& q_y1, const auto& q_v1, Eigen::Index from, Eigen::Index to) {
    const Eigen::Index n = derivative.rows();
    if (midpoint) {
      Ft.block(leading + from, to, n, n) += q_y1.transpose().lazyProduct(derivative.transpose());
      Ft.block(leading + nr + from, to, n, n) += q_v1.transpose().lazyProduct(derivative.transpose());
      if (free_midpoint)
        Ft.row(leading - 1).segment(to, n) += derivative.lazyProduct(y_s_.segment(from, n)).transpose();
    } else {
      Ft.block(leading + from, to, n, n) += derivative.transpose();
    }
  };
  for (const FreeJoint& free : free_joints_) {
    const Eigen::Index o = free.offset, n = free.size;
    Ft.middleCols(nr + o, n) = dv.middleCols(o, n);
    if (free.curved) {
      multiply(free.q_v, o, o);
      add(free.q_y, free.first_q_y, free.first_q_v, o, o);
    } else {
      Ft.middleCols(o, n) = h * dv.middleCols(o, n);
      Ft.block(leading + o, o, n, n).diagonal().array() += 1;
      if (midpoint) Ft.block(leading + nr + o, o, n, n).diagonal().array() += h;
      if (free_midpoint) Ft.row(leading - 1).segment(o, n) += y_s_.segment(o, n).transpose();
    }
  }
  for (size_t i = 0; i < reduction_.clusters.size(); ++i) {
    const LaneView::Drift &c = view.clusters[i].drift, &first = view.clusters[i].first;
    const Eigen::Index o = reduction_.clusters[i].offset;
    multiply(c.q_v, o, o);
    multiply(c.v_v, o, nr + o);
    add(c.q_y, first.q_y, first.q_v, o, o);
    add(c.v_y, first.q_y, first.q_v, o, nr + o);
  }
}

void NodeAssembly::setImpulseDerivatives(ConstMatrixRef by_q, ConstMatrixRef by_v, const ReducedEvaluation& at,
                                         const LaneView& view) {
  const int nr = reduction_.size, nu = model_.nu();
  PaddedMap dlambda = shapePadded(dlambda_, nu + 2 * nr, by_q.rows());
  dlambda.setZero();
  addTimesN(by_q, at, dlambda.middleRows(nu, nr));
  addTimesZ(by_v, view, dlambda.middleRows(nu, nr));
  addTimesN(by_v, at, dlambda.middleRows(nu + nr, nr));
}

}  // namespace bielle
