// Derivatives of steps in lanes: reduced_kernel.h Eqs. (c) to (g).
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "math/so3.h"
#include "model/joint.h"
#include "ocp/reduced/reduced_kernel.h"

namespace bielle {
namespace {

// Jacobian of q (+) d with respect to q: node by node except for spherical joints, the most frequent kind in closures.
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
  LaneMask out = makeMask(true);
  for (Eigen::Index k = 0; k < a.size(); ++k) out = out && a[k] <= b[k] && b[k] <= a[k];
  return out;
}

template <typename Derived>
void assignWhere(const LaneMask& mask, const Eigen::DenseBase<Derived>& from, MatrixX<Lanes>& to) {
  for (Eigen::Index c = 0; c < to.cols(); ++c)
    for (Eigen::Index r = 0; r < to.rows(); ++r) to(r, c) = select(mask, from(r, c), to(r, c));
}

}  // namespace

// Nodes and indices of a batch.
struct ReducedKernel::Batch {
  Batch(const LinearizeItem* items, int n) : count(n) {
    for (int l = 0; l < n; ++l) nodes[l] = items[l].at, indices[l] = items[l].node, specs[l] = items[l].spec;
  }
  LaneSource<const ReducedEvaluation> source() const { return {nodes.data(), count}; }
  int count;
  std::array<const ReducedEvaluation*, kLane> nodes;
  std::array<int, kLane> indices;
  std::array<const StageSpec*, kLane> specs;
};

void ReducedKernel::linearizeSteps(LinearizeItem* items, int count, std::vector<LaneView>& views) {
  const Batch batch(items, count);
  for (int l = 0; l < kLane; ++l) {
    const LinearizeItem& item = items[l < count ? l : 0];
    loadSteps(*item.spec, item.at->dt, l);
  }
  if (getPoint(*items->spec) == Point::Midpoint) {
    linearizeStates(items, count, views);
    linearizeStabilizations(batch, views);
    linearizeMidpoints(batch, items, views);
  } else {
    loadState(batch.source(), Point::State);
    loadBases(batch.source());
    updateColumns(model_, ws_);
    linearizeAccelerations(batch, Point::State);
    for (ContactLanes& contact : contacts_)
      if (contact.used) addStabilization(contact);
    linearizeStateCosts(items, count, views);
    storeColumns(count, views);
    for (int l = 0; l < count; ++l) items[l].ok = true;
  }
  storeAcceleration(batch.source(), views, &LaneView::acceleration);
  loadLastDrift(batch.source());
  updateDrifts(items, count);
  gatherLanes(count, x1_.size(), x1_.data(), [&](int l) { return items[l].next->x.data(); });
  for (size_t i = 0; i < clusters_.size(); ++i) updateGap(i, items, count);
  storeDrift(count, views, &LaneView::Cluster::drift);
  storeGaps(count, views);
}

// Those of the states, which are in place.
void ReducedKernel::linearizeStabilizations(const Batch& batch, std::vector<LaneView>& views) {
  loadContacts(batch.source(), batch.indices.data(), Point::State, ContactUse::Stabilization);
  tree_.updateTipVelocities(ws_, lifts_);
  for (ContactLanes& contact : contacts_) {
    if (!contact.used) continue;
    contact.dy.setZero();
    contact.dv.setZero();
    addStabilization(contact);
  }
  storeStabilizations(batch.count, views);
}

// The first drift, from the states that are in place, and the two accelerations half way.
void ReducedKernel::linearizeMidpoints(const Batch& batch, LinearizeItem* items, std::vector<LaneView>& views) {
  const int count = batch.count;
  loadFirstDrift(batch.source());
  updateDrifts(items, count);
  storeDrift(count, views, &LaneView::Cluster::first);
  loadState(batch.source(), Point::Foreseen);
  loadMidpointBases(batch.source());
  updateColumns(model_, ws_);
  linearizeAccelerations(batch, Point::Foreseen);
  storeAcceleration(batch.source(), views, &LaneView::foreseen);
  storeTurns(count, views);
  gatherLanes(count, v_.size(), v_.data(), [&](int l) { return batch.nodes[l]->v_mid.data(); });
  linearizeAccelerations(batch, Point::Midpoint);
  storeMidpointTurns(count, views);
}

// A_y and A_v at the bases and columns in place and the velocities v_, and Eq. (c).
void ReducedKernel::linearizeAccelerations(const Batch& batch, Point point) {
  loadContacts(batch.source(), batch.indices.data(), point, ContactUse::Derivatives);
  loadAccelerations(batch.source(), point);
  updateVelocities(model_, ws_, v_);
  updateAccelerations(model_, ws_, a_);
  for (ClusterLanes& c : clusters_) {
    const auto view = getPlacedView(c.cluster, ws_);
    if (point != Point::Midpoint) updateTwists(view, c.at, c.motion);  // those of the foreseen acceleration
    updateVelocityLift(view, c.motion);
    updateAccelerationLift(view, c.motion);
  }
  updateForces();
  tree_.updateDerivatives(ws_, lifts_, A_y_, A_v_);
  for (ContactLanes& contact : contacts_)
    if (contact.used) updateContact(contact);
}

// Eq. (g) for all clusters.
void ReducedKernel::updateDrifts(LinearizeItem* items, int count) {
  for (ClusterLanes& c : clusters_) {
    const LaneMask turned = updateClusterDerivatives(c);
    for (int l = 0; l < count; ++l) {
      if (turned[l] || !items[l].ok) continue;
      items[l].ok = false;
      *items[l].failure =
          "closure '" + c.cluster.closures.closures.front().name + "': the step rotates its loops too far";
    }
  }
}

// T of Eq. (h), by the accelerations a of the last linearization: J a = J a_d.
void ReducedKernel::storeTurns(int count, std::vector<LaneView>& views) {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& c = clusters_[i];
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) c.left[k] = -a_[c.cluster.dofs[k]];
    c.forces.setZero();
    addSmallProduct(c.at.J, c.left, c.forces);
    solveGram(c.at, c.forces);
    expandIndependent(c.at, c.forces, c.rows);
    calcGeometricStiffness(getPlacedView(c.cluster, ws_), c.motion, c.rows, c.JqN);
    c.mixed.setZero();
    addSmallProductTransposed(c.at.N, c.JqN, c.mixed);
    scatterLanes(c.mixed.data(), c.mixed.size(), count, [&](int l) { return views[l].clusters[i].T.data(); });
  }
}

void ReducedKernel::linearizeStates(LinearizeItem* items, int count, std::vector<LaneView>& views) {
  const Batch batch(items, count);
  loadState(batch.source(), Point::State);
  loadBases(batch.source());
  updateColumns(model_, ws_);
  updateVelocities(model_, ws_, v_);
  updateCompositeInertias(model_, ws_);
  for (ClusterLanes& c : clusters_) {
    const auto view = getPlacedView(c.cluster, ws_);
    updateTwists(view, c.at, c.motion);
    updateVelocityLift(view, c.motion);
  }
  for (int l = 0; l < count; ++l) items[l].ok = true;
  linearizeStateCosts(items, count, views);
  storeColumns(count, views);
}

void ReducedKernel::linearizeStateCosts(const LinearizeItem* items, int count, std::vector<LaneView>& views) {
  const Batch batch(items, count);
  if (!loadStateCosts(batch.indices.data(), batch.specs.data(), count)) return;
  state_cost_.update(ws_.q, v_);
  const StateCostModelOf<Lanes>& model = state_cost_.differentiate(v_, lifts_);
  scatterLanes(model.gradient.data(), model.gradient.size(), count,
               [&](int l) { return views[l].state_cost.gradient.data(); });
  scatterLanes(model.hessian.data(), model.hessian.size(), count,
               [&](int l) { return views[l].state_cost.hessian.data(); });
}

// K N of the closure forces, and the contribution of contact wrenches to inverse dynamics.
void ReducedKernel::updateForces() {
  for (Vector6<Lanes>& f : f_ext_) f.setZero();
  for (const ContactLanes& contact : contacts_)
    if (contact.used) f_ext_[layout_.tips[contact.tip]] += contact.wrench;
  updateInverseDynamicsFactors(model_, ws_, f_ext_);
  for (ClusterLanes& c : clusters_) {
    visitClosureRows(c.cluster,
                     [&](int to, int from, int n) { c.rows.segment(to, n) = closure_forces_.segment(from, n); });
    calcGeometricStiffness(getPlacedView(c.cluster, ws_), c.motion, c.rows, c.KN);
  }
}

// Eq. (c)
void ReducedKernel::updateContact(ContactLanes& contact) {
  const auto& tip = tree_.getTip(contact.tip);
  const Vector6<Lanes>&V1 = ws_.V[layout_.tips[contact.tip]], &A2 = ws_.A[0];
  for (size_t o = 0; o < tip.outer.size(); ++o) {
    const Vector6<Lanes> J = tip.J.col(o), dV = tip.dV.col(o);
    contact.dy.col(o) = contact.selectRows(Vector6<Lanes>(tip.dA.col(o) - crossMotion(V1, dV) + crossMotion(J, A2)));
    contact.dv.col(o) = contact.selectRows(Vector6<Lanes>(tip.dW.col(o) - crossMotion(V1, J)));
  }
}

// The derivatives of kd nu - kp r; needs the columns J and dV of the tip.
void ReducedKernel::addStabilization(ContactLanes& contact) {
  const auto& tip = tree_.getTip(contact.tip);
  for (size_t o = 0; o < tip.outer.size(); ++o) {
    const Vector6<Lanes> J = tip.J.col(o), kd_dV = contact.kd * tip.dV.col(o), kd_J = contact.kd * J;
    contact.dy.col(o) += contact.selectRows(kd_dV) - contact.kp_rate * contact.X_WF.actInvMotion(J);
    contact.dv.col(o) += contact.selectRows(kd_J);
  }
}

// Eqs. (d) to (g). Returns the lanes where X exists.
LaneMask ReducedKernel::updateClusterDerivatives(ClusterLanes& c) {
  const ReducedCluster& cluster = c.cluster;
  const ClusterBasisOf<Lanes>& next = c.next.basis;
  c.forces = c.next.zeta / drift_;  // closeCluster() moves by h w', so its zeta is h times that of Eq. (e)
  expandIndependent(c.at, c.forces, c.rows);
  calcGeometricStiffness(getPlacedView(cluster, ws_), c.motion, c.rows, c.JqN);  // K N of zeta
  for (MatrixX<Lanes>* m : {&c.PnNn, &c.mixed, &c.E, &c.En, &c.S}) m->setZero();
  addSmallProductTransposed(c.at.N, c.JqN, c.E);
  c.E *= -drift_;
  updateColumns(cluster.model, c.own);
  const auto ahead = getOwnView(cluster, c.own);
  updateTwists(ahead, next, c.ahead);
  c.forces.setZero();  // mu
  addSmallProduct(next.J, c.next.step, c.forces);
  c.forces /= drift_;
  solveGram(next, c.forces);
  expandIndependent(next, c.forces, c.rows);
  calcGeometricStiffness(ahead, c.ahead, c.rows, c.KnNn);

  // J_q N, J_d^{-T} W N and J_d^{-T} W N': J_q and J_d are the identity except for the blocks of curved joints.
  c.JqN = c.at.N;
  c.P = c.at.WN;
  c.Pn = next.WN;
  for (const Joint& joint : cluster.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const VectorUpTo6<Lanes> step = c.next.step.segment(i, n);
    JointMatrixOf<Lanes> difference(n, n);
    calcJointDifferenceJacobian(joint, step, difference);
    c.JqN.middleRows(i, n) = calcIntegrateJacobian(joint, step).lazyProduct(c.at.N.middleRows(i, n));
    c.P.middleRows(i, n) = difference.transpose().lazyProduct(c.at.WN.middleRows(i, n));
    c.Pn.middleRows(i, n) = difference.transpose().lazyProduct(next.WN.middleRows(i, n));
  }
  addSmallProductTransposed(c.P, next.N, c.mixed);
  addSmallProductTransposed(c.Pn, next.N, c.PnNn);
  addSmallProductTransposed(c.P, c.JqN, c.E);
  addSmallProductTransposed(c.Pn, c.JqN, c.En);
  addSmallProductTransposed(next.N, c.KnNn, c.S);

  c.X.setIdentity();
  const LaneMask turned = factorizeSmall(c.mixed, c.pivots);
  solveFactorized(c.mixed, c.pivots, c.X);
  for (MatrixX<Lanes>* m : {&c.Xn, &c.q_y, &c.v_y}) m->setZero();
  addSmallProduct(c.PnNn, c.X, c.Xn);
  addSmallProduct(c.X, c.E, c.q_y);
  c.q_v = drift_ * c.X;
  addSmallProduct(c.Xn, c.E, c.v_y);
  c.v_y = (c.v_y - c.En) / drift_;
  addSmallProduct(c.S, c.q_y, c.v_y, -1);
  c.v_v = c.Xn;
  addSmallProduct(c.S, c.q_v, c.v_v, -1);
  return turned;
}

// Contribution of reading Eq. (g) about node states that are open.
void ReducedKernel::updateGap(size_t index, const LinearizeItem* items, int count) {
  ClusterLanes& c = clusters_[index];
  ClusterGapOf<Lanes>& gap = c.gap;
  gatherConfiguration<Lanes>(model_, c.cluster, x1_, gap.q);
  for (size_t k = 0; k < c.cluster.dofs.size(); ++k) gap.v[k] = x1_[model_.nq() + c.cluster.dofs[k]];
  const LaneMask open = !(isEqual(gap.q, c.next.basis.q) && isEqual(gap.v, c.v_next));
  for (VectorX<Lanes>* x : {&gap.y, &gap.y_v}) x->setZero();
  if (!any(open)) return;
  gatherLanes(count, gap.WN.size(), gap.WN.data(), [&](int l) { return items[l].next->clusters[index].at.WN.data(); });
  updateVelocities(c.cluster.model, c.own, c.v_next);
  updateVelocityLift(getOwnView(c.cluster, c.own), c.ahead);
  gap.update(c.cluster, c.next.basis, c.v_next, c.ahead.Z);
  for (const auto& [dy, dy_v] : {std::pair(&c.q_y, &c.v_y), std::pair(&c.q_v, &c.v_v)}) {
    for (MatrixX<Lanes>* m : {&c.X, &c.Xn}) m->setZero();
    addSmallProduct(gap.P_v, *dy_v, c.Xn);
    addSmallProduct(gap.P_z, *dy, c.Xn);
    addSmallProduct(gap.P_q, *dy, c.X);
    assignWhere(open, c.X, *dy);
    assignWhere(open, c.Xn, *dy_v);
  }
  for (VectorX<Lanes>* x : {&gap.y, &gap.y_v})
    for (Lanes& entry : *x) entry = select(open, entry, 0);
}

}  // namespace bielle
