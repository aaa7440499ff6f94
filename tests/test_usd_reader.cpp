// What files of USD of others say: units, joints of every kind, loops, MuJoCo's and Newton's words, and what is refused with a remedy.
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "get_error.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

LoadedRobot loadUsdText(const std::string& text) {
  const RobotDirectory directory;
  return loadRobot(directory.write("robot.usda", text));
}

bool tellsUsd(const std::vector<std::string>& warnings, const std::string& text) {
  for (const std::string& warning : warnings)
    if (warning.find(text) != std::string::npos) return true;
  return false;
}

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
        loadUsdText(makeSquare(is_marked ? "        uniform bool physics:excludeFromArticulation = 1\n" : "\n"));
    const Model& model = robot.model;
    CAPTURE(robot.warnings);
    CHECK(tellsUsd(robot.warnings, "loops: the file does not say which joints close them") == !is_marked);
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
  const Model model = loadUsdText(makeSquare("        uniform bool physics:excludeFromArticulation = 1\n")).model;
  VectorXd q = findClosedConfiguration(model).q;
  const auto at = [&](const char* name) { return model.joints()[model.findJoint(name)].idx_q; };
  q[at("a")] = q[at("d")] = 0.4, q[at("b")] = -0.4;
  Workspace ws(model);
  updatePositions(model, ws, q);
  CHECK(calcLargestGap(ws, makeConstraintSet(model)) < 1e-7);
}

TEST_CASE(
    "a free body of USD, a ball and a slide; mass by shapes; bodies that are kinematic or have no file of their own") {
  const LoadedRobot robot = loadUsdText(R"(#usda 1.0
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
    CHECK(tellsUsd(robot.warnings, warning));
}

TEST_CASE(
    "joints of six coordinates are chains of those that their limits leave free, where the bodies of the file stand") {
  // Coordinates in the order of the chain: slides, then turns about x, y and z. Turns of two axes do not commute.
  struct Case {
    std::vector<std::string> free;
    std::vector<double> q;  // m, rad
  };
  for (const Case& c :
       {Case{{"rotX", "rotY"}, {0.3, -0.2}}, Case{{"rotX", "rotZ"}, {-0.4, 0.7}}, Case{{"rotY", "rotZ"}, {0.5, 0.6}},
        Case{{"transX", "rotX"}, {0.1, 0.3}}, Case{{"transY", "transZ", "rotX", "rotZ"}, {0.1, -0.2, 0.3, 0.4}},
        Case{{"rotX", "rotY", "rotZ"}, {0.5, -0.4, 0.9}}, Case{{"transX", "transY", "transZ"}, {0.1, -0.2, 0.3}}}) {
    CAPTURE(c.free);
    SE3 X;
    std::string schemas, limits;
    for (const char* name : {"transX", "transY", "transZ", "rotX", "rotY", "rotZ"}) {
      const std::string axis = name;
      const auto found = std::find(c.free.begin(), c.free.end(), axis);
      const bool is_turn = axis[0] == 'r';
      schemas += "\"PhysicsLimitAPI:" + axis + "\", ";
      limits += "float limit:" + axis + ":physics:low = " +
                (found == c.free.end() ? "1"
                 : is_turn             ? "-90"
                                       : "-1") +
                "\nfloat limit:" + axis + ":physics:high = " +
                (found == c.free.end() ? "-1"
                 : is_turn             ? "180"
                                       : "2") +
                "\n";
      if (found == c.free.end()) continue;
      const double q = c.q[static_cast<size_t>(found - c.free.begin())];
      const Vector3d direction = Vector3d::Unit(axis.back() - 'X');
      if (is_turn)
        X.R = X.R * Eigen::AngleAxisd(q, direction).matrix();
      else
        X.p += q * direction;
    }
    const Eigen::Quaterniond turn(X.R);
    std::ostringstream text;
    text.precision(17);
    text << "#usda 1.0\n(metersPerUnit = 1\nupAxis = \"Z\")\ndef Xform \"b\" (prepend apiSchemas = "
            "[\"PhysicsRigidBodyAPI\"])\n{\n"
         << "float physics:mass = 1\nfloat3 physics:diagonalInertia = (1, 1, 1)\ndouble3 xformOp:translate = ("
         << X.p.x() << ", " << X.p.y() << ", " << X.p.z() << ")\nquatd xformOp:orient = (" << turn.w() << ", "
         << turn.x() << ", " << turn.y() << ", " << turn.z()
         << ")\nuniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]\n}\n"
         << "def PhysicsJoint \"j\" (prepend apiSchemas = [" << schemas << "\"PhysicsDriveAPI:" << c.free[1]
         << "\"])\n{\nrel physics:body1 = </b>\nfloat drive:" << c.free[1] << ":physics:maxForce = 7\n"
         << limits << "}\n";
    const LoadedRobot robot = loadUsdText(text.str());
    const Model& model = robot.model;
    CHECK(tellsUsd(robot.warnings, "it is read as a chain of joints"));
    REQUIRE(model.nv() == static_cast<int>(c.free.size()));
    const AssemblyResult initial = assembleReference(model, "initial");
    REQUIRE(initial.status == NumericalStatus::Ok);
    Workspace ws(model);
    updatePositions(model, ws, initial.q);
    const Frame& b = model.frames()[static_cast<size_t>(model.findFrame("b"))];
    const SE3 there = getPlacement(ws, b.body, b.X_BF);
    CHECK((there.R - X.R).norm() + (there.p - X.p).norm() < 1e-12);
    for (size_t i = 0; i < c.free.size(); ++i) {
      const int j = model.findJoint("j_" + c.free[i]);
      REQUIRE(j > 0);
      const Joint& joint = model.joints()[static_cast<size_t>(j)];
      CHECK(initial.q[joint.idx_q] == Approx(c.q[i]).epsilon(1e-12));
      CHECK(model.lowerLimits()[joint.idx_v] == Approx(c.free[i][0] == 'r' ? -M_PI / 2 : -1));
      CHECK(model.upperLimits()[joint.idx_v] == Approx(c.free[i][0] == 'r' ? M_PI : 2));
    }
    REQUIRE(model.nu() == 1);
    CHECK(model.motors()[0].name == "j_" + c.free[1]);
    CHECK(model.motors()[0].effort_limit == 7);
  }
}

TEST_CASE("joints of MuJoCo between two bodies act one after the other") {
  const LoadedRobot robot = loadUsdText(R"(#usda 1.0
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
    return loadUsdText(
        makeSquare("        uniform bool physics:excludeFromArticulation = 1\n        quatf physics:localRot0 = (" + w +
                   ", 1.00000001e-7, 0, " + z + ")\n        quatf physics:localRot1 = (" + w + ", 0, 0, " + z + ")\n"));
  };
  const LoadedRobot floats = read("0.9689124", "0.24740396"),
                    doubles = read("0.9689124217106447", "0.24740395925452294");
  const auto count = [](const Model& model) { return calcMobility(model, findClosedConfiguration(model).q).mobility; };
  CHECK(count(floats.model) == 1);
  CHECK(tellsUsd(floats.warnings, "as a plane linkage"));
  CHECK_FALSE(tellsUsd(doubles.warnings, "as a plane linkage"));
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
  check(head + "class \"b\" (inherits = </c>) {}\nclass \"c\" (inherits = </b>) {}\ndef \"d\" (inherits = </b>) {}\n",
        "document: it has no rigid body");  // at once: each class is taken over once
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
  check(head + "def Xform \"b\"\n{\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n",
        "prim '/b' (line 5): xformOpOrder has 'xformOp:translate', which the prim does not have; give it");
  std::string locked, schemas;
  for (const char* axis : {"transX", "transY", "transZ", "rotX"}) {
    locked += std::string("float limit:") + axis + ":physics:low = 1\nfloat limit:" + axis + ":physics:high = -1\n";
    schemas += std::string("\"PhysicsLimitAPI:") + axis + "\", ";
  }
  check(joint("PhysicsJoint", locked + "uniform bool physics:excludeFromArticulation = 1\n",
              "(prepend apiSchemas = [" + schemas + "])"),
        "it closes a loop, but leaves rotY, rotZ free: no such closure is supported; let another joint");
  std::string deep = head;
  for (int i = 0; i < 100; ++i) deep += "def \"p\" {\n";
  check(deep, "prims nest more than 64 deep");
}
