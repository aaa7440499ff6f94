// Robots as files of USD: what is written comes back, and what others write is read or refused with a remedy.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
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
    for (const std::string& warning : back.warnings) WARN(name << ": " << warning);
    checkSame(a, back.model, closed.q);
  }
  CHECK(count > 5);
}
