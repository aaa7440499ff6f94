#include "impact_nodes.h"

#include "bielle/dynamics/kinematics.h"

namespace bielle {

FullImpactNode::FullImpactNode(const Model& model, const StageSpec& spec) : FullNode(model, spec), iws_(model) {
  for (MatrixXd* m : {&cws_.dlambda_dq, &cws_.dlambda_dv}) m->setZero(spec.constraints.rows, model.nv());
  cws_.dlambda_du.setZero(spec.constraints.rows, model.nu());
}

bool FullImpactNode::updateStep(ConstVectorRef x, ConstVectorRef, const NodeModel*) {
  failure_.clear();
  updateState(x);
  const DynamicsStatus status = updateImpact(model_, iws_, spec_.constraints, ws_.q, ws_.v);
  if (status != DynamicsStatus::Ok) {
    failure_ = getMessage(status);
    return false;
  }
  lambda_ = iws_.impulse;
  x_next_ << ws_.q, iws_.v_plus;
  return true;
}

bool FullImpactNode::linearizeStep(ConstVectorRef x_next_node, StageModel& out) {
  if (updateImpactDerivatives(model_, iws_, spec_.constraints) != DynamicsStatus::Ok) return false;
  const int nv = model_.nv();
  cws_.dlambda_dq = iws_.dimpulse_dq;
  cws_.dlambda_dv = iws_.dimpulse_dv;
  difference(x_next_node, x_next_, out.gap);
  out.Fu().setZero();
  out.Fx().topRows(nv).setZero();
  out.Fx().bottomLeftCorner(nv, nv) = iws_.dv_dq;
  out.Fx().bottomRightCorner(nv, nv) = iws_.dv_dv;
  for (const Joint& joint : model_.joints()) {
    if (joint.nv == 0) continue;
    JointMatrix Jdiff(joint.nv, joint.nv);
    calcJointDifferenceJacobian(joint, out.gap.segment(joint.idx_v, joint.nv), Jdiff);
    out.Fx().block(joint.idx_v, joint.idx_v, joint.nv, joint.nv) = Jdiff;
  }
  return true;
}

ReducedImpactNode::ReducedImpactNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
                                     std::shared_ptr<ReducedWorkPool> pool)
    : ReducedNode(model, reduction, spec, std::move(pool)), iws_(model) {
  for (MatrixXd* m : {&D_y_, &D_v_}) m->setZero(reduction.size, model.nv());
}

bool ReducedImpactNode::updateStep(ConstVectorRef x, ConstVectorRef, const NodeModel* previous) {
  takeWork();
  const bool follows = previous && previous->x_next() == x;
  if (!updateState(x, follows ? static_cast<const ReducedNode*>(previous) : nullptr)) return false;
  const DynamicsStatus status = updateImpact(model_, iws_, spec_.constraints, q_, v_);
  if (status != DynamicsStatus::Ok) {
    failure_ = getMessage(status);
    return false;
  }
  lambda_.tail(contact_rows_) = iws_.impulse.tail(contact_rows_);
  x_next_ << q_, iws_.v_plus;
  for (Cluster& b : clusters_) {
    gatherConfiguration(model_, b.loop, q_, b.work->q);
    if (!b.next.update(b.loop, b.work->scratch, b.work->q)) return fail(b, b.next);
    gatherVelocity(b.loop, iws_.v_plus, b.v_next);
  }
  return true;
}

bool ReducedImpactNode::linearizeStep(ConstVectorRef x_next_node, StageModel& out) {
  linearizeState();
  const DynamicsStatus status = updateImpactDerivatives(model_, iws_, spec_.constraints);
  if (status != DynamicsStatus::Ok) {
    failure_ = getMessage(status);
    return false;
  }
  updateForceDerivatives();
  for (MatrixXd* m : {&D_y_, &D_v_}) m->setZero();
  addColumns(iws_.dv_dq, Lift::N, D_y_);
  addColumns(iws_.dv_dv, Lift::Z, D_y_);
  addColumns(iws_.dv_dv, Lift::N, D_v_);
  out.Fx().setZero();
  out.Fu().setZero();
  for (Cluster& b : clusters_)
    if (!linearizeCluster(b, x_next_node, out)) return false;
  differenceFree(x_next_node, x_next_, out.gap);
  for (const FreeJoint& free : work_->free_joints) linearizeFreeJoint(free, out);
  return true;
}

// The impulses of the contacts, where setResiduals() expects them.
void ReducedImpactNode::updateForceDerivatives() {
  const int nr = reduction_.size, nu = model_.nu();
  const auto by_q = iws_.dimpulse_dq.bottomRows(contact_rows_), by_v = iws_.dimpulse_dv.bottomRows(contact_rows_);
  PaddedMap dlambda = shapeForceDerivatives();
  dlambda.setZero();
  addColumns(by_q, Lift::N, dlambda.middleRows(nu, nr));
  addColumns(by_v, Lift::Z, dlambda.middleRows(nu, nr));
  addColumns(by_v, Lift::N, dlambda.middleRows(nu + nr, nr));
}

// Eq. (a) for one cluster.
bool ReducedImpactNode::linearizeCluster(Cluster& b, ConstVectorRef x_next_node, StageModel& out) {
  const ReducedCluster& loop = b.loop;
  ClusterWork& work = *b.work;
  ClusterGapOf<double>& gap = work.gap;
  const int nr = reduction_.size, o = loop.offset, r = loop.size;
  gatherConfiguration(model_, loop, x_next_node.head(model_.nq()), gap.q);
  gatherVelocity(loop, x_next_node.tail(model_.nv()), gap.v);
  if (!updateGap(b)) return false;
  out.gap.segment(o, r) = gap.y;
  out.gap.segment(nr + o, r) = gap.y_v;
  // P_v (W N)^T, whose rows pick dv+ of the cluster's dofs.
  work.HN.noalias() = b.at.WN * gap.P_v.transpose();
  for (size_t k = 0; k < loop.dofs.size(); ++k)
    for (int c = 0; c < r; ++c) {
      out.Fx().row(nr + o + c).head(nr) += work.HN(k, c) * D_y_.col(loop.dofs[k]).transpose();
      out.Fx().row(nr + o + c).tail(nr) += work.HN(k, c) * D_v_.col(loop.dofs[k]).transpose();
    }
  out.Fx().block(o, o, r, r) = gap.P_q;
  out.Fx().block(nr + o, o, r, r) += gap.P_z;
  return true;
}

// From q+ to the node state that it holds.
bool ReducedImpactNode::updateGap(Cluster& b) {
  const ReducedCluster& loop = b.loop;
  ClusterWork& work = *b.work;
  ClusterGapOf<double>& gap = work.gap;
  if (gap.q == b.next.basis().q && gap.v == b.v_next) {
    for (VectorXd* x : {&gap.y, &gap.y_v}) x->setZero();
    for (MatrixXd* P : {&gap.P_q, &gap.P_v}) P->setIdentity();
    gap.P_z.setZero();
    return true;
  }
  b.next.load(loop, work.scratch);
  const auto view = getOwnView(loop, work.scratch.ws);
  updateTwists(view, b.next.basis(), work.ahead);
  updateVelocities(loop.model, work.scratch.ws, b.v_next);
  updateVelocityLift(view, work.ahead);
  if (!work.point.update(loop, work.scratch, gap.q)) return fail(b, work.point);
  gap.WN = work.point.basis().WN;
  gap.update(loop, b.next.basis(), b.v_next, work.ahead.Z);
  return true;
}

void ReducedImpactNode::linearizeFreeJoint(const FreeJoint& free, StageModel& out) const {
  const Joint& joint = model_.joints()[free.joint];
  const int nr = reduction_.size, o = free.offset, n = joint.nv;
  JointMatrix Jdiff(n, n);
  calcJointDifferenceJacobian(joint, out.gap.segment(o, n), Jdiff);
  out.Fx().block(o, o, n, n) = Jdiff;
  out.Fx().block(nr + o, 0, n, nr) = D_y_.middleCols(joint.idx_v, n).transpose();
  out.Fx().block(nr + o, nr, n, nr) = D_v_.middleCols(joint.idx_v, n).transpose();
}

}  // namespace bielle
