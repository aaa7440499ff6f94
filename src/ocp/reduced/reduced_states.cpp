// Sums and differences of states in lanes.
#include "model/joint.h"
#include "ocp/reduced/reduced_kernel.h"

namespace bielle {

void ReducedKernel::difference(const DifferenceTask* tasks, int count) {
  const int nq = model_.nq(), nr = reduction_.size;
  const auto getNode = [&](int l) -> const ReducedEvaluation& {
    return *static_cast<const ReducedEvaluation*>(tasks[l].at);
  };
  gatherLanes(count, nq, ws_.q.data(), [&](int l) { return getNode(l).x.data(); });
  gatherLanes(count, v_.size(), v_.data(), [&](int l) { return getNode(l).x.data() + nq; });
  gatherLanes(count, x1_.size(), x1_.data(), [&](int l) { return tasks[l].x1->data(); });
  const auto getOfRobot = [&](VectorXd& dx) { return dx.data() + dx.size() - dx_.size(); };
  const auto subtract = [&](const Joint& joint, auto&& d) {
    calcJointDifference(joint, ws_.q.segment(joint.idx_q, joint.nq), x1_.segment(joint.idx_q, joint.nq), d);
  };
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int o = reduction_.free_offsets[i], n = joint.nv;
    subtract(joint, dx_.segment(o, n));
    dx_.segment(nr + o, n) = x1_.segment(nq + joint.idx_v, n) - v_.segment(joint.idx_v, n);
  }
  for (size_t i = 0; i < clusters_.size(); ++i) {
    ClusterLanes& c = clusters_[i];
    MatrixX<Lanes>& WN = c.at.WN;
    gatherLanes(count, WN.size(), WN.data(), [&](int l) { return getNode(l).clusters[i].at.WN.data(); });
    for (size_t j = 0; j < c.cluster.joints.size(); ++j) {
      const Joint &own = c.cluster.model.joints()[j + 1], &joint = model_.joints()[c.cluster.joints[j]];
      subtract(joint, c.left.segment(own.idx_v, own.nv));
    }
    auto dy = dx_.segment(c.cluster.offset, c.cluster.size), dy_v = dx_.segment(nr + c.cluster.offset, c.cluster.size);
    dy.setZero();
    addSmallProductTransposed(WN, c.left, dy);
    for (size_t k = 0; k < c.cluster.dofs.size(); ++k) c.left[k] = x1_[nq + c.cluster.dofs[k]] - v_[c.cluster.dofs[k]];
    dy_v.setZero();
    addSmallProductTransposed(WN, c.left, dy_v);
  }
  scatterLanes(dx_.data(), dx_.size(), count, [&](int l) { return getOfRobot(*tasks[l].dx); });
}

void ReducedKernel::integrate(const IntegrateTask* tasks, int count) {
  const int nq = model_.nq(), nr = reduction_.size;
  const auto getNode = [&](int l) -> const ReducedEvaluation& {
    return *static_cast<const ReducedEvaluation*>(tasks[l].at);
  };
  const auto getOfRobot = [&](const VectorXd& dx) { return dx.data() + dx.size() - dx_.size(); };
  std::array<const ReducedEvaluation*, kLane> nodes;
  for (int l = 0; l < count; ++l) nodes[l] = &getNode(l);
  gatherLanes(count, nq, ws_.q.data(), [&](int l) { return getNode(l).x.data(); });
  gatherLanes(count, v_.size(), v_.data(), [&](int l) { return getNode(l).x.data() + nq; });
  gatherLanes(count, dx_.size(), dx_.data(), [&](int l) { return getOfRobot(*tasks[l].dx); });
  loadBases({nodes.data(), count});
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int o = reduction_.free_offsets[i], n = joint.nv, k = joint.idx_v;
    integrateJoint<Lanes>(joint, ws_.q.segment(joint.idx_q, joint.nq), dx_.segment(o, n),
                          x1_.segment(joint.idx_q, joint.nq));
    x1_.segment(nq + k, n) = v_.segment(k, n) + dx_.segment(nr + o, n);
  }
  LaneMask done = makeMask(true);
  for (ClusterLanes& c : clusters_) {
    const ReducedCluster& cluster = c.cluster;
    c.d.setZero();
    addSmallProduct(c.at.N, dx_.segment(cluster.offset, cluster.size), c.d);
    done = done && closeCluster<Lanes>(cluster, c.scratch, c.at, c.d, VectorX<Lanes>(), c.next);
    // The velocity at the new point whose coordinates about the old one are N^T v + dy_v.
    const ClusterBasisOf<Lanes>& to = c.next.basis;
    for (size_t k = 0; k < cluster.dofs.size(); ++k) c.left[k] = v_[cluster.dofs[k]];
    c.target = dx_.segment(nr + cluster.offset, cluster.size);
    addSmallProductTransposed(c.at.WN, c.left, c.target);
    c.mixed.setZero();
    addSmallProductTransposed(c.at.WN, to.N, c.mixed);
    done = done && factorizeSmall(c.mixed, c.pivots);
    solveFactorized(c.mixed, c.pivots, c.target);
    c.left.setZero();
    addSmallProduct(to.N, c.target, c.left);
    for (size_t k = 0; k < cluster.dofs.size(); ++k) x1_[nq + cluster.dofs[k]] = c.left[k];
    scatterConfiguration<Lanes>(model_, cluster, to.q, x1_);
  }
  for (int l = 0; l < count; ++l)
    if (!done[l]) tasks[l].x_out->setConstant(std::numeric_limits<double>::quiet_NaN());
  scatterLanes(x1_.data(), x1_.size(), count, [&](int l) { return done[l] ? tasks[l].x_out->data() : nullptr; });
}

}  // namespace bielle
