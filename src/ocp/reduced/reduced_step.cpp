// Steps in lanes: robot_problem.h Eqs. (1) and (4), reduced_kernel.h Eq. (b).
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
  dydd.setZero(roundUpToLane(model.nu() + 2 * reduction.size) * reduction.size);
  for (const ReducedCluster& cluster : reduction.clusters) {
    const int r = cluster.size;
    const MatrixXd square = MatrixXd::Zero(r, r);
    clusters.push_back(
        {MatrixXd::Zero(cluster.model.nv(), r), square, square, square, square, VectorXd::Zero(r), VectorXd::Zero(r)});
  }
  for (int tip : layout.slots) {
    const Matrix6Xd columns = Matrix6Xd::Zero(6, tree.getTip(tip).outer.size());
    contacts.push_back({columns, columns});
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
  for (VectorX<Lanes>* x : {&v_, &a_, &tau_}) x->setZero(nv);
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
      placed.v[l] = 0;
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
  for (int l = 0; l < count; ++l) items[l].at->status = placed[l] ? StepStatus::Ok : StepStatus::Failed;
}

void ReducedKernel::step(const StepItem* items, int count, std::vector<LaneView>& views) {
  const LaneMask placed = placeAll(items, count);
  loadControls(items, count);
  std::array<const ReducedEvaluation*, kLane> nodes;
  std::array<int, kLane> indices;
  for (int l = 0; l < count; ++l) nodes[l] = items[l].at, indices[l] = items[l].node;
  loadContacts({nodes.data(), count}, indices.data(), ContactUse::Step);
  updateDriftAccelerations();
  updateSystem();
  const LaneMask regular = system_.factorize(M_, JcN_);
  system_.solve(f_, gamma_, ydd_, contact_forces_);
  system_.updateInverse();
  stepFreeJoints();
  LaneMask closed = makeMask(true);
  for (ClusterLanes& c : clusters_) {
    const LaneMask this_one = closeStep(c);
    for (int l = 0; l < count; ++l)
      if (!this_one[l] && closed[l] && regular[l] && placed[l])
        items[l].at->failure = describeFailure(c.cluster, c.scratch, l);
    closed = closed && this_one;
  }
  updateClosureForces();
  storeStep(items, count);
  storeMotion(count, views);
  for (int l = 0; l < count; ++l) {
    if (placed[l] && !regular[l]) items[l].at->failure = "the mass matrix is singular";
    items[l].at->status = placed[l] && regular[l] && closed[l] ? StepStatus::Ok : StepStatus::Failed;
  }
}

// a_d = -J^+ gamma of the closures.
void ReducedKernel::updateDriftAccelerations() {
  updateCompositeInertias(model_, ws_);
  updateDrift(model_, ws_);
  a_.setZero();
  for (ClusterLanes& c : clusters_) {
    const auto view = getPlacedView(c.cluster, ws_);
    calcClusterDrift<Lanes>(view, c.cluster, c.at, c.rows, c.drift);
    c.forces = c.drift;
    applyPseudoInverse<Lanes>(c.cluster, c.at, -1, c.forces, c.a);
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) a_[c.cluster.dofs[k]] = c.a[k];
    updateTwists(view, c.at, c.motion);
  }
  updateInverseDynamics(model_, ws_, a_);
}

// Eq. (b)
void ReducedKernel::updateSystem() {
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
  tree_.updateMassMatrix(ws_, lifts_, M_);
  for (size_t slot = 0; slot < contacts_.size(); ++slot) updateContactRows(slot);
}

// J_c N and gamma_c + J_c a_d; the accelerations of the workspace are those of a_d. Rows that a node lacks are zero.
void ReducedKernel::updateContactRows(size_t slot) {
  ContactLanes& contact = contacts_[slot];
  auto JcN = JcN_.middleRows<6>(6 * slot);
  auto gamma = gamma_.segment<6>(6 * slot);
  JcN.setZero();
  gamma.setZero();
  if (!contact.used) return;
  const auto& tip = tree_.getTip(contact.tip);
  const int body = layout_.tips[contact.tip];
  gamma = contact.selectRows(ws_.A[body] - ws_.A[0] + contact.kd * ws_.V[body]) - contact.kp_residual;
  for (size_t o = 0; o < tip.outer.size(); ++o) JcN.col(tip.outer[o]) = contact.selectRows(tip.J.col(o));
}

// robot_problem.h Eq. (1) without closures. Lanes without a node repeat the first one and need no special treatment.
void ReducedKernel::stepFreeJoints() {
  const int nq = model_.nq();
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int o = reduction_.free_offsets[i], n = joint.nv;
    VectorUpTo6<Lanes> d(n);
    for (int k = 0; k < n; ++k) {
      const int dof = joint.idx_v + k;
      a_[dof] += ydd_[o + k];
      x1_[nq + dof] = v_[dof] + h_ * a_[dof];
      d[k] = h_ * x1_[nq + dof];
    }
    integrateJoint<Lanes>(joint, ws_.q.segment(joint.idx_q, joint.nq), d, x1_.segment(joint.idx_q, joint.nq));
  }
}

// The same for a cluster.
LaneMask ReducedKernel::closeStep(ClusterLanes& c) {
  const ReducedCluster& cluster = c.cluster;
  const auto ydd = ydd_.segment(cluster.offset, cluster.size);
  addSmallProduct(c.at.N, ydd, c.a);
  for (size_t k = 0; k < cluster.dofs.size(); ++k) {
    const int dof = cluster.dofs[k];
    a_[dof] = c.a[k];
    c.d[k] = h_ * (v_[dof] + h_ * a_[dof]);
  }
  // To second order the closures open by h^2/2 gamma along h w: J W^{-1} J^T zeta = h^2/2 gamma. applyPseudoInverse()
  // has left the solution for gamma in c.forces.
  c.forces *= 0.5 * h_ * h_;
  const LaneMask closed = closeCluster<Lanes>(cluster, c.scratch, c.at, c.d, c.forces, c.next);
  // (I - J'^+ J') w' = N' (W N')^T w'
  const ClusterBasisOf<Lanes>& next = c.next.basis;
  c.target.setZero();
  addSmallProductTransposed(next.WN, c.next.step, c.target);
  c.target /= h_;
  c.v_next.setZero();
  addSmallProduct(next.N, c.target, c.v_next);
  for (size_t k = 0; k < cluster.dofs.size(); ++k) x1_[model_.nq() + cluster.dofs[k]] = c.v_next[k];
  scatterConfiguration<Lanes>(model_, cluster, next.q, x1_);
  return closed;
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
