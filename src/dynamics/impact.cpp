#include "bielle/dynamics/impact.h"

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/saddle_point.h"

namespace bielle {
namespace {

void resize(const Model& model, ImpactWorkspace& iws, int rows) {
  const int nv = model.nv();
  if (iws.J.rows() == rows && iws.J.cols() == nv) return;
  iws.J.setZero(rows, nv);
  iws.impulse.setZero(rows);
  for (MatrixXd* m : {&iws.dimpulse_dq, &iws.dimpulse_dv}) m->setZero(rows, nv);
  iws.saddle_point->resize(nv, rows);
  iws.zero.setZero(rows);
}

}  // namespace

ImpactWorkspace::ImpactWorkspace(const Model& model) : ws(model) {
  for (VectorXd* v : {&v_plus, &momentum, &change}) v->setZero(model.nv());
  for (MatrixXd* m : {&dv_dq, &dv_dv}) m->setZero(model.nv(), model.nv());
  f_ext.assign(model.numBodies(), Vector6d::Zero());
}

NumericalStatus updateImpact(const Model& model, ImpactWorkspace& iws, const ConstraintSet& constraints,
                             ConstVectorRef q, ConstVectorRef v) {
  resize(model, iws, constraints.rows);
  updatePositions(model, iws.ws, q);
  updateMassMatrix(model, iws.ws);
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    calcClosureJacobian(iws.ws, closure, iws.J.middleRows(constraints.offsets[c], getRows(closure.kind)));
  }
  if (!iws.saddle_point->factorize(iws.ws.M, iws.J)) return NumericalStatus::Singular;
  iws.momentum.noalias() = iws.ws.M * v;
  iws.saddle_point->solve(iws.momentum, iws.zero, iws.v_plus, iws.impulse);
  iws.change = iws.v_plus - v;
  return iws.v_plus.allFinite() && iws.impulse.allFinite() ? NumericalStatus::Ok : NumericalStatus::NotFinite;
}

NumericalStatus updateImpactDerivatives(const Model& model, ImpactWorkspace& iws, const ConstraintSet& constraints) {
  Workspace& ws = iws.ws;
  updateVelocities(model, ws, iws.v_plus);
  iws.dimpulse_dq.setZero();
  iws.dimpulse_dv.setZero();
  for (Vector6d& f : iws.f_ext) f.setZero();
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    const int row = constraints.offsets[c], n = getRows(closure.kind);
    const Vector6d W = calcClosureWrench(ws, closure, iws.impulse.segment(row, n));
    iws.f_ext[closure.body1] += W;
    iws.f_ext[closure.body2] -= W;
    calcClosureVelocityDerivative(ws, closure, iws.dimpulse_dq.middleRows(row, n));
  }
  iws.dv_dv.setZero();  // first used as a state at rest
  updateVelocities(model, ws, iws.dv_dv.col(0));
  updateAccelerations(model, ws, iws.dv_dv.col(0));
  updateInverseDynamicsDerivatives(model, ws, {});
  iws.dv_dq = -ws.dID_dq;  // gravity
  updateAccelerations(model, ws, iws.change);
  updateInverseDynamicsDerivatives(model, ws, iws.f_ext);
  iws.dv_dq += ws.dID_dq;
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    addClosureForceDerivative(model, ws, closure, iws.impulse.segment(constraints.offsets[c], getRows(closure.kind)),
                              iws.dv_dq);
  }
  iws.dv_dv = -ws.M;
  iws.saddle_point->updateInverse();
  iws.saddle_point->solveDerivatives(iws.dv_dq, iws.dimpulse_dq);
  iws.saddle_point->solveDerivatives(iws.dv_dv, iws.dimpulse_dv);
  return iws.dv_dq.allFinite() && iws.dv_dv.allFinite() ? NumericalStatus::Ok : NumericalStatus::NotFinite;
}

}  // namespace bielle
