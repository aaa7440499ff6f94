#pragma once
// Compares the derivatives of a residual with finite differences, for Catch2 tests.
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/ocp/cost.h"
#include "check_derivative.h"

namespace bielle::testing {

constexpr double kResidualStep = 5e-4;

// A node at (q, v) with forces lambda.
struct TestNode {
  explicit TestNode(const Model& model, const ConstraintSet& set)
      : model(model), set(set), ws(model), u(VectorXd::Zero(model.nu())), lambda(VectorXd::Zero(set.rows)), speeds(u) {}
  VectorXd calc(const Residual& residual, const VectorXd& q, const VectorXd& v, const VectorXd& forces) {
    move(q, v, forces);
    VectorXd r(residual.size());
    residual.calc(view(), r);
    return r;
  }
  void move(const VectorXd& q, const VectorXd& v, const VectorXd& forces) {
    updatePositions(model, ws, q);
    updateVelocities(model, ws, v);
    updateMassMatrix(model, ws);
    lambda = forces;
  }
  NodeView view() const { return {model, ws, set, u, lambda, time_scale, &speeds}; }

  const Model& model;
  const ConstraintSet& set;
  Workspace ws;
  VectorXd u, lambda, speeds;
  double time_scale = 1.3;
};

inline void checkResidual(const Model& model, const ConstraintSet& set, const Residual& residual, const VectorXd& q,
                          const VectorXd& v, const VectorXd& lambda) {
  const int n = residual.size(), nv = model.nv();
  MatrixXd dq = MatrixXd::Zero(n, nv), dv = dq, dlambda = MatrixXd::Zero(n, set.rows),
           du = MatrixXd::Zero(n, model.nu()), dspeeds = du;
  VectorXd ds = VectorXd::Zero(n);
  TestNode node(model, set);
  // The Jacobian is written over that of another state: what it does not write must be zero everywhere.
  std::mt19937 rng(99);
  node.move(model.integrate(q, randomVector(rng, nv, 0.5)), v + randomVector(rng, nv), 2 * lambda);
  node.u = randomVector(rng, model.nu());
  node.speeds = randomVector(rng, model.nu());
  residual.calcJacobian(node.view(), {dq, dv, dlambda, du, dspeeds, ds});
  node.move(q, v, lambda);
  const VectorXd u = randomVector(rng, model.nu());
  node.u = u;
  node.speeds = randomVector(rng, model.nu());
  residual.calcJacobian(node.view(), {dq, dv, dlambda, du, dspeeds, ds});
  checkDerivative(dq, differentiateTangent(model, q, kResidualStep,
                                           [&](const VectorXd& x) { return node.calc(residual, x, v, lambda); }));
  checkDerivative(
      dv, differentiate(v, kResidualStep, [&](const VectorXd& x) { return node.calc(residual, q, x, lambda); }));
  checkDerivative(ds, differentiate(VectorXd::Constant(1, node.time_scale), kResidualStep, [&](const VectorXd& s) {
                    TestNode other = node;
                    other.time_scale = s[0];
                    return other.calc(residual, q, v, lambda);
                  }));
  CHECK(residual.needsControls() == !du.isZero(0));
  CHECK(residual.needsSpeeds() == !dspeeds.isZero(0));
  if (model.nu() > 0)
    checkDerivative(dspeeds, differentiate(node.speeds, kResidualStep, [&](const VectorXd& x) {
                      TestNode other = node;
                      other.speeds = x;
                      return other.calc(residual, q, v, lambda);
                    }));
  if (model.nu() > 0)
    checkDerivative(du, differentiate(u, kResidualStep, [&](const VectorXd& x) {
                      node.u = x;
                      return node.calc(residual, q, v, lambda);
                    }));
  if (set.rows == 0) return;
  checkDerivative(dlambda,
                  differentiate(lambda, 1e-2, [&](const VectorXd& x) { return node.calc(residual, q, v, x); }));
  if (dlambda.cwiseAbs().maxCoeff() > 0) CHECK(residual.needsForces());
}

}  // namespace bielle::testing
