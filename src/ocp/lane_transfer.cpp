// What goes into the lanes of reduced_lanes.h and comes out of them: from nodes that each have their numbers side by side to
// numbers that each have their nodes side by side.
#include <algorithm>

#include "reduced_node.h"

namespace bielle {
namespace {

// Placements as the numbers they are made of.
const double* getNumbers(const SE3& X) { return X.R.data(); }
Lanes* getNumbers(SE3Of<Lanes>& X) { return X.R.data(); }

}  // namespace

// `get` says where the numbers of a node are; lanes without a node do what the first one does.
template <typename Get>
void ReducedLanes::pack(const Get& get, Eigen::Index size, Lanes* out) const {
  std::array<const double*, kLane> in;
  for (size_t l = 0; l < kLane; ++l) in[l] = get(*nodes_[l < nodes_.size() ? l : 0]);
  packLanes(in, size, out);
}

// `get` says where the numbers of a lane go, null for nowhere.
template <typename Get>
void ReducedLanes::unpack(const Lanes* in, Eigen::Index size, const Get& get, Eigen::Index stride) const {
  std::array<double*, kLane> out{};
  for (size_t l = 0; l < nodes_.size(); ++l) out[l] = get(l);
  unpackLanes(in, size, out, stride);
}

void ReducedLanes::packPlacements() {
  pack([](const ReducedNode& n) { return getNumbers(n.X_WB_.front()); }, 12 * model_.numBodies(),
       getNumbers(ws_.X_WB.front()));
  ws_.stage = WorkspaceStage::Placement;
}

// Bases of nodes that do not go on from another, and placements of all.
LaneMask ReducedLanes::updatePoints() {
  pack([](const ReducedNode& n) { return n.q_.data(); }, ws_.q.size(), ws_.q.data());
  LaneMask placed = Lanes(0) <= Lanes(0);
  const auto isNew = [](const ReducedNode* n) { return !n->before_; };
  if (std::any_of(nodes_.begin(), nodes_.end(), isNew))
    for (size_t i = 0; i < clusters_.size(); ++i) {
      ClusterLanes& b = clusters_[i];
      for (size_t j = 0; j < b.loop.joints.size(); ++j) {
        const Joint &own = b.loop.model.joints()[j + 1], &joint = model_.joints()[b.loop.joints[j]];
        b.at.q.segment(own.idx_q, own.nq) = ws_.q.segment(joint.idx_q, joint.nq);
      }
      placed = placed && b.closing.update(b.loop, b.scratch, b.at.q);
      std::array<ClusterState*, kLane> states{};  // `next` is free until the step is done
      for (size_t l = 0; l < nodes_.size(); ++l)
        if (isNew(nodes_[l])) states[l] = &nodes_[l]->clusters_[i].next;
      b.closing.store(states);
      for (ReducedNode* n : nodes_)
        if (isNew(n)) n->takePoint(n->clusters_[i], n->clusters_[i].next);
    }
  packPlacements();
  placeWhole<Lanes>(model_, reduction_, ws_.q, ws_.X_WB);
  unpack(ws_.X_WB.front().R.data(), 12 * model_.numBodies(),
         [this](size_t l) { return nodes_[l]->X_WB_.front().R.data(); });
  for (size_t l = 0; l < nodes_.size(); ++l)
    if (!isNew(nodes_[l])) placed.v[l] = -1;
  return placed;
}

void ReducedLanes::packNodes() {
  using Node = const ReducedNode&;
  pack([](Node n) { return n.v_.data(); }, v_.size(), v_.data());
  pack([](Node n) { return n.tau_.data(); }, tau_.size(), tau_.data());
  pack([](Node n) { return &n.spec_.dt; }, 1, &h_);
  for (size_t i = 0; i < clusters_.size(); ++i)
    packBasis(
        clusters_[i].loop, [&](Node n) -> const ClusterBasis& { return n.clusters_[i].at; }, clusters_[i].at);
  for (size_t i = 0; i < contacts_.size(); ++i) packContact(i);
}

template <typename GetBasis>
void ReducedLanes::packBasis(const ReducedCluster& cluster, const GetBasis& getBasis, ClusterBasisOf<Lanes>& to) const {
  using Node = const ReducedNode&;
  pack([&](Node n) { return getBasis(n).N.data(); }, to.N.size(), to.N.data());
  for (Eigen::Index c = 0; c < to.N.cols(); ++c)
    for (Eigen::Index k = 0; k < to.N.rows(); ++k) to.WN(k, c) = cluster.metric[k] * to.N(k, c);
  pack([&](Node n) { return getBasis(n).J.data(); }, to.J.size(), to.J.data());
  pack([&](Node n) { return getBasis(n).L.data(); }, to.L.size(), to.L.data());
  for (size_t k = 0; k < to.rows.size(); ++k)
    for (size_t l = 0; l < kLane; ++l) to.rows[k][l] = getBasis(*nodes_[l < nodes_.size() ? l : 0]).rows[k];
}

// What linearize() needs of the steps.
void ReducedLanes::packSteps() {
  pack([](const ReducedNode& n) { return n.a_.data(); }, a_.size(), a_.data());
  for (size_t i = 0; i < clusters_.size(); ++i) packCluster(i);
}

void ReducedLanes::packCluster(size_t i) {
  using Node = const ReducedNode&;
  ClusterLanes& b = clusters_[i];
  packBasis(
      b.loop, [&](Node n) -> const ClusterBasis& { return n.clusters_[i].next.basis(); }, b.next);
  pack([&](Node n) { return n.clusters_[i].next.basis().q.data(); }, b.next.q.size(), b.next.q.data());
  pack([&](Node n) { return n.clusters_[i].v_next.data(); }, b.v_next.size(), b.v_next.data());
  pack([&](Node n) { return n.clusters_[i].next.zeta().data(); }, b.zeta.size(), b.zeta.data());
  pack([&](Node n) { return n.clusters_[i].next.step().data(); }, b.step.size(), b.step.data());
  pack([&](Node n) { return getNumbers(n.clusters_[i].next.placements().front()); }, 12 * b.loop.model.numBodies(),
       getNumbers(b.own.X_WB.front()));
  b.own.stage = WorkspaceStage::Placement;
}

// Nodes without this contact have no force there, and whatever its other numbers.
void ReducedLanes::packContact(size_t slot) {
  ContactLanes& contact = contacts_[slot];
  contact.used = false;
  contact.wrench.setZero();
  contact.kd = 0;
  contact.kp_rate.setZero();
  contact.kp_residual.setZero();
  auto absent = system_.absent.segment<6>(6 * slot);
  absent.setOnes();
  for (size_t l = 0; l < nodes_.size(); ++l) {
    const ReducedNode& node = *nodes_[l];
    const int index = node.findContact(static_cast<int>(slot));
    if (index < 0) continue;
    const Closure& closure = node.spec_.constraints.closures[index];
    const SE3 X_WF = node.X_WB_[closure.body1] * closure.X_B1;
    const VectorUpTo6<double> lambda =
        node.lambda_.segment(node.spec_.constraints.offsets[index], getRows(closure.kind));
    const Vector6d wrench = X_WF.actForce(expandRows(closure, lambda));
    for (int k = 0; k < 12; ++k) getNumbers(contact.X_WF)[k].set(l, getNumbers(X_WF)[k]);
    for (int k = 0; k < 6; ++k) contact.wrench[k].set(l, wrench[k]);
    contact.kd.set(l, closure.kd);
    contact.used = true;
    for (Eigen::Index r = 0; r < lambda.size(); ++r) absent[r].set(l, 0);
    if (closure.kp == 0) continue;
    const SE3 X_12 = X_WF.inverseTimes(closure.X_B2);
    const RowVectorUpTo6 residual = closure.kp * calcClosureResidual(closure, X_12);
    const RowsBy6 rate = closure.kp * calcClosureResidualRate(closure, X_12);
    // As a hinge's rows are no rows of the frame, they are brought back to where selectRows() finds them.
    const Vector6d residual_rows = expandRows(closure, residual);
    for (int r = 0; r < 6; ++r) contact.kp_residual[r].set(l, residual_rows[r]);
    for (int c = 0; c < 6; ++c) {
      const Vector6d rate_rows = expandRows(closure, rate.col(c));
      for (int r = 0; r < 6; ++r) contact.kp_rate(r, c).set(l, rate_rows[r]);
    }
  }
}

// References and weights of the state costs, unless they are there from the last call. False when no node has one; nodes that
// have none get weights of zero.
bool ReducedLanes::packStateCosts() {
  std::array<const StateCost*, kLane> costs;
  for (size_t l = 0; l < kLane; ++l) costs[l] = nodes_[l < nodes_.size() ? l : 0]->state_cost_;
  const auto some = std::find_if(costs.begin(), costs.end(), [](const StateCost* cost) { return cost; });
  if (some == costs.end()) return false;
  if (costs == state_costs_) return true;
  state_costs_ = costs;
  const auto packCosts = [&](const auto& get, VectorX<Lanes>& out) {
    std::array<const double*, kLane> in;
    for (size_t l = 0; l < kLane; ++l) in[l] = get(costs[l] ? *costs[l] : **some).data();
    packLanes(in, out.size(), out.data());
  };
  packCosts([](const StateCost& cost) -> const VectorXd& { return cost.q_ref; }, state_cost_.q_ref);
  packCosts([](const StateCost& cost) -> const VectorXd& { return cost.v_ref; }, state_cost_.v_ref);
  packCosts([](const StateCost& cost) -> const VectorXd& { return cost.weights; }, state_cost_.weights);
  Lanes weight;
  for (size_t l = 0; l < kLane; ++l) weight.set(l, costs[l] ? costs[l]->weight : 0);
  state_cost_.weights *= weight;
  return true;
}

void ReducedLanes::updateStateCosts() {
  if (!packStateCosts()) return;
  const Lanes value = state_cost_.update(ws_.q, v_);
  unpack(state_cost_.difference.data(), state_cost_.difference.size(),
         [this](size_t l) { return nodes_[l]->state_difference_.data(); });
  for (size_t l = 0; l < nodes_.size(); ++l) {
    nodes_[l]->state_value_ = value[l];
    nodes_[l]->has_state_value_ = true;
  }
}

void ReducedLanes::linearizeStateCosts() {
  if (!packStateCosts()) return;
  for (ReducedNode* node : nodes_)
    if (node->state_cost_) node->calcStateCost();  // for the difference of steps taken alone
  pack([](const ReducedNode& n) { return n.state_difference_.data(); }, state_cost_.difference.size(),
       state_cost_.difference.data());
  const StateCostModelOf<Lanes>& model = state_cost_.differentiate(v_, lifts_);
  unpack(model.gradient.data(), model.gradient.size(),
         [this](size_t l) { return views_[l].state_cost.gradient.data(); });
  unpack(model.hessian.data(), model.hessian.size(), [this](size_t l) { return views_[l].state_cost.hessian.data(); });
}

void ReducedLanes::packPoint(size_t i) {
  using Node = const ReducedNode&;
  ClusterLanes& b = clusters_[i];
  packBasis(
      b.loop, [&](Node n) -> const ClusterBasis& { return n.clusters_[i].at; }, b.at);
  pack([&](Node n) { return n.clusters_[i].at.q.data(); }, b.at.q.size(), b.at.q.data());
}

void ReducedLanes::packClusterStep(size_t i) {
  using Node = const ReducedNode&;
  ClusterLanes& b = clusters_[i];
  pack([&](Node n) { return n.clusters_[i].at.q.data(); }, b.at.q.size(), b.at.q.data());
  for (size_t l = 0; l < kLane; ++l) {
    const ReducedNode* before = nodes_[l < nodes_.size() ? l : 0]->before_;
    for (Eigen::Index k = 0; k < b.surplus.size(); ++k)
      b.surplus[k].set(l, before ? before->clusters_[i].surplus[k] : 0);
  }
}

// Rows that a node has are the first ones of their slots.
void ReducedLanes::storeFactors(const LaneMask& solved) {
  const auto store = [&](const auto& from, const auto& get) {
    unpack(from.data(), from.size(), [&](size_t l) { return solved[l] ? get(nodes_[l]->factors_).data() : nullptr; });
  };
  store(system_.L, [](SaddlePointFactors& factors) -> MatrixXd& { return factors.L; });
  for (size_t slot = 0; slot < contacts_.size(); ++slot)
    for (int r = 0; r < 6; ++r) {
      const int i = static_cast<int>(slot) * 6 + r;
      const auto column = system_.Wt.col(i);
      unpack(column.data(), column.size(), [&](size_t l) -> double* {
        const int row = solved[l] ? nodes_[l]->getContactRow(slot, r) : -1;
        return row < 0 ? nullptr : &nodes_[l]->factors_.Wt(0, row);
      });
    }
  for (size_t l = 0; l < nodes_.size(); ++l)
    if (solved[l]) storeForces(l);
}

// The small part of it, and the forces.
void ReducedLanes::storeForces(size_t lane) {
  ReducedNode& node = *nodes_[lane];
  for (size_t slot = 0; slot < contacts_.size(); ++slot)
    for (int r = 0; r < 6; ++r) {
      const int row = node.getContactRow(slot, r);
      if (row < 0) continue;
      const Eigen::Index i = 6 * slot + r;
      node.lambda_[node.loop_rows_ + row] = system_.lambda[i][lane];
      node.factors_.D[row] = system_.D[i][lane];
      for (size_t other = 0; other < contacts_.size(); ++other)
        for (int s = 0; s < 6; ++s) {
          const int col = node.getContactRow(other, s);
          if (col >= 0) node.factors_.Ginv(row, col) = system_.Ginv(i, 6 * other + s)[lane];
        }
    }
}

void ReducedLanes::loadSystem(int lane, MatrixXd& M, MatrixXd& JcN, VectorXd& f, VectorXd& gamma) const {
  const ReducedNode& node = *nodes_[lane];
  const ConstraintSet& set = node.spec_.constraints;
  unpackLane(system_.M.data(), lane, M.size(), M.data());
  unpackLane(system_.f.data(), lane, f.size(), f.data());
  JcN.setZero();
  for (size_t c = set.num_loops; c < set.closures.size(); ++c) {
    const ContactLanes& contact = contacts_[node.contact_slots_[c - set.num_loops]];
    const std::vector<int>& outer = tree_.getTip(contact.tip).outer;
    const int row = set.offsets[c] - node.loop_rows_, n = getRows(set.closures[c].kind);
    Vector6d full;
    unpackLane(contact.gamma.data(), lane, 6, full.data());
    gamma.segment(row, n) = selectRows(set.closures[c], full);
    for (size_t o = 0; o < outer.size(); ++o) {
      unpackLane(&contact.J(0, o), lane, 6, full.data());
      JcN.col(outer[o]).segment(row, n) = selectRows(set.closures[c], full);
    }
  }
}

void ReducedLanes::storeAccelerations(int lane, const VectorXd& ydd) {
  for (Eigen::Index k = 0; k < ydd.size(); ++k) system_.ydd[k].set(lane, ydd[k]);
}

void ReducedLanes::storeSteps(const bool* ok) {
  const auto store = [&](const VectorX<Lanes>& from, const auto& get) {
    unpack(from.data(), from.size(), [&](size_t l) { return ok[l] ? get(*nodes_[l]).data() : nullptr; });
  };
  store(a_, [](ReducedNode& node) -> VectorXd& { return node.a_; });
  for (size_t i = 0; i < clusters_.size(); ++i) {
    std::array<ClusterState*, kLane> next{};
    for (size_t l = 0; l < nodes_.size(); ++l) next[l] = ok[l] ? &nodes_[l]->clusters_[i].next : nullptr;
    clusters_[i].closing.store(next);
    store(clusters_[i].surplus, [i](ReducedNode& node) -> VectorXd& { return node.clusters_[i].surplus; });
    store(clusters_[i].v_next, [i](ReducedNode& node) -> VectorXd& { return node.clusters_[i].v_next; });
  }
  const int nb = model_.numBodies();
  unpack(ws_.V.front().data(), 6 * nb, [this](size_t l) { return views_[l].ws.V.front().data(); });
  unpack(ws_.hc.front().data(), 6 * nb, [this](size_t l) { return views_[l].ws.hc.front().data(); });
}

void ReducedLanes::storeDerivatives() {
  const auto store = [this](const auto& from, const auto& get) {
    unpack(from.data(), from.size(), [&](size_t l) { return get(views_[l]); });
  };
  store(ws_.J, [](LaneView& view) { return view.ws.J.data(); });
  store(ws_.dV, [](LaneView& view) { return view.ws.dV.data(); });
  store(ws_.YJ, [](LaneView& view) { return view.ws.YJ.data(); });
  const Eigen::Index nr = reduction_.size, nu = model_.nu(), rows = roundUpToLane(nu + 2 * nr);
  for (Eigen::Index i = 0; i < nr; ++i) {
    const auto getColumn = [&](Eigen::Index row) {
      return [this, at = i * rows + row](size_t l) { return &views_[l].dydd[at]; };
    };
    unpack(&A_y_(i, 0), nr, getColumn(nu), nr);
    unpack(&A_v_(i, 0), nr, getColumn(nu + nr), nr);
  }
  const int nb = model_.numBodies();
  unpack(ws_.V.front().data(), 6 * nb, [this](size_t l) { return views_[l].ws.V.front().data(); });
  unpack(ws_.hc.front().data(), 6 * nb, [this](size_t l) { return views_[l].ws.hc.front().data(); });
  unpack(ws_.Yc.front().data(), 36 * nb, [this](size_t l) { return views_[l].ws.Yc.front().data(); });
  for (size_t i = 0; i < clusters_.size(); ++i) {
    const ClusterLanes& b = clusters_[i];
    store(b.motion.Z, [i](LaneView& view) { return view.clusters[i].Z.data(); });
    store(b.q_y, [i](LaneView& view) { return view.clusters[i].q_y.data(); });
    store(b.q_v, [i](LaneView& view) { return view.clusters[i].q_v.data(); });
    store(b.v_y, [i](LaneView& view) { return view.clusters[i].v_y.data(); });
    store(b.v_v, [i](LaneView& view) { return view.clusters[i].v_v.data(); });
    store(b.gap.y, [i](LaneView& view) { return view.clusters[i].gap.data(); });
    store(b.gap.y_v, [i](LaneView& view) { return view.clusters[i].gap_v.data(); });
    for (size_t l = 0; l < nodes_.size(); ++l) {
      views_[l].clusters[i].turned = b.turned[l];
      views_[l].clusters[i].placed = b.placed[l];
    }
  }
  for (size_t i = 0; i < contacts_.size(); ++i) {
    if (!contacts_[i].used) continue;
    store(contacts_[i].dy, [i](LaneView& view) { return view.contacts[i].dy.data(); });
    store(contacts_[i].dv, [i](LaneView& view) { return view.contacts[i].dv.data(); });
  }
}

}  // namespace bielle
