#include "ocp/full/full_step.h"

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/constrained_parts.h"
#include "dynamics/saddle_point.h"
#include "model/joint.h"

namespace bielle {

FullStepScratch::FullStepScratch(const Model& model, int most_constraint_rows)
    : tau(VectorXd::Zero(model.nv())),
      displacement(VectorXd::Zero(model.nv())),
      by_scale(VectorXd::Zero(2 * model.nv())),
      by_velocity(MatrixXd::Zero(std::max(model.nv(), most_constraint_rows), model.nv())) {}

void updateNode(const Model& model, const VectorXd& x, Workspace& ws) {
  ws.armature = model.armature();
  updatePositions(model, ws, x.head(model.nq()));
  updateVelocities(model, ws, x.segment(model.nq(), model.nv()));
  updateMassMatrix(model, ws);
}

namespace {

void setArmature(const Model& model, const StageSpec& spec, Workspace& ws) {
  ws.armature = model.armature();
  if (spec.armature.size() > 0) ws.armature += spec.armature;
}

bool isMidpoint(const StageSpec& spec) { return spec.step == StepRule::Midpoint; }

// Length of the last drift.
double getLastDrift(const StageSpec& spec, double h) { return isMidpoint(spec) ? h / 2 : h; }

auto getVelocity(const Model& model, const VectorXd& x) { return x.segment(model.nq(), model.nv()); }

// a and lambda of the step, after the drifts that come before.
NumericalStatus updateEulerAcceleration(const Model& model, const StageSpec& spec, FullStepScratch& scratch,
                                        FullEvaluation& at) {
  setArmature(model, spec, at.ws);
  return updateConstrainedDynamics(model, at.ws, at.cws, spec.constraints, at.x.head(model.nq()),
                                   getVelocity(model, at.x), scratch.tau);
}

NumericalStatus updateMidpointAcceleration(const Model& model, const StageSpec& spec, FullStepScratch& scratch,
                                           FullEvaluation& at) {
  if (!at.midpoint) at.midpoint = std::make_unique<FullEvaluation::Midpoint>(model);
  FullEvaluation::Midpoint& mid = *at.midpoint;
  const auto q = at.x.head(model.nq());
  const auto v = getVelocity(model, at.x);
  updateNode(model, at.x, at.ws);
  setArmature(model, spec, mid.ws);
  scratch.displacement = at.dt / 2 * v;
  model.integrate(q, scratch.displacement, at.q_mid);
  if (!updateConstrainedSystem(model, mid.ws, at.cws, spec.constraints, at.q_mid)) return NumericalStatus::Singular;
  updateVelocities(model, mid.ws, v);
  const NumericalStatus status = solveConstrainedSystem(model, mid.ws, at.cws, spec.constraints, scratch.tau, nullptr);
  if (status != NumericalStatus::Ok) return status;
  mid.a_0 = at.cws.a;
  mid.lambda_0 = at.cws.lambda;
  at.v_mid = v + at.dt / 2 * mid.a_0;
  mid.stabilization.resize(spec.constraints.rows);
  calcStabilization(at.ws, spec.constraints, mid.stabilization);
  updateVelocities(model, mid.ws, at.v_mid);
  return solveConstrainedSystem(model, mid.ws, at.cws, spec.constraints, scratch.tau, &mid.stabilization);
}

}  // namespace

NumericalStatus updateFullStep(const Model& model, const StageSpec& spec, FullStepScratch& scratch,
                               FullEvaluation& at) {
  const int nq = model.nq();
  calcMotorForces(model, at.u, scratch.tau);
  const NumericalStatus status = isMidpoint(spec) ? updateMidpointAcceleration(model, spec, scratch, at)
                                                  : updateEulerAcceleration(model, spec, scratch, at);
  if (status != NumericalStatus::Ok) return status;
  at.a = at.cws.a;
  at.lambda = at.cws.lambda;
  auto v_next = at.x_next.segment(nq, model.nv());
  v_next = getVelocity(model, at.x) + at.dt * at.a;
  scratch.displacement = getLastDrift(spec, at.dt) * v_next;
  if (isMidpoint(spec))
    model.integrate(at.q_mid, scratch.displacement, at.x_next.head(nq));
  else
    model.integrate(at.x.head(nq), scratch.displacement, at.x_next.head(nq));
  return status;
}

namespace {

// Eq. (3): sources by (q_m, v_m, u) become those by (q_m, v, u).
void chainForeseen(double h, const FullEvaluation::Midpoint& mid, MatrixXd& by_velocity, MatrixXd& dq, MatrixXd& dv,
                   MatrixXd& du) {
  auto factor = by_velocity.topRows(dv.rows());
  factor = h / 2 * dv;
  dq.noalias() += factor * mid.A0_q;
  dv.noalias() += factor * mid.A0_v;
  du.noalias() += factor * mid.A0_u;
}

// r_s of Eq. (4) for dID or dc, after chainForeseen() for the same.
void setSourcesByScale(double s, const FullEvaluation::Midpoint& mid, const MatrixXd& by_velocity, const MatrixXd& dq,
                       VectorXd& out) {
  out.noalias() = by_velocity.topRows(dq.rows()) * mid.a_0;
  out /= s;
  out.noalias() += dq * mid.q_s;
}

// q_m,s of Eq. (5).
void setMidpointByScale(const Model& model, double h, const FullEvaluation& at, VectorXd& out) {
  out = h / (2 * at.time_scale) * getVelocity(model, at.x);
  for (const Joint& joint : model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    JointMatrix Jq(n, n), Jd(n, n);
    const JointVector d = at.time_scale * out.segment(i, n), d_s = out.segment(i, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    out.segment(i, n).noalias() = Jd * d_s;
  }
}

// Those by (q_m, v) become those by (q, v). The displacement is that of the first drift, h/2 v.
void chainDrift(const Model& model, double h, const VectorXd& displacement, MatrixXd& dq, MatrixXd& dv) {
  for (const Joint& joint : model.joints()) {
    const int i = joint.idx_v, n = joint.nv;
    if (n == 0) continue;
    if (!isCurved(joint)) {
      dv.middleCols(i, n) += h / 2 * dq.middleCols(i, n);
      continue;
    }
    JointMatrix Jq(n, n), Jd(n, n);
    const JointVector d = displacement.segment(i, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    Jd *= h / 2;
    for (Eigen::Index row = 0; row < dq.rows(); ++row) {
      const Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, 6> r = dq.row(row).segment(i, n);
      dv.row(row).segment(i, n).noalias() += r * Jd;
      dq.row(row).segment(i, n).noalias() = r * Jq;
    }
  }
}

}  // namespace

NumericalStatus updateFullStepDerivatives(const Model& model, const StageSpec& spec, bool free,
                                          FullStepScratch& scratch, FullEvaluation& at) {
  ConstrainedWorkspace& cws = at.cws;
  if (!isMidpoint(spec)) return updateConstrainedDerivatives(model, at.ws, cws, spec.constraints);
  FullEvaluation::Midpoint& mid = *at.midpoint;
  const auto v = getVelocity(model, at.x);
  cws.saddle_point->updateInverse();
  cws.lambda = mid.lambda_0;
  updateVelocities(model, mid.ws, v);
  updateAccelerations(model, mid.ws, mid.a_0);
  updateConstrainedSources(model, mid.ws, cws, spec.constraints);
  cws.lambda = at.lambda;
  const NumericalStatus status = solveConstrainedSources(cws);
  if (status != NumericalStatus::Ok) return status;
  mid.A0_q = cws.da_dq;
  mid.A0_v = cws.da_dv;
  mid.A0_u = cws.da_du;
  updateVelocities(model, mid.ws, at.v_mid);
  updateAccelerations(model, mid.ws, at.a);
  updateConstrainedSources(model, mid.ws, cws, spec.constraints);
  const double h = at.dt;
  if (free) setMidpointByScale(model, h, at, mid.q_s);
  chainForeseen(h, mid, scratch.by_velocity, cws.da_dq, cws.da_dv, cws.da_du);
  if (free) setSourcesByScale(at.time_scale, mid, scratch.by_velocity, cws.da_dq, mid.a_s);
  chainForeseen(h, mid, scratch.by_velocity, cws.dlambda_dq, cws.dlambda_dv, cws.dlambda_du);
  if (free) {
    setSourcesByScale(at.time_scale, mid, scratch.by_velocity, cws.dlambda_dq, mid.lambda_s);
    cws.saddle_point->solveDerivatives(mid.a_s, mid.lambda_s);
  }
  scratch.displacement = h / 2 * v;
  chainDrift(model, h, scratch.displacement, cws.da_dq, cws.da_dv);
  chainDrift(model, h, scratch.displacement, cws.dlambda_dq, cws.dlambda_dv);
  addStabilizationSources(at.ws, spec.constraints, cws);
  return solveConstrainedSources(cws);
}

void updateSpeedDerivatives(const Model& model, bool free, FullStepScratch& scratch, FullEvaluation& at) {
  FullEvaluation::Midpoint& mid = *at.midpoint;
  const double h = at.dt;
  mid.speeds_q.resize(model.nu(), model.nv());
  mid.speeds_v.resize(model.nu(), model.nv());
  mid.speeds_u.resize(model.nu(), model.nu());
  mid.speeds_s.setZero(model.nu());
  for (int m = 0; m < model.nu(); ++m) {
    const int dof = model.motors()[m].dof;
    mid.speeds_q.row(m) = h / 2 * mid.A0_q.row(dof);
    mid.speeds_v.row(m) = h / 2 * mid.A0_v.row(dof);
    mid.speeds_v(m, dof) += 1;
    mid.speeds_u.row(m) = h / 2 * mid.A0_u.row(dof);
    if (free) mid.speeds_s[m] = h / (2 * at.time_scale) * mid.a_0[dof] + mid.speeds_q.row(m).dot(mid.q_s);
  }
  scratch.displacement = h / 2 * getVelocity(model, at.x);
  chainDrift(model, h, scratch.displacement, mid.speeds_q, mid.speeds_v);
}

namespace {

// Adds to the rows of a joint of q what its own q and v contribute without the acceleration, through the drifts.
template <class Block>
void addDrifts(const Model& model, const StageSpec& spec, const FullEvaluation& at, const Joint& joint,
               const JointMatrix& by_start, Block&& Fx) {
  const int i = joint.idx_v, n = joint.nv, nv = model.nv();
  if (!isMidpoint(spec)) {
    Fx.block(i, i, n, n) += by_start;
    return;
  }
  const double h = at.dt;
  JointMatrix Jq(n, n), Jd(n, n);
  const JointVector d = h / 2 * getVelocity(model, at.x).segment(i, n);
  calcJointIntegrateJacobians(joint, d, Jq, Jd);
  Fx.block(i, i, n, n).noalias() += by_start * Jq;
  Fx.block(i, nv + i, n, n).noalias() += h / 2 * by_start * Jd;
}

}  // namespace

namespace {

// Eqs. (4) and (5) before the Jacobians of the last drift: v+_s, and the derivative of the displacement.
void setByScale(const Model& model, const StageSpec& spec, const FullEvaluation& at, VectorXd& by_scale) {
  const int nv = model.nv();
  const double s = at.time_scale, h = at.dt, last = getLastDrift(spec, h);
  auto of_q = by_scale.head(nv), of_v = by_scale.tail(nv);
  of_v = h / s * at.a;
  if (isMidpoint(spec)) of_v += h * at.midpoint->a_s;
  of_q = last / s * getVelocity(model, at.x_next) + last * of_v;
}

}  // namespace

void setFullStep(const Model& model, const StageSpec& spec, bool free, const FullEvaluation& at, ConstVectorRef gap,
                 FullStepScratch& scratch, StageModel& out) {
  const int nv = model.nv(), nu = model.nu();
  const double h = at.dt, last = getLastDrift(spec, h);
  RowMatrixMap all = out.Fx();
  auto Fx = all.bottomRightCorner(2 * nv, 2 * nv);
  auto Fu = out.Fu().bottomLeftCorner(2 * nv, nu);
  VectorXd& by_scale = scratch.by_scale;
  if (free) setByScale(model, spec, at, by_scale);
  auto Fv = Fx.bottomRows(nv);
  Fv.leftCols(nv) = h * at.cws.da_dq;
  Fv.rightCols(nv) = h * at.cws.da_dv;
  Fv.rightCols(nv).diagonal().array() += 1;
  Fu.bottomRows(nv) = h * at.cws.da_du;
  scratch.displacement = last * getVelocity(model, at.x_next);
  for (const Joint& joint : model.joints()) {
    const int i = joint.idx_v, n = joint.nv;
    if (n == 0) continue;
    if (!isCurved(joint)) {
      Fx.middleRows(i, n) = last * Fx.middleRows(nv + i, n);
      Fx.block(i, i, n, n).diagonal().array() += 1;
      if (isMidpoint(spec)) Fx.block(i, nv + i, n, n).diagonal().array() += h / 2;
      Fu.middleRows(i, n) = last * Fu.middleRows(nv + i, n);
      if (free && isMidpoint(spec)) by_scale.segment(i, n) += at.midpoint->q_s.segment(i, n);
      continue;
    }
    JointMatrix Jq(n, n), Jd(n, n), Jdiff(n, n);
    const JointVector d = scratch.displacement.segment(i, n), open = gap.segment(i, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    calcJointDifferenceJacobian(joint, open, Jdiff);
    const JointMatrix dv = last * Jdiff * Jd, dq = Jdiff * Jq;
    Fx.middleRows(i, n).noalias() = dv * Fx.middleRows(nv + i, n);
    addDrifts(model, spec, at, joint, dq, Fx);
    Fu.middleRows(i, n).noalias() = dv * Fu.middleRows(nv + i, n);
    if (!free) continue;
    const JointVector d_s = by_scale.segment(i, n);
    by_scale.segment(i, n).noalias() = Jdiff * Jd * d_s;
    if (isMidpoint(spec)) by_scale.segment(i, n).noalias() += dq * at.midpoint->q_s.segment(i, n);
  }
  if (free) out.Ft().row(nu).tail(2 * nv) = by_scale.transpose();
}

}  // namespace bielle
