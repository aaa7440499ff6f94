#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/rnea.h"

namespace bielle {
namespace {

// Inverse of D G D, or its pseudo-inverse as the limit of Eq. (3): with P = (DGD + mu I)^{-1} and E = mu P, the sum
// P (I + E + E^2 + ...) is doubled at each pass, P_{2k} = P_k + E^k P_k.
void calcDelassusInverse(ConstrainedWorkspace& cws, const ConstrainedOptions& options) {
  cws.Ginv.setIdentity();
  cws.G_llt.solveInPlace(cws.Ginv);
  if (!cws.redundant) return;
  constexpr int kDoublings = 3;  // eight proximal steps
  cws.T1 = options.proximal * cws.Ginv;
  for (int i = 0; i < kDoublings; ++i) {
    cws.T3 = cws.Ginv;
    cws.T3.noalias() += cws.T1 * cws.Ginv;
    cws.Ginv = cws.T3;
    cws.T3.noalias() = cws.T1 * cws.T1;
    cws.T1 = cws.T3;
  }
}

// Eq. (4) for one argument: dID is overwritten by da; dc is the derivative of the constraint acceleration, null for
// zero.
void solveDerivative(ConstrainedWorkspace& cws, const MatrixXd* dc, MatrixXd& dlambda, MatrixXd& dID_to_da) {
  // In the coordinates of L: W = L^{-1} J^T D and X = L^{-1} dID give J M^{-1} dID = D^{-1} W^T X.
  cws.M_llt.matrixL().solveInPlace(dID_to_da);
  auto rhs = cws.T2.leftCols(dID_to_da.cols());
  rhs.noalias() = cws.W.transpose() * dID_to_da;
  if (dc) rhs -= cws.D.asDiagonal() * *dc;
  dlambda.noalias() = cws.Ginv * rhs;
  dID_to_da *= -1;
  dID_to_da.noalias() += cws.W * dlambda;
  cws.M_llt.matrixU().solveInPlace(dID_to_da);
  dlambda = cws.D.asDiagonal() * dlambda;
}

}  // namespace

DynamicsStatus updateConstrainedDerivatives(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                            const ConstraintSet& constraints, const ConstrainedOptions& options) {
  for (Vector6d& f : cws.f_ext) f.setZero();
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    const Vector6d W =
        calcClosureWrench(ws, closure, cws.lambda.segment(constraints.offsets[c], getRows(closure.kind)));
    cws.f_ext[closure.body1] += W;
    cws.f_ext[closure.body2] -= W;
  }
  updateInverseDynamicsDerivatives(model, ws, cws.f_ext);
  cws.dc_dq.setZero();
  cws.dc_dv.setZero();
  cws.da_dq = ws.dID_dq;
  cws.da_dv = ws.dID_dv;
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    const int row = constraints.offsets[c], n = getRows(closure.kind);
    const Vector6d W = calcClosureWrench(ws, closure, cws.lambda.segment(row, n));
    addClosureForceDerivative(model, ws, closure, W, cws.da_dq);
    calcClosureDerivatives(ws, closure, cws.dc_dq.middleRows(row, n), cws.dc_dv.middleRows(row, n));
  }
  cws.da_du.setZero();  // the torques enter ID with a minus
  for (int m = 0; m < model.nu(); ++m) cws.da_du(model.motors()[m].dof, m) = -1;
  if (constraints.rows == 0) {
    for (MatrixXd* m : {&cws.da_dq, &cws.da_dv, &cws.da_du}) {
      *m *= -1;
      cws.M_llt.solveInPlace(*m);
    }
  } else {
    calcDelassusInverse(cws, options);
    solveDerivative(cws, &cws.dc_dq, cws.dlambda_dq, cws.da_dq);
    solveDerivative(cws, &cws.dc_dv, cws.dlambda_dv, cws.da_dv);
    solveDerivative(cws, nullptr, cws.dlambda_du, cws.da_du);
  }
  const bool finite = cws.da_dq.allFinite() && cws.da_dv.allFinite() && cws.dlambda_dq.allFinite();
  return finite ? DynamicsStatus::Ok : DynamicsStatus::NotFinite;
}

}  // namespace bielle
