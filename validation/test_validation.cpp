// Simbody against random mechanisms of every joint and closure kind, with fixed and free bases; wrong models must be
// seen.
#include <catch2/catch.hpp>
#include <filesystem>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "change_model.h"
#include "math/so3.h"
#include "mechanisms.h"
#include "model/joint.h"
#include "model_copy.h"
#include "motion.h"
#include "print_report.h"
#include "published_robots.h"
#include "selection.h"
#include "simbody_bridge.h"
#include "validate.h"

using namespace bielle;
using namespace bielle::testing;
using namespace bielle::validation;

TEST_CASE("every joint kind with every closure kind agrees with Simbody", "[sweep]") {
  std::mt19937 rng(11);
  Selection selection(5);
  ValidationOptions options;
  options.samples = 3;
  for (const MechanismKind& kind : listMechanismKinds()) {
    if (selection.isLeftOut()) continue;
    const Mechanism mechanism = makeRandomMechanism(rng, kind.joint, kind.closure, kind.base);
    options.start = mechanism.q_closed;
    const ValidationReport report = validateRobot(mechanism.model, options);
    CAPTURE(kind);
    INFO(print(report));
    CHECK(report.passed());
    for (const char* quantity : {"mass matrix", "accelerations, Simbody solver", "closure forces, Simbody solver",
                                 "accelerations, with rotors", "da/dq along the closures"})
      CHECK(report.findRow(quantity) != nullptr);
    for (const ValidationRow& row : report.rows)  // Simbody's own rounding does not excuse these mechanisms
      if (row.tolerance < options.derivative_tolerance) CHECK(row.difference < 1e-9);
  }
}

TEST_CASE("springs and dampers on joints and between points, and friction, agree with Simbody") {
  std::mt19937 rng(13);
  ValidationOptions options;
  options.samples = 3;
  for (JointKind joint : {JointKind::Revolute, JointKind::Continuous, JointKind::Prismatic, JointKind::Spherical}) {
    const Mechanism mechanism = makeSprungMechanism(rng, joint, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
    options.start = mechanism.q_closed;
    const ValidationReport report = validateRobot(mechanism.model, options);
    CAPTURE(getName(joint));
    INFO(print(report));
    CHECK(report.passed());
  }
}

TEST_CASE("couplers beside other closures, redundant or not, agree with Simbody") {
  std::mt19937 rng(14);
  ValidationOptions options;
  options.samples = 3;
  for (JointKind joint : kJointKinds)
    for (bool repeated : {false, true}) {
      const Mechanism mechanism =
          makeBeltedMechanism(rng, joint, ClosureKind::Hinge5D, MechanismBase::FreeFlyer, repeated);
      options.start = mechanism.q_closed;
      const ValidationReport report = validateRobot(mechanism.model, options);
      CAPTURE(getName(joint), repeated);
      INFO(print(report));
      CHECK(report.passed());
      CHECK((report.redundant_states == 0) == !repeated);
    }
}

TEST_CASE("polynomials in couplers, beside other closures or not, agree with Simbody; a wrong one is seen") {
  std::mt19937 rng(16);
  ValidationOptions options;
  options.samples = 3;
  for (JointKind joint : {JointKind::Revolute, JointKind::Prismatic, JointKind::Spherical})
    for (ClosureKind closure : {ClosureKind::Hinge5D, ClosureKind::Coupler}) {
      const Mechanism mechanism = makeCammedMechanism(rng, joint, closure, MechanismBase::FreeFlyer);
      options.start = mechanism.q_closed;
      const ValidationReport report = validateRobot(mechanism.model, options);
      CAPTURE(getName(joint), getName(closure));
      INFO(print(report));
      CHECK(report.passed());
      for (const char* quantity :
           {"accelerations, Simbody solver", "closure forces, Simbody solver", "da/dq along the closures"})
        CHECK(report.findRow(quantity) != nullptr);
      const Model wrong = changeModel(mechanism.model, [](ModelParts& parts) {
        for (CouplerTerm& term : parts.closures.back().terms)
          if (!term.isLinear()) term.higher[1] *= 1.001;
      });
      CHECK(!validateAgainst(mechanism.model, wrong, options).passed());
    }
}

TEST_CASE("a wrong ratio of a coupler is seen") {
  std::mt19937 rng(15);
  const Mechanism mechanism =
      makeRandomMechanism(rng, JointKind::Prismatic, ClosureKind::Coupler, MechanismBase::Fixed);
  ValidationOptions options;
  options.samples = 2;
  options.start = mechanism.q_closed;
  REQUIRE(validateAgainst(mechanism.model, mechanism.model, options).passed());
  const Model wrong =
      changeModel(mechanism.model, [](ModelParts& parts) { parts.closures[0].terms[0].coefficient *= 1.001; });
  const ValidationReport report = validateAgainst(mechanism.model, wrong, options);
  INFO(print(report));
  CHECK(!report.findRow("accelerations, Simbody solver")->passed());
  CHECK(!report.findRow("constraint forces J'lambda, with rotors")->passed());
}

TEST_CASE("the planar four-bar, with redundant rows, agrees with Simbody in accelerations and generalized forces") {
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.45, 0.3, 0.7);
  ValidationOptions options;
  options.start = mechanism.q_closed;
  const ValidationReport report = validateRobot(mechanism.model, options);
  INFO(print(report));
  CHECK(report.passed());
  CHECK(report.redundant_states == options.samples);
  for (const char* label : {"with rotors", "Simbody solver"}) {
    CHECK(report.findRow(std::string("accelerations, ") + label)->samples == options.samples);
    CHECK(report.findRow(std::string("constraint forces J'lambda, ") + label)->samples == options.samples);
    CHECK(report.findRow(std::string("closure forces, ") + label) == nullptr);  // not determined
  }
}

TEST_CASE("published closed-chain models agree with Simbody, on a free and on a fixed base") {
  const std::string directory = findPublishedDirectory("battobot_6d");
  int robots = 0;
  if (!directory.empty())
    for (const auto& entry : std::filesystem::directory_iterator(directory)) {
      if (!entry.is_directory()) continue;
      ++robots;
      for (const BaseKind base : {BaseKind::Free, BaseKind::Fixed}) {
        LoadOptions load;
        load.base = base;
        ValidationOptions options;
        options.samples = 4;
        const ValidationReport report = validateRobot(loadRobot(entry.path().string(), load).model, options);
        CAPTURE(entry.path().filename().string(), base == BaseKind::Free);
        INFO(print(report));
        CHECK(report.passed());
      }
    }
  if (robots == 0) WARN("skipped: no directory of BIELLE_ROBOTS holds published robots");
}

TEST_CASE("a wrong inertia, a moved closure and a turned hinge axis are each seen") {
  std::mt19937 rng(12);
  const Mechanism mechanism =
      makeRandomMechanism(rng, JointKind::Spherical, ClosureKind::Hinge5D, MechanismBase::FreeFlyer);
  const Model& model = mechanism.model;
  ValidationOptions options;
  options.samples = 2;
  options.start = mechanism.q_closed;
  CHECK(validateAgainst(model, model, options).passed());
  const auto expectFailure = [&](const Change& change, const std::set<std::string>& quantities) {
    const ValidationReport report = validateAgainst(model, changeModel(model, change), options);
    INFO(print(report));
    CHECK(report.failure.empty());
    CHECK(!report.passed());
    for (const std::string& quantity : quantities) {
      CAPTURE(quantity);
      CHECK(!report.findRow(quantity)->passed());
    }
  };
  expectFailure([](ModelParts& parts) { parts.bodies[5].inertia.I_com *= 1 + 1e-6; },
                {"mass matrix", "bias", "kinetic energy", "accelerations, with rotors", "accelerations, Simbody solver",
                 "closure forces, Simbody solver"});
  expectFailure([](ModelParts& parts) { parts.bodies[5].inertia.com.x() += 1e-6; },
                {"mass matrix", "potential energy", "accelerations, Simbody solver"});
  const std::set<std::string> closing = {"accelerations, with rotors", "accelerations, Simbody solver",
                                         "closure forces, with rotors"};
  expectFailure(
      [](ModelParts& parts) {
        for (Closure& closure : parts.closures) closure.X_B2.p.x() += 1e-6;
      },
      closing);
  expectFailure(
      [](ModelParts& parts) {
        for (Closure& closure : parts.closures)
          closure.X_B2.R = closure.X_B2.R * exp3(1e-6 * closure.axis.unitOrthogonal());
      },
      closing);
  expectFailure([](ModelParts& parts) { parts.armature *= 1.001; },
                {"mass matrix", "kinetic energy", "accelerations, with rotors"});
}

TEST_CASE("derivatives of a slightly different robot are seen as different") {
  std::mt19937 rng(13);
  const Mechanism mechanism =
      makeRandomMechanism(rng, JointKind::Planar, ClosureKind::Weld6D, MechanismBase::FreeFlyer);
  ValidationOptions options;
  options.samples = 1;
  options.start = mechanism.q_closed;
  const Model wrong = changeModel(mechanism.model, [](ModelParts& parts) { parts.bodies[5].inertia.mass *= 1.001; });
  const ValidationReport report = validateAgainst(mechanism.model, wrong, options);
  INFO(print(report));
  for (const std::string quantity : {"da/dq along the closures", "da/dv along the closures", "da/du",
                                     "dlambda/dq along the closures", "dlambda/dv along the closures", "dlambda/du"}) {
    CAPTURE(quantity);
    REQUIRE(report.findRow(quantity));
    CHECK(!report.findRow(quantity)->passed());
  }
}

TEST_CASE("closed chains move freely for two seconds with Simbody, at the order of the scheme") {
  std::mt19937 rng(14);
  const std::pair<JointKind, ClosureKind> kinds[] = {{JointKind::Spherical, ClosureKind::Hinge5D},
                                                     {JointKind::Planar, ClosureKind::Weld6D},
                                                     {JointKind::Universal, ClosureKind::Ball3D},
                                                     {JointKind::Revolute, ClosureKind::Distance},
                                                     {JointKind::Spherical, ClosureKind::Slider}};
  for (const auto& [joint, closure] : kinds) {
    const Mechanism mechanism = makeRandomMechanism(rng, joint, closure, MechanismBase::FreeFlyer);
    const Model model = makeModelWithoutArmature(mechanism.model);
    Workspace ws(model);
    const ConstraintSet set = makeConstraintSet(model);
    const VectorXd v = projectVelocity(model, ws, set, mechanism.q_closed, randomVector(rng, model.nv(), 1));
    validation::MotionOptions options;
    options.step = 1e-2;
    const MotionReport coarse = compareMotion(model, mechanism.q_closed, v, options);
    options.step = 5e-3;
    const MotionReport fine = compareMotion(model, mechanism.q_closed, v, options);
    CAPTURE(getName(joint), getName(closure), coarse.distance, fine.distance, coarse.energy_error, fine.energy_error,
            fine.travelled, fine.gap);
    REQUIRE(coarse.ok);
    REQUIRE(fine.ok);
    CHECK(fine.travelled > 1);
    CHECK(fine.gap < 1e-12);
    CHECK(fine.distance < 1e-6 * fine.travelled);
    CHECK(fine.energy_error < 1e-6 * fine.kinetic_energy);
    CHECK(coarse.distance > 12 * fine.distance);  // 16 by the order of the scheme
    CHECK(coarse.energy_error > 12 * fine.energy_error);
  }
}

TEST_CASE("a tiny planar loop in a slanted plane: rows that are nothing but rounding stay without effect") {
  std::mt19937 rng(15);
  const Vector3d normal = randomVector(rng, 3).normalized(), along = normal.unitOrthogonal();
  ModelBuilder builder("slanted");
  std::string parent = "world";
  for (const char* link : {"crank", "coupler", "rocker", "pin"}) {
    Joint joint;
    joint.name = std::string("j_") + link;
    joint.kind = JointKind::Revolute;
    joint.axis = normal;
    joint.X_PJ.p = 0.01 * along;
    Inertia inertia;  // a bead of a hundredth of a milligram
    inertia.mass = 1e-8;
    inertia.com = 0.005 * along;
    inertia.I_com = 1e-13 * Matrix3d::Identity();
    builder.addLink(link, parent, joint, inertia);
    parent = link;
  }
  ValidationOptions options;
  options.start = Eigen::Vector4d(0.3, 0.9, 1.1, -0.4);
  options.force = 1e-10;
  const Model tree = builder.build();
  Workspace ws(tree);
  updatePositions(tree, ws, options.start);
  const SE3 X_BT{makePlaneBasis(normal), Vector3d::Zero()};  // in its plane: three of the six rows should be zero
  builder.addFrame("tip", "pin", X_BT);
  builder.addFrame("anchor", "world", ws.X_WB[4] * X_BT);
  builder.addClosure("loop", ClosureKind::Weld6D, "tip", "anchor");
  builder.addMotor("j_crank");
  const ValidationReport report = validateRobot(builder.build(), options);
  INFO(print(report));
  CHECK(report.redundant_states == options.samples);
  const ValidationRow* row = report.findRow("accelerations, with rotors");
  REQUIRE(row);
  CHECK(row->passed());
  CHECK(report.findRow("constraint forces J'lambda, with rotors")->passed());
}
