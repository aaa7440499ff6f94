// Oracles: central differences in tangent space (fourth order, step 1e-3: relative error reached about 1e-9), power
// balance, closed-form mechanisms. Every derivative test also sees a poisoned entry.
#include <catch2/catch.hpp>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "check_derivative.h"
#include "dynamics/saddle_point.h"
#include "math/constants.h"
#include "math/so3.h"
#include "model/joint.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("inverse dynamics: M, b and RNEA agree, and its derivatives agree with differences") {
  std::mt19937 rng(1);
  for (JointKind kind : kJointKinds) {
    CAPTURE(getName(kind));
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Weld6D, MechanismBase::FreeFlyer);
    const Model& model = mechanism.model;
    Workspace ws(model);
    const VectorXd& q = mechanism.q_closed;
    const VectorXd v = randomVector(rng, model.nv(), 2), a = randomVector(rng, model.nv(), 5);
    const VectorXd tau = calcInverseDynamics(model, ws, q, v, a);
    updateInverseDynamicsDerivatives(model, ws, {});
    const MatrixXd dq = ws.dID_dq, dv = ws.dID_dv;
    updateMassMatrix(model, ws);
    updateBias(model, ws);
    CHECK(calcRelativeError(ws.M * a + ws.b, tau) < 1e-12);
    CHECK(0.5 * v.dot(ws.M * v) == Approx(calcKineticEnergy(model, ws)).epsilon(1e-12));
    checkDerivative(dq, differentiateTangent(model, q, kDynamicsStep, [&](const VectorXd& x) {
                      return calcInverseDynamics(model, ws, x, v, a);
                    }));
    checkDerivative(dv, differentiate(v, kDynamicsStep,
                                      [&](const VectorXd& x) { return calcInverseDynamics(model, ws, q, x, a); }));
  }
}

TEST_CASE("centre of mass: Jacobian and velocity derivative") {
  std::mt19937 rng(2);
  for (JointKind kind : kJointKinds) {
    CAPTURE(getName(kind));
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
    const Model& model = mechanism.model;
    Workspace ws(model);
    const VectorXd v = randomVector(rng, model.nv(), 2);
    updatePositions(model, ws, mechanism.q_closed);
    updateVelocities(model, ws, v);
    updateMassMatrix(model, ws);
    Eigen::Matrix3Xd J(3, model.nv()), dv_dq(3, model.nv());
    calcComJacobian(model, ws, J);
    calcComVelocityDerivative(model, ws, dv_dq);
    CHECK((J * v - calcComVelocity(model, ws)).norm() < 1e-12);
    Workspace other(model);
    checkDerivative(J, differentiateTangent(model, mechanism.q_closed, kDynamicsStep, [&](const VectorXd& x) {
                      updatePositions(model, other, x);
                      return VectorXd(calcCom(model, other));
                    }));
    checkDerivative(dv_dq, differentiateTangent(model, mechanism.q_closed, kDynamicsStep, [&](const VectorXd& x) {
                      updatePositions(model, other, x);
                      updateVelocities(model, other, v);
                      return VectorXd(calcComVelocity(model, other));
                    }));
  }
}

TEST_CASE("closures: residual rate, velocity and acceleration are time derivatives of one another") {
  std::mt19937 rng(3);
  for (const int i : {0, 1, 2, 3, 4}) {
    const bool is_cam = i == 4;  // a coupler with a polynomial, beside one without
    const ClosureKind closure_kind = kClosureKinds[std::min(i, 3)];
    for (bool open : {false, true}) {
      CAPTURE(getName(closure_kind), is_cam, open);
      const Mechanism mechanism = (is_cam ? makeCammedMechanism : makeRandomMechanism)(
          rng, JointKind::Spherical, closure_kind, MechanismBase::FreeFlyer, 0, 0);
      const Model& model = mechanism.model;
      Workspace ws(model);
      const ConstraintSet set = makeConstraintSet(model);
      const Closure& closure = set.closures.back();
      VectorXd q = mechanism.q_closed;
      updatePositions(model, ws, q);
      CHECK(calcClosureResidual(ws, closure).norm() < 1e-13);
      if (open) q = model.integrate(q, randomVector(rng, model.nv(), 0.2));
      const VectorXd v = randomVector(rng, model.nv(), 1), a = randomVector(rng, model.nv(), 1);
      // Along q(t) = q (+) (t v + t^2/2 a') the velocity is v and its derivative a, for joints where the exponential
      // commutes to second order: take v(t) = v + t a as the definition and move q by the midpoint rule.
      const auto state = [&](double t) {
        const VectorXd qt = model.integrate(q, t * (v + 0.5 * t * a));
        updatePositions(model, ws, qt);
        updateVelocities(model, ws, v + t * a);
      };
      const auto derive = [&](const std::function<VectorXd()>& f) {
        return differentiate(VectorXd::Zero(1), 1e-3, [&](const VectorXd& t) {
          state(t[0]);
          return f();
        });
      };
      const VectorXd residual_rate = derive([&] { return VectorXd(calcClosureResidual(ws, closure)); });
      const VectorXd acceleration = derive([&] { return VectorXd(calcClosureVelocity(ws, closure)); });
      state(0);
      const bool coupler = closure_kind == ClosureKind::Coupler;
      Vector6d nu = (ws.X_WB[closure.body1] * closure.X_B1).actInvMotion(ws.V[closure.body1] - ws.V[closure.body2]);
      if (!coupler) CHECK(calcRelativeError(calcClosureResidualRate(ws, closure) * nu, residual_rate) < 1e-8);
      updateAccelerations(model, ws, a);
      CHECK(calcRelativeError(calcClosureAcceleration(ws, closure), acceleration) < 1e-6);
      // At a closed configuration the residual moves with minus the velocity; that of a coupler or a distance anywhere.
      if (!open || coupler || closure_kind == ClosureKind::Distance)
        CHECK(calcRelativeError(-calcClosureVelocity(ws, closure), residual_rate) < 1e-8);
    }
  }
}

TEST_CASE("closures: a hinge turned by up to pi is open by its angle, and its rate is that of the residual") {
  std::mt19937 rng(8);
  Closure closure;
  closure.kind = ClosureKind::Hinge5D;
  for (const double off : {0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-9, 1e-6, 1e-3, 1.0})
    for (int i = 0; i < 30; ++i) {
      closure.axis = i < 3 ? Vector3d(Vector3d::Unit(i)) : Vector3d(randomVector(rng, 3, 1).normalized());
      // About a normal of the axis; then any turn about the axis itself.
      const Vector3d normal = makePlaneBasis(closure.axis) * Vector3d(std::cos(0.7 * i), std::sin(0.7 * i), 0);
      const SE3 X(makeAxisRotation(normal, kPi - off) * makeAxisRotation(closure.axis, 0.2 * i), Vector3d(0.1, 0, 0.2));
      CAPTURE(off, closure.axis.transpose());
      const VectorXd r = calcClosureResidual(closure, X);
      CHECK(r.head<3>() == X.p);
      CHECK(std::abs(r.tail<2>().norm() - (kPi - off)) < 1e-14);
      const RowsBy6 rate = calcClosureResidualRate(closure, X);
      CHECK(rate.allFinite());
      if (off < 1e-6) continue;  // the direction of the residual turns by more than any difference
      const double h = 1e-3 * off;
      const MatrixXd numeric = differentiate(Vector6d::Zero(), h, [&](const VectorXd& nu) {
        return VectorXd(calcClosureResidual(closure, exp6(-nu) * X));  // frame 1 moves by nu
      });
      CHECK((rate - numeric).norm() < 1e-4 * rate.norm());
    }
  // What a matrix says exactly.
  closure.axis = Vector3d::UnitZ();
  const SE3 opposite(Vector3d(1, -1, -1).asDiagonal().toDenseMatrix(), Vector3d::Zero());
  CHECK(calcClosureResidual(closure, opposite).norm() == Approx(kPi).epsilon(1e-15));
  SE3Of<Lanes> lanes;
  for (int k = 0; k < 9; ++k) lanes.R(k) = opposite.R(k);
  for (int k = 0; k < 3; ++k) lanes.p[k] = 0;
  CHECK(calcClosureResidual(closure, lanes)[3][kLane - 1] == calcClosureResidual(closure, opposite)[3]);
  CHECK(calcClosureResidual(closure, SE3()).isZero(0));
}

TEST_CASE("constrained dynamics: every joint kind times every closure kind, closed and open, against differences",
          "[sweep]") {
  std::mt19937 rng(4);
  Selection selection(5);
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds)
      for (bool open : {false, true})
        for (MechanismBase base : {MechanismBase::Fixed, MechanismBase::FreeFlyer}) {
          if (selection.isLeftOut()) continue;
          CAPTURE(getName(kind), getName(closure), open, base == MechanismBase::Fixed);
          const double kp = open ? 3 : 0, kd = open ? 2 : 0;
          const Mechanism mechanism = makeRandomMechanism(rng, kind, closure, base, kp, kd);
          const Model& model = mechanism.model;
          std::vector<ContactTarget> contacts;
          if (base == MechanismBase::FreeFlyer)
            contacts = {{0, randomPlacement(rng), 5, 4}, {1, randomPlacement(rng), 0, 10}};
          const ConstraintSet set = makeConstraintSet(model, contacts);
          VectorXd q = mechanism.q_closed;
          if (open) q = model.integrate(q, randomVector(rng, model.nv(), 0.1));
          const VectorXd v = randomVector(rng, model.nv(), 1), u = randomVector(rng, model.nu(), 10);
          const VectorXd tau = calcMotorForces(model, u);
          Workspace ws(model);
          ConstrainedWorkspace cws;
          REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, tau) == NumericalStatus::Ok);
          REQUIRE(!cws.saddle_point->isRedundant());
          CHECK(cws.residual < 1e-9 * (1 + cws.gamma.cwiseAbs().maxCoeff()));
          CHECK(calcRelativeError(ws.M * cws.a + ws.b - cws.J.transpose() * cws.lambda, tau) < 1e-9);
          CHECK(cws.lambda.cwiseAbs().minCoeff() > 0);
          REQUIRE(updateConstrainedDerivatives(model, ws, cws, set) == NumericalStatus::Ok);
          const int nv = model.nv();
          Workspace other(model);
          ConstrainedWorkspace ocws;
          const auto solve = [&](const VectorXd& x, const VectorXd& y, const VectorXd& t) {
            updateConstrainedDynamics(model, other, ocws, set, x, y, t);
            VectorXd out(nv + set.rows);
            out << ocws.a, ocws.lambda;
            return out;
          };
          const double h = 5e-4;
          MatrixXd numeric = differentiateTangent(model, q, h, [&](const VectorXd& x) { return solve(x, v, tau); });
          checkDerivative(cws.da_dq, numeric.topRows(nv));
          checkDerivative(cws.dlambda_dq, numeric.bottomRows(set.rows));
          numeric = differentiate(v, h, [&](const VectorXd& x) { return solve(q, x, tau); });
          checkDerivative(cws.da_dv, numeric.topRows(nv));
          checkDerivative(cws.dlambda_dv, numeric.bottomRows(set.rows));
          // Linear in u: a large step loses nothing and drowns the rounding of entries that are nearly zero.
          numeric = differentiate(u, 10, [&](const VectorXd& x) { return solve(q, v, calcMotorForces(model, x)); });
          checkDerivative(cws.da_du, numeric.topRows(nv));
          checkDerivative(cws.dlambda_du, numeric.bottomRows(set.rows));
        }
}
