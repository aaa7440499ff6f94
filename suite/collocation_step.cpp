#include "collocation_step.h"

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "model/joint.h"
#include "ocp/transcription.h"

namespace bielle {
namespace {

bool isImpact(const StageSpec& spec) { return spec.kind == StageKind::Impact; }

// Work(closure, first row, rows) for closures, contacts or both.
template <typename Work>
void visit(const ConstraintSet& set, int first, int end, const Work& work) {
  for (int c = first; c < end; ++c) work(set.closures[c], set.offsets[c], getRows(set.closures[c].kind));
}
int countClosures(const ConstraintSet& set) { return static_cast<int>(set.closures.size()); }

template <typename Make>
JointBlocks makeBlocks(const Model& model, double plain, const Make& make) {
  JointBlocks out{plain, {}};
  for (const Joint& joint : model.joints()) {
    if (!isCurved(joint)) continue;
    MatrixXd block(joint.nv, joint.nv);
    make(joint, block);
    out.curved.emplace_back(joint.idx_v, block);
  }
  return out;
}

// Of q1 (-) q0 = d, by q1.
JointBlocks makeDifferenceBlocks(const Model& model, const VectorXd& d) {
  return makeBlocks(model, 1, [&](const Joint& joint, MatrixXd& block) {
    calcJointDifferenceJacobian(joint, d.segment(joint.idx_v, joint.nv), block);
  });
}

}  // namespace

MatrixXd multiply(const MatrixXd& by, const JointBlocks& blocks) {
  MatrixXd out = blocks.plain * by;
  for (const auto& [first, block] : blocks.curved)
    out.middleCols(first, block.cols()).noalias() = by.middleCols(first, block.cols()) * block;
  return out;
}

JointBlocks makeIntegrateBlocks(const Model& model, const VectorXd& d) {
  return makeBlocks(model, 1, [&](const Joint& joint, MatrixXd& block) {
    MatrixXd by_q(joint.nv, joint.nv);
    calcJointIntegrateJacobians(joint, d.segment(joint.idx_v, joint.nv), by_q, block);
  });
}

StepLayout::StepLayout(const Model& model, const ConstraintSet& constraints) {
  const int nv = model.nv();
  forces = constraints.rows;
  visit(constraints, 0, constraints.num_loops, [this](const Closure&, int, int n) { loops += n; });
  v0 = q0 + nv;
  u = v0 + nv;
  lambda = u + model.nu();
  zeta = lambda + forces;
  q1 = zeta + loops;
  v1 = q1 + nv;
  columns = v1 + nv;
  dynamics = places + nv;
  contacts = dynamics + nv;
  closed = contacts + forces - loops;
  still = closed + loops;
  rows = still + loops;
}

CollocationStep::CollocationStep(const Model& model)
    : model_(model), start_(model), middle_(model), end_(model), f_ext_(model.numBodies()) {
  for (Workspace* ws : {&start_, &middle_, &end_}) ws->armature = model.armature();
}

void CollocationStep::update(const Input& in, VectorXd& out) {
  const ConstraintSet& set = in.spec.constraints;
  const StepLayout at(model_, set);
  const int nq = model_.nq(), nv = model_.nv();
  const auto q0 = in.x0.head(nq), q1 = in.x1.head(nq);
  const auto v0 = in.x0.segment(nq, nv), v1 = in.x1.segment(nq, nv);
  const bool impact = isImpact(in.spec);
  h_ = impact ? 1 : in.spec.dt;
  delta_ = model_.difference(q0, q1);
  a_ = (v1 - v0) / h_;
  v_mid_ = impact ? VectorXd(VectorXd::Zero(nv)) : VectorXd((v0 + v1) / 2);
  updatePositions(model_, start_, q0);
  updateVelocities(model_, start_, v0);
  updatePositions(model_, end_, q1);
  updateVelocities(model_, end_, v1);
  updatePositions(model_, middle_, model_.integrate(q0, delta_ / 2));
  updateMassMatrix(model_, middle_);
  updateVelocities(model_, middle_, impact ? VectorXd(v1) : v_mid_);
  updateInverseDynamics(model_, middle_, a_);
  J_.setZero(at.forces, nv);
  visit(set, 0, countClosures(set),
        [&](const Closure& closure, int row, int n) { calcClosureJacobian(middle_, closure, J_.middleRows(row, n)); });

  out.resize(at.rows);
  out.segment(at.places, nv) = delta_ - h_ * (v_mid_ + J_.topRows(at.loops).transpose() * in.zeta);
  auto dynamics = out.segment(at.dynamics, nv);
  dynamics = -J_.transpose() * in.lambda;
  if (impact)
    dynamics += middle_.M * a_;
  else
    dynamics += middle_.b - calcMotorForces(model_, in.u);
  visit(set, set.num_loops, countClosures(set), [&](const Closure& closure, int row, int n) {
    auto rows = out.segment(at.contacts + row - at.loops, n);
    if (impact)
      rows = calcClosureVelocity(middle_, closure);
    else
      rows = calcClosureAcceleration(middle_, closure) + calcClosureStabilization(start_, closure);
  });
  visit(set, 0, set.num_loops, [&](const Closure& closure, int row, int n) {
    out.segment(at.closed + row, n) = calcClosureResidual(end_, closure);
    out.segment(at.still + row, n) = calcClosureVelocity(end_, closure);
  });
}

// Adds -d(J^T lambda)/dq and what else moves with q in inverse dynamics; leaves D_v_ at its derivative by v.
void CollocationStep::addForceDerivatives(const ConstraintSet& set, const VectorXd& lambda, MatrixXd& by_q) {
  for (Vector6d& f : f_ext_) f.setZero();
  visit(set, 0, countClosures(set), [&](const Closure& closure, int row, int n) {
    const Vector6d W = calcClosureWrench(middle_, closure, lambda.segment(row, n));
    f_ext_[closure.body1] += W;
    f_ext_[closure.body2] -= W;
  });
  updateInverseDynamicsDerivatives(model_, middle_, f_ext_);
  by_q += middle_.dID_dq;
  D_v_ = middle_.dID_dv;
  visit(set, 0, countClosures(set), [&](const Closure& closure, int row, int n) {
    addClosureForceDerivative(model_, middle_, closure, lambda.segment(row, n), by_q);
  });
}

// G_ is the difference of the derivatives of inverse dynamics without forces and with zeta as forces.
void CollocationStep::differentiateDynamics(const Input& in, const StepLayout& at) {
  const ConstraintSet& set = in.spec.constraints;
  const int nv = model_.nv();
  const bool impact = isImpact(in.spec);
  for (MatrixXd* m : {&c_q_, &c_v_}) m->setZero(at.forces - at.loops, nv);
  for (MatrixXd* m : {&D_q_, &G_}) m->setZero(nv, nv);
  if (impact)
    visit(set, set.num_loops, countClosures(set), [&](const Closure& closure, int row, int n) {
      calcClosureVelocityDerivative(middle_, closure, c_q_.middleRows(row - at.loops, n));
    });
  updateVelocities(model_, middle_, v_mid_);
  updateAccelerations(model_, middle_, a_);
  VectorXd zeta = VectorXd::Zero(at.forces);
  addForceDerivatives(set, zeta, G_);
  zeta.head(at.loops) = -in.zeta;
  MatrixXd with = MatrixXd::Zero(nv, nv);
  addForceDerivatives(set, zeta, with);
  G_ = with - G_;
  addForceDerivatives(set, in.lambda, D_q_);
  if (!impact) {
    visit(set, set.num_loops, countClosures(set), [&](const Closure& closure, int row, int n) {
      calcClosureDerivatives(middle_, closure, c_q_.middleRows(row - at.loops, n), c_v_.middleRows(row - at.loops, n));
    });
    return;
  }
  updateAccelerations(model_, middle_, VectorXd::Zero(nv));  // at rest what is left is gravity and springs
  updateInverseDynamicsDerivatives(model_, middle_, {});
  D_q_ -= middle_.dID_dq;
  D_v_.setZero();
}

void CollocationStep::differentiate(const Input& in, MatrixXd& out) {
  const StepLayout at(model_, in.spec.constraints);
  const int nv = model_.nv(), contacts = at.forces - at.loops;
  const bool impact = isImpact(in.spec);
  differentiateDynamics(in, at);
  out.setZero(at.rows, at.columns);
  setPlaces(in, at, out);
  const auto Jc = J_.bottomRows(contacts);
  for (const int side : {0, 1}) {
    auto dynamics = out.block(at.dynamics, side == 0 ? at.v0 : at.v1, nv, nv);
    auto rows = out.block(at.contacts, side == 0 ? at.v0 : at.v1, contacts, nv);
    dynamics = (side == 0 ? -1 : 1) / h_ * middle_.M;
    if (impact) {
      if (side == 1) rows = Jc;
      continue;
    }
    dynamics += 0.5 * D_v_;
    rows = (side == 0 ? -1 : 1) / h_ * Jc + 0.5 * c_v_;
  }
  if (!impact)
    for (int m = 0; m < model_.nu(); ++m) out(at.dynamics + model_.motors()[m].dof, at.u + m) = -1;
  out.block(at.dynamics, at.lambda, nv, at.forces) = -J_.transpose();
  differentiateEnds(in, at, out);
}

// Eq. (2), and (3) and (4) by q_0 and q_1.
void CollocationStep::setPlaces(const Input& in, const StepLayout& at, MatrixXd& out) const {
  const int nv = model_.nv(), contacts = at.forces - at.loops;
  const VectorXd half = delta_ / 2, back = -delta_;
  const JointBlocks by_end = makeDifferenceBlocks(model_, delta_), by_start = makeDifferenceBlocks(model_, back);
  JointBlocks mid_start{0.5, {}}, mid_end{0.5, {}};
  for (size_t i = 0, j = 0; i < model_.joints().size(); ++i) {
    const Joint& joint = model_.joints()[i];
    if (!isCurved(joint)) continue;
    MatrixXd by_q(joint.nv, joint.nv), by_d(joint.nv, joint.nv);
    calcJointIntegrateJacobians(joint, half.segment(joint.idx_v, joint.nv), by_q, by_d);
    mid_start.curved.emplace_back(joint.idx_v, by_q - 0.5 * by_d * by_start.curved[j].second);
    mid_end.curved.emplace_back(joint.idx_v, 0.5 * by_d * by_end.curved[j++].second);
  }
  const MatrixXd identity = MatrixXd::Identity(nv, nv);
  out.block(at.places, at.q0, nv, nv) = -multiply(identity, by_start) - h_ * multiply(G_, mid_start);
  out.block(at.places, at.q1, nv, nv) = multiply(identity, by_end) - h_ * multiply(G_, mid_end);
  if (!isImpact(in.spec))
    for (const int column : {at.v0, at.v1}) out.block(at.places, column, nv, nv).diagonal().setConstant(-h_ / 2);
  out.block(at.places, at.zeta, nv, at.loops) = -h_ * J_.topRows(at.loops).transpose();
  out.block(at.dynamics, at.q0, nv, nv) = multiply(D_q_, mid_start);
  out.block(at.dynamics, at.q1, nv, nv) = multiply(D_q_, mid_end);
  out.block(at.contacts, at.q0, contacts, nv) = multiply(c_q_, mid_start);
  out.block(at.contacts, at.q1, contacts, nv) = multiply(c_q_, mid_end);
}

// Eq. (5), and the stabilization of (4).
void CollocationStep::differentiateEnds(const Input& in, const StepLayout& at, MatrixXd& out) {
  const ConstraintSet& set = in.spec.constraints;
  const int nv = model_.nv();
  if (!isImpact(in.spec))
    visit(set, set.num_loops, countClosures(set), [&](const Closure& closure, int row, int n) {
      const int first = at.contacts + row - at.loops;
      addStabilizationDerivatives(start_, closure, out.block(first, at.q0, n, nv), out.block(first, at.v0, n, nv));
    });
  visit(set, 0, set.num_loops, [&](const Closure& closure, int row, int n) {
    calcClosureResidualJacobian(end_, closure, out.block(at.closed + row, at.q1, n, nv));
    calcClosureVelocityDerivative(end_, closure, out.block(at.still + row, at.q1, n, nv));
    calcClosureJacobian(end_, closure, out.block(at.still + row, at.v1, n, nv));
  });
}

}  // namespace bielle
