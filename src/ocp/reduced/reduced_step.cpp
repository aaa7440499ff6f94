// Steps in lanes: robot_problem.h Eqs. (1), (2) and (4), reduced_kernel.h Eq. (b).
#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "model/joint.h"
#include "ocp/reduced/reduced_kernel.h"

namespace bielle {

ClusterLanes::ClusterLanes(const ReducedCluster& l)
    : cluster(l), at(l), motion(l), scratch(l), next(l), own(l.model), ahead(l), gap(l) {
  const int n = l.model.nv(), r = l.size, rank = l.rank;
  for (VectorX<Lanes>* x : {&v_next, &a, &d, &left}) x->setZero(n);
  for (VectorX<Lanes>* x : {&drift, &forces}) x->setZero(rank);
  target.setZero(r);
  rows.setZero(l.closures.rows);
  for (MatrixX<Lanes>* x : {&KN, &KnNn, &JqN, &P, &Pn}) x->setZero(n, r);
  for (MatrixX<Lanes>* x : {&mixed, &E, &En, &S, &X, &Xn, &PnNn, &q_y, &q_v, &v_y, &v_v}) x->setZero(r, r);
  pivots.resize(r);
}

LaneView::LaneView(const Model& model, const Reduction& reduction, const ReducedTreeOf<Lanes>& tree,
                   const ReducedLayout& layout)
    : ws(model), state_cost(model, reduction) {
  for (const ReducedCluster& cluster : reduction.clusters) {
    const int r = cluster.size;
    const MatrixXd square = MatrixXd::Zero(r, r);
    const Drift drift{square, square, square, square};
    const MatrixXd turns = MatrixXd::Zero(cluster.model.nv(), r);
    clusters.push_back({turns, turns, drift, drift, square, VectorXd::Zero(r), VectorXd::Zero(r)});
  }
  for (Acceleration* out : {&acceleration, &foreseen}) {
    out->dydd.setZero(roundUpToLane(model.nu() + 1 + 2 * reduction.size) * reduction.size);
  }
  for (int tip : layout.slots) {
    const Matrix6Xd columns = Matrix6Xd::Zero(6, tree.getTip(tip).outer.size());
    for (std::vector<Contact>* contacts : {&acceleration.contacts, &foreseen.contacts, &stabilizations})
      contacts->push_back({columns, columns});
  }
}

ReducedKernel::ReducedKernel(const Model& model, const Reduction& reduction, const ReducedLayout& layout)
    : model_(model),
      reduction_(reduction),
      layout_(layout),
      ws_(model),
      tree_(model, reduction, layout.tips),
      state_cost_(model, reduction) {
  const int nv = model.nv(), nr = reduction.size, rows = 6 * static_cast<int>(layout.slots.size());
  clusters_.reserve(reduction.clusters.size());  // lifts point into them
  int closure_rows = 0;
  for (const ReducedCluster& cluster : reduction.clusters) {
    clusters_.emplace_back(cluster);
    lifts_.push_back({&clusters_.back().motion, &clusters_.back().KN});
    closure_rows += cluster.closures.rows;
  }
  for (int tip : layout.slots) {
    ContactLanes contact;
    contact.tip = tip;
    contact.X_WF = SE3Of<Lanes>(Matrix3<Lanes>::Identity(), Vector3<Lanes>::Zero());
    for (Matrix6X<Lanes>* x : {&contact.dy, &contact.dv}) x->setZero(6, tree_.getTip(tip).outer.size());
    contacts_.push_back(contact);
  }
  for (VectorX<Lanes>* x : {&v_, &a_, &tau_, &v_mid_}) x->setZero(nv);
  x1_.setZero(model.nq() + nv);
  system_.resize(nr, rows);
  for (MatrixX<Lanes>* x : {&M_, &A_y_, &A_v_}) x->setZero(nr, nr);
  JcN_.setZero(rows, nr);
  for (VectorX<Lanes>* x : {&f_, &ydd_}) x->setZero(nr);
  for (VectorX<Lanes>* x : {&gamma_, &contact_forces_}) x->setZero(rows);
  closure_forces_.setZero(closure_rows);
  int offset = 0;
  for (const Closure& closure : model.closures()) {
    closure_offsets_.push_back(offset);
    offset += getRows(closure.kind);
  }
  u_.setZero(model.nu());
  dx_.setZero(2 * nr);
  f_ext_.assign(model.numBodies(), Vector6<Lanes>::Zero());
  loaded_costs_.fill(-1);
}

// Bases and placements of the states, and all velocities. Returns the lanes that succeeded.
LaneMask ReducedKernel::placeAll(const StepItem* items, int count) {
  const int nq = model_.nq();
  gatherLanes(count, nq, ws_.q.data(), [&](int l) { return items[l].at->x.data(); });
  gatherLanes(count, v_.size(), v_.data(), [&](int l) { return items[l].at->x.data() + nq; });
  LaneMask placed = makeMask(true);
  const bool all_follow = std::all_of(items, items + count, [](const StepItem& item) { return item.previous; });
  for (size_t i = 0; i < clusters_.size() && !all_follow; ++i) {
    ClusterLanes& c = clusters_[i];
    gatherConfiguration<Lanes>(model_, c.cluster, ws_.q, c.at.q);
    const LaneMask regular = updateClusterState(c.cluster, c.scratch, c.at.q, c.next);
    storeNext(i, items, count);
    for (int l = 0; l < count; ++l) {
      if (regular[l] || items[l].previous) continue;
      if (placed[l]) items[l].at->failure = describeFailure(c.cluster, c.scratch, l);
      placed.set(l, false);
    }
  }
  loadPoints(items, count);
  placeBodies();
  storePoints(items, count);
  ws_.stage = WorkspaceStage::Placement;
  updateColumns(model_, ws_);
  updateVelocities(model_, ws_, v_);
  updateStateCosts(items, count);
  return placed;
}

// Converts placements relative to the bodies that carry the clusters to placements in the world.
void ReducedKernel::placeBodies() {
  for (int i = 1; i < model_.numBodies(); ++i) {
    const ReducedJoint& reduced = reduction_.joints[reduction_.joint_of_body[i]];
    const Joint& joint = model_.joints()[i];
    if (reduced.cluster >= 0) {
      ws_.X_WB[i] = ws_.X_WB[reduction_.clusters[reduced.cluster].root] * ws_.X_WB[i];
    } else {
      const SE3Of<Lanes> X_JB = calcJointPlacement<Lanes>(joint, ws_.q.segment(joint.idx_q, joint.nq));
      ws_.X_WB[i] = ws_.X_WB[joint.parent] * joint.X_PJ * X_JB;
    }
  }
}

void ReducedKernel::updateStateCosts(const StepItem* items, int count) {
  std::array<int, kLane> indices;
  std::array<const StageSpec*, kLane> specs;
  for (int l = 0; l < count; ++l) indices[l] = items[l].node, specs[l] = items[l].spec;
  const bool some = loadStateCosts(indices.data(), specs.data(), count);
  const Lanes value = some ? state_cost_.update(ws_.q, v_) : Lanes(0);
  for (int l = 0; l < count; ++l) items[l].at->state_cost = value[l];
}

void ReducedKernel::place(const StepItem* items, int count, std::vector<LaneView>& views) {
  const LaneMask placed = placeAll(items, count);
  storeMotion(count, views);
  for (int l = 0; l < count; ++l) items[l].at->status = placed[l] ? NumericalStatus::Ok : NumericalStatus::Failed;
}

void ReducedKernel::step(const StepItem* items, int count, std::vector<LaneView>& views) {
  const Point point = getPoint(*items->spec);
  const LaneMask placed = placeAll(items, count);
  storeMotion(count, views);
  loadControls(items, count);
  std::array<const ReducedEvaluation*, kLane> nodes;
  std::array<int, kLane> indices;
  for (int l = 0; l < count; ++l) nodes[l] = items[l].at, indices[l] = items[l].node;
  loadContacts({nodes.data(), count}, indices.data(), Point::State, ContactUse::Step);
  updateStabilizations();
  LaneMask reached = makeMask(true);
  if (point == Point::Midpoint) {
    reached = driftToMidpoint(items, count);
    loadContacts({nodes.data(), count}, indices.data(), point, ContactUse::Step);
  }
  updateSystem();
  updateLoads(point == Point::Midpoint ? Point::Foreseen : point);
  const LaneMask regular = system_.factorize(M_, JcN_);
  system_.solve(f_, gamma_, ydd_, contact_forces_);
  combineAccelerations();
  if (point == Point::Midpoint) {
    updateClosureForces();
    storeForeseen(items, count);
    foreseeVelocity();
    updateLoads(point);
    system_.solve(f_, gamma_, ydd_, contact_forces_);
    combineAccelerations();
  }
  system_.updateInverse();
  driftFreeJoints();
  LaneMask closed = makeMask(true);
  for (ClusterLanes& c : clusters_) {
    const LaneMask this_one = driftCluster(c);
    for (int l = 0; l < count; ++l)
      if (!this_one[l] && closed[l] && reached[l] && regular[l] && placed[l])
        items[l].at->failure = describeFailure(c.cluster, c.scratch, l);
    closed = closed && this_one;
  }
  updateClosureForces();
  storeStep(items, count);
  for (int l = 0; l < count; ++l) {
    const bool moved = placed[l] && reached[l];
    if (moved && !regular[l]) items[l].at->failure = "the mass matrix is singular";
    items[l].at->status = moved && regular[l] && closed[l] ? NumericalStatus::Ok : NumericalStatus::Failed;
  }
}

// The first drift of a midpoint step: from here on the point of the kernel is the one half way.
LaneMask ReducedKernel::driftToMidpoint(const StepItem* items, int count) {
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const VectorUpTo6<Lanes> d = drift_ * v_.segment(joint.idx_v, joint.nv);
    integrateJoint<Lanes>(joint, ws_.q.segment(joint.idx_q, joint.nq), d, x1_.segment(joint.idx_q, joint.nq));
  }
  LaneMask reached = makeMask(true);
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& c = clusters_[i];
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) c.d[k] = drift_ * v_[c.cluster.dofs[k]];
    const LaneMask closed = closeCluster<Lanes>(c.cluster, c.scratch, c.at, c.d, VectorX<Lanes>(), c.next);
    for (int l = 0; l < count; ++l)
      if (!closed[l] && reached[l] && items[l].at->failure.empty())
        items[l].at->failure = describeFailure(c.cluster, c.scratch, l);
    reached = reached && closed;
    updateNextVelocity(c);
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) v_[c.cluster.dofs[k]] = c.v_next[k];
    scatterConfiguration<Lanes>(model_, c.cluster, c.next.basis.q, x1_);
    c.at = c.next.basis;
    for (size_t j = 0; j < c.cluster.joints.size(); ++j) ws_.X_WB[c.cluster.joints[j]] = c.next.placements[j + 1];
  }
  ws_.q = x1_.head(model_.nq());
  placeBodies();
  storeMidpoint(items, count);
  ws_.stage = WorkspaceStage::Placement;
  updateColumns(model_, ws_);
  updateVelocities(model_, ws_, v_);
  return reached;
}

// The matrices of Eq. (b); rows that a node lacks are zero.
void ReducedKernel::updateSystem() {
  updateCompositeInertias(model_, ws_);
  for (ClusterLanes& c : clusters_) updateTwists(getPlacedView(c.cluster, ws_), c.at, c.motion);
  tree_.updateMassMatrix(ws_, lifts_, M_);
  for (size_t slot = 0; slot < contacts_.size(); ++slot) {
    auto JcN = JcN_.middleRows<6>(6 * slot);
    JcN.setZero();
    if (!contacts_[slot].used) continue;
    const auto& tip = tree_.getTip(contacts_[slot].tip);
    for (size_t o = 0; o < tip.outer.size(); ++o) JcN.col(tip.outer[o]) = contacts_[slot].selectRows(tip.J.col(o));
  }
}

// From residuals to kd nu - kp r.
void ReducedKernel::updateStabilizations() {
  for (ContactLanes& contact : contacts_)
    if (contact.used)
      contact.stabilization += contact.selectRows(Vector6<Lanes>(contact.kd * ws_.V[layout_.tips[contact.tip]]));
}

// Its right-hand sides at the velocities of the workspace: N^T (tau - b - M a_d), and gamma_c + J_c a_d; and
// a_d = -J^+ gamma of the closures.
void ReducedKernel::updateLoads(Point point) {
  updateDrift(model_, ws_);
  a_.setZero();
  for (ClusterLanes& c : clusters_) {
    calcClusterDrift<Lanes>(getPlacedView(c.cluster, ws_), c.cluster, c.at, c.rows, c.drift);
    c.forces = c.drift;
    applyPseudoInverse<Lanes>(c.cluster, c.at, -1, c.forces, c.a);
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) a_[c.cluster.dofs[k]] = c.a[k];
  }
  updateInverseDynamics(model_, ws_, a_);
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    for (int k = 0; k < joint.nv; ++k)
      f_[reduction_.free_offsets[i] + k] = tau_[joint.idx_v + k] - ws_.b[joint.idx_v + k];
  }
  for (ClusterLanes& c : clusters_) {
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) c.left[k] = tau_[c.cluster.dofs[k]] - ws_.b[c.cluster.dofs[k]];
    auto f = f_.segment(c.cluster.offset, c.cluster.size);
    f.setZero();
    addSmallProductTransposed(c.at.N, c.left, f);
  }
  for (size_t slot = 0; slot < contacts_.size(); ++slot) {
    const ContactLanes& contact = contacts_[slot];
    auto gamma = gamma_.segment<6>(6 * slot);
    gamma.setZero();
    if (!contact.used) continue;
    const int body = layout_.tips[contact.tip];
    gamma = contact.selectRows(ws_.A[body] - ws_.A[0]);
    if (point != Point::Foreseen) gamma += contact.stabilization;
  }
}

// a = N y' + a_d
void ReducedKernel::combineAccelerations() {
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    for (int k = 0; k < joint.nv; ++k) a_[joint.idx_v + k] += ydd_[reduction_.free_offsets[i] + k];
  }
  for (ClusterLanes& c : clusters_) {
    addSmallProduct(c.at.N, ydd_.segment(c.cluster.offset, c.cluster.size), c.a);
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) a_[c.cluster.dofs[k]] = c.a[k];
  }
}

// v^ = v + k/2 N y', into the workspace too
void ReducedKernel::foreseeVelocity() {
  v_mid_ = v_;
  const Lanes half = 0.5 * kick_;
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    for (int k = 0; k < joint.nv; ++k) v_mid_[joint.idx_v + k] += half * ydd_[reduction_.free_offsets[i] + k];
  }
  for (ClusterLanes& c : clusters_) {
    c.d.setZero();
    addSmallProduct(c.at.N, ydd_.segment(c.cluster.offset, c.cluster.size), c.d);
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) v_mid_[c.cluster.dofs[k]] += half * c.d[k];
  }
  updateVelocities(model_, ws_, v_mid_);
}

// The kick and the drift after it, outside the clusters. Lanes without a node repeat the first one and need no special
// treatment.
void ReducedKernel::driftFreeJoints() {
  const int nq = model_.nq();
  for (int i : reduction_.free_joints) {
    const Joint& joint = model_.joints()[i];
    VectorUpTo6<Lanes> d(joint.nv);
    for (int k = 0; k < joint.nv; ++k) {
      const int dof = joint.idx_v + k;
      x1_[nq + dof] = v_[dof] + kick_ * a_[dof];
      d[k] = drift_ * x1_[nq + dof];
    }
    integrateJoint<Lanes>(joint, ws_.q.segment(joint.idx_q, joint.nq), d, x1_.segment(joint.idx_q, joint.nq));
  }
}

// The same for a cluster.
LaneMask ReducedKernel::driftCluster(ClusterLanes& c) {
  const ReducedCluster& cluster = c.cluster;
  for (size_t k = 0; k < cluster.dofs.size(); ++k) {
    const int dof = cluster.dofs[k];
    c.d[k] = drift_ * (v_[dof] + kick_ * a_[dof]);
  }
  // To second order the closures open by h (k - h/2) gamma along h w: J W^{-1} J^T zeta = h (k - h/2) gamma.
  // applyPseudoInverse() has left the solution for gamma in c.forces.
  c.forces *= drift_ * (kick_ - 0.5 * drift_);
  const LaneMask closed = closeCluster<Lanes>(cluster, c.scratch, c.at, c.d, c.forces, c.next);
  updateNextVelocity(c);
  for (size_t k = 0; k < cluster.dofs.size(); ++k) x1_[model_.nq() + cluster.dofs[k]] = c.v_next[k];
  scatterConfiguration<Lanes>(model_, cluster, c.next.basis.q, x1_);
  return closed;
}

// (I - J'^+ J') w' = N' (W N')^T w'
void ReducedKernel::updateNextVelocity(ClusterLanes& c) {
  const ClusterBasisOf<Lanes>& next = c.next.basis;
  c.target.setZero();
  addSmallProductTransposed(next.WN, c.next.step, c.target);
  c.target /= drift_;
  c.v_next.setZero();
  addSmallProduct(next.N, c.target, c.v_next);
}

// J^T lambda_l = M a + b - tau - J_c^T lambda_c, solved on the independent rows; the others have no force.
void ReducedKernel::updateClosureForces() {
  updateInverseDynamics(model_, ws_, a_);
  for (size_t slot = 0; slot < contacts_.size(); ++slot) {
    const ContactLanes& contact = contacts_[slot];
    if (!contact.used) continue;
    const Vector6<Lanes> wrench = contact.expandRows(contact_forces_.segment<6>(6 * slot));
    for (int k : model_.supportDofs(layout_.tips[contact.tip])) ws_.b[k] -= ws_.J.col(k).dot(wrench);
  }
  for (ClusterLanes& c : clusters_) {
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) {
      const int dof = c.cluster.dofs[k];
      c.left[k] = c.cluster.inverse_metric[k] * (ws_.b[dof] - tau_[dof]);
    }
    c.forces.setZero();
    addSmallProduct(c.at.J, c.left, c.forces);
    solveGram(c.at, c.forces);
    expandIndependent(c.at, c.forces, c.rows);
    visitClosureRows(c.cluster,
                     [&](int from, int to, int n) { closure_forces_.segment(to, n) = c.rows.segment(from, n); });
  }
}

}  // namespace bielle
