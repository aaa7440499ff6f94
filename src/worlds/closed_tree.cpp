#include "worlds/closed_tree.h"

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/whole_turns.h"
#include "model/joint.h"
#include "model/number_text.h"

namespace bielle::worlds {

ClosedTree::Cluster::Cluster(const ReducedCluster& l) : cluster(l), scratch(l), state(l), next(l), kept(l), motion(l) {
  for (VectorXd* x : {&d, &a_d}) x->setZero(l.model.nv());
  for (VectorXd* x : {&drift, &zeta}) x->setZero(l.rank);
  rows.setZero(l.closures.rows);
}

ClosedTree::ClosedTree(const Model& model, ConstVectorRef q, const std::vector<int>& tips)
    : model_(model),
      reduction_(makeReduction(model, q)),
      tree_(model, reduction_, tips),
      ws_(model),
      free_turns_(listFreeTurns(model)),
      turns_(VectorXd::Zero(model.nq())) {
  places_.resize(model.nv());
  clusters_.reserve(reduction_.clusters.size());  // lifts point into them
  for (const ReducedCluster& cluster : reduction_.clusters) {
    for (size_t k = 0; k < cluster.dofs.size(); ++k)
      places_[cluster.dofs[k]] = {static_cast<int>(clusters_.size()), static_cast<int>(k)};
    clusters_.emplace_back(cluster);
    lifts_.push_back({&clusters_.back().motion, nullptr});
  }
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model.joints()[reduction_.free_joints[i]];
    for (int k = 0; k < joint.nv; ++k) places_[joint.idx_v + k] = {-1, reduction_.free_offsets[i] + k};
  }
  M_.setZero(size(), size());
  for (VectorXd* x : {&q_, &q_next_, &q_kept_}) *x = model.makeNeutral();
  for (VectorXd* x : {&v_, &v_foreseen_, &a_d_}) x->setZero(model.nv());
  for (VectorXd* x : {&w_, &w_foreseen_, &loads_, &w_kept_}) x->setZero(size());
}

bool ClosedTree::set(ConstVectorRef q, ConstVectorRef v) {
  q_ = q;
  turns_.setZero();
  leaveOutTurns(free_turns_, q_, turns_);
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    gatherConfiguration(model_, c.cluster, q_, c.state.basis.q);
    c.zeta.setZero();
    c.drift.setZero();  // of the state before
    if (!updateClusterState<double>(c.cluster, c.scratch, c.state.basis.q, c.state)) {
      failed_ = i;
      return false;
    }
    gatherVelocity(c.cluster, v, c.d);
    w_.segment(c.cluster.offset, c.cluster.size).noalias() = c.state.basis.WN.transpose() * c.d;
  }
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    w_.segment(reduction_.free_offsets[i], joint.nv) = v.segment(joint.idx_v, joint.nv);
  }
  updateTree();
  return true;
}

bool ClosedTree::drift(double h, int halvings) {
  if (driftAtOnce(h)) return true;
  return halvings > 0 && drift(0.5 * h, halvings - 1) && drift(0.5 * h, halvings - 1);
}

// Changes nothing if it fails.
bool ClosedTree::driftAtOnce(double h) {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    gatherVelocity(c.cluster, v_, c.d);
    c.d *= h;
    // To second order the closures open by h^2/2 times their drift. `drift` has it since updateLoads(), solved.
    c.zeta = -0.5 * h * h * c.drift;
    if (!closeCluster<double>(c.cluster, c.scratch, c.state.basis, c.d, c.zeta, c.next)) {
      failed_ = i;
      return false;
    }
  }
  for (Cluster& c : clusters_) {
    auto w = w_.segment(c.cluster.offset, c.cluster.size);
    w.noalias() = c.next.basis.WN.transpose() * c.next.step;
    w /= h;
    std::swap(c.state, c.next);
    scatterConfiguration(model_, c.cluster, c.state.basis.q, q_next_);
  }
  for (int i : reduction_.free_joints) {
    const Joint& joint = model_.joints()[i];
    v_foreseen_.segment(joint.idx_v, joint.nv) = h * v_.segment(joint.idx_v, joint.nv);
    integrateJoint(joint, q_.segment(joint.idx_q, joint.nq), v_foreseen_.segment(joint.idx_v, joint.nv),
                   q_next_.segment(joint.idx_q, joint.nq));
  }
  q_.swap(q_next_);
  updateTree();
  return true;
}

void ClosedTree::keep() {
  const bool is_near = !leaveOutTurns(free_turns_, q_, turns_);
  for (Cluster& c : clusters_) {
    if (!is_near) gatherConfiguration(model_, c.cluster, q_, c.state.basis.q);
    c.kept = c.state;
  }
  q_kept_ = q_;
  w_kept_ = w_;
}

void ClosedTree::restore() {
  for (Cluster& c : clusters_) {
    c.state = c.kept;
    c.drift.setZero();  // of another state
  }
  q_ = q_kept_;
  w_ = w_kept_;
  updateTree();
}

// Bodies and velocities at q and w.
void ClosedTree::updateTree() {
  updatePositions(model_, ws_, q_);
  v_.setZero();
  addReduced(w_, v_);
}

double ClosedTree::calcPotential() const { return calcPotentialEnergy(model_, ws_); }

double ClosedTree::calcEnergy() {
  updateVelocities<double>(model_, ws_, v_);
  return calcKineticEnergy(model_, ws_) + calcPotential();
}

std::string ClosedTree::failure() const {
  const Cluster& c = clusters_[failed_];
  const std::string why = describeFailure(c.cluster, c.scratch);
  if (c.scratch.closed) return why;
  return why + "; " + formatNumber(c.scratch.residual.cwiseAbs().maxCoeff(), "%.3g") + " m or rad are left open";
}

void ClosedTree::updateMassMatrix() {
  updateCompositeInertias(model_, ws_);
  for (Cluster& c : clusters_) updateTwists(getPlacedView(c.cluster, ws_), c.state.basis, c.motion);
  tree_.updateMassMatrix(ws_, lifts_, M_);
}

void ClosedTree::updateLoads(ConstVectorRef tau, const VectorXd& dw) {
  v_foreseen_ = v_;
  addReduced(dw, v_foreseen_);
  updateVelocities<double>(model_, ws_, v_foreseen_);
  updateDrift(model_, ws_);
  a_d_.setZero();
  for (Cluster& c : clusters_) {
    calcClusterDrift<double>(getPlacedView(c.cluster, ws_), c.cluster, c.state.basis, c.rows, c.drift);
    applyPseudoInverse<double>(c.cluster, c.state.basis, -1, c.drift, c.a_d);  // leaves the solution in c.drift
    scatterVelocity(c.cluster, c.a_d, a_d_);
  }
  updateInverseDynamics<double>(model_, ws_, a_d_);
  v_foreseen_ = tau - ws_.b;
  for (Cluster& c : clusters_) {
    gatherVelocity(c.cluster, v_foreseen_, c.d);
    loads_.segment(c.cluster.offset, c.cluster.size).noalias() = c.state.basis.N.transpose() * c.d;
  }
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    loads_.segment(reduction_.free_offsets[i], joint.nv) = v_foreseen_.segment(joint.idx_v, joint.nv);
  }
}

void ClosedTree::kick(const VectorXd& dw) {
  w_ += dw;
  addReduced(dw, v_);
}

// v += N dw
void ClosedTree::addReduced(const VectorXd& dw, VectorXd& v) const {
  for (const Cluster& c : clusters_)
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k)
      v[c.cluster.dofs[k]] += c.state.basis.N.row(k).dot(dw.segment(c.cluster.offset, c.cluster.size));
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    v.segment(joint.idx_v, joint.nv) += dw.segment(reduction_.free_offsets[i], joint.nv);
  }
}

}  // namespace bielle::worlds
