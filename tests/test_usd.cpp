// Robots as files of USD: what is written comes back.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "formats/usd.h"
#include "get_error.h"
#include "mechanisms.h"
#include "robot_difference.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

LoadedRobot loadUsd(const std::string& text) {
  const RobotDirectory directory;
  return loadRobot(directory.write("robot.usda", text));
}

bool has(const std::vector<std::string>& warnings, const std::string& text) {
  for (const std::string& warning : warnings)
    if (warning.find(text) != std::string::npos) return true;
  return false;
}

// What USD has no word for: universal joints become two, couplers of more joints, contacts and springs are left out.
bool isExpressible(const Model& model) {
  for (const Joint& joint : model.joints())
    if (joint.kind == JointKind::Universal || joint.kind == JointKind::Planar ||
        (joint.kind == JointKind::FreeFlyer && joint.parent != 0))
      return false;
  return true;
}

// As robot_difference.h compares, without what is left out; coordinates are the same, balls too.
void checkSame(const Model& a, const Model& b, ConstVectorRef q_ref) {
  REQUIRE(a.nq() == b.nq());
  REQUIRE(a.numBodies() == b.numBodies());
  std::mt19937 rng(5);
  Workspace wa(a), wb(b);
  const auto getJoint = [&](const Joint& joint) -> const Joint& {
    const int j = joint.kind == JointKind::FreeFlyer ? 1 : b.findJoint(joint.name);
    REQUIRE(j > 0);
    return b.joints()[j];
  };
  MatrixXd order = MatrixXd::Zero(b.nv(), a.nv());
  for (const Joint& joint : a.joints()) {
    if (joint.nv == 0) continue;
    const Joint& other = getJoint(joint);
    REQUIRE(other.nv == joint.nv);
    order.block(other.idx_v, joint.idx_v, joint.nv, joint.nv).setIdentity();
    for (int k = 0; k < joint.nv; ++k) {
      const int ka = joint.idx_v + k, kb = other.idx_v + k;
      CAPTURE(joint.name, a.lowerLimits()[ka], b.lowerLimits()[kb]);
      if (joint.nv == 1) CHECK(areSame(a.lowerLimits()[ka], b.lowerLimits()[kb]));
      if (joint.nv == 1) CHECK(areSame(a.upperLimits()[ka], b.upperLimits()[kb]));
      if (joint.nv == 1) CHECK(areSame(a.velocityLimits()[ka], b.velocityLimits()[kb]));
      if (joint.kind != JointKind::FreeFlyer) CHECK(a.armature()[ka] == b.armature()[kb]);
    }
  }
  double mass = 0, bias = 0, closures = 0;
  for (int i = 0; i < 3; ++i) {
    const VectorXd q = a.integrate(q_ref, randomVector(rng, a.nv(), 0.5)), v = randomVector(rng, a.nv());
    VectorXd qb = b.makeNeutral();
    for (const Joint& joint : a.joints())
      if (joint.nq) qb.segment(getJoint(joint).idx_q, joint.nq) = q.segment(joint.idx_q, joint.nq);
    updatePositions(a, wa, q), updatePositions(b, wb, qb);
    updateVelocities(a, wa, v), updateVelocities(b, wb, order * v);
    updateMassMatrix(a, wa), updateMassMatrix(b, wb);
    updateBias(a, wa), updateBias(b, wb);
    MatrixXd M = wb.M, armature = a.armature().asDiagonal();
    M = order.transpose() * M * order;
    for (const Joint& joint : a.joints())  // USD has none of free bodies
      if (joint.kind == JointKind::FreeFlyer)
        M.diagonal().segment(joint.idx_v, 6) += a.armature().segment(joint.idx_v, 6);
    mass = std::max(mass, calcRelativeError(M, wa.M));
    bias = std::max(bias, calcRelativeError(order.transpose() * wb.b, wa.b));
    for (const Closure& closure : a.closures())
      if (closure.kind != ClosureKind::Coupler) {
        const int k = b.findClosure(closure.name);
        REQUIRE(k >= 0);
        CHECK(b.closures()[k].kind == closure.kind);
        closures = std::max(closures, compareClosure(wa, closure, wb, b.closures()[k], q, qb));
      }
  }
  CHECK(mass < kTolerance);
  if (a.pointSprings().empty() && a.jointForces().empty()) CHECK(bias < kTolerance);
  CHECK(closures < kTolerance);
  REQUIRE(a.nu() == b.nu());
  for (int i = 0; i < a.nu(); ++i) {
    CHECK(a.motors()[i].name == b.motors()[i].name);
    CHECK(a.motors()[i].effort_limit == b.motors()[i].effort_limit);
  }
  for (const Frame& frame : a.frames()) CHECK((frame.body == 0 || b.findFrame(frame.name) >= 0));
  CHECK(a.gravity().isApprox(b.gravity(), 1e-15));
}

}  // namespace

TEST_CASE("robots come back from USD with their bodies, loops, ranges, motors and rotors") {
  int count = 0;
  for (const std::string& name : listRobots()) {
    CAPTURE(name);
    const Model a = loadRobot(name).model;
    if (!isExpressible(a)) continue;
    ++count;
    const AssemblyResult closed = findClosedConfiguration(a);
    const LoadedRobot back = loadUsd(formatUsd(a, closed.q).usda);
    checkSame(a, back.model, closed.q);
  }
  CHECK(count > 5);
}

TEST_CASE("random mechanisms come back from USD with their loops, and what it cannot express is refused by name") {
  int same = 0, refused = 0;
  const std::vector<MechanismKind> kinds = listMechanismKinds();
  for (size_t i = 0; i < kinds.size(); ++i) {
    CAPTURE(kinds[i]);
    std::mt19937 rng(static_cast<unsigned>(i));
    const Mechanism mechanism = makeRandomMechanism(rng, kinds[i].joint, kinds[i].closure, kinds[i].base);
    const Model& a = mechanism.model;
    std::string text;
    const std::string error = getError([&] { text = formatUsd(a, mechanism.q_closed).usda; });
    if (kinds[i].joint == JointKind::Planar || kinds[i].joint == JointKind::FreeFlyer) {
      CHECK(error.find("which UsdPhysics cannot express; write another format") != std::string::npos);
      ++refused;
      continue;
    }
    REQUIRE(error.empty());
    const Model b = loadUsd(text).model;
    const AssemblyResult closed = findClosedConfiguration(b);
    CHECK(closed.status == NumericalStatus::Ok);
    if (kinds[i].closure != ClosureKind::Coupler)
      CHECK(calcMobility(b, closed.q).mobility == calcMobility(a, mechanism.q_closed).mobility);
    if (!isExpressible(a)) continue;
    checkSame(a, b, mechanism.q_closed);
    ++same;
  }
  CHECK((same > 10 && refused > 10));
}

TEST_CASE("a universal joint is two revolute ones in USD, and bodies move alike") {
  const Model a = loadRobot("bipetto").model;
  const AssemblyResult closed = findClosedConfiguration(a);
  const Model b = loadUsd(formatUsd(a, closed.q).usda).model;
  CHECK(b.mass() == Approx(a.mass()).epsilon(1e-9));
  CHECK(b.nv() == a.nv());
  const Joint& joint = a.joints()[a.findJoint("free_knee_left")];
  CHECK(b.findFrame(joint.name + "_cross") >= 0);
  const AssemblyResult back = findClosedConfiguration(b);
  REQUIRE(back.status == NumericalStatus::Ok);
  CHECK(calcMobility(b, back.q).mobility == calcMobility(a, closed.q).mobility);
  Workspace wa(a), wb(b);
  updatePositions(a, wa, closed.q), updatePositions(b, wb, back.q);
  for (int i = 1; i < a.numBodies(); ++i) {
    const Frame& own = a.frames()[a.findFrame(a.bodies()[i].name)];
    const Frame& other = b.frames()[b.findFrame(own.name)];
    const SE3 X_a = getPlacement(wa, own.body, own.X_BF), X_b = getPlacement(wb, other.body, other.X_BF);
    CHECK((X_a.p - X_b.p).norm() < 1e-9);
    CHECK((X_a.R - X_b.R).norm() < 1e-9);
  }
}

TEST_CASE("couplers of two joints, damping, names that USD does not allow, and gravity come back") {
  ModelBuilder builder("two arms");
  const auto add = [&](const std::string& link, const std::string& parent, JointKind kind) {
    Joint joint;
    joint.name = link + ".joint";
    joint.kind = kind;
    joint.X_PJ.p = {0.1, 0, 0.3};
    joint.axis = Vector3d(1, 2, -2) / 3;
    JointLimits limits = {VectorXd::Constant(1, -0.5), VectorXd::Constant(1, 0.25), VectorXd::Constant(1, 3)};
    builder.addLink(link, parent, joint, {2, {0, 0, 0.1}, 0.01 * Matrix3d::Identity()}, limits);
  };
  add("upper-arm", "world", JointKind::Revolute);
  add("2nd arm", "upper-arm", JointKind::Revolute);
  add("slide", "2nd arm", JointKind::Prismatic);
  add("upper_arm", "world", JointKind::Revolute);
  builder.addMotor("upper-arm.joint", 0.02, 30);
  builder.addCoupler("belt", {{"upper-arm.joint", 2}, {"2nd arm.joint", 1}}, 0.1);
  builder.addCoupler("screw", {{"slide.joint", 1}, {"upper_arm.joint", 0.02}}, 0.003);
  builder.addJointForce("2nd arm.joint", {0, 0, 0, 0, 0, 0, 0.3, 0.4, 0.01});
  builder.setGravity({0, 3, -4});
  const Model a = builder.build();
  const UsdText text = formatUsd(a, a.makeNeutral());
  CHECK(text.usda.find("\"PhysxMimicJointAPI:rotY\"") != std::string::npos);
  CHECK(has(text.warnings, "closure 'screw': only Newton reads it"));
  const Model b = loadUsd(text.usda).model;
  CHECK(b.name() == "two_arms");
  REQUIRE(b.nq() == 4);
  for (const char* name : {"upper-arm.joint", "2nd arm.joint", "slide.joint", "upper_arm.joint"}) {
    CAPTURE(name);
    REQUIRE(b.findJoint(name) > 0);
    const int ka = a.joints()[a.findJoint(name)].idx_v, kb = b.joints()[b.findJoint(name)].idx_v;
    CHECK(areSame(a.lowerLimits()[ka], b.lowerLimits()[kb]));
    CHECK(areSame(a.velocityLimits()[ka], b.velocityLimits()[kb]));
    CHECK(a.armature()[ka] == b.armature()[kb]);
  }
  REQUIRE(b.closures().size() == 2);
  for (const Closure& closure : a.closures()) {
    const CouplerTerm &x = closure.terms[0], &y = closure.terms[1];
    const auto find = [&](const CouplerTerm& term) {
      return b.joints()[b.findJoint(a.joints()[term.joint].name)].idx_v;
    };
    bool found = false;
    for (const Closure& other : b.closures()) {
      VectorXd own = VectorXd::Zero(4), back = VectorXd::Zero(4);
      own[find(x)] = x.coefficient, own[find(y)] = y.coefficient;
      for (const CouplerTerm& term : other.terms) back[term.dof] = term.coefficient;
      const double factor = own.dot(back) / back.squaredNorm();
      found =
          found || ((own - factor * back).norm() < 1e-12 && std::abs(closure.offset - factor * other.offset) < 1e-12);
    }
    CHECK(found);
  }
  REQUIRE(b.jointForces().size() == 1);
  CHECK(b.jointForces()[0].damping == Approx(0.3).epsilon(1e-14));
  CHECK(b.jointForces()[0].friction == 0.4);
  CHECK((a.gravity() - b.gravity()).norm() < 1e-15);
  CHECK(b.findFrame("2nd arm") >= 0);
}
