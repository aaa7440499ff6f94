#include "bielle/dynamics/constrained.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/saddle_point.h"

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
  for (VectorXd* v : {&cws.gamma, &cws.lambda, &cws.violation}) v->setZero(rows);
  for (VectorXd* v : {&cws.a, &cws.force}) v->setZero(nv);
  for (MatrixXd* m : {&cws.da_dq, &cws.da_dv}) m->setZero(nv, nv);
  for (MatrixXd* m : {&cws.dlambda_dq, &cws.dlambda_dv}) m->setZero(rows, nv);
  cws.da_du.setZero(nv, model.nu());
  cws.dlambda_du.setZero(rows, model.nu());
  cws.f_ext.assign(model.numBodies(), Vector6d::Zero());
  cws.saddle_point->resize(nv, rows);
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

const char* getMessage(DynamicsStatus status) {
  switch (status) {
    case DynamicsStatus::Ok:
      return "ok";
    case DynamicsStatus::MassMatrixSingular:
      return "the mass matrix is singular: a joint moves no inertia; give its links a mass or the joint an armature";
    case DynamicsStatus::NotFinite:
      return "the accelerations are not finite";
    case DynamicsStatus::ContradictoryRows:
      return "redundant rows of closures and contacts contradict each other: close the loops, or let their "
             "stabilisations agree";
  }
  return "?";
}

DynamicsStatus updateConstrainedDynamics(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                         const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef v,
                                         ConstVectorRef tau) {
  resize(model, cws, constraints.rows);
  updatePositions(model, ws, q);
  updateVelocities(model, ws, v);
  updateMassMatrix(model, ws);
  updateBias(model, ws);
  assembleConstraints(ws, cws, constraints);
  if (!cws.saddle_point->factorize(ws.M, cws.J)) return DynamicsStatus::MassMatrixSingular;
  cws.force = tau - ws.b;
  cws.saddle_point->solve(cws.force, cws.gamma, cws.a, cws.lambda);
  cws.violation = cws.gamma;
  cws.violation.noalias() += cws.J * cws.a;
  cws.residual = constraints.rows > 0 ? cws.violation.cwiseAbs().maxCoeff() : 0;
  if (!cws.a.allFinite() || !cws.lambda.allFinite()) return DynamicsStatus::NotFinite;
  updateAccelerations(model, ws, cws.a);
  return areContradictory(cws) ? DynamicsStatus::ContradictoryRows : DynamicsStatus::Ok;
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
