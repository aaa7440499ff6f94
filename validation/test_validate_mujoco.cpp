// MuJoCo against random mechanisms of every joint and closure kind; wrong models must be seen.
#include <catch2/catch.hpp>

#include "change_model.h"
#include "mechanisms.h"
#include "print_report.h"
#include "selection.h"
#include "validate_mujoco.h"

using namespace bielle;
using namespace bielle::testing;
using namespace bielle::validation;

namespace {

constexpr const char* kComplete = "accelerations, rigid closures, dJ/dt v added";

}  // namespace

TEST_CASE("every joint kind with every closure kind agrees with MuJoCo", "[sweep]") {
  std::mt19937 rng(21);
  Selection selection(5);
  ValidationOptions options;
  options.samples = 3;
  options.tolerance = 1e-10;
  double without_rate = 0;
  for (const MechanismKind& kind : listMechanismKinds()) {
    if (kind.closure == ClosureKind::Slider) continue;  // which MuJoCo does not have
    if (selection.isLeftOut()) continue;
    const Mechanism mechanism = makeRandomMechanism(rng, kind.joint, kind.closure, kind.base);
    options.start = mechanism.q_closed;
    const ValidationReport report = validateByMujoco(mechanism.model, options);
    CAPTURE(kind);
    INFO(print(report));
    CHECK(report.passed());
    REQUIRE(report.findRow(kComplete));
    without_rate = std::max(without_rate, report.findRow("accelerations, rigid closures")->difference);
  }
  CHECK(without_rate > 1e-3);  // dJ/dt v is not negligible
}

TEST_CASE("polynomials in couplers of two joints agree with MuJoCo") {
  std::mt19937 rng(24);
  ValidationOptions options;
  options.samples = 3;
  options.tolerance = 1e-10;
  for (JointKind joint : {JointKind::Spherical, JointKind::Universal})
    for (ClosureKind closure : {ClosureKind::Hinge5D, ClosureKind::Coupler}) {
      const Mechanism mechanism = makeCammedMechanism(rng, joint, closure, MechanismBase::FreeFlyer);
      options.start = mechanism.q_closed;
      const ValidationReport report = validateByMujoco(mechanism.model, options);
      CAPTURE(getName(joint), getName(closure));
      INFO(print(report));
      CHECK(report.passed());
      REQUIRE(report.findRow(kComplete));
    }
}

TEST_CASE("springs and dampers on joints and between points, and friction, agree with MuJoCo") {
  std::mt19937 rng(23);
  ValidationOptions options;
  options.samples = 3;
  options.tolerance = 1e-10;
  for (JointKind joint : {JointKind::Revolute, JointKind::Prismatic}) {
    const Mechanism mechanism = makeSprungMechanism(rng, joint, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
    options.start = mechanism.q_closed;
    const ValidationReport report = validateByMujoco(mechanism.model, options);
    CAPTURE(getName(joint));
    INFO(print(report));
    CHECK(report.passed());
  }
}

TEST_CASE("MuJoCo sees a wrong inertia, a moved closure and a wrong armature") {
  std::mt19937 rng(22);
  const Mechanism mechanism =
      makeRandomMechanism(rng, JointKind::Spherical, ClosureKind::Hinge5D, MechanismBase::FreeFlyer);
  ValidationOptions options;
  options.samples = 2;
  options.start = mechanism.q_closed;
  const auto expectFailure = [&](const Change& change, const std::vector<std::string>& quantities) {
    const ValidationReport report =
        validateAgainstMujoco(mechanism.model, changeModel(mechanism.model, change), options);
    INFO(print(report));
    for (const std::string& quantity : quantities) {
      CAPTURE(quantity);
      CHECK(!report.findRow(quantity)->passed());
    }
  };
  CHECK(validateAgainstMujoco(mechanism.model, mechanism.model, options).passed());
  expectFailure([](ModelParts& parts) { parts.bodies[5].inertia.mass *= 1 + 1e-5; },
                {"mass matrix", "bias", kComplete});
  expectFailure(
      [](ModelParts& parts) {
        for (Closure& closure : parts.closures) closure.X_B1.p.x() += 1e-4;
      },
      {kComplete, "accelerations, rigid closures, at rest"});
  expectFailure([](ModelParts& parts) { parts.armature *= 1.001; }, {"mass matrix", kComplete});
}
