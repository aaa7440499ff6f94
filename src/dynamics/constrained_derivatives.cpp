#include "bielle/dynamics/rnea.h"
#include "dynamics/constrained_parts.h"
#include "dynamics/saddle_point.h"

namespace bielle {

NumericalStatus updateConstrainedDerivatives(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                             const ConstraintSet& constraints) {
  updateConstrainedSources(model, ws, cws, constraints);
  addStabilizationSources(ws, constraints, cws);
  cws.saddle_point->updateInverse();
  return solveConstrainedSources(cws);
}

void updateConstrainedSources(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                              const ConstraintSet& constraints) {
  for (Vector6d& f : cws.f_ext) f.setZero();
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    const Vector6d W =
        calcClosureWrench(ws, closure, cws.lambda.segment(constraints.offsets[c], getRows(closure.kind)));
    cws.f_ext[closure.body1] += W;
    cws.f_ext[closure.body2] -= W;
  }
  updateInverseDynamicsDerivatives(model, ws, cws.f_ext);
  for (MatrixXd* m : {&cws.dlambda_dq, &cws.dlambda_dv, &cws.dlambda_du}) m->setZero();
  cws.da_dq = ws.dID_dq;
  cws.da_dv = ws.dID_dv;
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    const int row = constraints.offsets[c], n = getRows(closure.kind);
    addClosureForceDerivative(model, ws, closure, cws.lambda.segment(row, n), cws.da_dq);
    calcClosureDerivatives(ws, closure, cws.dlambda_dq.middleRows(row, n), cws.dlambda_dv.middleRows(row, n));
  }
  cws.da_du.setZero();  // the torques enter ID with a minus
  for (int m = 0; m < model.nu(); ++m) cws.da_du(model.motors()[m].dof, m) = -1;
}

void addStabilizationSources(const Workspace& ws, const ConstraintSet& constraints, ConstrainedWorkspace& cws) {
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    const int row = constraints.offsets[c], n = getRows(closure.kind);
    addStabilizationDerivatives(ws, closure, cws.dlambda_dq.middleRows(row, n), cws.dlambda_dv.middleRows(row, n));
  }
}

NumericalStatus solveConstrainedSources(ConstrainedWorkspace& cws) {
  cws.saddle_point->solveDerivatives(cws.da_dq, cws.dlambda_dq);
  cws.saddle_point->solveDerivatives(cws.da_dv, cws.dlambda_dv);
  cws.saddle_point->solveDerivatives(cws.da_du, cws.dlambda_du);
  const bool finite = cws.da_dq.allFinite() && cws.da_dv.allFinite() && cws.dlambda_dq.allFinite();
  return finite ? NumericalStatus::Ok : NumericalStatus::NotFinite;
}

}  // namespace bielle
