// Rigid impacts: momentum, energy, derivatives against central differences (fourth order, step 1e-3), every joint kind
// times every closure kind; a dropped block and a body that falls on its edge as closed forms.
#include <catch2/catch.hpp>

#include "bielle/dynamics/impact.h"
#include "bielle/dynamics/kinematics.h"
#include "check_derivative.h"
#include "count_allocations.h"
#include "dynamics/saddle_point.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

double calcEnergy(const MatrixXd& M, const VectorXd& v) { return 0.5 * v.dot(M * v); }

// After updateImpact(), against differences.
void checkImpactDerivatives(const Model& model, const ConstraintSet& set, const VectorXd& q, const VectorXd& v,
                            ImpactWorkspace& iws) {
  REQUIRE(updateImpactDerivatives(model, iws, set) == NumericalStatus::Ok);
  const int nv = model.nv();
  // A rod alone hardly stiffens what varies fast, and turns itself; the rows of a coupler are known to less.
  const bool has_rod = set.closures[0].kind == ClosureKind::Distance;
  const double step = has_rod ? 1e-3 : 4e-3;
  ImpactWorkspace other(model);
  const auto solve = [&](const VectorXd& x, const VectorXd& y) {
    updateImpact(model, other, set, x, y);
    VectorXd out(nv + set.rows);
    out << other.v_plus, other.impulse;
    return out;
  };
  MatrixXd numeric = differentiateTangent(model, q, step, [&](const VectorXd& x) { return solve(x, v); });
  checkDerivative(iws.dv_dq, numeric.topRows(nv), "v+ by q");
  checkDerivative(iws.dimpulse_dq, numeric.bottomRows(set.rows), "impulse by q");
  numeric = differentiate(v, 1, [&](const VectorXd& y) { return solve(q, y); });
  checkDerivative(iws.dv_dv, numeric.topRows(nv), "v+ by v");
  checkDerivative(iws.dimpulse_dv, numeric.bottomRows(set.rows), "impulse by v");
}

}  // namespace

TEST_CASE("impacts: constraints hold afterwards, the energy of the change is lost, derivatives agree with differences",
          "[sweep]") {
  std::mt19937 rng(57);
  Selection selection;
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds)
      for (bool open : {false, true})
        for (MechanismBase base : {MechanismBase::Fixed, MechanismBase::FreeFlyer}) {
          if (selection.isLeftOut()) continue;
          CAPTURE(getName(kind), getName(closure), open, base == MechanismBase::Fixed);
          const Mechanism mechanism = makeRandomMechanism(rng, kind, closure, base);
          const Model& model = mechanism.model;
          std::vector<ContactTarget> contacts;
          if (base == MechanismBase::FreeFlyer) contacts = {{1, randomPlacement(rng), 5, 4}};
          const ConstraintSet set = makeConstraintSet(model, contacts);
          VectorXd q = mechanism.q_closed;
          if (open) q = model.integrate(q, randomVector(rng, model.nv(), 0.1));
          const VectorXd v = randomVector(rng, model.nv(), 1);
          ImpactWorkspace iws(model);
          REQUIRE(updateImpact(model, iws, set, q, v) == NumericalStatus::Ok);
          const MatrixXd M = iws.ws.M, J = iws.J;
          const double before = calcEnergy(M, v);
          CHECK((J * iws.v_plus).norm() < 1e-10);
          CHECK((M * (iws.v_plus - v) - J.transpose() * iws.impulse).norm() < 1e-10 * (M * v).norm());
          CHECK(before - calcEnergy(M, iws.v_plus) == Approx(calcEnergy(M, iws.v_plus - v)).epsilon(1e-9));
          CHECK(calcEnergy(M, iws.v_plus) < before);

          checkImpactDerivatives(model, set, q, v, iws);
        }
}

TEST_CASE("a block that lands flat stops; redundant loops meet the same velocity whatever the rows") {
  std::mt19937 rng(52);
  const Mechanism four_bar = makePlanarFourBar(0.4, 0.15, 0.45, 0.3, 0.7);
  const Model& model = four_bar.model;
  ImpactWorkspace iws(model);
  const ConstraintSet set = makeConstraintSet(model);
  REQUIRE(set.rows == 6);
  const VectorXd v = randomVector(rng, model.nv(), 1);
  REQUIRE(updateImpact(model, iws, set, four_bar.q_closed, v) == NumericalStatus::Ok);
  CHECK(iws.saddle_point->isRedundant());
  CHECK((iws.J * iws.v_plus).norm() < 1e-10);
  // Momentum along the null space N of J is conserved: N^T M v+ = N^T M v.
  const Eigen::FullPivLU<MatrixXd> lu(iws.J);
  Eigen::FullPivLU<MatrixXd> rank(lu);
  rank.setThreshold(1e-9);
  const MatrixXd N = rank.kernel();
  REQUIRE(N.cols() == 1);
  CHECK((N.transpose() * iws.ws.M * (iws.v_plus - v)).norm() < 1e-10);

  ModelBuilder builder("block");
  Joint joint;
  joint.name = "free";
  joint.kind = JointKind::FreeFlyer;
  builder.addLink("block", "world", joint, randomInertia(rng));
  builder.addContact("sole", "block", ContactKind::Surface6D, 0.1, 0.05);
  const Model block = builder.build();
  ImpactWorkspace flat(block);
  REQUIRE(updateImpact(block, flat, makeConstraintSet(block, {{0, SE3::Identity(), 0, 0}}), block.makeNeutral(),
                       randomVector(rng, 6, 1)) == NumericalStatus::Ok);
  CHECK(flat.v_plus.norm() < 1e-12);
}

TEST_CASE("a body that lands on an edge goes on rolling about it, by its angular momentum about the edge") {
  std::mt19937 rng(54);
  for (int trial = 0; trial < 5; ++trial) {
    ModelBuilder builder("blade");
    Joint joint;
    joint.name = "free";
    joint.kind = JointKind::FreeFlyer;
    const Inertia inertia = randomInertia(rng);
    builder.addLink("blade", "world", joint, inertia);
    builder.addFrame("edge", "blade", randomPlacement(rng));
    builder.addContact("edge", "edge", ContactKind::Edge5D, 0.1, 0);
    const Model model = builder.build();
    const VectorXd q = model.integrate(model.makeNeutral(), randomVector(rng, 6, 1)), v = randomVector(rng, 6, 1);
    Workspace ws(model);
    updatePositions(model, ws, q);
    const SE3 X_WB = ws.X_WB[1], X_WE = getPlacement(ws, 1, model.contacts()[0].X_BF);
    const ConstraintSet set = makeConstraintSet(model, {{0, X_WE, 0, 0}});
    REQUIRE(set.rows == 5);
    ImpactWorkspace iws(model);
    REQUIRE(updateImpact(model, iws, set, q, v) == NumericalStatus::Ok);

    // In the axes of the world: the impulse acts on the edge and has no moment about it.
    const Vector3d axis = X_WE.R.col(0), com = X_WB.act(inertia.com), arm = com - X_WE.p;
    const Vector3d velocity = X_WB.R * v.head<3>(), rate = X_WB.R * v.tail<3>();
    const Matrix3d I = X_WB.R * inertia.I_com * X_WB.R.transpose();  // about the centre of mass
    const Vector3d momentum = inertia.mass * (velocity + rate.cross(com - X_WB.p));
    const double about_edge = axis.dot(arm.cross(momentum) + I * rate);
    const double roll = about_edge / (axis.dot(I * axis) + inertia.mass * axis.cross(arm).squaredNorm());
    VectorXd expected(6);
    expected << X_WB.R.transpose() * (roll * axis).cross(X_WB.p - X_WE.p), X_WB.R.transpose() * (roll * axis);
    REQUIRE(std::abs(roll) > 0.01);
    const auto calcError = [&](const VectorXd& v_plus) { return (v_plus - expected).cwiseAbs().maxCoeff(); };
    CHECK(calcError(iws.v_plus) < 1e-11);
    for (int i = 0; i < 6; ++i) CHECK(calcError(iws.v_plus + 1e-3 * VectorXd::Unit(6, i)) > 1e-4);

    const MatrixXd M = iws.ws.M;
    CHECK((iws.J * iws.v_plus).norm() < 1e-11);
    CHECK((M * (iws.v_plus - v) - iws.J.transpose() * iws.impulse).norm() < 1e-11 * (M * v).norm());
    CHECK(calcEnergy(M, v) - calcEnergy(M, iws.v_plus) == Approx(calcEnergy(M, iws.v_plus - v)).epsilon(1e-9));
    CHECK(calcEnergy(M, iws.v_plus) < calcEnergy(M, v));
  }
}

TEST_CASE("impacts of edges on mechanisms: derivatives agree with differences") {
  std::mt19937 rng(55);
  for (ClosureKind closure : kClosureKinds) {
    CAPTURE(getName(closure));
    const Mechanism mechanism = makeRandomMechanism(rng, JointKind::Revolute, closure, MechanismBase::FreeFlyer);
    ModelParts parts = takeParts(mechanism.model);
    parts.contacts[0].kind = ContactKind::Edge5D;
    parts.contacts[0].half_width = 0;
    const Model model = ModelBuilder::restore(std::move(parts));
    const ConstraintSet set = makeConstraintSet(model, {{0, randomPlacement(rng), 0, 0}});
    const VectorXd q = mechanism.q_closed, v = randomVector(rng, model.nv(), 1);
    ImpactWorkspace iws(model);
    REQUIRE(updateImpact(model, iws, set, q, v) == NumericalStatus::Ok);
    CHECK((iws.J * iws.v_plus).norm() < 1e-10);
    checkImpactDerivatives(model, set, q, v, iws);
  }
}

TEST_CASE("impacts with polynomials in couplers: derivatives agree with differences") {
  std::mt19937 rng(56);
  for (JointKind kind : {JointKind::Revolute, JointKind::Prismatic, JointKind::Spherical})
    for (bool open : {false, true}) {
      CAPTURE(getName(kind), open);
      const Mechanism mechanism = makeCammedMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
      const Model& model = mechanism.model;
      const ConstraintSet set = makeConstraintSet(model, {{1, randomPlacement(rng), 5, 4}});
      VectorXd q = mechanism.q_closed;
      if (open) q = model.integrate(q, randomVector(rng, model.nv(), 0.1));
      const VectorXd v = randomVector(rng, model.nv(), 1);
      ImpactWorkspace iws(model);
      REQUIRE(updateImpact(model, iws, set, q, v) == NumericalStatus::Ok);
      CHECK((iws.J * iws.v_plus).norm() < 1e-10);
      checkImpactDerivatives(model, set, q, v, iws);
    }
}

TEST_CASE("impacts allocate nothing after the first") {
  std::mt19937 rng(53);
  const Mechanism mechanism =
      makeRandomMechanism(rng, JointKind::Spherical, ClosureKind::Weld6D, MechanismBase::FreeFlyer);
  const ConstraintSet set = makeConstraintSet(mechanism.model, {{0, SE3::Identity(), 0, 0}});
  ImpactWorkspace iws(mechanism.model);
  const VectorXd v = randomVector(rng, mechanism.model.nv(), 1);
  const auto run = [&] {
    return updateImpact(mechanism.model, iws, set, mechanism.q_closed, v) == NumericalStatus::Ok &&
           updateImpactDerivatives(mechanism.model, iws, set) == NumericalStatus::Ok;
  };
  REQUIRE(run());
  const long before = num_allocations;
  const bool ok = run();
  CHECK(num_allocations == before);
  CHECK(ok);
}
