// Derivatives of steps in the lanes of reduced_lanes.h.
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "reduced_node.h"

namespace bielle {
namespace {

// Jacobian of q (+) d with respect to q: node by node but for the one kind that loops are full of.
JointMatrixOf<Lanes> calcIntegrateJacobian(const Joint& joint, const VectorUpTo6<Lanes>& d) {
  if (joint.kind == JointKind::Spherical) return exp3(Vector3<Lanes>(d)).transpose();
  const int n = joint.nv;
  JointMatrixOf<Lanes> out(n, n);
  JointMatrix q(n, n), step(n, n);
  JointVector one(n);
  for (Eigen::Index l = 0; l < kLane; ++l) {
    unpackLane(d.data(), l, n, one.data());
    calcJointIntegrateJacobians(joint, one, q, step);
    for (int c = 0; c < n; ++c)
      for (int r = 0; r < n; ++r) out(r, c).set(l, q(r, c));
  }
  return out;
}

LaneMask isEqual(const VectorX<Lanes>& a, const VectorX<Lanes>& b) {
  LaneMask out = Lanes(0) <= Lanes(0);
  for (Eigen::Index k = 0; k < a.size(); ++k) out = out && a[k] <= b[k] && b[k] <= a[k];
  return out;
}

template <typename Derived>
void assignWhere(const LaneMask& mask, const Eigen::DenseBase<Derived>& from, MatrixX<Lanes>& to) {
  for (Eigen::Index c = 0; c < to.cols(); ++c)
    for (Eigen::Index r = 0; r < to.rows(); ++r) to(r, c) = select(mask, from(r, c), to(r, c));
}

}  // namespace

void ReducedLanes::linearize(const NodeModel::Linearization* items, int count) {
  setNodes(count, [&](int l) { return static_cast<ReducedNode*>(items[l].node); });
  packItems(
      items, count, [](const auto& item) { return item.x_next_node; }, x1_);
  packPlacements();
  packNodes();
  packSteps();
  updateColumns(model_, ws_);
  updateVelocities(model_, ws_, v_);
  updateAccelerations(model_, ws_, a_);
  for (ClusterLanes& b : clusters_) {
    const auto view = getPlacedView(b.loop, ws_);
    updateTwists(view, b.at, b.motion);
    updateVelocityLift(view, b.motion);
    updateAccelerationLift(view, b.motion);
  }
  updateForces();
  tree_.updateDerivatives(ws_, lifts_, A_y_, A_v_);
  for (ContactLanes& contact : contacts_)
    if (contact.used) updateContact(contact);
  for (size_t i = 0; i < clusters_.size(); ++i) {
    linearizeStep(clusters_[i]);
    updateGap(i, items);
  }
  linearizeStateCosts();
  storeDerivatives();
}

// H N of the loop forces, and the wrenches of the contacts on the bodies. The forces that the loops are left with are
// those through their joints.
void ReducedLanes::updateForces() {
  for (Vector6<Lanes>& f : f_ext_) f.setZero();
  for (const ContactLanes& contact : contacts_)
    if (contact.used) f_ext_[tips_[contact.tip]] += contact.wrench;
  updateInverseDynamicsFactors(model_, ws_, f_ext_);
  for (ClusterLanes& b : clusters_) {
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) {
      const int dof = b.loop.dofs[k];
      const Lanes left =
          ws_.J.col(dof).dot(ws_.F[model_.dofs()[dof].joint]) + model_.armature()[dof] * a_[dof] - tau_[dof];
      b.left[k] = b.loop.inverse_metric[k] * left;
    }
    b.independent.setZero();
    addSmallProduct(b.at.J, b.left, b.independent);
    solveGram(b.at, b.independent);
    expandIndependent(b.at, b.independent, b.rows);
    calcForceLift(getPlacedView(b.loop, ws_), b.motion, b.rows, b.HN);
  }
}

// Eq. (c)
void ReducedLanes::updateContact(ContactLanes& contact) {
  const auto& tip = tree_.getTip(contact.tip);
  const Vector6<Lanes>&V1 = ws_.V[tips_[contact.tip]], &A2 = ws_.A[0];
  for (size_t o = 0; o < tip.outer.size(); ++o) {
    const Vector6<Lanes> J = tip.J.col(o), dV = tip.dV.col(o);
    const Vector6<Lanes> dq = tip.dA.col(o) - crossMotion(V1, dV) + crossMotion(J, A2) + contact.kd * dV;
    const Vector6<Lanes> dv = tip.dW.col(o) - crossMotion(V1, J) + contact.kd * J;
    contact.dy.col(o) = contact.X_WF.actInvMotion(dq) - contact.kp_rate * contact.X_WF.actInvMotion(J);
    contact.dv.col(o) = contact.X_WF.actInvMotion(dv);
  }
}

// Eqs. (d) to (g).
void ReducedLanes::linearizeStep(ClusterLanes& b) {
  b.independent = b.zeta / h_;  // close() moves by h w', so its zeta is h times that of Eq. (e)
  expandIndependent(b.at, b.independent, b.rows);
  calcForceLift(getPlacedView(b.loop, ws_), b.motion, b.rows, b.HN);
  updateColumns(b.loop.model, b.own);
  const auto ahead = getOwnView(b.loop, b.own);
  updateTwists(ahead, b.next, b.ahead);
  b.independent.setZero();  // mu
  addSmallProduct(b.next.J, b.step, b.independent);
  b.independent /= h_;
  solveGram(b.next, b.independent);
  expandIndependent(b.next, b.independent, b.rows);
  calcForceLift(ahead, b.ahead, b.rows, b.HnNn);

  // J_q N, J_d^{-T} W N and J_d^{-T} W N': the identity but for the clusters of curved joints.
  b.JqN = b.at.N;
  b.P = b.at.WN;
  b.Pn = b.next.WN;
  for (const Joint& joint : b.loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const VectorUpTo6<Lanes> step = b.step.segment(i, n);
    JointMatrixOf<Lanes> difference(n, n);
    calcJointDifferenceJacobian(joint, step, difference);
    b.JqN.middleRows(i, n) = calcIntegrateJacobian(joint, step).lazyProduct(b.at.N.middleRows(i, n));
    b.P.middleRows(i, n) = difference.transpose().lazyProduct(b.at.WN.middleRows(i, n));
    b.Pn.middleRows(i, n) = difference.transpose().lazyProduct(b.next.WN.middleRows(i, n));
  }
  for (MatrixX<Lanes>* m : {&b.mixed, &b.mixed_next, &b.E, &b.En, &b.S}) m->setZero();
  addSmallProductTransposed(b.P, b.next.N, b.mixed);
  addSmallProductTransposed(b.Pn, b.next.N, b.mixed_next);
  addSmallProductTransposed(b.at.N, b.HN, b.E);
  b.E *= -h_;
  addSmallProductTransposed(b.P, b.JqN, b.E);
  addSmallProductTransposed(b.Pn, b.JqN, b.En);
  addSmallProductTransposed(b.next.N, b.HnNn, b.S);

  b.X.setIdentity();
  b.turned = factorizeSmall(b.mixed, b.pivots);
  solveFactorized(b.mixed, b.pivots, b.X);
  for (MatrixX<Lanes>* m : {&b.Xn, &b.q_y, &b.v_y}) m->setZero();
  addSmallProduct(b.mixed_next, b.X, b.Xn);
  addSmallProduct(b.X, b.E, b.q_y);
  b.q_v = h_ * b.X;
  addSmallProduct(b.Xn, b.E, b.v_y);
  b.v_y = (b.v_y - b.En) / h_;
  addSmallProduct(b.S, b.q_y, b.v_y, -1);
  b.v_v = b.Xn;
  addSmallProduct(b.S, b.q_v, b.v_v, -1);
}

// What comes of Eq. (g) read about the node states, where they are open.
void ReducedLanes::updateGap(size_t i, const NodeModel::Linearization* items) {
  ClusterLanes& b = clusters_[i];
  ClusterGapOf<Lanes>& gap = b.gap;
  for (size_t j = 0; j < b.loop.joints.size(); ++j) {
    const Joint &own = b.loop.model.joints()[j + 1], &joint = model_.joints()[b.loop.joints[j]];
    gap.q.segment(own.idx_q, own.nq) = x1_.segment(joint.idx_q, joint.nq);
  }
  for (size_t k = 0; k < b.loop.dofs.size(); ++k) gap.v[k] = x1_[model_.nq() + b.loop.dofs[k]];
  const LaneMask open = !(isEqual(gap.q, b.next.q) && isEqual(gap.v, b.v_next));
  b.placed = !open;
  for (VectorX<Lanes>* x : {&gap.y, &gap.y_v}) x->setZero();
  if (!any(open)) return;
  findNodeBasis(i, items, open);
  updateVelocities(b.loop.model, b.own, b.v_next);
  updateVelocityLift(getOwnView(b.loop, b.own), b.ahead);
  gap.update(b.loop, b.next, b.v_next, b.ahead.Z);
  for (const auto& [dy, dy_v] : {std::pair(&b.q_y, &b.v_y), std::pair(&b.q_v, &b.v_v)}) {
    for (MatrixX<Lanes>* m : {&b.X, &b.Xn}) m->setZero();
    addSmallProduct(gap.P_v, *dy_v, b.Xn);
    addSmallProduct(gap.P_z, *dy, b.Xn);
    addSmallProduct(gap.P_q, *dy, b.X);
    assignWhere(open, b.X, *dy);
    assignWhere(open, b.Xn, *dy_v);
  }
  for (VectorX<Lanes>* x : {&gap.y, &gap.y_v})
    for (Lanes& entry : *x) entry = select(open, entry, 0);
}

// That of the node itself where it is at hand, or that of q+ where only velocities differ.
void ReducedLanes::findNodeBasis(size_t i, const NodeModel::Linearization* items, const LaneMask& open) {
  ClusterLanes& b = clusters_[i];
  const int count = static_cast<int>(nodes_.size());
  const auto getNear = [i](const NodeModel::Linearization& item) -> const ClusterBasis& {
    if (item.next) return static_cast<const ReducedNode*>(item.next)->clusters_[i].at;
    return static_cast<const ReducedNode*>(item.node)->clusters_[i].next.basis();
  };
  packItems(
      items, count, [&](const auto& item) { return getNear(item).q.data(); }, b.q_near);
  packItems(
      items, count, [&](const auto& item) { return getNear(item).WN.data(); }, b.gap.WN);
  const LaneMask unknown = open && !isEqual(b.q_near, b.gap.q);
  b.placed = !unknown;
  if (!any(unknown)) return;
  b.placed = b.placed || b.closing.update(b.loop, b.scratch, b.gap.q);
  assignWhere(unknown, b.closing.basis().WN, b.gap.WN);
}

}  // namespace bielle
