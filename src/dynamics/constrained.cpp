#include "bielle/dynamics/constrained.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/constrained_parts.h"
#include "dynamics/saddle_point.h"
#include "math/decompositions.h"

namespace bielle {

SaddlePointMemory::SaddlePointMemory() : system_(std::make_unique<SaddlePoint>()) {}
SaddlePointMemory::~SaddlePointMemory() = default;
SaddlePointMemory::SaddlePointMemory(const SaddlePointMemory& other)
    : system_(std::make_unique<SaddlePoint>(*other.system_)) {}
SaddlePointMemory::SaddlePointMemory(SaddlePointMemory&& other) noexcept = default;
SaddlePointMemory& SaddlePointMemory::operator=(const SaddlePointMemory& other) {
  if (this != &other) system_ = std::make_unique<SaddlePoint>(*other.system_);
  return *this;
}
SaddlePointMemory& SaddlePointMemory::operator=(SaddlePointMemory&& other) noexcept = default;
namespace {

void resize(const Model& model, ConstrainedWorkspace& cws, int rows) {
  const int nv = model.nv();
  if (cws.J.rows() == rows && cws.J.cols() == nv) return;
  cws.J.setZero(rows, nv);
  for (VectorXd* v : {&cws.gamma, &cws.lambda, &cws.violation, &cws.stabilization}) v->setZero(rows);
  for (VectorXd* v : {&cws.a, &cws.force}) v->setZero(nv);
  for (MatrixXd* m : {&cws.da_dq, &cws.da_dv}) m->setZero(nv, nv);
  for (MatrixXd* m : {&cws.dlambda_dq, &cws.dlambda_dv}) m->setZero(rows, nv);
  cws.da_du.setZero(nv, model.nu());
  cws.dlambda_du.setZero(rows, model.nu());
  cws.f_ext.assign(model.numBodies(), Vector6d::Zero());
  cws.saddle_point->resize(nv, rows);
}

// Accelerations of the closures below this, m/s^2 or rad/s^2, are rounding, as all are at rest.
constexpr double kRoundingAcceleration = 1e-6;

// Independent rows are satisfied to rounding.
bool areContradictory(const ConstrainedWorkspace& cws) {
  if (!cws.saddle_point->isRedundant()) return false;
  double size = 0;
  for (Eigen::Index i = 0; i < cws.J.rows(); ++i)
    size = std::max(size,
                    std::abs(cws.gamma[i]) + cws.J.row(i).cwiseAbs().cwiseProduct(cws.a.cwiseAbs().transpose()).sum());
  return cws.residual > std::max(kContradiction * size, kRoundingAcceleration);
}

}  // namespace

bool updateConstrainedSystem(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                             const ConstraintSet& constraints, ConstVectorRef q) {
  resize(model, cws, constraints.rows);
  updatePositions(model, ws, q);
  updateMassMatrix(model, ws);
  cws.J.setZero();
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    calcClosureJacobian(ws, closure, cws.J.middleRows(constraints.offsets[c], getRows(closure.kind)));
  }
  return cws.saddle_point->factorize(ws.M, cws.J);
}

NumericalStatus solveConstrainedSystem(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                       const ConstraintSet& constraints, ConstVectorRef tau,
                                       const VectorXd* stabilization) {
  updateBias(model, ws);  // leaves the accelerations of a = 0
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    cws.gamma.segment(constraints.offsets[c], getRows(closure.kind)) = calcClosureAcceleration(ws, closure);
  }
  if (stabilization) cws.gamma += *stabilization;
  cws.force = tau - ws.b;
  cws.saddle_point->solve(cws.force, cws.gamma, cws.a, cws.lambda);
  cws.violation = cws.gamma;
  cws.violation.noalias() += cws.J * cws.a;
  cws.residual = constraints.rows > 0 ? cws.violation.cwiseAbs().maxCoeff() : 0;
  if (!cws.a.allFinite() || !cws.lambda.allFinite()) return NumericalStatus::NotFinite;
  updateAccelerations(model, ws, cws.a);
  return areContradictory(cws) ? NumericalStatus::Contradictory : NumericalStatus::Ok;
}

NumericalStatus updateConstrainedDynamics(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                          const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef v,
                                          ConstVectorRef tau) {
  if (!updateConstrainedSystem(model, ws, cws, constraints, q)) return NumericalStatus::Singular;
  updateVelocities(model, ws, v);
  calcStabilization(ws, constraints, cws.stabilization);
  return solveConstrainedSystem(model, ws, cws, constraints, tau, &cws.stabilization);
}

void calcStabilization(const Workspace& ws, const ConstraintSet& constraints, VectorRef out) {
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    out.segment(constraints.offsets[c], getRows(closure.kind)) = calcClosureStabilization(ws, closure);
  }
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
