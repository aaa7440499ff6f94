// Copies data between the nodes and the kernel's lanes.
#include <algorithm>
#include <array>

#include "ocp/reduced/reduced_kernel.h"

namespace bielle {

// Placements and velocities of a point.
void ReducedKernel::loadState(LaneSource<const ReducedEvaluation> nodes, Point point) {
  const int nq = model_.nq(), count = nodes.count;
  const bool at_state = point == Point::State;
  gatherLanes(count, nq, ws_.q.data(), [&](int l) { return (at_state ? nodes[l].x : nodes[l].q_mid).data(); });
  gatherLanes(count, v_.size(), v_.data(), [&](int l) {
    if (at_state) return nodes[l].x.data() + nq;
    return (point == Point::Foreseen ? nodes[l].midpoint->v : nodes[l].v_mid).data();
  });
  gatherLanes(count, 12 * model_.numBodies(), getNumbers(ws_.X_WB.front()),
              [&](int l) { return getNumbers((at_state ? nodes[l].X_WB : nodes[l].midpoint->X_WB).front()); });
  ws_.stage = WorkspaceStage::Placement;
}

namespace {

// The cluster of each node that `get` names.
template <typename Get>
void loadBasis(const ReducedCluster& cluster, int count, const Get& get, ClusterBasisOf<Lanes>& to) {
  gatherLanes(count, to.q.size(), to.q.data(), [&](int l) { return get(l).q.data(); });
  gatherLanes(count, to.N.size(), to.N.data(), [&](int l) { return get(l).N.data(); });
  gatherLanes(count, to.J.size(), to.J.data(), [&](int l) { return get(l).J.data(); });
  gatherLanes(count, to.L.size(), to.L.data(), [&](int l) { return get(l).L.data(); });
  for (Eigen::Index c = 0; c < to.N.cols(); ++c)
    for (Eigen::Index k = 0; k < to.N.rows(); ++k) to.WN(k, c) = cluster.metric[k] * to.N(k, c);
  for (size_t k = 0; k < to.rows.size(); ++k)
    for (int l = 0; l < kLane; ++l) to.rows[k].set(l, get(l < count ? l : 0).rows[k]);
}

template <typename Get>
void storeBasis(const ClusterBasisOf<Lanes>& basis, int count, const Get& get) {
  const auto give = [&](const auto& from, const auto& select) {
    scatterLanes(from.data(), from.size(), count, [&](int l) -> double* {
      ClusterBasis* to = get(l);
      return to ? select(*to).data() : nullptr;
    });
  };
  give(basis.q, [](ClusterBasis& b) -> VectorXd& { return b.q; });
  give(basis.N, [](ClusterBasis& b) -> MatrixXd& { return b.N; });
  give(basis.WN, [](ClusterBasis& b) -> MatrixXd& { return b.WN; });
  give(basis.J, [](ClusterBasis& b) -> MatrixXd& { return b.J; });
  give(basis.L, [](ClusterBasis& b) -> MatrixXd& { return b.L; });
  for (int l = 0; l < count; ++l)
    if (ClusterBasis* to = get(l))
      for (size_t k = 0; k < basis.rows.size(); ++k) to->rows[k] = basis.rows[k][l];
}

// The state of a cluster to those that `get` names, null for none.
template <typename Get>
void storeState(const ClusterStateOf<Lanes>& state, int count, const Get& get) {
  storeBasis(state.basis, count, [&](int l) -> ClusterBasis* {
    ClusterState* to = get(l);
    return to ? &to->basis : nullptr;
  });
  const auto give = [&](const Lanes* from, Eigen::Index size, const auto& select) {
    scatterLanes(from, size, count, [&](int l) -> double* {
      ClusterState* to = get(l);
      return to ? select(*to) : nullptr;
    });
  };
  give(getNumbers(state.placements.front()), 12 * state.placements.size(),
       [](ClusterState& s) { return getNumbers(s.placements.front()); });
  give(state.zeta.data(), state.zeta.size(), [](ClusterState& s) { return s.zeta.data(); });
  give(state.step.data(), state.step.size(), [](ClusterState& s) { return s.step.data(); });
}

}  // namespace

void ReducedKernel::loadBases(LaneSource<const ReducedEvaluation> nodes) {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& c = clusters_[i];
    loadBasis(
        c.cluster, nodes.count, [&](int l) -> const ClusterBasis& { return nodes[l].clusters[i].at; }, c.at);
  }
}

void ReducedKernel::loadMidpointBases(LaneSource<const ReducedEvaluation> nodes) {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& c = clusters_[i];
    loadBasis(
        c.cluster, nodes.count, [&](int l) -> const ClusterBasis& { return nodes[l].midpoint->clusters[i].basis; },
        c.at);
  }
}

// Bases and placements relative to the body that carries the cluster: those of the q+ with which the state is
// identical, if there is one, or else those that placeAll() has stored in place of q+.
void ReducedKernel::loadPoints(const StepItem* items, int count) {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& c = clusters_[i];
    const auto get = [&](int l) -> const ClusterState& {
      return (items[l].previous ? items[l].previous : items[l].at)->clusters[i].next;
    };
    loadBasis(
        c.cluster, count, [&](int l) -> const ClusterBasis& { return get(l).basis; }, c.at);
    for (size_t j = 0; j < c.cluster.joints.size(); ++j)
      gatherLanes(count, 12, getNumbers(ws_.X_WB[c.cluster.joints[j]]),
                  [&](int l) { return getNumbers(get(l).placements[j + 1]); });
    for (int l = 0; l < count; ++l) items[l].at->clusters[i].at = get(l).basis;
  }
}

// Stores to the nodes whose state is not the q+ of another node: the memory of their own q+ is free until their step.
void ReducedKernel::storeNext(size_t cluster, const StepItem* items, int count) {
  storeState(clusters_[cluster].next, count,
             [&](int l) { return items[l].previous ? nullptr : &items[l].at->clusters[cluster].next; });
}

void ReducedKernel::storePoints(const StepItem* items, int count) {
  scatterLanes(getNumbers(ws_.X_WB.front()), 12 * model_.numBodies(), count,
               [&](int l) { return getNumbers(items[l].at->X_WB.front()); });
}

// k and h of Eq. (g); of a midpoint step those of the second drift.
void ReducedKernel::loadSteps(const StageSpec& spec, double h, int lane) {
  kick_.set(lane, h);
  drift_.set(lane, spec.step == StepRule::Midpoint ? 0.5 * h : h);
  for (int k = 0; k < model_.nv(); ++k)
    ws_.armature[k].set(lane, model_.armature()[k] + (spec.armature.size() > 0 ? spec.armature[k] : 0));
}

// Time steps, armature and motor forces.
void ReducedKernel::loadControls(const StepItem* items, int count) {
  for (int l = 0; l < kLane; ++l) {
    const StepItem& item = items[l < count ? l : 0];
    loadSteps(*item.spec, item.at->dt, l);
  }
  gatherLanes(count, u_.size(), u_.data(), [&](int l) { return items[l].at->u.data(); });
  tau_.setZero();
  for (int m = 0; m < model_.nu(); ++m) tau_[model_.motors()[m].dof] = u_[m];
}

// Nodes without a contact in a slot have zero force there; its other numbers are arbitrary. Lanes without a node
// repeat the first one: without its contacts they would fall, and take longer to close than all others. Gains act at
// the state.
void ReducedKernel::loadContacts(LaneSource<const ReducedEvaluation> nodes, const int* indices, Point point,
                                 ContactUse use) {
  for (ContactLanes& slot : contacts_) {
    slot.used = false;
    slot.present = 0;
    slot.turn.setZero();
    if (use == ContactUse::Derivatives) slot.wrench.setZero();
    if (point != Point::State) continue;
    slot.kd = 0;
    slot.stabilization.setZero();
    slot.kp_rate.setZero();
  }
  for (int l = 0; l < kLane; ++l) {
    const ContactLayout& layout = layout_.contacts[indices[l < nodes.count ? l : 0]];
    for (const ContactLayout::Contact& contact : layout.contacts)
      loadContact(l, contact, nodes[l], layout.closure_rows, point, use);
  }
}

void ReducedKernel::loadContact(int lane, const ContactLayout::Contact& contact, const ReducedEvaluation& node,
                                int closure_rows, Point point, ContactUse use) {
  ContactLanes& slot = contacts_[contact.slot];
  const Closure& closure = *contact.closure;
  const SE3 X_WF = (point == Point::State ? node.X_WB : node.midpoint->X_WB)[closure.body1] * closure.X_B1;
  for (int k = 0; k < 12; ++k) getNumbers(slot.X_WF)[k].set(lane, getNumbers(X_WF)[k]);
  for (int k = 0; k < 9; ++k) slot.turn.data()[k].set(lane, contact.turn.data()[k]);
  slot.present.set(lane, 1);
  slot.used = true;
  if (use == ContactUse::Derivatives) {
    const VectorXd& forces = point == Point::Foreseen ? node.midpoint->lambda : node.lambda;
    const VectorUpTo6<double> lambda = forces.segment(closure_rows + contact.row, contact.rows);
    const Vector6d wrench = X_WF.actForce(expandRows(closure, lambda));
    for (int k = 0; k < 6; ++k) slot.wrench[k].set(lane, wrench[k]);
  }
  if (point != Point::State) return;
  slot.kd.set(lane, closure.kd);
  if (closure.kp == 0) return;
  const SE3 X_12 = X_WF.inverseTimes(closure.X_B2);
  if (use == ContactUse::Step) {
    const RowVectorUpTo6 residual = closure.kp * calcClosureResidual(closure, X_12);
    for (int r = 0; r < contact.rows; ++r) slot.stabilization[r].set(lane, -residual[r]);
  } else {
    const RowsBy6 rate = closure.kp * calcClosureResidualRate(closure, X_12);
    for (int r = 0; r < contact.rows; ++r)
      for (int c = 0; c < 6; ++c) slot.kp_rate(r, c).set(lane, rate(r, c));
  }
}

// References and weights of the state costs, unless they are still loaded from the last call. False if no node has one;
// nodes without one get weights of zero.
bool ReducedKernel::loadStateCosts(const int* indices, const StageSpec* const* specs, int count) {
  std::array<int, kLane> wanted;
  std::array<const StateCost*, kLane> costs;
  const StateCost* some = nullptr;
  for (int l = 0; l < kLane; ++l) {
    const int i = l < count ? l : 0;
    wanted[l] = layout_.state_costs[indices[i]];
    costs[l] = wanted[l] < 0 ? nullptr : &specs[i]->state;
    if (costs[l]) some = costs[l];
  }
  if (!some) return false;
  if (wanted == loaded_costs_) return true;
  loaded_costs_ = wanted;
  const auto load = [&](const auto& get, auto& out) {
    gatherLanes(kLane, out.size(), out.data(), [&](int l) { return get(costs[l] ? *costs[l] : *some).data(); });
  };
  load([](const StateCost& cost) -> const VectorXd& { return cost.q_ref; }, state_cost_.q_ref);
  load([](const StateCost& cost) -> const VectorXd& { return cost.v_ref; }, state_cost_.v_ref);
  load([](const StateCost& cost) -> const VectorXd& { return cost.weights; }, state_cost_.weights);
  Lanes weight;
  for (int l = 0; l < kLane; ++l) weight.set(l, costs[l] ? costs[l]->weight : 0);
  state_cost_.weights *= weight;
  if (!model_.hasFreeFlyer()) return true;
  for (int k = 0; k < 4; ++k) {
    std::array<Matrix3d, kLane> own;
    for (int l = 0; l < kLane; ++l)
      own[l] = (costs[l] ? *costs[l] : *some).calcCoupling(3 * (k % 2) + k / 2 * model_.nv());
    Matrix3<Lanes>& coupling = state_cost_.couplings[k];
    gatherLanes(kLane, coupling.size(), coupling.data(), [&](int l) { return own[l].data(); });
    coupling *= weight;
  }
  return true;
}

// Accelerations and closure forces of a step that was evaluated before.
void ReducedKernel::loadAccelerations(LaneSource<const ReducedEvaluation> nodes, Point point) {
  const bool foreseen = point == Point::Foreseen;
  gatherLanes(nodes.count, a_.size(), a_.data(),
              [&](int l) { return (foreseen ? nodes[l].midpoint->a : nodes[l].a).data(); });
  gatherLanes(nodes.count, closure_forces_.size(), closure_forces_.data(),
              [&](int l) { return (foreseen ? nodes[l].midpoint->lambda : nodes[l].lambda).data(); });
}

// Where a drift has led; get(node, cluster) is the state.
template <typename Get>
void ReducedKernel::loadDrift(LaneSource<const ReducedEvaluation> nodes, const Get& get_state) {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& c = clusters_[i];
    const auto get = [&](int l) -> const ClusterState& { return get_state(nodes[l], i); };
    loadBasis(
        c.cluster, nodes.count, [&](int l) -> const ClusterBasis& { return get(l).basis; }, c.next.basis);
    gatherLanes(nodes.count, c.next.zeta.size(), c.next.zeta.data(), [&](int l) { return get(l).zeta.data(); });
    gatherLanes(nodes.count, c.next.step.size(), c.next.step.data(), [&](int l) { return get(l).step.data(); });
    gatherLanes(nodes.count, 12 * c.cluster.model.numBodies(), getNumbers(c.own.X_WB.front()),
                [&](int l) { return getNumbers(get(l).placements.front()); });
    c.own.q = c.next.basis.q;
    c.own.stage = WorkspaceStage::Placement;
  }
}

void ReducedKernel::loadFirstDrift(LaneSource<const ReducedEvaluation> nodes) {
  loadDrift(nodes,
            [](const ReducedEvaluation& node, size_t i) -> const ClusterState& { return node.midpoint->clusters[i]; });
}

void ReducedKernel::loadLastDrift(LaneSource<const ReducedEvaluation> nodes) {
  loadDrift(nodes,
            [](const ReducedEvaluation& node, size_t i) -> const ClusterState& { return node.clusters[i].next; });
  for (size_t i = 0; i < clusters_.size(); ++i)
    gatherLanes(nodes.count, clusters_[i].v_next.size(), clusters_[i].v_next.data(),
                [&](int l) { return nodes[l].clusters[i].v_next.data(); });
}

void ReducedKernel::storeMidpoint(const StepItem* items, int count) {
  scatterLanes(getNumbers(ws_.X_WB.front()), 12 * model_.numBodies(), count,
               [&](int l) { return getNumbers(items[l].at->midpoint->X_WB.front()); });
  scatterLanes(ws_.q.data(), ws_.q.size(), count, [&](int l) { return items[l].at->q_mid.data(); });
  scatterLanes(v_.data(), v_.size(), count, [&](int l) { return items[l].at->midpoint->v.data(); });
  for (size_t i = 0; i < clusters_.size(); ++i)
    storeState(clusters_[i].next, count, [&](int l) { return &items[l].at->midpoint->clusters[i]; });
}

void ReducedKernel::storeForeseen(const StepItem* items, int count) {
  scatterLanes(a_.data(), a_.size(), count, [&](int l) { return items[l].at->midpoint->a.data(); });
  scatterLanes(closure_forces_.data(), closure_forces_.size(), count,
               [&](int l) { return items[l].at->midpoint->lambda.data(); });
  for (int l = 0; l < count; ++l) storeContactForces(layout_.contacts[items[l].node], l, items[l].at->midpoint->lambda);
}

void ReducedKernel::storeStep(const StepItem* items, int count) {
  scatterLanes(a_.data(), a_.size(), count, [&](int l) { return items[l].at->a.data(); });
  scatterLanes(x1_.data(), x1_.size(), count, [&](int l) { return items[l].at->x_next.data(); });
  scatterLanes(closure_forces_.data(), closure_forces_.size(), count,
               [&](int l) { return items[l].at->lambda.data(); });
  for (size_t i = 0; i < clusters_.size(); ++i) {
    const ClusterLanes& c = clusters_[i];
    storeState(c.next, count, [&](int l) { return &items[l].at->clusters[i].next; });
    scatterLanes(c.v_next.data(), c.v_next.size(), count,
                 [&](int l) { return items[l].at->clusters[i].v_next.data(); });
  }
  if (getPoint(*items->spec) == Point::Midpoint)
    scatterLanes(v_mid_.data(), v_mid_.size(), count, [&](int l) { return items[l].at->v_mid.data(); });
  scatterLanes(system_.L().data(), system_.L().size(), count, [&](int l) { return items[l].at->factors.L.data(); });
  for (int l = 0; l < count; ++l) {
    storeContactForces(layout_.contacts[items[l].node], l, items[l].at->lambda);
    storeSystem(items[l], l);
  }
}

void ReducedKernel::storeContactForces(const ContactLayout& layout, int lane, VectorXd& lambda) const {
  for (const ContactLayout::Contact& contact : layout.contacts)
    for (int r = 0; r < contact.rows; ++r)
      lambda[layout.closure_rows + contact.row + r] = contact_forces_[6 * contact.slot + r][lane];
}

// The rows of the system that a node has.
void ReducedKernel::storeSystem(const StepItem& item, int lane) {
  const ContactLayout& layout = layout_.contacts[item.node];
  SaddlePointFactors& factors = item.at->factors;
  const auto W = system_.W();
  for (const ContactLayout::Contact& contact : layout.contacts)
    for (int r = 0; r < contact.rows; ++r) {
      const int row = contact.row + r, from = 6 * contact.slot + r;
      factors.D[row] = system_.D()[from][lane];
      for (Eigen::Index k = 0; k < W.cols(); ++k) factors.Wt(k, row) = W(from, k)[lane];
      for (const ContactLayout::Contact& other : layout.contacts)
        for (int s = 0; s < other.rows; ++s)
          factors.Ginv(row, other.row + s) = system_.Ginv()(from, 6 * other.slot + s)[lane];
    }
}

// Velocities of the bodies, without their columns.
void ReducedKernel::storeMotion(int count, std::vector<LaneView>& views) const {
  const int nb = model_.numBodies();
  const auto store = [&](const Lanes* from, Eigen::Index size, const auto& get) {
    scatterLanes(from, size, count, [&](int l) { return get(views[l].ws); });
  };
  store(ws_.q.data(), ws_.q.size(), [](Workspace& ws) { return ws.q.data(); });
  store(v_.data(), v_.size(), [](Workspace& ws) { return ws.v.data(); });
  store(getNumbers(ws_.X_WB.front()), 12 * nb, [](Workspace& ws) { return getNumbers(ws.X_WB.front()); });
  store(ws_.V.front().data(), 6 * nb, [](Workspace& ws) { return ws.V.front().data(); });
  store(ws_.hc.front().data(), 6 * nb, [](Workspace& ws) { return ws.hc.front().data(); });
  for (int l = 0; l < count; ++l) views[l].ws.stage = WorkspaceStage::Bodies;
}

// All data that Jacobians of residuals read.
void ReducedKernel::storeColumns(int count, std::vector<LaneView>& views) const {
  storeMotion(count, views);
  const auto store = [&](const Lanes* from, Eigen::Index size, const auto& get) {
    scatterLanes(from, size, count, [&](int l) { return get(views[l]); });
  };
  store(ws_.J.data(), ws_.J.size(), [](LaneView& view) { return view.ws.J.data(); });
  store(ws_.dV.data(), ws_.dV.size(), [](LaneView& view) { return view.ws.dV.data(); });
  store(ws_.YJ.data(), ws_.YJ.size(), [](LaneView& view) { return view.ws.YJ.data(); });
  store(ws_.h.front().data(), 6 * model_.numBodies(), [](LaneView& view) { return view.ws.h.front().data(); });
  store(ws_.Yc.front().data(), 36 * model_.numBodies(), [](LaneView& view) { return view.ws.Yc.front().data(); });
  for (size_t i = 0; i < clusters_.size(); ++i)
    store(clusters_[i].motion.Z.data(), clusters_[i].motion.Z.size(),
          [i](LaneView& view) { return view.clusters[i].Z.data(); });
  for (int l = 0; l < count; ++l) views[l].ws.stage = WorkspaceStage::Velocity;
}

void ReducedKernel::storeMidpointTurns(int count, std::vector<LaneView>& views) const {
  for (size_t i = 0; i < clusters_.size(); ++i)
    scatterLanes(clusters_[i].motion.Z.data(), clusters_[i].motion.Z.size(), count,
                 [&](int l) { return views[l].clusters[i].Z_mid.data(); });
}

void ReducedKernel::storeAcceleration(LaneSource<const ReducedEvaluation> nodes, std::vector<LaneView>& views,
                                      LaneView::Acceleration LaneView::*to) const {
  const Eigen::Index nr = reduction_.size;
  const int count = nodes.count;
  for (Eigen::Index i = 0; i < nr; ++i) {
    const auto storeRow = [&](const MatrixX<Lanes>& A, Eigen::Index row) {
      const auto get = [&](int l) {
        const Eigen::Index leading = nodes[l].leading;
        return &(views[l].*to).dydd[i * roundUpToLane(leading + 2 * nr) + leading + row];
      };
      scatterLanes(&A(i, 0), nr, count, get, nr);
    };
    storeRow(A_y_, 0);
    storeRow(A_v_, nr);
  }
  storeContacts(count, [&](int l) -> std::vector<LaneView::Contact>& { return (views[l].*to).contacts; });
}

// Derivatives of contact rows, to those that `get` names.
template <typename Get>
void ReducedKernel::storeContacts(int count, const Get& get) const {
  const auto store = [&](size_t i, const Matrix6X<Lanes>& from, Matrix6Xd LaneView::Contact::*to) {
    scatterLanes(from.data(), from.size(), count, [&](int l) { return (get(l)[i].*to).data(); });
  };
  for (size_t i = 0; i < contacts_.size(); ++i) {
    if (!contacts_[i].used) continue;
    store(i, contacts_[i].dy, &LaneView::Contact::dy);
    store(i, contacts_[i].dv, &LaneView::Contact::dv);
  }
}

void ReducedKernel::storeStabilizations(int count, std::vector<LaneView>& views) const {
  storeContacts(count, [&](int l) -> std::vector<LaneView::Contact>& { return views[l].stabilizations; });
}

void ReducedKernel::storeDrift(int count, std::vector<LaneView>& views, LaneView::Drift LaneView::Cluster::*to) const {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    const ClusterLanes& c = clusters_[i];
    const auto store = [&](const MatrixX<Lanes>& from, MatrixXd LaneView::Drift::*member) {
      scatterLanes(from.data(), from.size(), count, [&](int l) { return (views[l].clusters[i].*to.*member).data(); });
    };
    store(c.q_y, &LaneView::Drift::q_y);
    store(c.q_v, &LaneView::Drift::q_v);
    store(c.v_y, &LaneView::Drift::v_y);
    store(c.v_v, &LaneView::Drift::v_v);
  }
}

void ReducedKernel::storeGaps(int count, std::vector<LaneView>& views) const {
  for (size_t i = 0; i < clusters_.size(); ++i) {
    const ClusterGapOf<Lanes>& gap = clusters_[i].gap;
    scatterLanes(gap.y.data(), gap.y.size(), count, [&](int l) { return views[l].clusters[i].gap.data(); });
    scatterLanes(gap.y_v.data(), gap.y_v.size(), count, [&](int l) { return views[l].clusters[i].gap_v.data(); });
  }
}

}  // namespace bielle
