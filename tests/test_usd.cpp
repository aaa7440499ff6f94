// Robots as files of USD: what is written comes back, and what others write is read or refused with a remedy.
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
  CHECK(text.usda.find("\"PhysxMimicJointAPI:rotZ\"") != std::string::npos);
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

namespace {

// A four-bar of bars of 1 m, drawn as a square: ground, two cranks and a coupler, in centimetres with y up, and turned in space by an
// Xform above. Joints turn about z, out of its plane. \param closing  what the last joint has beside its place
std::string makeSquare(const std::string& closing, const std::string& in_layer = "metersPerUnit = 0.01",
                       const std::string& extra = "") {
  const auto body = [](const std::string& name, const std::string& place) {
    return "    def Xform \"" + name +
           "\" (\n        prepend apiSchemas = [\"PhysicsRigidBodyAPI\", \"PhysicsMassAPI\"]\n    )\n    {\n"
           "        float physics:mass = 3\n        float3 physics:diagonalInertia = (1e4, 2e4, 3e4)\n"
           "        point3f physics:centerOfMass = (0, 50, 0)\n        double3 xformOp:translate = " +
           place + "\n        uniform token[] xformOpOrder = [\"xformOp:translate\"]\n    }\n";
  };
  const auto joint = [](const std::string& name, const std::string& body0, const std::string& body1, const char* p0,
                        const char* p1, const std::string& more) {
    return "    def PhysicsRevoluteJoint \"" + name + "\"" + (more[0] == '(' ? " " : "\n    {\n") + more +
           "        uniform token physics:axis = \"Z\"\n" +
           (body0.empty() ? "" : "        rel physics:body0 = </square/" + body0 + ">\n") +
           "        rel physics:body1 = </square/" + body1 + ">\n        point3f physics:localPos0 = " + p0 +
           "\n        point3f physics:localPos1 = " + p1 + "\n    }\n";
  };
  return "#usda 1.0\n(\n    defaultPrim = \"square\"\n    " + in_layer +
         "\n)\n\n# a comment\ndef Xform \"square\"\n{\n    float xformOp:rotateY = 90\n"
         "    uniform token[] xformOpOrder = [\"xformOp:rotateY\"]\n" +
         body("left", "(0, 0, 0)") + body("top", "(0, 100, 0)") + body("right", "(100, 0, 0)") +
         joint(
             "a", "", "left", "(0, 0, 0)", "(0, 0, 0)",
             "(\n        prepend apiSchemas = [\"PhysicsDriveAPI:angular\"]\n    )\n    {\n        float "
             "drive:angular:physics:maxForce = 2e5\n        float physics:lowerLimit = -45\n        float "
             "physics:upperLimit = 90\n        float physxJoint:armature = 100\n        float "
             "physxJoint:maxJointVelocity = 180\n        quatf physics:localRot0 = (0.70710677, 0, 0.70710677, 0)\n") +
         joint("b", "left", "top", "(0, 100, 0)", "(0, 0, 0)", "\n") +
         joint("c", "right", "top", "(0, 100, 0)", "(100, 0, 0)", closing) +
         joint("d", "", "right", "(0, 0, -100)", "(0, 0, 0)",
               "        quatf physics:localRot0 = (0.70710677, 0, 0.70710677, 0)\n") +
         extra + "}\n";
}

}  // namespace

TEST_CASE("units, the vertical, ranges in degrees, drives, transforms above and joints of either direction in USD") {
  for (const bool is_marked : {true, false}) {
    const LoadedRobot robot =
        loadUsd(makeSquare(is_marked ? "        uniform bool physics:excludeFromArticulation = 1\n" : "\n"));
    const Model& model = robot.model;
    CAPTURE(robot.warnings);
    CHECK(has(robot.warnings, "loops: the file does not say which joints close them") == !is_marked);
    CHECK(model.name() == "square");
    CHECK(model.mass() == 9);
    CHECK_FALSE(model.hasFreeFlyer());
    REQUIRE(model.nv() == 3);
    REQUIRE(model.closures().size() == 1);
    CHECK(model.closures()[0].kind == ClosureKind::Hinge5D);
    if (is_marked) CHECK(model.closures()[0].name == "c");
    const AssemblyResult closed = findClosedConfiguration(model);
    REQUIRE(closed.status == NumericalStatus::Ok);
    CHECK(calcMobility(model, closed.q).mobility == 1);
    const Joint& a = model.joints()[model.findJoint("a")];
    CHECK(model.lowerLimits()[a.idx_v] == Approx(-M_PI / 4));
    CHECK(model.upperLimits()[a.idx_v] == Approx(M_PI / 2));
    CHECK(model.velocityLimits()[a.idx_v] == Approx(M_PI));
    CHECK(model.armature()[a.idx_v] == Approx(0.01));  // 100 kg cm^2
    REQUIRE(model.nu() == 1);
    CHECK(model.motors()[0].effort_limit == Approx(20));  // 2e5 kg cm^2/s^2
    // The square stands in the file's plane x = 0, y up: in ours, z up.
    Workspace ws(model);
    updatePositions(model, ws, closed.q);
    const Frame& top = model.frames()[model.findFrame("top")];
    CHECK((getPlacement(ws, top.body, top.X_BF).p - Vector3d(0, 0, 1)).norm() < 1e-7);
    const Inertia& left = model.bodies()[model.frames()[model.findFrame("left")].body].inertia;
    CHECK((left.com - Vector3d(0, 0.5, 0)).norm() < 1e-12);
    CHECK(left.I_com(2, 2) == Approx(3));
  }
  // Two bars turn: the coupler stays level, and the second joint of the coupler, which carries its first body, turns the same way.
  const Model model = loadUsd(makeSquare("        uniform bool physics:excludeFromArticulation = 1\n")).model;
  VectorXd q = findClosedConfiguration(model).q;
  const auto at = [&](const char* name) { return model.joints()[model.findJoint(name)].idx_q; };
  q[at("a")] = q[at("d")] = 0.4, q[at("b")] = -0.4;
  Workspace ws(model);
  updatePositions(model, ws, q);
  CHECK(calcLargestGap(ws, makeConstraintSet(model)) < 1e-7);
}

TEST_CASE(
    "a free body of USD, a ball and a slide; mass by shapes; bodies that are kinematic or have no file of their own") {
  const LoadedRobot robot = loadUsd(R"(#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Z"
)
over "prototype"
{
    def Sphere "ball" (prepend apiSchemas = ["PhysicsCollisionAPI"])
    {
        double radius = 0.1
        rel target = </prototype/ball>
    }
}
def PhysicsScene "scene"
{
    vector3f physics:gravityDirection = (0, 0, -1)
    float physics:gravityMagnitude = 1.62
}
def Xform "hull" (
    prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysicsArticulationRootAPI", "FancyAPI"]
    displayName = "ignored"
)
{
    float physics:density = 500
    matrix4d xformOp:transform = ( (0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (1, 2, 3, 1) )
    uniform token[] xformOpOrder = ["xformOp:transform"]
    custom float unknown:number = 3
    def Cube "box" (
        prepend apiSchemas = ["PhysicsCollisionAPI"]
    )
    {
        double size = 1
        float3 xformOp:scale = (0.4, 0.2, 0.1)
        uniform token[] xformOpOrder = ["xformOp:scale"]
        color3f[] primvars:displayColor = [(1, 0.5, 0)]
    }
    def Mesh "drawn"
    {
        point3f[] points = [(0, 0, 0), (1, 0, 0)]
    }
    def Xform "wheel" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])
    {
        double3 xformOp:translate = (0, 0, 0.5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def "shape" (prepend references = </prototype>) {}
        def Xform "tip" (prepend apiSchemas = ["NewtonSiteAPI"])
        {
            double3 xformOp:translate = (0, 0, 0.1)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
    def PhysicsSphericalJoint "socket"
    {
        rel physics:body0 = <..>
        rel physics:body1 = <../wheel>
        point3f physics:localPos0 = (0, 0, 0.5)
    }
}
def Xform "slider" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
{
    float physics:mass = 2
    float3 physics:diagonalInertia = (1, 1, 1)
    def PhysicsPrismaticJoint "slide"
    {
        uniform token physics:axis = "Y"
        rel physics:body0 = </hull>
        rel physics:body1 = </slider>
        float physics:upperLimit = 4
        float physics:breakForce = 7
    }
}
def Xform "table" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
{
    bool physics:kinematicEnabled = 1
    float physics:mass = 2
    float3 physics:diagonalInertia = (1, 1, 1)
}
)");
  const Model& model = robot.model;
  CAPTURE(robot.warnings);
  CHECK(model.hasFreeFlyer());
  REQUIRE(model.nv() == 6 + 3 + 1);
  CHECK(model.gravity() == Vector3d(0, 0, -1.62));
  CHECK(model.bodies()[1].name == "hull");
  CHECK(model.bodies()[1].inertia.mass == Approx(500 * 0.4 * 0.2 * 0.1));
  CHECK(model.bodies()[1].inertia.I_com(0, 0) == Approx(4.0 / 12 * (0.04 + 0.01)));
  const int wheel = model.frames()[model.findFrame("wheel")].body;
  CHECK(model.bodies()[wheel].inertia.mass == Approx(1000 * 4 * M_PI / 3 * 1e-3));
  CHECK(model.findFrame("tip") >= 0);
  REQUIRE(model.visuals().size() == 2);
  CHECK(model.visuals()[0].rgba == Eigen::Vector4d(1, 0.5, 0, 1));
  CHECK(model.shapes().size() == 2);
  // The hull stands turned by a right angle about z, and so is what its slide needs to be where the file has the slider.
  const Reference& reference = model.references()[0];
  REQUIRE(reference.joints.count("root_joint"));
  CHECK(reference.joints.at("root_joint")[1] == 2);
  CHECK(reference.joints.at("root_joint")[6] == Approx(std::sqrt(0.5)));
  for (const char* warning :
       {"over (line 6)", "schema FancyAPI (line 19)", "Xform unknown:number (line 27)",
        "Mesh (line 37): it is left out", "physics:breakForce (line 63): left out: joints do not break here",
        "kinematic body (line 72): nothing moves it here",
        "joint (line 63): its bodies do not stand where it holds them"})
    CHECK(has(robot.warnings, warning));
}

TEST_CASE("joints of MuJoCo between two bodies act one after the other") {
  const LoadedRobot robot = loadUsd(R"(#usda 1.0
( metersPerUnit = 1; upAxis = "Z" )
def Xform "foot" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
{
    float physics:mass = 2
    float3 physics:diagonalInertia = (1, 1, 1)
    def PhysicsRevoluteJoint "pitch" (prepend apiSchemas = ["MjcJointAPI"])
    {
        uniform token physics:axis = "Y"
        rel physics:body1 = </foot>
        uniform double mjc:damping = 0.5
        uniform double mjc:armature = 0.01
    }
    def PhysicsRevoluteJoint "roll" (prepend apiSchemas = ["MjcJointAPI"])
    {
        uniform token physics:axis = "X"
        rel physics:body1 = </foot>
    }
}
def MjcActuator "drive"
{
    uniform double[] mjc:gear = [20, 0, 0, 0, 0, 0]
    uniform double mjc:ctrlRange:max = 1.5
    rel mjc:target = </foot/roll>
}
)");
  const Model& model = robot.model;
  CAPTURE(robot.warnings);
  REQUIRE(model.nv() == 2);
  CHECK(model.joints()[1].name == "pitch");
  CHECK(model.joints()[2].name == "roll");
  CHECK(model.armature() == Eigen::Vector2d(0.01, 0));
  REQUIRE(model.nu() == 1);
  CHECK(model.motors()[0].name == "roll");
  CHECK(model.motors()[0].effort_limit == 30);
  Workspace ws(model);
  updatePositions(model, ws, Eigen::Vector2d(0.3, 0.2));
  const Matrix3d R = (Eigen::AngleAxisd(0.3, Vector3d::UnitY()) * Eigen::AngleAxisd(0.2, Vector3d::UnitX())).matrix();
  CHECK((getPlacement(ws, 2, SE3()).R - R).norm() < 1e-14);
}

TEST_CASE(
    "linkages that float's digits lock are read as what was rounded; those with all digits are as they are written") {
  // The axis of the joint that closes the loop is tilted by 2e-7 rad in one of its bodies.
  const auto read = [](const std::string& w, const std::string& z) {
    return loadUsd(
        makeSquare("        uniform bool physics:excludeFromArticulation = 1\n        quatf physics:localRot0 = (" + w +
                   ", 1.00000001e-7, 0, " + z + ")\n        quatf physics:localRot1 = (" + w + ", 0, 0, " + z + ")\n"));
  };
  const LoadedRobot floats = read("0.9689124", "0.24740396"),
                    doubles = read("0.9689124217106447", "0.24740395925452294");
  const auto count = [](const Model& model) { return calcMobility(model, findClosedConfiguration(model).q).mobility; };
  CHECK(count(floats.model) == 1);
  CHECK(has(floats.warnings, "as a plane linkage"));
  CHECK_FALSE(has(doubles.warnings, "as a plane linkage"));
}

TEST_CASE("USD files that are no robot are errors with line, prim and remedy") {
  const RobotDirectory directory;
  const auto check = [&](const std::string& text, const std::string& problem, const char* name = "robot.usda") {
    CAPTURE(problem);
    const std::string file = directory.write(name, text);
    const std::string error = getError([&] { loadRobot(file); });
    CAPTURE(error);
    CHECK(error.rfind(file + ": ", 0) == 0);
    CHECK(error.find(problem) != std::string::npos);
    CHECK(error.find("; ") != std::string::npos);
  };
  const std::string head = "#usda 1.0\n(metersPerUnit = 1)\n";
  const std::string body =
      "def Xform \"b\" (prepend apiSchemas = [\"PhysicsRigidBodyAPI\"])\n{\nfloat physics:mass = 1\nfloat3 "
      "physics:diagonalInertia = (1, 1, 1)\n}\n";
  const auto joint = [&](const std::string& type, const std::string& in_joint, const std::string& metadata = "") {
    return head + body + "def " + type + " \"j\" " + metadata + "\n{\nrel physics:body1 = </b>\n" + in_joint + "\n}\n";
  };
  check("PXR-USDC\1\2", "file: it is USD in binary form", "robot.usd");
  check("PK\3\4", "file: it is USD in a package (.usdz)", "robot.usdz");
  check("solid", "line 1: it does not begin with '#usda 1.0'");
  check(head, "document: it has no rigid body");
  check(head + "def Xform \"b\"\n{\n", "line 5: the file ends within a prim");
  check(head + "def Xform \"b\"\n{\nfloat a = (1, 2\n}\n", "closes another bracket");
  check(head + "def Xform \"b\"\n{\nstring a = \"x\n\n}\n", "line 5: a text does not end");
  check(head + "def Xform \"b\" {}\ndef Xform \"b\" {}\n", "line 4: there are two prims 'b' in one place");
  check("#usda 1.0\n(\nsubLayers = [@a.usda@]\n)\n", "subLayers (line 3): other files are parts of it");
  check("#usda 1.0\n(\nmetersPerUnit = 0\n)\n", "metersPerUnit (line 3): it is not a positive number");
  check("#usda 1.0\n(upAxis = \"X\")\n", "upAxis: it is 'X'");
  check(head + "def \"b\" (references = @a.usd@</x>)\n{\n}\n",
        "prim '/b' (line 3): references would bring in prims of another file; let `usdcat");
  check(head + "def \"b\" (inherits = </c>)\n{\n}\n", "prim '/b' (line 3): inherits leads to no prim: </c>");
  check(head + "def \"b\" (inherits = </b>)\n{\n}\n", "inherits leads to itself");
  check(head + "def \"b\"\n{\nvariantSet \"v\" = {\n\"one\" {\n}\n}\n}\n",
        "prim '/b' (line 3): it has variants (line 5)");
  check(joint("PhysicsDistanceJoint", "float physics:maxDistance = 0.3"),
        "prim '/j' (line 8): it is a rope: its physics:minDistance is not its physics:maxDistance, or not positive; "
        "give both");
  check(joint("PhysxPhysicsGearJoint", ""),
        "it is a PhysxPhysicsGearJoint, which is not supported; couple the two joints");
  check(joint("PhysicsRevoluteJoint", "uniform token physics:axis = \"W\""), "its physics:axis is 'W'");
  check(joint("PhysicsRevoluteJoint", "rel physics:body0 = </c>"), "physics:body0 leads to no prim: </c>");
  check(joint("PhysicsRevoluteJoint", "float physics:lowerLimit = 3\nfloat physics:upperLimit = 2"),
        "its range is empty");
  check(joint("PhysicsRevoluteJoint", "point3f physics:localPos0 = (1, 2)"),
        "prim '/j' (line 11): physics:localPos0 is not 3 finite numbers");
  check(joint("PhysicsRevoluteJoint", "point3f physics:localPos0.timeSamples = { 0: (1, 2, 3) }"),
        "physics:localPos0 has no value of its own (.timeSamples)");
  check(head + "def Xform \"b\" (prepend apiSchemas = [\"PhysicsRigidBodyAPI\"])\n{\nfloat physics:mass = 1\n}\n",
        "it has a mass, but no moments of inertia and no shapes");
  check(head +
            "def Xform \"b\" (prepend apiSchemas = [\"PhysicsRigidBodyAPI\"])\n{\ndef Mesh \"m\" (prepend apiSchemas = "
            "[\"PhysicsCollisionAPI\"]) {}\n}\n",
        "prim '/b/m' (line 5): the mass of body 'b' is to be computed from it, a Mesh; give physics:mass");
  check(head + "def Xform \"b\"\n{\nfloat xformOp:shear = 1\nuniform token[] xformOpOrder = [\"xformOp:shear\"]\n}\n",
        "its xformOpOrder has the unknown operation 'xformOp:shear'");
  std::string locked, schemas;
  for (const char* axis : {"transX", "transY", "transZ", "rotX"}) {
    locked += std::string("float limit:") + axis + ":physics:low = 1\nfloat limit:" + axis + ":physics:high = -1\n";
    schemas += std::string("\"PhysicsLimitAPI:") + axis + "\", ";
  }
  check(joint("PhysicsJoint", locked, "(prepend apiSchemas = [" + schemas + "])"),
        "it leaves rotY, rotZ free: such a joint is not supported; put a chain");
  std::string deep = head;
  for (int i = 0; i < 100; ++i) deep += "def \"p\" {\n";
  check(deep, "prims nest more than 64 deep");
}
