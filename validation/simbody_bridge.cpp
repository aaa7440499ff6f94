#include "simbody_bridge.h"

#include <Simbody.h>

#include <cmath>
#include <stdexcept>

#include "math/decompositions.h"
#include "math/so3.h"
#include "simbody_system.h"

namespace bielle::validation {
namespace {

using SimTK::Stage;

VectorXd toVector(const SimTK::Vector& v) {
  VectorXd out(v.size());
  for (int i = 0; i < v.size(); ++i) out[i] = v[i];
  return out;
}

// Residual of notation.h, whose directions are used below.
Vector6d calcClosureGap(const Closure& closure, const SE3& X_12) {
  if (closure.kind == ClosureKind::Weld6D) return log6(X_12);
  Vector6d gap = Vector6d::Zero();
  if (closure.kind == ClosureKind::Distance) {
    const double L = closure.length;
    gap[0] = (X_12.p.squaredNorm() - L * L) / (2 * L);
    return gap;
  }
  if (closure.kind == ClosureKind::Slider) {
    const Vector3d p = X_12.R.transpose() * X_12.p;
    gap << p - closure.axis.dot(p) * closure.axis, log3(X_12.R);
    return gap;
  }
  gap.head<3>() = X_12.p;
  if (closure.kind == ClosureKind::Ball3D) return gap;
  const Vector3d axis2 = X_12.R * closure.axis, normal = closure.axis.cross(axis2);
  if (normal.norm() > 0) gap.tail<3>() = std::atan2(normal.norm(), closure.axis.dot(axis2)) * normal.normalized();
  return gap;
}

// Of a coupler by a coordinate.
double calcSlope(const CouplerTerm& term, double q) {
  double slope = term.coefficient;
  for (size_t k = 0; k < term.higher.size(); ++k) slope += (k + 2.0) * term.higher[k] * std::pow(q, k + 1.0);
  return slope;
}

// Unit twists of frame 1, relative to frame 2, that a closure forbids; notation.h. Of a coupler or a distance, the first entry.
MatrixXd listDirections(const Closure& closure) {
  if (closure.kind == ClosureKind::Coupler || closure.kind == ClosureKind::Distance) return Vector6d::Unit(0);
  const Eigen::Matrix<double, 6, 6> all = Eigen::Matrix<double, 6, 6>::Identity();
  if (closure.kind == ClosureKind::Weld6D) return all;
  if (closure.kind == ClosureKind::Ball3D) return all.leftCols(3);
  const Vector3d normal = closure.axis.unitOrthogonal();
  MatrixXd directions = MatrixXd::Zero(6, 5);
  if (closure.kind == ClosureKind::Slider) {
    directions.col(0).head<3>() = normal;
    directions.col(1).head<3>() = closure.axis.cross(normal);
    directions.rightCols(3) = all.rightCols(3);
    return directions;
  }
  directions.leftCols(3) = all.leftCols(3);
  directions.col(3).tail<3>() = normal;
  directions.col(4).tail<3>() = closure.axis.cross(normal);
  return directions;
}

template <typename Real>
const SaddleSolver<Real>& getSaddle(const SimbodyBridge& simbody, std::optional<SaddleSolver<Real>>& kept) {
  return kept ? *kept : kept.emplace(simbody.calcMassMatrix(), simbody.calcConstraintJacobian());
}

}  // namespace

void SimbodyBridge::System::setPlace(const VectorXd& place) {
  if (q.size() == 0 || q != place) at_q = {};
  q = place;
}

SimbodyBridge::SimbodyBridge(const Model& model, const std::vector<Closure>& closures)
    : s_(std::make_unique<System>(model, closures)) {}
SimbodyBridge::~SimbodyBridge() = default;

void SimbodyBridge::setState(ConstVectorRef q, ConstVectorRef v, ConstVectorRef tau) {
  s_->setPlace(q);
  s_->setCoordinates(q);
  s_->updateVelocityMap(q, v);
  s_->tau = tau;
  SimTK::Vector u(s_->model.nv()), f(s_->model.nv());
  s_->scatter(s_->T * v, u);
  s_->scatter(s_->T.transpose().inverse() * tau, f);
  s_->state.updU() = u;
  s_->torques.setAllMobilityForces(s_->state, f);
  s_->applied = f;
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

Vector3d SimbodyBridge::calcCom() const { return toEigen(s_->matter.calcSystemMassCenterLocationInGround(s_->state)); }

double SimbodyBridge::calcPotentialEnergy() const { return s_->system.calcPotentialEnergy(s_->state); }

MatrixXd SimbodyBridge::calcMassMatrix() const {
  if (s_->at_q.M) return *s_->at_q.M;
  SimTK::Matrix M_s;
  s_->matter.calcM(s_->state, M_s);
  const int nv = s_->model.nv();
  MatrixXd M(nv, nv);
  for (int i = 0; i < nv; ++i)
    for (int j = 0; j < nv; ++j) M(i, j) = M_s(s_->u_index[i], s_->u_index[j]);
  M = s_->T.transpose() * M * s_->T;
  M.diagonal() += s_->model.armature();
  s_->at_q.M = M;
  return M;
}

VectorXd SimbodyBridge::calcInverseDynamics(ConstVectorRef a) const {
  SimTK::Vector udot(s_->model.nv()), residual;
  s_->scatter(s_->T * a + s_->Tdot_v, udot);
  s_->matter.calcResidualForceIgnoringConstraints(
      s_->state, s_->calcPassiveForces(), s_->system.getRigidBodyForces(s_->state, Stage::Dynamics), udot, residual);
  return s_->T.transpose() * s_->gather(residual) + s_->model.armature().cwiseProduct(a);
}

VectorXd SimbodyBridge::calcBias() const { return calcInverseDynamics(VectorXd::Zero(s_->model.nv())); }

MatrixXd SimbodyBridge::calcConstraintJacobian() const {
  if (s_->at_q.J) return *s_->at_q.J;
  const int nv = s_->model.nv();
  SimTK::Matrix G_s;
  s_->matter.calcG(s_->state, G_s);
  MatrixXd J(G_s.nrow(), nv);
  for (int i = 0; i < J.rows(); ++i)
    for (int j = 0; j < nv; ++j) J(i, j) = G_s(i, s_->u_index[j]);
  s_->at_q.J = J * s_->T;
  return *s_->at_q.J;
}

VectorXd SimbodyBridge::calcWrenchForces(const std::vector<Vector6d>& wrenches) const {
  // Simbody: moment first, about the origin of the body, world axes.
  SimTK::Vector_<SimTK::SpatialVec> body_forces(s_->matter.getNumBodies(), SimTK::SpatialVec(SimTK::Vec3(0)));
  VectorXd coupled = VectorXd::Zero(s_->model.nv());
  for (size_t c = 0; c < s_->closures.size(); ++c) {
    const Closure& closure = s_->closures[c];
    for (const CouplerTerm& term : closure.terms)
      coupled[term.dof] += calcSlope(term, s_->bodies[term.joint].getOneQ(s_->state, 0)) * wrenches[c][0];
    if (closure.kind == ClosureKind::Coupler) continue;
    const SE3 X_W1 = getPlacement(closure.body1) * closure.X_B1;
    Vector3d force = X_W1.R * wrenches[c].head<3>(), moment = X_W1.R * wrenches[c].tail<3>();
    if (closure.kind == ClosureKind::Distance)  // a tension
      force = wrenches[c][0] / closure.length * ((getPlacement(closure.body2) * closure.X_B2).p - X_W1.p);
    const auto apply = [&](int body, double sign) {
      const Vector3d arm = X_W1.p - getPlacement(body).p;
      body_forces[s_->bodies[body].getMobilizedBodyIndex()] +=
          SimTK::SpatialVec(toSimTK(sign * (moment + arm.cross(force))), toSimTK(sign * force));
    };
    apply(closure.body1, 1);
    apply(closure.body2, -1);
  }
  SimTK::Vector generalized;
  s_->matter.multiplyBySystemJacobianTranspose(s_->state, body_forces, generalized);
  return coupled + s_->T.transpose() * s_->gather(generalized);
}

double SimbodyBridge::calcCouplerGap(const Closure& coupler) const {
  double gap = coupler.offset;
  for (const CouplerTerm& term : coupler.terms) {
    const double q = s_->bodies[term.joint].getOneQ(s_->state, 0);
    gap -= term.coefficient * q;
    for (size_t k = 0; k < term.higher.size(); ++k) gap -= term.higher[k] * std::pow(q, k + 2.0);
  }
  return gap;
}

double SimbodyBridge::calcCouplerRate(const Closure& coupler) const {
  double rate = 0;
  for (const CouplerTerm& term : coupler.terms) {
    const SimTK::MobilizedBody& body = s_->bodies[term.joint];
    rate += calcSlope(term, body.getOneQ(s_->state, 0)) * body.getOneU(s_->state, 0);
  }
  return rate;
}

OracleSolution SimbodyBridge::solveBySimbody() {
  s_->system.realize(s_->state, Stage::Acceleration);
  OracleSolution out;
  out.a = s_->T.inverse() * (s_->gather(s_->state.getUDot()) - s_->Tdot_v);
  s_->readForces(s_->state.getMultipliers(), out);
  out.rounding = s_->calcRounding();
  return out;
}

VectorXd SimbodyBridge::calcConstraintAcceleration(ConstVectorRef a) const {
  SimTK::Vector udot(s_->model.nv()), rows;
  s_->scatter(s_->T * a + s_->Tdot_v, udot);
  s_->matter.calcConstraintAccelerationErrors(s_->state, udot, rows);
  return toVector(rows);
}

OracleSolution SimbodyBridge::solveWithArmature(Precision precision) const {
  const MatrixXd force = s_->tau - calcBias(), target = -calcConstraintAcceleration(VectorXd::Zero(s_->model.nv()));
  MatrixXd a, m;
  if (precision == Precision::Double)
    getSaddle(*this, s_->at_q.saddle).solve(force, target, a, m);
  else
    getSaddle(*this, s_->at_q.extended_saddle).solve(force, target, a, m);
  return s_->makeSolution(a, m);
}

ClosureRows SimbodyBridge::calcClosureRows() const {
  ClosureRows out;
  const size_t loops = s_->model.closures().size();
  std::vector<Vector6d> wrenches(s_->closures.size(), Vector6d::Zero());
  std::vector<VectorXd> rows;
  std::vector<double> residual;
  for (size_t c = 0; c < s_->closures.size(); ++c) {
    const Closure& closure = s_->closures[c];
    const SE3 X_12 =
        (getPlacement(closure.body1) * closure.X_B1).inverseTimes(getPlacement(closure.body2) * closure.X_B2);
    const MatrixXd directions = listDirections(closure);
    const Vector6d gap = closure.kind == ClosureKind::Coupler ? calcCouplerGap(closure) * Vector6d::Unit(0)
                                                              : calcClosureGap(closure, X_12);
    for (Eigen::Index i = 0; i < directions.cols(); ++i) {
      wrenches[c] = directions.col(i);
      rows.push_back(calcWrenchForces(wrenches));
      residual.push_back(directions.col(i).dot(gap));
    }
    wrenches[c].setZero();
    if (c + 1 == loops) out.num_loop_rows = static_cast<int>(rows.size());
  }
  out.J.resize(rows.size(), s_->model.nv());
  for (size_t i = 0; i < rows.size(); ++i) out.J.row(i) = rows[i].transpose();
  out.residual = Eigen::Map<const VectorXd>(residual.data(), residual.size());
  return out;
}

MatrixXd SimbodyBridge::calcResponse(const MatrixXd& J, const MatrixXd& targets) const {
  MatrixXd a, m;
  SaddleSolver<double>(calcMassMatrix(), J).solve(MatrixXd::Zero(J.cols(), targets.cols()), targets, a, m);
  return a;
}

OracleSolution SimbodyBridge::solveImpact(ConstVectorRef rates) const {
  MatrixXd v, m;
  getSaddle(*this, s_->at_q.saddle).solve(calcMassMatrix() * s_->v, rates, v, m);
  return s_->makeSolution(v, m);
}

VectorXd SimbodyBridge::calcPassiveForces() const {
  SimTK::Vector generalized;
  s_->matter.multiplyBySystemJacobianTranspose(s_->state, s_->system.getRigidBodyForces(s_->state, Stage::Dynamics),
                                               generalized);
  return s_->T.transpose() * s_->gather(generalized + s_->calcPassiveForces());
}

VectorXd SimbodyBridge::calcDissipativeForces() const {
  VectorXd out = VectorXd::Zero(s_->model.nv());
  for (const JointForce& force : s_->model.jointForces()) {
    const double v = s_->bodies[force.joint].getOneU(s_->state, 0);
    out[force.dof] -= force.damping * v + force.friction * v / std::hypot(v, force.friction_speed);
  }
  SimTK::Vector_<SimTK::SpatialVec> body_forces(s_->matter.getNumBodies(), SimTK::SpatialVec(SimTK::Vec3(0)));
  for (const PointSpring& spring : s_->model.pointSprings()) {
    const SimTK::MobilizedBody &body1 = s_->bodies[spring.body1], &body2 = s_->bodies[spring.body2];
    const SimTK::Vec3 p1 = toSimTK(spring.point1), p2 = toSimTK(spring.point2);
    const SimTK::Vec3 direction =
        (body2.findStationLocationInGround(s_->state, p2) - body1.findStationLocationInGround(s_->state, p1))
            .normalize();
    const double rate = SimTK::dot(
        direction, body2.findStationVelocityInGround(s_->state, p2) - body1.findStationVelocityInGround(s_->state, p1));
    const SimTK::Vec3 force = spring.damping * rate * direction;
    body1.applyForceToBodyPoint(s_->state, p1, force, body_forces);
    body2.applyForceToBodyPoint(s_->state, p2, -force, body_forces);
  }
  SimTK::Vector generalized;
  s_->matter.multiplyBySystemJacobianTranspose(s_->state, body_forces, generalized);
  return out + s_->T.transpose() * s_->gather(generalized);
}

void SimbodyBridge::integrate(double duration, double accuracy, VectorXd& q, VectorXd& v) {
  SimTK::RungeKuttaMersonIntegrator integrator(s_->system);
  integrator.setAccuracy(accuracy);
  integrator.setConstraintTolerance(accuracy);
  integrator.setUseInfinityNorm(true);
  integrator.setProjectEveryStep(true);
  integrator.setFinalTime(duration);
  SimTK::TimeStepper stepper(s_->system, integrator);
  stepper.initialize(s_->state);
  stepper.stepTo(duration);
  s_->state = integrator.getState();
  s_->system.realize(s_->state, Stage::Dynamics);
  s_->readState(s_->state, q, v);
  s_->setPlace(q);
}

}  // namespace bielle::validation
