// Differences and sums of states in the lanes of reduced_lanes.h.
#include "reduced_node.h"

namespace bielle {

void ReducedLanes::calcDifferences(const NodeModel::Difference* items, int count) {
  const int nq = model_.nq(), nr = reduction_.size;
  packItems(
      items, count, [](const auto& item) { return item.x0->data(); }, x0_);
  packItems(
      items, count, [](const auto& item) { return item.x1->data(); }, x1_);
  const auto subtract = [&](const Joint& joint, auto&& d) {
    calcJointDifference(joint, x0_.segment(joint.idx_q, joint.nq), x1_.segment(joint.idx_q, joint.nq), d);
  };
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int o = reduction_.free_offsets[i];
    subtract(joint, dx_.segment(o, joint.nv));
    dx_.segment(nr + o, joint.nv) = x1_.segment(nq + joint.idx_v, joint.nv) - x0_.segment(nq + joint.idx_v, joint.nv);
  }
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& b = clusters_[i];
    MatrixX<Lanes>& chart = b.P;
    packItems(
        items, count,
        [i](const auto& item) { return static_cast<const ReducedNode*>(item.node)->clusters_[i].chart.data(); }, chart);
    for (size_t j = 0; j < b.loop.joints.size(); ++j) {
      const Joint &own = b.loop.model.joints()[j + 1], &joint = model_.joints()[b.loop.joints[j]];
      subtract(joint, b.left.segment(own.idx_v, own.nv));
    }
    auto dy = dx_.segment(b.loop.offset, b.loop.size), dy_v = dx_.segment(nr + b.loop.offset, b.loop.size);
    dy.setZero();
    addSmallProductTransposed(chart, b.left, dy);
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) b.left[k] = x1_[nq + b.loop.dofs[k]] - x0_[nq + b.loop.dofs[k]];
    dy_v.setZero();
    addSmallProductTransposed(chart, b.left, dy_v);
  }
  std::array<double*, kLane> out{};
  for (int l = 0; l < count; ++l) out[l] = items[l].dx->data();
  unpackLanes(dx_.data(), dx_.size(), out);
}

LaneMask ReducedLanes::integrate(const NodeModel::Integration* items, int count) {
  const int nq = model_.nq(), nr = reduction_.size;
  setNodes(count, [&](int l) { return static_cast<ReducedNode*>(items[l].node); });
  packItems(
      items, count, [](const auto& item) { return item.x->data(); }, x0_);
  packItems(
      items, count, [](const auto& item) { return item.dx->data(); }, dx_);
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int o = reduction_.free_offsets[i], n = joint.nv, k = nq + joint.idx_v;
    integrateJoint<Lanes>(joint, x0_.segment(joint.idx_q, joint.nq), dx_.segment(o, n),
                          x1_.segment(joint.idx_q, joint.nq));
    x1_.segment(k, n) = x0_.segment(k, n) + dx_.segment(nr + o, n);
  }
  LaneMask done = Lanes(0) <= Lanes(0);
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& b = clusters_[i];
    packPoint(i);
    b.step.setZero();
    addSmallProduct(b.at.N, dx_.segment(b.loop.offset, b.loop.size), b.step);
    done = done && b.closing.close(b.loop, b.scratch, b.at, b.step, {});
    // The velocity at the new point whose coordinates about the old one are N^T v + dy_v.
    const ClusterBasisOf<Lanes>& to = b.closing.basis();
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) b.left[k] = x0_[nq + b.loop.dofs[k]];
    b.target = dx_.segment(nr + b.loop.offset, b.loop.size);
    addSmallProductTransposed(b.at.WN, b.left, b.target);
    b.mixed.setZero();
    addSmallProductTransposed(b.at.WN, to.N, b.mixed);
    done = done && factorizeSmall(b.mixed, b.pivots);
    solveFactorized(b.mixed, b.pivots, b.target);
    b.left.setZero();
    addSmallProduct(to.N, b.target, b.left);
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) x1_[nq + b.loop.dofs[k]] = b.left[k];
    for (size_t j = 0; j < b.loop.joints.size(); ++j) {
      const Joint &own = b.loop.model.joints()[j + 1], &joint = model_.joints()[b.loop.joints[j]];
      x1_.segment(joint.idx_q, joint.nq) = to.q.segment(own.idx_q, own.nq);
    }
  }
  std::array<double*, kLane> out{};
  for (int l = 0; l < count; ++l) out[l] = done[l] ? items[l].x_out->data() : nullptr;
  unpackLanes(x1_.data(), x1_.size(), out);
  return done;
}

}  // namespace bielle
