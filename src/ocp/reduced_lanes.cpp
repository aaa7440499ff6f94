#include "reduced_lanes.h"

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "reduced_node.h"

namespace bielle {

ClusterLanes::ClusterLanes(const ReducedCluster& l)
    : loop(l), at(l), next(l), own(l.model), motion(l), ahead(l), gap(l), scratch(l), closing(l) {
  const int n = l.model.nv(), r = l.size, rank = l.rank;
  target.setZero(r);
  for (VectorX<Lanes>* x : {&left, &step, &a_d, &v_next}) x->setZero(n);
  for (VectorX<Lanes>* x : {&zeta, &independent, &drift, &predicted, &surplus}) x->setZero(rank);
  rows.setZero(l.closures.rows);
  for (MatrixX<Lanes>* x : {&HN, &HnNn, &JqN, &P, &Pn}) x->setZero(n, r);
  for (MatrixX<Lanes>* x : {&E, &En, &S, &X, &Xn, &mixed, &mixed_next, &q_y, &q_v, &v_y, &v_v}) x->setZero(r, r);
  pivots.resize(r);
  q_near.setZero(l.model.nq());
}

LaneView::LaneView(const Model& model, const Reduction& reduction, const std::vector<ClusterLanes>& clusters,
                   const std::vector<ContactLanes>& contacts)
    : ws(model), state_cost(model, reduction) {
  dydd.setZero(roundUpToLane(model.nu() + 2 * reduction.size) * reduction.size);
  for (const ClusterLanes& b : clusters) {
    const Eigen::Index n = b.at.N.rows(), r = b.at.N.cols();
    const MatrixXd square = MatrixXd::Zero(r, r);
    const VectorXd gap = VectorXd::Zero(r);
    this->clusters.push_back({MatrixXd::Zero(n, r), square, square, square, square, gap, gap, true, true});
  }
  for (const ContactLanes& contact : contacts) {
    const Matrix6Xd columns = Matrix6Xd::Zero(6, contact.J.cols());
    this->contacts.push_back({columns, columns});
  }
}

ReducedLanes::ReducedLanes(const Model& model, const Reduction& reduction, const std::vector<int>& tips,
                           const std::vector<int>& slots)
    : model_(model),
      reduction_(reduction),
      tips_(tips),
      ws_(model),
      tree_(model, reduction, tips),
      system_(reduction.size, 6 * static_cast<int>(slots.size())),
      state_cost_(model, reduction) {
  clusters_.reserve(reduction.clusters.size());  // lifts point into them
  for (const ReducedCluster& cluster : reduction.clusters) {
    clusters_.emplace_back(cluster);
    lifts_.push_back({&clusters_.back().motion, &clusters_.back().HN});
  }
  for (int tip : slots) {
    ContactLanes contact;
    contact.tip = tip;
    for (Matrix6X<Lanes>* x : {&contact.dy, &contact.dv, &contact.J}) x->setZero(6, tree_.getTip(tip).outer.size());
    contacts_.push_back(contact);
  }
  for (size_t i = 0; i < reduction.free_joints.size(); ++i) {
    const Joint& joint = model.joints()[reduction.free_joints[i]];
    free_.push_back({joint.idx_v, reduction.free_offsets[i], joint.nv});
  }
  nodes_.reserve(kLane);
  f_ext_.assign(model.numBodies(), Vector6<Lanes>::Zero());
  for (VectorX<Lanes>* x : {&v_, &a_, &tau_}) x->setZero(model.nv());
  for (VectorX<Lanes>* x : {&x0_, &x1_}) x->setZero(model.nq() + model.nv());
  dx_.setZero(2 * reduction.size);
  for (MatrixX<Lanes>* x : {&A_y_, &A_v_}) x->setZero(reduction.size, reduction.size);
  for (size_t l = 0; l < kLane; ++l) views_.emplace_back(model, reduction, clusters_, contacts_);
}

int ReducedLanes::findLane(const ReducedNode* node) const {
  const auto found = std::find(nodes_.begin(), nodes_.end(), node);
  return found == nodes_.end() ? -1 : static_cast<int>(found - nodes_.begin());
}

LaneMask ReducedLanes::startSteps(NodeModel* const* nodes, int count, LaneMask& placed) {
  setNodes(count, [&](int l) { return static_cast<ReducedNode*>(nodes[l]); });
  placed = updatePoints();
  packNodes();
  updateStateCosts();
  for (size_t i = 0; i < clusters_.size(); ++i) packClusterStep(i);
  updateColumns(model_, ws_);
  updateVelocities(model_, ws_, v_);
  updateCompositeInertias(model_, ws_);
  updateDrift(model_, ws_);
  a_.setZero();  // here a_d
  for (ClusterLanes& b : clusters_) {
    const auto view = getPlacedView(b.loop, ws_);
    calcClusterDrift<Lanes>(view, b.loop, b.at, b.rows, b.drift);
    b.independent = b.drift;
    applyPseudoInverse<Lanes>(b.loop, b.at, -1, b.independent, b.a_d);
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) a_[b.loop.dofs[k]] = b.a_d[k];
    updateTwists(view, b.at, b.motion);
  }
  updateInverseDynamics(model_, ws_, a_);
  for (const FreeDofs& free : free_)
    for (int k = 0; k < free.size; ++k) system_.f[free.offset + k] = tau_[free.dof + k] - ws_.b[free.dof + k];
  for (ClusterLanes& b : clusters_) {
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) b.left[k] = tau_[b.loop.dofs[k]] - ws_.b[b.loop.dofs[k]];
    auto f = system_.f.segment(b.loop.offset, b.loop.size);
    f.setZero();
    addSmallProductTransposed(b.at.N, b.left, f);
  }
  tree_.updateMassMatrix(ws_, lifts_, system_.M);
  for (size_t slot = 0; slot < contacts_.size(); ++slot) updateContactRows(slot);
  LaneMask solved = system_.solve();
  for (size_t l = 0; l < nodes_.size(); ++l)
    if (nodes_[l]->hasHinges()) solved.v[l] = 0;
  storeFactors(solved);
  return solved;
}

// J_c N and gamma_c + J_c a_d; the accelerations of the workspace are those of a_d.
void ReducedLanes::updateContactRows(size_t slot) {
  ContactLanes& contact = contacts_[slot];
  auto Jt = system_.Jt.middleCols<6>(6 * slot);
  auto gamma = system_.gamma.segment<6>(6 * slot);
  Jt.setZero();
  gamma.setZero();
  if (!contact.used) return;
  const auto& tip = tree_.getTip(contact.tip);
  const int body = tips_[contact.tip];
  contact.gamma = contact.X_WF.actInvMotion(ws_.A[body] - ws_.A[0] + contact.kd * ws_.V[body]) - contact.kp_residual;
  for (size_t o = 0; o < tip.outer.size(); ++o) contact.J.col(o) = contact.X_WF.actInvMotion(tip.J.col(o));
  for (int r = 0; r < 6; ++r) {
    const LaneMask present = system_.absent[6 * slot + r] < Lanes(1);
    gamma[r] = select(present, contact.gamma[r], 0);
    for (size_t o = 0; o < tip.outer.size(); ++o) Jt(tip.outer[o], r) = select(present, contact.J(r, o), 0);
  }
}

// robot_problem.h Eq. (3). Lanes without a node are left to themselves.
LaneMask ReducedLanes::finishSteps() {
  VectorX<Lanes>& ydd = system_.ydd;
  for (Eigen::Index k = 0; k < ydd.size(); ++k)
    for (Eigen::Index l = nodes_.size(); l < kLane; ++l) ydd[k].set(l, ydd[k][0]);
  for (const FreeDofs& free : free_)
    for (int k = 0; k < free.size; ++k) a_[free.dof + k] += ydd[free.offset + k];
  LaneMask closed = Lanes(0) <= Lanes(0);
  for (ClusterLanes& b : clusters_) closed = closed && close(b);
  return closed;
}

LaneMask ReducedLanes::close(ClusterLanes& b) {
  const auto ydd = system_.ydd.segment(b.loop.offset, b.loop.size);
  addSmallProduct(b.at.N, ydd, b.a_d);  // now a
  for (size_t k = 0; k < b.loop.dofs.size(); ++k) {
    const int dof = b.loop.dofs[k];
    a_[dof] = b.a_d[k];
    b.step[k] = h_ * (v_[dof] + h_ * a_[dof]);
  }
  // To second order the closures open by h^2/2 gamma along h w: J J^T zeta = h^2/2 gamma, with the zeta of close(). What that
  // lacked in the step before, it will lack again.
  b.predicted = b.independent * (0.5 * h_ * h_);
  b.zeta = b.predicted + b.surplus;
  const LaneMask closed = b.closing.close(b.loop, b.scratch, b.at, b.step, b.zeta);
  b.surplus = b.closing.zeta() - b.predicted;
  // (I - J'^+ J') w' = N' (W N')^T w'
  const ClusterBasisOf<Lanes>& next = b.closing.basis();
  b.target.setZero();
  addSmallProductTransposed(next.WN, b.closing.step(), b.target);
  b.target /= h_;
  b.v_next.setZero();
  addSmallProduct(next.N, b.target, b.v_next);
  return closed;
}

}  // namespace bielle
