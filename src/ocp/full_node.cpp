#include "full_node.h"

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "impact_nodes.h"

namespace bielle {

NodeModel::NodeModel(const Model& model, const StageSpec& spec) : model_(model), spec_(spec) {
  lambda_.setZero(spec.constraints.rows);
  x_next_.setZero(model.nq() + model.nv());
}

int countResidualRows(const StageSpec& spec) {
  int rows = 0;
  for (const Cost& cost : spec.costs) rows += cost.residual->size();
  return rows;
}

FullNode::FullNode(const Model& model, const StageSpec& spec) : NodeModel(model, spec), ws_(model) {
  tau_.setZero(model.nv());
  displacement_.setZero(model.nv());
  difference_.setZero(model.nv());
  const int rows = countResidualRows(spec);
  for (MatrixXd* m : {&jacobians_.q, &jacobians_.v}) m->setZero(rows, model.nv());
  jacobians_.lambda.setZero(rows, spec.constraints.rows);
}

void FullNode::integrate(ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) {
  model_.integrate(x.head(model_.nq()), dx.head(model_.nv()), x_out.head(model_.nq()));
  x_out.tail(model_.nv()) = x.tail(model_.nv()) + dx.tail(model_.nv());
}

void FullNode::difference(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) {
  model_.difference(x0.head(model_.nq()), x1.head(model_.nq()), dx.head(model_.nv()));
  dx.tail(model_.nv()) = x1.tail(model_.nv()) - x0.tail(model_.nv());
}

bool FullNode::updateState(ConstVectorRef x) {
  updatePositions(model_, ws_, x.head(model_.nq()));
  updateVelocities(model_, ws_, x.tail(model_.nv()));
  updateMassMatrix(model_, ws_);
  return true;
}

bool FullNode::updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel*) {
  const int nq = model_.nq(), nv = model_.nv();
  calcMotorForces(model_, u, tau_);
  failure_.clear();
  const DynamicsStatus status =
      updateConstrainedDynamics(model_, ws_, cws_, spec_.constraints, x.head(nq), x.tail(nv), tau_);
  if (status != DynamicsStatus::Ok) {
    failure_ = getMessage(status);
    return false;
  }
  lambda_ = cws_.lambda;
  x_next_.tail(nv) = x.tail(nv) + spec_.dt * cws_.a;  // robot_problem.h Eq. (1)
  displacement_ = spec_.dt * x_next_.tail(nv);
  model_.integrate(x.head(nq), displacement_, x_next_.head(nq));
  return true;
}

// robot_problem.h Eq. (2), then the Jacobian of the difference to the node state where a gap is open.
bool FullNode::linearizeStep(ConstVectorRef x_next_node, StageModel& out) {
  if (updateConstrainedDerivatives(model_, ws_, cws_, spec_.constraints) != DynamicsStatus::Ok) return false;
  const int nv = model_.nv();
  const double h = spec_.dt;
  auto Fv = out.Fx().bottomRows(nv);
  Fv.leftCols(nv) = h * cws_.da_dq;
  Fv.rightCols(nv) = h * cws_.da_dv;
  Fv.rightCols(nv).diagonal().array() += 1;
  out.Fu().bottomRows(nv) = h * cws_.da_du;
  difference(x_next_node, x_next_, out.gap);
  for (const Joint& joint : model_.joints()) {
    const int i = joint.idx_v, n = joint.nv;
    if (n == 0) continue;
    if (!isCurved(joint)) {
      out.Fx().middleRows(i, n) = h * out.Fx().middleRows(nv + i, n);
      out.Fx().block(i, i, n, n).diagonal().array() += 1;
      out.Fu().middleRows(i, n) = h * out.Fu().middleRows(nv + i, n);
      continue;
    }
    JointMatrix Jq(n, n), Jd(n, n), Jdiff(n, n);
    const JointVector d = displacement_.segment(i, n), gap = out.gap.segment(i, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    calcJointDifferenceJacobian(joint, gap, Jdiff);
    const JointMatrix dv = h * Jdiff * Jd, dq = Jdiff * Jq;
    out.Fx().middleRows(i, n).noalias() = dv * out.Fx().middleRows(nv + i, n);
    out.Fx().block(i, i, n, n) += dq;
    out.Fu().middleRows(i, n).noalias() = dv * out.Fu().middleRows(nv + i, n);
  }
  return true;
}

double FullNode::calcStateCost() {
  const StateCost& state = spec_.state;
  const int nv = model_.nv();
  model_.difference(state.q_ref, ws_.q, difference_);
  return 0.5 * state.weight *
         (difference_.cwiseAbs2().dot(state.weights.head(nv)) +
          (ws_.v - state.v_ref).cwiseAbs2().dot(state.weights.tail(nv)));
}

void FullNode::addStateCost(double scale, StageModel& out) {
  const StateCost& state = spec_.state;
  const int nv = model_.nv();
  const double w = scale * state.weight;
  out.lx.tail(nv) += w * state.weights.tail(nv).cwiseProduct(ws_.v - state.v_ref);
  out.lxx().diagonal().tail(nv) += w * state.weights.tail(nv);
  for (const Joint& joint : model_.joints()) {
    const int i = joint.idx_v, n = joint.nv;
    if (n == 0) continue;
    const JointVector weights = w * state.weights.segment(i, n);
    const JointVector d = difference_.segment(i, n);
    JointMatrix J(n, n);
    calcJointDifferenceJacobian(joint, d, J);
    const JointMatrix WJ = weights.asDiagonal() * J;
    out.lx.segment(i, n).noalias() += WJ.transpose() * d;
    out.lxx().block(i, i, n, n).noalias() += J.transpose() * WJ;
  }
}

ResidualJacobians& FullNode::startResiduals(const ResidualStack&) {
  for (MatrixXd* m : {&jacobians_.q, &jacobians_.v, &jacobians_.lambda}) m->setZero();
  return jacobians_;
}

void FullNode::setResiduals(const ResidualStack& stack, bool running, StageModel& out) {
  const int nv = model_.nv(), rows = static_cast<int>(stack.r.size());
  if (Rx_.rows() != rows) {
    Rx_.setZero(rows, 2 * nv);
    Ru_.setZero(rows, model_.nu());
    scaled_ = Rx_;
  }
  Rx_.leftCols(nv) = jacobians_.q;
  Rx_.rightCols(nv) = jacobians_.v;
  if (running) {
    Rx_.leftCols(nv).noalias() += jacobians_.lambda * cws_.dlambda_dq;
    Rx_.rightCols(nv).noalias() += jacobians_.lambda * cws_.dlambda_dv;
    Ru_.noalias() = jacobians_.lambda * cws_.dlambda_du;
  }
  scaled_ = stack.hessian.asDiagonal() * Rx_;
  out.lx.noalias() = Rx_.transpose() * stack.gradient;
  out.lxx().noalias() = Rx_.transpose() * scaled_;
  if (!running) return;
  out.lu.noalias() = Ru_.transpose() * stack.gradient;
  out.lux().noalias() = Ru_.transpose() * scaled_;
  Ru_scaled_ = stack.hessian.asDiagonal() * Ru_;
  out.luu().noalias() = Ru_.transpose() * Ru_scaled_;
}

std::unique_ptr<NodeModel> makeFullNode(const Model& model, const StageSpec& spec) {
  if (spec.kind == StageKind::Impact) return std::make_unique<FullImpactNode>(model, spec);
  return std::make_unique<FullNode>(model, spec);
}

}  // namespace bielle
