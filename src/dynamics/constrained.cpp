#include "bielle/dynamics/constrained.h"

#include <Eigen/SVD>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"

namespace bielle {
namespace {

void resize(const Model& model, ConstrainedWorkspace& cws, int rows) {
  const int nv = model.nv();
  if (cws.J.rows() == rows && cws.J.cols() == nv) return;
  cws.J.setZero(rows, nv);
  cws.gamma.setZero(rows);
  cws.a.setZero(nv);
  cws.force.setZero(nv);
  for (VectorXd* v : {&cws.lambda, &cws.D, &cws.rhs, &cws.correction}) v->setZero(rows);
  for (MatrixXd* m : {&cws.da_dq, &cws.da_dv}) m->setZero(nv, nv);
  for (MatrixXd* m : {&cws.dlambda_dq, &cws.dlambda_dv, &cws.dc_dq, &cws.dc_dv}) m->setZero(rows, nv);
  cws.da_du.setZero(nv, model.nu());
  cws.dlambda_du.setZero(rows, model.nu());
  cws.W.setZero(nv, rows);
  for (MatrixXd* m : {&cws.G, &cws.Ginv, &cws.T1, &cws.T3}) m->setZero(rows, rows);
  cws.T2.setZero(rows, nv);
  cws.f_ext.assign(model.numBodies(), Vector6d::Zero());
  cws.M_llt = Eigen::LLT<MatrixXd>(nv);
  cws.G_llt = Eigen::LLT<MatrixXd>(rows);
}

// Jacobian and gamma of all closures; the accelerations in ws are those of a = 0.
void assembleConstraints(const Workspace& ws, ConstrainedWorkspace& cws, const ConstraintSet& constraints) {
  cws.J.setZero();
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    const int row = constraints.offsets[c], n = getRows(closure.kind);
    calcClosureJacobian(ws, closure, cws.J.middleRows(row, n));
    cws.gamma.segment(row, n) = calcClosureAcceleration(ws, closure) + calcClosureStabilization(ws, closure);
  }
}

// Factorises D G D, directly or with the proximal term.
void factorizeDelassus(ConstrainedWorkspace& cws, const ConstrainedOptions& options) {
  cws.W = cws.J.transpose();
  cws.M_llt.matrixL().solveInPlace(cws.W);
  for (Eigen::Index i = 0; i < cws.W.cols(); ++i) {
    const double norm = cws.W.col(i).norm();
    cws.D[i] = norm > 1e-14 ? 1 / norm : 0;  // a row that nothing moves has no force
    cws.W.col(i) *= cws.D[i];
  }
  cws.G.setZero();
  cws.G.selfadjointView<Eigen::Lower>().rankUpdate(cws.W.transpose());
  cws.G.triangularView<Eigen::StrictlyUpper>() = cws.G.transpose();
  cws.G_llt.compute(cws.G);
  const double pivot =
      cws.G_llt.info() == Eigen::Success ? cws.G_llt.matrixLLT().diagonal().array().square().minCoeff() : 0;
  cws.redundant = !(pivot > options.direct_threshold);
  if (!cws.redundant) return;
  cws.T1 = cws.G;
  cws.T1.diagonal().array() += options.proximal;
  cws.G_llt.compute(cws.T1);
}

// y with D G D y = rhs, Eq. (3); y is written to cws.lambda before scaling.
void solveDelassus(ConstrainedWorkspace& cws, const ConstrainedOptions& options) {
  cws.lambda = cws.rhs;
  cws.G_llt.solveInPlace(cws.lambda);
  for (int i = 1; i < (cws.redundant ? options.max_iterations : 2); ++i) {
    cws.correction = cws.rhs;
    cws.correction.noalias() -= cws.G * cws.lambda;
    cws.G_llt.solveInPlace(cws.correction);
    cws.lambda += cws.correction;
    if (cws.correction.norm() <= options.tolerance * cws.lambda.norm()) break;
  }
}

}  // namespace

const char* getMessage(DynamicsStatus status) {
  switch (status) {
    case DynamicsStatus::Ok:
      return "ok";
    case DynamicsStatus::MassMatrixSingular:
      return "the mass matrix is singular: a joint moves no inertia; give its links a mass or the joint an armature";
    case DynamicsStatus::NotFinite:
      return "the accelerations are not finite";
  }
  return "?";
}

DynamicsStatus updateConstrainedDynamics(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                         const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef v,
                                         ConstVectorRef tau, const ConstrainedOptions& options) {
  resize(model, cws, constraints.rows);
  updatePositions(model, ws, q);
  updateVelocities(model, ws, v);
  updateMassMatrix(model, ws);
  updateBias(model, ws);
  cws.M_llt.compute(ws.M);
  if (cws.M_llt.info() != Eigen::Success) return DynamicsStatus::MassMatrixSingular;
  cws.a = tau - ws.b;
  cws.M_llt.solveInPlace(cws.a);  // free accelerations
  if (constraints.rows > 0) {
    assembleConstraints(ws, cws, constraints);
    factorizeDelassus(cws, options);
    cws.rhs.noalias() = -cws.J * cws.a;
    cws.rhs = cws.D.cwiseProduct(cws.rhs - cws.gamma);
    solveDelassus(cws, options);
    cws.lambda = cws.D.cwiseProduct(cws.lambda);
    cws.force.noalias() = cws.J.transpose() * cws.lambda;
    cws.force += tau - ws.b;
    cws.a = cws.force;
    cws.M_llt.solveInPlace(cws.a);
    cws.rhs = cws.gamma;
    cws.rhs.noalias() += cws.J * cws.a;
    cws.residual = cws.rhs.cwiseAbs().maxCoeff();
  }
  if (!cws.a.allFinite() || !cws.lambda.allFinite()) return DynamicsStatus::NotFinite;
  updateAccelerations(model, ws, cws.a);
  return DynamicsStatus::Ok;
}

void calcMotorForces(const Model& model, ConstVectorRef u, VectorRef tau) {
  tau.setZero();
  for (int m = 0; m < model.nu(); ++m) tau[model.motors()[m].dof] = u[m];
}

VectorXd calcMotorForces(const Model& model, ConstVectorRef u) {
  VectorXd tau(model.nv());
  calcMotorForces(model, u, tau);
  return tau;
}

Mobility calcMobility(const Model& model, ConstVectorRef q, double tolerance) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  const ConstraintSet set = makeConstraintSet(model);
  Mobility out;
  out.rows = set.rows;
  out.mobility = model.nv();
  if (set.rows == 0) return out;
  MatrixXd J = MatrixXd::Zero(set.rows, model.nv());
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureJacobian(ws, set.closures[c], J.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  out.singular_values = Eigen::JacobiSVD<MatrixXd>(J).singularValues();
  out.rank = static_cast<int>((out.singular_values.array() > tolerance * out.singular_values[0]).count());
  out.mobility = model.nv() - out.rank;
  return out;
}

}  // namespace bielle
