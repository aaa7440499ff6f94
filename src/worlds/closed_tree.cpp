#include "worlds/closed_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/energy.h"
#include "dynamics/joint_force.h"
#include "dynamics/nearby_closing.h"
#include "dynamics/whole_turns.h"
#include "math/small_dense.h"
#include "model/joint.h"
#include "model/number_text.h"

namespace bielle::worlds {
namespace {

template <typename T>
void gather(const std::vector<int>& dofs, const VectorX<T>& v, VectorX<T>& out) {
  for (size_t k = 0; k < dofs.size(); ++k) out[k] = v[dofs[k]];
}

// out = A^T x
template <typename T, typename Out>
void multiplyTransposed(const MatrixX<T>& A, const VectorX<T>& x, Out&& out) {
  if constexpr (std::is_same_v<T, double>) {
    out.noalias() = A.transpose() * x;
  } else {
    out.setZero();
    addSmallProductTransposed(A, x, out);
  }
}

// updateVelocities() and updateDrift(), without what derivatives alone need.
template <typename T>
void updateMotion(const Model& model, WorkspaceOf<T>& ws, const VectorX<T>& v) {
  ws.v = v;
  ws.a.setZero();
  ws.A[0] << -model.gravity().cast<T>(), Vector3<T>::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const bool sequential = joint.kind == JointKind::Universal;
    Vector6<T> V = ws.V[joint.parent], A = ws.A[joint.parent];
    if (!sequential && joint.nv > 1)
      for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) V += ws.J.col(k) * v[k];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) {
      const Vector6<T> J = ws.J.col(k), dJ = crossMotion(V, J);
      ws.dJ.col(k) = dJ;
      A += dJ * v[k];
      if (sequential || joint.nv == 1) V += J * v[k];
    }
    ws.V[i] = V;
    ws.A[i] = A;
    if (model.bodies()[i].inertia.mass > 0) ws.h[i].noalias() = ws.Y[i] * V;
  }
  ws.stage = WorkspaceStage::Velocity;
}

template <typename T>
void assignState(const MaskOf<T>& mask, const ClusterStateOf<T>& from, ClusterStateOf<T>& to) {
  for (auto part : {&ClusterBasisOf<T>::N, &ClusterBasisOf<T>::WN, &ClusterBasisOf<T>::J, &ClusterBasisOf<T>::L})
    assignLanes(mask, from.basis.*part, to.basis.*part);
  assignLanes(mask, from.basis.q, to.basis.q);
  for (size_t i = 0; i < to.basis.rows.size(); ++i)
    to.basis.rows[i] = select(mask, from.basis.rows[i], to.basis.rows[i]);
  for (size_t i = 0; i < to.placements.size(); ++i) {
    assignLanes(mask, from.placements[i].R, to.placements[i].R);
    assignLanes(mask, from.placements[i].p, to.placements[i].p);
  }
  assignLanes(mask, from.zeta, to.zeta);
  assignLanes(mask, from.step, to.step);
}

}  // namespace

template <typename T>
ClosedTreeOf<T>::Cluster::Cluster(const ReducedCluster& l) : cluster(l), scratch(l), next(l), motion(l) {
  for (Vector* x : {&d, &a_d}) x->setZero(l.model.nv());
  for (Vector* x : {&drift, &zeta}) x->setZero(l.rank);
  rows.setZero(l.closures.rows);
  JW.setZero(l.rank, l.model.nv());
  B.setZero(l.rank, l.closures.rows);
  BB.setZero(l.rank, l.rank);
  y.setZero(l.rank);
  lambda.setZero(l.closures.rows);
  pivots.resize(l.rank);
}

template <typename T>
ClosedTreeOf<T>::ClosedTreeOf(const Model& model, ConstVectorRef q, const std::vector<int>& tips)
    : model_(model),
      reduction_(makeReduction(model, q)),
      tree_(model, reduction_, tips),
      ws_(model),
      free_turns_(listFreeTurns(model)) {
  places_.resize(model.nv());
  clusters_.reserve(reduction_.clusters.size());  // lifts point into them
  for (const ReducedCluster& cluster : reduction_.clusters) {
    for (size_t k = 0; k < cluster.dofs.size(); ++k)
      places_[cluster.dofs[k]] = {static_cast<int>(clusters_.size()), static_cast<int>(k)};
    clusters_.emplace_back(cluster);
    clusters_.back().scratch.changes = &state_.changes;
    lifts_.push_back({&clusters_.back().motion, nullptr});
    state_.clusters.emplace_back(cluster);
    for (auto* each : {&state_.drifts, &state_.thirds}) each->push_back(Vector::Zero(cluster.rank));
  }
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model.joints()[reduction_.free_joints[i]];
    for (int k = 0; k < joint.nv; ++k) places_[joint.idx_v + k] = {-1, reduction_.free_offsets[i] + k};
  }
  M_.setZero(size(), size());
  for (Vector* x : {&state_.q, &q_next_, &q_kept_}) *x = model.makeNeutral().cast<T>();
  state_.turns.setZero(model.nq());
  for (Vector* x : {&state_.v, &v_next_, &v_foreseen_, &a_d_, &forces_, &rates_}) x->setZero(model.nv());
  changes_.assign(model.numBodies(), Vector6<T>::Zero());
  state_.armature = ws_.armature;
  for (Vector* x : {&state_.w, &w_next_, &loads_, &w_kept_}) x->setZero(size());
}

template <typename T>
MaskOf<T> ClosedTreeOf<T>::set(const Vector& q, const Vector& v, const Mask& which) {
  Mask done = which;
  assignLanes(which, q, state_.q);
  assignLanes(which, Vector::Zero(q.size()), state_.turns);
  leaveOutTurns(which);
  w_next_ = state_.w;
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    Mask regular = renew(i, which);
    if (!state_.changes.empty()) regular = closeChanged(i, regular);
    describe(i, done && !regular);
    done = done && regular;
    if (!any(done)) return done;
    gather(c.cluster.dofs, v, c.d);
    multiplyTransposed<T>(state_.clusters[i].basis.WN, c.d, w_next_.segment(c.cluster.offset, c.cluster.size));
  }
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    w_next_.segment(reduction_.free_offsets[i], joint.nv) = v.segment(joint.idx_v, joint.nv);
  }
  assignLanes(which, w_next_, state_.w);
  updateTree(which);
  return done;
}

template <typename T>
void ClosedTreeOf<T>::setInertias(const Vector& mass_factors, const Vector& armature, const Mask& which) {
  Vector& factors = state_.mass_factors;
  if (factors.size() == 0) factors.setOnes(model_.numBodies());
  assignLanes(which, mass_factors, factors);
  assignLanes(which, armature, state_.armature);
  ws_.armature = state_.armature;
  bool differ = false;
  for (const T& factor : factors) differ = differ || any(factor < T(1) || factor > T(1));
  if (!differ) factors.resize(0);
  updateTree(which);
}

// The state of a cluster at q: its bases are the same however it is reached. \returns false where it is singular
template <typename T>
MaskOf<T> ClosedTreeOf<T>::renew(size_t cluster, const Mask& which) {
  Cluster& c = clusters_[cluster];
  gatherConfiguration<T>(model_, c.cluster, state_.q, c.next.basis.q);
  const Mask regular = updateNearbyCluster<T>(c.cluster, c.scratch, c.next.basis.q, c.next);
  takeNext(which, cluster);
  for (auto* each : {&state_.drifts, &state_.thirds})  // of another state
    assignLanes(which, Vector::Zero(c.cluster.rank), (*each)[cluster]);
  return regular;
}

template <typename T>
void ClosedTreeOf<T>::setClosures(const std::vector<ClosureChangeOf<T>>& changes, const Mask& which) {
  std::vector<ClosureChangeOf<T>>& own = state_.changes;
  if (own.empty())
    for (const Closure& closure : model_.closures()) {
      own.emplace_back();
      own.back().length = closure.length;
      own.back().square = closure.length * closure.length;
    }
  for (size_t c = 0; c < own.size(); ++c) {
    for (auto shift : {&ClosureChangeOf<T>::shift1, &ClosureChangeOf<T>::shift2})
      assignLanes(which, changes[c].*shift, own[c].*shift);
    assignLanes(which, changes[c].length, own[c].length);
    assignLanes(which, changes[c].square, own[c].square);
  }
}

// Whether a cluster has closures other than those of the model.
template <typename T>
MaskOf<T> ClosedTreeOf<T>::findChanged(size_t cluster) const {
  Mask out = makeMask<T>(false);
  for (int c : clusters_[cluster].cluster.closure_indices) {
    const ClosureChangeOf<T>& change = state_.changes[c];
    const T amount = change.shift1.squaredNorm() + change.shift2.squaredNorm(), length = model_.closures()[c].length;
    out = out || amount > T(0) || change.length < length || change.length > length;
  }
  return out;
}

// Closes a cluster whose closures are not those of the model, from where it is.
template <typename T>
MaskOf<T> ClosedTreeOf<T>::closeChanged(size_t cluster, const Mask& which) {
  Cluster& c = clusters_[cluster];
  const Mask changed = which && findChanged(cluster);
  if (!any(changed)) return which;
  c.d.setZero();
  const Mask closed =
      closeNearbyCluster<T>(c.cluster, c.scratch, state_.clusters[cluster].basis, c.d, Vector(), c.next);
  takeNext(changed && closed, cluster);
  q_next_ = state_.q;
  scatterConfiguration<T>(model_, c.cluster, state_.clusters[cluster].basis.q, q_next_);
  assignLanes(changed && closed, q_next_, state_.q);
  return which && (closed || !changed);
}

template <typename T>
MaskOf<T> ClosedTreeOf<T>::drift(const T& h, const Mask& which, int halvings) {
  const Mask done = driftAtOnce(h, which, halvings == 0), left = which && !done;
  if (halvings == 0 || !any(left)) return done;
  const T half = 0.5 * h;
  const Mask first = drift(half, left, halvings - 1);
  return any(first) ? done || drift(half, first, halvings - 1) : done;
}

// Changes nothing where it fails.
template <typename T>
MaskOf<T> ClosedTreeOf<T>::driftAtOnce(const T& h, const Mask& which, bool is_last) {
  Mask done = which;
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    gather(c.cluster.dofs, state_.v, c.d);
    c.d *= h;
    // To second order the closures open by h^2/2 times their drift; beyond that, much as in the last one.
    c.zeta = h * h * (h * state_.thirds[i] - 0.5 * state_.drifts[i]);
    if (!all(done)) {  // the others close at once
      assignLanes(!done, Vector::Zero(c.d.size()), c.d);
      assignLanes(!done, Vector::Zero(c.zeta.size()), c.zeta);
    }
    const Mask closed = closeNearbyCluster<T>(c.cluster, c.scratch, state_.clusters[i].basis, c.d, c.zeta, c.next);
    if (is_last) describe(i, done && !closed);
    done = done && closed;
    if (!any(done)) return done;
  }
  w_next_ = state_.w;
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    auto w = w_next_.segment(c.cluster.offset, c.cluster.size);
    multiplyTransposed<T>(c.next.basis.WN, c.next.step, w);
    w /= h;
    c.zeta = (c.next.zeta / (h * h) + 0.5 * state_.drifts[i]) / h;
    assignLanes(done, c.zeta, state_.thirds[i]);
    takeNext(done, i);
    scatterConfiguration<T>(model_, c.cluster, state_.clusters[i].basis.q, q_next_);
  }
  for (int i : reduction_.free_joints) {
    const Joint& joint = model_.joints()[i];
    v_foreseen_.segment(joint.idx_v, joint.nv) = h * state_.v.segment(joint.idx_v, joint.nv);
    integrateJoint<T>(joint, state_.q.segment(joint.idx_q, joint.nq), v_foreseen_.segment(joint.idx_v, joint.nv),
                      q_next_.segment(joint.idx_q, joint.nq));
  }
  if (!all(done)) {
    assignLanes(!done, state_.q, q_next_);
    assignLanes(!done, state_.w, w_next_);
  }
  state_.q.swap(q_next_);
  state_.w.swap(w_next_);
  updateTree(done);
  return done;
}

template <typename T>
void ClosedTreeOf<T>::takeNext(const Mask& which, size_t cluster) {
  if (all(which))
    std::swap(state_.clusters[cluster], clusters_[cluster].next);
  else
    assignState(which, clusters_[cluster].next, state_.clusters[cluster]);
}

template <typename T>
bool ClosedTreeOf<T>::leaveOutTurns(const Mask& which) {
  if constexpr (std::is_same_v<T, double>) {
    return bielle::leaveOutTurns(free_turns_, state_.q, state_.turns);
  } else {
    bool is_far = false;
    for (int i : free_turns_)
      for (int l = 0; l < kLane; ++l) {
        const double angle = state_.q[i][l], rest = bielle::leaveOutTurns(angle);
        if (!which[l] || rest == angle) continue;
        state_.turns[i].set(l, state_.turns[i][l] + (angle - rest));
        state_.q[i].set(l, rest);
        is_far = true;
      }
    return is_far;
  }
}

template <typename T>
void ClosedTreeOf<T>::keep(const Mask& which) {
  if (leaveOutTurns(which))
    for (size_t i = 0; i < clusters_.size(); ++i)
      gatherConfiguration<T>(model_, clusters_[i].cluster, state_.q, state_.clusters[i].basis.q);
  assignLanes(which, state_.q, q_kept_);
  assignLanes(which, state_.w, w_kept_);
}

template <typename T>
void ClosedTreeOf<T>::restore(const Mask& which) {
  assignLanes(which, q_kept_, state_.q);
  assignLanes(which, w_kept_, state_.w);
  for (size_t i = 0; i < clusters_.size(); ++i) renew(i, which);
  updateTree(which);
}

// Bodies at q, and velocities at w.
template <typename T>
void ClosedTreeOf<T>::updateTree(const Mask& which) {
  updatePlacements<T>(model_, ws_, state_.q);
  updateColumns<T>(model_, ws_);
  for (Eigen::Index i = 0; i < state_.mass_factors.size(); ++i) ws_.Y[i] *= state_.mass_factors[i];
  v_next_.setZero();
  addReduced(state_.w, v_next_);
  if (!all(which)) assignLanes(!which, state_.v, v_next_);
  state_.v.swap(v_next_);
}

template <typename T>
T ClosedTreeOf<T>::calcMass() const {
  T mass = model_.mass();
  for (Eigen::Index i = 0; i < state_.mass_factors.size(); ++i)
    mass += (state_.mass_factors[i] - 1) * model_.bodies()[i].inertia.mass;
  return mass;
}

template <typename T>
T ClosedTreeOf<T>::calcPotential() const {
  T energy = calcPotentialEnergyOf(model_, ws_);
  for (Eigen::Index i = 0; i < state_.mass_factors.size(); ++i) {
    const Inertia& inertia = model_.bodies()[i].inertia;
    const Vector3<T> weight = inertia.mass * model_.gravity().cast<T>();
    energy -= (state_.mass_factors[i] - 1) * weight.dot(ws_.X_WB[i].act(inertia.com.cast<T>()));
  }
  return energy;
}

template <typename T>
T ClosedTreeOf<T>::calcEnergy() {
  updateVelocities<T>(model_, ws_, state_.v);
  return calcKineticEnergyOf(model_, ws_) + calcPotential();
}

template <typename T>
void ClosedTreeOf<T>::describe(size_t cluster, const Mask& which) {
  if (!any(which)) return;
  const Cluster& c = clusters_[cluster];
  for (int l = 0; l < kLanesOf<T>; ++l) {
    if (!getLane(which, l)) continue;
    failures_[l] = describeFailure(c.cluster, c.scratch, l);
    if (getLane(c.scratch.closed, l)) continue;
    double largest = 0;
    for (const T& gap : c.scratch.residual) largest = std::max(largest, std::abs(getLane(gap, l)));
    failures_[l] += "; " + formatNumber(largest, "%.3g") + " m or rad are left open";
  }
}

template <typename T>
void ClosedTreeOf<T>::updateMassMatrix() {
  updateCompositeInertias(model_, ws_);
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    updateTwists(getPlacedView(c.cluster, ws_), state_.clusters[i].basis, c.motion);
  }
  tree_.updateMassMatrix(ws_, lifts_, M_);
}

template <typename T>
void ClosedTreeOf<T>::updateLoads(const Vector& tau, const Vector& dw, const Mask& which) {
  v_foreseen_ = state_.v;
  addReduced(dw, v_foreseen_);
  updateMotion(model_, ws_, v_foreseen_);
  a_d_.setZero();
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    const ClusterBasisOf<T>& basis = state_.clusters[i].basis;
    calcClusterDrift<T>(getPlacedView(c.cluster, ws_), c.cluster, basis, c.rows, c.drift, state_.changes);
    applyPseudoInverse<T>(c.cluster, basis, -1, c.drift, c.a_d);  // leaves the solution in c.drift
    assignLanes(which, c.drift, state_.drifts[i]);
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) a_d_[c.cluster.dofs[k]] = c.a_d[k];
  }
  updateInverseDynamics<T>(model_, ws_, a_d_);
  forces_ = tau - ws_.b;
  for (const JointForce& force : model_.jointForces())
    forces_[force.dof] -= calcDissipativeForce<T>(force, ws_.v[force.dof]);
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    gather(c.cluster.dofs, forces_, c.d);
    multiplyTransposed<T>(state_.clusters[i].basis.N, c.d, loads_.segment(c.cluster.offset, c.cluster.size));
  }
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    loads_.segment(reduction_.free_offsets[i], joint.nv) = forces_.segment(joint.idx_v, joint.nv);
  }
}

// J_all^T lambda = r = M w' - what else acts. With lambda = J_all x, x = W^{-1} J^T y, this is B B^T y = J W^{-1} r;
// where no row is redundant, lambda = (J W^{-1} J^T)^{-1} J W^{-1} r.
template <typename T>
void ClosedTreeOf<T>::updateClosureForces(const T& h, const Vector& dw, const std::vector<Vector6<T>>& on_bodies,
                                          const Vector& on_dofs, const std::vector<int>& closures, Vector& sizes) {
  using std::sqrt;
  rates_.setZero();
  addReduced(dw, rates_);
  rates_ /= h;
  for (int i = 1; i < model_.numBodies(); ++i) {
    const Joint& joint = model_.joints()[i];
    changes_[i] = changes_[joint.parent];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) changes_[i] += ws_.J.col(k) * rates_[k];
    ws_.F[i] = ws_.Y[i] * changes_[i] - on_bodies[i];
  }
  for (int i = model_.numBodies() - 1; i > 0; --i) {
    const Joint& joint = model_.joints()[i];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k)
      rates_[k] = ws_.J.col(k).dot(ws_.F[i]) + ws_.armature[k] * rates_[k] - forces_[k] - on_dofs[k];
    if (joint.parent > 0) ws_.F[joint.parent] += ws_.F[i];
  }
  for (size_t i = 0; i < clusters_.size(); ++i) {
    Cluster& c = clusters_[i];
    const std::vector<int>& own = c.cluster.closure_indices;
    const auto holds = [&](int closure) { return std::find(own.begin(), own.end(), closure) != own.end(); };
    if (std::none_of(closures.begin(), closures.end(), holds)) continue;
    const ClusterBasisOf<T>& basis = state_.clusters[i].basis;
    gather(c.cluster.dofs, rates_, c.d);
    for (Eigen::Index k = 0; k < c.d.size(); ++k) c.d[k] *= c.cluster.inverse_metric[k];
    c.y.setZero();
    addSmallProduct(basis.J, c.d, c.y);
    if (c.cluster.rank == c.cluster.closures.rows) {
      solveGram(basis, c.y);
      expandIndependent<T>(basis, c.y, c.lambda);
    } else {
      for (Eigen::Index k = 0; k < c.JW.cols(); ++k) c.JW.col(k) = basis.J.col(k) * T(c.cluster.inverse_metric[k]);
      for (MatrixX<T>* x : {&c.B, &c.BB}) x->setZero();
      addSmallProduct(c.JW, c.scratch.J_all.transpose(), c.B);
      addSmallProduct(c.B, c.B.transpose(), c.BB);
      factorizeSmall(c.BB, c.pivots);
      solveFactorized(c.BB, c.pivots, c.y);
      c.lambda.setZero();
      addSmallProductTransposed(c.B, c.y, c.lambda);
    }
    for (size_t k = 0; k < closures.size(); ++k)
      for (size_t o = 0; o < own.size(); ++o)
        if (own[o] == closures[k])
          sizes[k] = sqrt(c.lambda.template segment<3>(c.cluster.closures.offsets[o]).squaredNorm());
  }
}

template <typename T>
void ClosedTreeOf<T>::kick(const Vector& dw, const Mask& which) {
  w_next_ = state_.w + dw;
  v_next_ = state_.v;
  addReduced(dw, v_next_);
  if (!all(which)) {
    assignLanes(!which, state_.w, w_next_);
    assignLanes(!which, state_.v, v_next_);
  }
  state_.w.swap(w_next_);
  state_.v.swap(v_next_);
}

// v += N dw
template <typename T>
void ClosedTreeOf<T>::addReduced(const Vector& dw, Vector& v) const {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    const ReducedCluster& cluster = clusters_[i].cluster;
    for (size_t k = 0; k < cluster.dofs.size(); ++k)
      v[cluster.dofs[k]] += state_.clusters[i].basis.N.row(k).dot(dw.segment(cluster.offset, cluster.size));
  }
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    v.segment(joint.idx_v, joint.nv) += dw.segment(reduction_.free_offsets[i], joint.nv);
  }
}

template class ClosedTreeOf<double>;
template class ClosedTreeOf<Lanes>;

}  // namespace bielle::worlds
