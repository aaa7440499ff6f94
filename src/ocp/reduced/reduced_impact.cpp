#include "ocp/reduced/reduced_impact.h"

#include "bielle/dynamics/kinematics.h"
#include "model/joint.h"

namespace bielle {

ReducedImpact::Cluster::Cluster(const ReducedCluster& c) : cluster(c), scratch(c), ahead(c), gap(c) {
  WNP.setZero(c.model.nv(), c.size);
}

ReducedImpact::ReducedImpact(const Model& model, const Reduction& reduction) : model_(model), reduction_(reduction) {
  clusters_.reserve(reduction.clusters.size());
  for (const ReducedCluster& cluster : reduction.clusters) clusters_.emplace_back(cluster);
  for (MatrixXd* m : {&D_y_, &D_v_}) m->setZero(reduction.size, model.nv());
}

void ReducedImpact::update(const ReducedKernel::StepItem& item) {
  ReducedEvaluation& at = *item.at;
  const int nq = model_.nq(), nv = model_.nv();
  if (!at.impact) at.impact = std::make_unique<ImpactWorkspace>(model_);
  const NumericalStatus status =
      updateImpact(model_, *at.impact, item.spec->constraints, at.x.head(nq), at.x.segment(nq, nv));
  if (status != NumericalStatus::Ok) {
    at.failure = getMessage(status);
    at.status = status;
    return;
  }
  at.lambda = at.impact->impulse;
  at.a.setZero();
  at.x_next.head(nq) = at.x.head(nq);
  at.x_next.segment(nq, nv) = at.impact->v_plus;
  for (size_t i = 0; i < at.clusters.size(); ++i) {
    if (item.previous) at.clusters[i].next = item.previous->clusters[i].next;
    gatherVelocity(reduction_.clusters[i], at.impact->v_plus, at.clusters[i].v_next);
  }
}

NumericalStatus ReducedImpact::linearize(const ConstraintSet& constraints, const ReducedEvaluation& at,
                                         const ReducedEvaluation& next, const LaneView& view, NodeAssembly& assembly,
                                         StageModel& out) {
  ImpactWorkspace& impact = *at.impact;
  const NumericalStatus status = updateImpactDerivatives(model_, impact, constraints);
  if (status != NumericalStatus::Ok) return status;
  int closure_rows = 0;
  for (const Closure& closure : model_.closures()) closure_rows += getRows(closure.kind);
  const Eigen::Index contact_rows = impact.dimpulse_dq.rows() - closure_rows;
  assembly.setImpulseDerivatives(impact.dimpulse_dq.bottomRows(contact_rows),
                                 impact.dimpulse_dv.bottomRows(contact_rows), at, view);
  for (MatrixXd* m : {&D_y_, &D_v_}) m->setZero();
  assembly.addTimesN(impact.dv_dq, at, D_y_);
  assembly.addTimesZ(impact.dv_dv, view, D_y_);
  assembly.addTimesN(impact.dv_dv, at, D_v_);
  out.Fx().setZero();
  out.Fu().setZero();
  for (size_t i = 0; i < clusters_.size(); ++i) linearizeCluster(i, at, next, out);
  assembly.calcFreeGaps(at, next, out.gap);
  for (const NodeAssembly::FreeJoint& free : assembly.freeJoints()) linearizeFreeJoint(free, out);
  return NumericalStatus::Ok;
}

// Eq. (a) for one cluster.
void ReducedImpact::linearizeCluster(size_t index, const ReducedEvaluation& at, const ReducedEvaluation& next,
                                     StageModel& out) {
  Cluster& c = clusters_[index];
  const ReducedCluster& cluster = c.cluster;
  ClusterGapOf<double>& gap = c.gap;
  const int nr = reduction_.size, o = cluster.offset, r = cluster.size;
  gatherConfiguration(model_, cluster, next.x.head(model_.nq()), gap.q);
  gatherVelocity(cluster, next.x.segment(model_.nq(), model_.nv()), gap.v);
  updateGap(c, at.clusters[index], next.clusters[index].at);
  out.gap.segment(o, r) = gap.y;
  out.gap.segment(nr + o, r) = gap.y_v;
  // P_v (W N)^T, which maps dv+ of the cluster's dofs to dy_v+.
  RowMatrixMap Fx = out.Fx();
  c.WNP.noalias() = at.clusters[index].at.WN * gap.P_v.transpose();
  for (size_t k = 0; k < cluster.dofs.size(); ++k)
    for (int row = 0; row < r; ++row) {
      Fx.row(nr + o + row).head(nr) += c.WNP(k, row) * D_y_.col(cluster.dofs[k]).transpose();
      Fx.row(nr + o + row).tail(nr) += c.WNP(k, row) * D_v_.col(cluster.dofs[k]).transpose();
    }
  Fx.block(o, o, r, r) = gap.P_q;
  Fx.block(nr + o, o, r, r) += gap.P_z;
}

// Updates c.gap, from q+ to the node state.
void ReducedImpact::updateGap(Cluster& c, const ClusterNode& node, const ClusterBasis& next) {
  ClusterGapOf<double>& gap = c.gap;
  if (gap.q == node.next.basis.q && gap.v == node.v_next) {
    for (VectorXd* x : {&gap.y, &gap.y_v}) x->setZero();
    for (MatrixXd* P : {&gap.P_q, &gap.P_v}) P->setIdentity();
    gap.P_z.setZero();
    return;
  }
  loadClusterState(c.cluster, node.next, c.scratch);
  const auto view = getOwnView(c.cluster, c.scratch.ws);
  updateTwists(view, node.next.basis, c.ahead);
  updateVelocities(c.cluster.model, c.scratch.ws, node.v_next);
  updateVelocityLift(view, c.ahead);
  gap.WN = next.WN;
  gap.update(c.cluster, node.next.basis, node.v_next, c.ahead.Z);
}

void ReducedImpact::linearizeFreeJoint(const NodeAssembly::FreeJoint& free, StageModel& out) const {
  const int nr = reduction_.size, o = free.offset, n = free.size;
  JointMatrix Jdiff(n, n);
  calcJointDifferenceJacobian(*free.joint, out.gap.segment(o, n), Jdiff);
  RowMatrixMap Fx = out.Fx();
  Fx.block(o, o, n, n) = Jdiff;
  Fx.block(nr + o, 0, n, nr) = D_y_.middleCols(free.joint->idx_v, n).transpose();
  Fx.block(nr + o, nr, n, nr) = D_v_.middleCols(free.joint->idx_v, n).transpose();
}

}  // namespace bielle
