// The motion of closed mechanisms as a smooth field: the full system as its oracle, and a Runge-Kutta method whose order shows
// that it is smooth beside the manifold.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "count_allocations.h"
#include "dynamics/closed_field.h"
#include "math/runge_kutta.h"
#include "mechanisms.h"

namespace bielle {
namespace {

using namespace bielle::testing;

// The state after one step of length h of a mechanism without forces from outside, as (d, u) in the chart of its start.
VectorXd takeStep(ClosedField& field, const Mechanism& mechanism, const VectorXd& v, double h, double* error) {
  const int nv = mechanism.model.nv();
  const VectorXd tau = VectorXd::Zero(nv);
  RungeKutta method(2 * nv);
  const auto derive = [&](const VectorXd& x, VectorXd& rate) {
    if (!field.close(x.head(nv), x.tail(nv))) return false;
    field.accelerate(tau, rate.head(nv), rate.tail(nv));
    return true;
  };
  field.begin(mechanism.q_closed);
  VectorXd x(2 * nv), rate(2 * nv);
  x << VectorXd::Zero(nv), v;
  REQUIRE(derive(x, rate));
  *error = method.step(derive, x, rate, h, VectorXd::Ones(2 * nv));
  return method.end();
}

}  // namespace

TEST_CASE("closed field: accelerations and forces of the full system, for every joint and closure") {
  std::mt19937 rng(7);
  for (const MechanismKind& kind : listMechanismKinds()) {
    CAPTURE(kind);
    const Mechanism mechanism = makeSprungMechanism(rng, kind.joint, kind.closure, kind.base);
    const Model& model = mechanism.model;
    ClosedField field(model);
    field.select(mechanism.q_closed);
    field.begin(mechanism.q_closed);
    const VectorXd u = randomVector(rng, model.nv()), tau = randomVector(rng, model.nv(), 5);
    REQUIRE(field.close(VectorXd::Zero(model.nv()), u));
    VectorXd d_rate(model.nv()), a(model.nv());
    field.accelerate(tau, d_rate, a);
    Workspace ws(model);
    ConstrainedWorkspace cws;
    REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), field.configuration(), field.velocity(),
                                      tau) == NumericalStatus::Ok);
    CHECK(calcRelativeError(a, cws.a) < 1e-9);
    CHECK((d_rate - field.velocity()).norm() < 1e-12);
    VectorXd poisoned = tau;
    poisoned[model.nv() - 1] += 1e-3 * (1 + std::abs(poisoned[model.nv() - 1]));
    field.accelerate(poisoned, d_rate, a);
    CHECK(calcRelativeError(a, cws.a) > 1e-9);
  }
}

TEST_CASE("closed field: a step has the order of its method, for every joint") {
  std::mt19937 rng(5);
  for (JointKind joint : kJointKinds) {
    CAPTURE(getName(joint));
    const Mechanism mechanism = makeRandomMechanism(rng, joint, ClosureKind::Hinge5D, MechanismBase::FreeFlyer);
    const Model& model = mechanism.model;
    Workspace ws(model);
    const VectorXd v =
        projectVelocity(model, ws, makeConstraintSet(model), mechanism.q_closed, randomVector(rng, model.nv(), 1));
    ClosedField field(model);
    field.select(mechanism.q_closed);
    // The error of a step, told by two of half the length: the estimate is of a lower order, and never less.
    double coarse = 0, fine = 0, estimate = 0;
    for (double h : {0.2, 0.1}) {
      double error = 0, part = 0;
      const VectorXd whole = takeStep(field, mechanism, v, h, &error);
      REQUIRE(field.close(whole.head(model.nv()), whole.tail(model.nv())));
      const VectorXd q = field.configuration();
      const VectorXd half = takeStep(field, mechanism, v, h / 2, &part);
      REQUIRE(field.close(half.head(model.nv()), half.tail(model.nv())));
      Mechanism middle{model, field.configuration()};
      const VectorXd middle_v = field.velocity();
      const VectorXd second = takeStep(field, middle, middle_v, h / 2, &part);
      REQUIRE(field.close(second.head(model.nv()), second.tail(model.nv())));
      (h == 0.2 ? coarse : fine) = model.difference(q, field.configuration()).norm();
      if (h == 0.2) estimate = error;
    }
    CAPTURE(coarse, fine, estimate);
    CHECK((fine < coarse / 100 || fine < 1e-13));  // 2^9 in the limit
    CHECK(coarse < 10 * estimate);
  }
}

TEST_CASE("closed field: how independent its rows are does not depend on the way there") {
  std::mt19937 rng(9);
  const Mechanism mechanism = makeRandomMechanism(rng, JointKind::Prismatic, ClosureKind::Ball3D, MechanismBase::Fixed);
  ClosedField field(mechanism.model);
  field.select(mechanism.q_closed);
  const VectorXd zero = VectorXd::Zero(mechanism.model.nv());
  const auto measure = [&](const VectorXd& q) {
    field.begin(q);
    REQUIRE(field.close(zero, zero));
    return field.independence();
  };
  const double before = measure(mechanism.q_closed);
  bool changes = false;
  for (int i = 0; i < 6; ++i) {
    const VectorXd moved = mechanism.model.integrate(mechanism.q_closed, randomVector(rng, mechanism.model.nv(), 0.5));
    const AssemblyResult other = closeConfiguration(mechanism.model, moved);
    if (other.status == NumericalStatus::Ok) changes = changes || std::abs(measure(other.q) - before) > 0.01;
  }
  CHECK(changes);
  CHECK(measure(mechanism.q_closed) == before);
}

TEST_CASE("closed field: evaluations do not allocate") {
  std::mt19937 rng(9);
  const Mechanism mechanism =
      makeSprungMechanism(rng, JointKind::Spherical, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
  const Model& model = mechanism.model;
  ClosedField field(model);
  field.select(mechanism.q_closed);
  const VectorXd d = randomVector(rng, model.nv(), 1e-3), u = randomVector(rng, model.nv()),
                 tau = VectorXd::Zero(model.nv());
  VectorXd d_rate(model.nv()), a(model.nv());
  field.begin(mechanism.q_closed);
  REQUIRE(field.close(d, u));
  const long before = num_allocations;
  field.begin(mechanism.q_closed);
  const bool closes = field.close(d, u);
  field.accelerate(tau, d_rate, a);
  const long after = num_allocations;
  CHECK(closes);
  CHECK(after == before);
}

}  // namespace bielle
