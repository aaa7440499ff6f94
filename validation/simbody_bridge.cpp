#include "simbody_bridge.h"

#include <Simbody.h>

#include <Eigen/QR>
#include <stdexcept>

#include "simbody_system.h"

namespace bielle::validation {
namespace {

using SimTK::Stage;

VectorXd toEigen(const SimTK::Vector& v) {
  VectorXd out(v.size());
  for (int i = 0; i < v.size(); ++i) out[i] = v[i];
  return out;
}

}  // namespace

SimbodyBridge::SimbodyBridge(const Model& model, const std::vector<Closure>& closures)
    : s_(std::make_unique<System>(model, closures)) {}
SimbodyBridge::~SimbodyBridge() = default;

void SimbodyBridge::setState(ConstVectorRef q, ConstVectorRef v, ConstVectorRef tau) {
  s_->setCoordinates(q);
  s_->updateVelocityMap(q, v);
  s_->tau = tau;
  SimTK::Vector u(s_->model.nv()), f(s_->model.nv());
  s_->scatter(s_->T * v, u);
  s_->scatter(s_->T.transpose().inverse() * tau, f);
  s_->state.updU() = u;
  s_->torques.setAllMobilityForces(s_->state, f);
  s_->system.realize(s_->state, Stage::Dynamics);
}

SE3 SimbodyBridge::getPlacement(int body) const {
  const SimTK::Transform& X = s_->bodies[body].getBodyTransform(s_->state);
  return {toEigen(X.R()), toEigen(X.p())};
}

Vector6d SimbodyBridge::calcTwist(int body) const {
  const SimTK::SpatialVec& V = s_->bodies[body].getBodyVelocity(s_->state);
  const Matrix3d R = getPlacement(body).R;
  Vector6d twist;
  twist << R.transpose() * toEigen(V[1]), R.transpose() * toEigen(V[0]);
  return twist;
}

double SimbodyBridge::calcKineticEnergy() const {
  return s_->system.calcKineticEnergy(s_->state) + 0.5 * s_->model.armature().dot(s_->v.cwiseAbs2());
}

double SimbodyBridge::calcPotentialEnergy() const { return s_->system.calcPotentialEnergy(s_->state); }

MatrixXd SimbodyBridge::calcMassMatrix() const {
  SimTK::Matrix M_s;
  s_->matter.calcM(s_->state, M_s);
  const int nv = s_->model.nv();
  MatrixXd M(nv, nv);
  for (int i = 0; i < nv; ++i)
    for (int j = 0; j < nv; ++j) M(i, j) = M_s(s_->u_index[i], s_->u_index[j]);
  M = s_->T.transpose() * M * s_->T;
  M.diagonal() += s_->model.armature();
  return M;
}

VectorXd SimbodyBridge::calcInverseDynamics(ConstVectorRef a) const {
  SimTK::Vector udot(s_->model.nv()), residual;
  s_->scatter(s_->T * a + s_->Tdot_v, udot);
  s_->matter.calcResidualForceIgnoringConstraints(
      s_->state, SimTK::Vector(), s_->system.getRigidBodyForces(s_->state, Stage::Dynamics), udot, residual);
  return s_->T.transpose() * s_->gather(residual) + s_->model.armature().cwiseProduct(a);
}

VectorXd SimbodyBridge::calcBias() const { return calcInverseDynamics(VectorXd::Zero(s_->model.nv())); }

OracleSolution SimbodyBridge::solveBySimbody() {
  s_->system.realize(s_->state, Stage::Acceleration);
  OracleSolution out;
  out.a = s_->T.inverse() * (s_->gather(s_->state.getUDot()) - s_->Tdot_v);
  s_->readForces(s_->state.getMultipliers(), out);
  out.rounding = s_->calcRounding();
  return out;
}

OracleSolution SimbodyBridge::solveWithArmature() const {
  const int nv = s_->model.nv();
  SimTK::Matrix G_s;
  s_->matter.calcG(s_->state, G_s);
  const int m = G_s.nrow();
  MatrixXd J(m, nv);
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < nv; ++j) J(i, j) = G_s(i, s_->u_index[j]);
  J *= s_->T;
  SimTK::Vector udot(nv), drift;
  s_->scatter(s_->Tdot_v, udot);
  s_->matter.calcConstraintAccelerationErrors(s_->state, udot, drift);

  // With unit diagonal of M: a = D y, m = E z. One scale for all rows, as some may be nothing but rounding.
  const MatrixXd M = calcMassMatrix();
  const VectorXd D = M.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd JD = J * D.asDiagonal();
  const double E = m > 0 ? 1 / JD.rowwise().norm().maxCoeff() : 1;
  MatrixXd K = MatrixXd::Zero(nv + m, nv + m);
  K.topLeftCorner(nv, nv) = D.asDiagonal() * M * D.asDiagonal();
  K.bottomLeftCorner(m, nv) = E * JD;
  K.topRightCorner(nv, m) = E * JD.transpose();
  VectorXd rhs(nv + m);
  rhs << D.cwiseProduct(s_->tau - calcBias()), -E * toEigen(drift);
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> factor;
  factor.setThreshold(1e-11);
  factor.compute(K);
  VectorXd solution = factor.solve(rhs);
  solution += factor.solve(rhs - K * solution);

  OracleSolution out;
  out.a = D.cwiseProduct(solution.head(nv));
  SimTK::Vector multipliers(m);
  for (int i = 0; i < m; ++i) multipliers[i] = E * solution[nv + i];
  s_->readForces(multipliers, out);
  return out;
}

void SimbodyBridge::integrate(double duration, double accuracy, VectorXd& q, VectorXd& v) {
  SimTK::RungeKuttaMersonIntegrator integrator(s_->system);
  integrator.setAccuracy(accuracy);
  integrator.setConstraintTolerance(accuracy);
  integrator.setProjectEveryStep(true);
  integrator.setFinalTime(duration);
  SimTK::TimeStepper stepper(s_->system, integrator);
  stepper.initialize(s_->state);
  stepper.stepTo(duration);
  s_->state = integrator.getState();
  s_->system.realize(s_->state, Stage::Dynamics);
  s_->readState(q, v);
}

}  // namespace bielle::validation
