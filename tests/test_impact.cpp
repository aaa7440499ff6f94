// Rigid impacts: momentum, energy, derivatives against central differences (fourth order, step 1e-3), every joint kind
// times every closure kind; a dropped block as the closed form.
#include <catch2/catch.hpp>

#include "bielle/dynamics/impact.h"
#include "bielle/dynamics/kinematics.h"
#include "check_derivative.h"
#include "count_allocations.h"
#include "dynamics/saddle_point.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

double calcEnergy(const MatrixXd& M, const VectorXd& v) { return 0.5 * v.dot(M * v); }

}  // namespace

TEST_CASE(
    "impacts: constraints hold afterwards, the energy of the change is lost, derivatives agree with differences") {
  std::mt19937 rng(51);
  for (JointKind kind : kJointKinds)
    for (ClosureKind closure : kClosureKinds)
      for (bool open : {false, true})
        for (MechanismBase base : {MechanismBase::Fixed, MechanismBase::FreeFlyer}) {
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
          REQUIRE(updateImpact(model, iws, set, q, v) == DynamicsStatus::Ok);
          const MatrixXd M = iws.ws.M, J = iws.J;
          const double before = calcEnergy(M, v);
          CHECK((J * iws.v_plus).norm() < 1e-10);
          CHECK((M * (iws.v_plus - v) - J.transpose() * iws.impulse).norm() < 1e-10 * (M * v).norm());
          CHECK(before - calcEnergy(M, iws.v_plus) == Approx(calcEnergy(M, iws.v_plus - v)).epsilon(1e-9));
          CHECK(calcEnergy(M, iws.v_plus) < before);

          REQUIRE(updateImpactDerivatives(model, iws, set) == DynamicsStatus::Ok);
          const int nv = model.nv();
          ImpactWorkspace other(model);
          const auto solve = [&](const VectorXd& x, const VectorXd& y) {
            updateImpact(model, other, set, x, y);
            VectorXd out(nv + set.rows);
            out << other.v_plus, other.impulse;
            return out;
          };
          MatrixXd numeric = differentiateTangent(model, q, 4e-3, [&](const VectorXd& x) { return solve(x, v); });
          checkDerivative(iws.dv_dq, numeric.topRows(nv), "v+ by q");
          checkDerivative(iws.dimpulse_dq, numeric.bottomRows(set.rows), "impulse by q");
          numeric = differentiate(v, 1, [&](const VectorXd& x) { return solve(q, x); });
          checkDerivative(iws.dv_dv, numeric.topRows(nv), "v+ by v");
          checkDerivative(iws.dimpulse_dv, numeric.bottomRows(set.rows), "impulse by v");
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
  REQUIRE(updateImpact(model, iws, set, four_bar.q_closed, v) == DynamicsStatus::Ok);
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
                       randomVector(rng, 6, 1)) == DynamicsStatus::Ok);
  CHECK(flat.v_plus.norm() < 1e-12);
}

TEST_CASE("impacts allocate nothing after the first") {
  std::mt19937 rng(53);
  const Mechanism mechanism =
      makeRandomMechanism(rng, JointKind::Spherical, ClosureKind::Weld6D, MechanismBase::FreeFlyer);
  const ConstraintSet set = makeConstraintSet(mechanism.model, {{0, SE3::Identity(), 0, 0}});
  ImpactWorkspace iws(mechanism.model);
  const VectorXd v = randomVector(rng, mechanism.model.nv(), 1);
  const auto run = [&] {
    return updateImpact(mechanism.model, iws, set, mechanism.q_closed, v) == DynamicsStatus::Ok &&
           updateImpactDerivatives(mechanism.model, iws, set) == DynamicsStatus::Ok;
  };
  REQUIRE(run());
  const long before = num_allocations;
  const bool ok = run();
  CHECK(num_allocations == before);
  CHECK(ok);
}
