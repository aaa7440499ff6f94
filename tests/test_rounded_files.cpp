// Files whose linkages move only because of numbers that are rounded: in every format, told once, and written so that they come back.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/robot_loader.h"
#include "formats/decimals.h"
#include "get_error.h"
#include "math/constants.h"
#include "math/settled.h"
#include "model/number_text.h"
#include "robot_directory.h"
#include "rounded_families.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// A four-bar whose crank is turned by `right`, a right angle about x, and whose rocker's pin by the same; `gap` across its plane.
std::string makeUrdf(const std::string& right, const std::string& gap = "0") {
  const auto link = [](const std::string& name) {
    return "<link name=\"" + name +
           "\"><inertial><mass value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" "
           "iyz=\"0\"/></inertial></link>\n";
  };
  const auto joint = [](const std::string& name, const std::string& type, const std::string& parent,
                        const std::string& xyz, const std::string& rpy, const std::string& axis) {
    return "<joint name=\"" + name + "_joint\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" +
           name + "\"/><origin xyz=\"" + xyz + "\" rpy=\"" + rpy + "\"/><axis xyz=\"" + axis + "\"/></joint>\n";
  };
  return "<robot name=\"fourbar\"><link name=\"world\"/>\n" + link("crank") + link("rod") + link("rocker") +
         "<link name=\"rod_end\"/><link name=\"pin\"/>\n" +
         joint("crank", "continuous", "world", "0 0 0.5", right + " 0 0", "0 0 1") +
         joint("rod", "continuous", "crank", "0.1 0.1 0", "0 0 0", "0 0 1") +
         joint("rocker", "continuous", "world", "0.5 0 0.5", "0 0 0", "0 -1 0") +
         joint("rod_end", "fixed", "rod", "0.35 0.1 0", "0 0 0", "1 0 0") +
         joint("pin", "fixed", "rocker", "-0.05 " + gap + " 0.2", right + " 0 0", "1 0 0") + "</robot>\n";
}

std::string makeYaml(const std::string& type, const std::string& more = "") {
  return "base: fixed\nmotors: {crank_joint: {armature: 0.001}}\nclosures: [{name: pin, frames: [rod_end, pin], "
         "type: " +
         type + "}]\n" + more;
}

int countWarnings(const LoadedRobot& robot, const std::string& text) {
  int count = 0;
  for (const std::string& warning : robot.warnings) count += warning.find(text) != std::string::npos;
  return count;
}

// It turns by a radian, closed.
void checkTurns(const Model& model) {
  AssemblyProblem problem;
  problem.q_ref = model.makeNeutral();
  problem.weights = VectorXd::Constant(model.nv(), 1e-4);
  problem.weights[0] = 1;
  for (double angle : {0.2, 0.4, 0.6}) {
    problem.q_ref[0] = -angle;
    const AssemblyResult turned = assemble(model, problem);
    REQUIRE(turned.status == NumericalStatus::Ok);
    CHECK(turned.q[0] == Approx(-angle).margin(1e-9));
    problem.q_ref = turned.q;
  }
}

double calcHalfUnit(const std::string& numbers, Decimals::Kind kind = Decimals::Kind::Lengths) {
  Decimals decimals(kind);
  decimals.add(numbers);
  return decimals.calcHalfUnit();
}

// MuJoCo's: bodies in the frames of their hinges, and two points, a lever apart, for each hinge that closes a loop: anchors, or sites
// of both bodies, which are rounded on each. \param more  elements
std::string makeMjcf(const HingeNet& net, int decimals, double lever, bool with_sites = false,
                     const std::string& more = "") {
  const auto write = [decimals](const auto& numbers) {
    std::string text;
    for (const double x : numbers) text += formatNumber(x, ("%." + std::to_string(decimals) + "f").c_str()) + " ";
    return text;
  };
  std::vector<SE3> X_WB(net.bodies);
  std::vector<std::string> bodies(net.bodies), sites(net.bodies);
  std::vector<int> parents(net.bodies, -1);
  parents[0] = 0;
  std::string closures;
  for (size_t k = 0; k < net.hinges.size(); ++k) {
    const auto& [body1, body2, X_W] = net.hinges[k];
    const auto name = [](int body) { return body == 0 ? "world" : "body" + std::to_string(body); };
    if (parents[body2] < 0) {
      parents[body2] = body1;
      X_WB[body2] = X_W;
      const SE3 X = X_WB[body1].inverse() * X_W;
      const Eigen::Quaterniond q(X.R);
      bodies[body2] = "<body name=\"" + name(body2) + "\" pos=\"" + write(X.p) + "\" quat=\"" +
                      write(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())) + "\"><joint name=\"hinge" +
                      std::to_string(k + 1) + "\"/><geom size=\"0.02\"/>";
      continue;
    }
    for (const double side : {-0.5, 0.5}) {
      const Vector3d point = X_W.act({0, 0, side * lever});
      const std::string site = "site" + std::to_string(k) + (side < 0 ? "a" : "b");
      for (const auto& [body, end] : {std::pair(body1, "1"), {body2, "2"}})
        sites[body] += "<site name=\"" + site + end + "\" pos=\"" + write(X_WB[body].inverse().act(point)) + "\"/>";
      if (with_sites) {
        closures += "<connect site1=\"" + site + "1\" site2=\"" + site + "2\"/>";
        continue;
      }
      closures += "<connect body1=\"" + name(body2) + "\" body2=\"" + name(body1) + "\" anchor=\"" +
                  write(X_WB[body2].inverse().act(point)) + "\"/>";
    }
  }
  const std::function<std::string(int)> writeChildren = [&](int parent) {
    std::string text = sites[parent];
    for (int body = 1; body < net.bodies; ++body)
      if (parents[body] == parent) text += bodies[body] + writeChildren(body) + "</body>";
    return text;
  };
  return "<mujoco><compiler angle=\"radian\"/><worldbody>" + writeChildren(0) + "</worldbody><equality>" + closures +
         "</equality>" + more + "</mujoco>";
}

}  // namespace

TEST_CASE("how far numbers may be off, from how they are written") {
  CHECK(calcHalfUnit("") == 0);
  CHECK(calcHalfUnit("0 0.0") == 0);
  CHECK(calcHalfUnit("0 0.1 -0.25") == Approx(5e-3));
  CHECK(calcHalfUnit("1.570796 0.000001") == Approx(5e-7));  // %.6f
  CHECK(calcHalfUnit("12.345678 1e-6") == Approx(5e-7));
  CHECK(calcHalfUnit("1.5708 0.0123457 -0.349066") == Approx(5e-6));  // %.6g
  CHECK(calcHalfUnit("1.5707963267948966 0.1") < 1e-15);              // a double
  // A rounded constant beside exact numbers.
  for (const char* constant : {"1.5708", "-0.7854", "3.1416", "0.7071", "-0.8660", "5.2360"})
    CHECK(calcHalfUnit(constant + std::string(" 3.141592653589793"), Decimals::Kind::Angles) == Approx(5e-5));
  for (const char* other : {"1.5707963267948966", "0.70710678118654757", "0.5", "1.57", "1.5709", "0.0001"})
    CHECK(calcHalfUnit(other + std::string(" 3.141592653589793"), Decimals::Kind::Angles) < 1e-14);
  CHECK(calcHalfUnit("1.5708 3.141592653589793") < 1e-14);
  // In degrees beside directions; but few digits are those of exact numbers.
  for (const auto& [degrees, half] :
       {std::pair("30.12 -45", 0.005 * kDegree), {"30.125 90", 0.0005 * kDegree}, {"30 90", 0.0}}) {
    Decimals decimals(Decimals::Kind::Angles);
    decimals.add(degrees, kDegree);
    decimals.add("0.267261241912424 0.963624111659432");
    CHECK(decimals.calcHalfUnit() == Approx(half).margin(1e-14));
    CHECK(decimals.most_digits() == 15);
  }
  CHECK(calcHalfUnit("1.57079637050628662 0.100000001490116119 0.5") == Approx(1.57 * std::pow(2, -24)).epsilon(0.01));
}

TEST_CASE(
    "a four-bar with right angles of five digits is the plane one, told once, and comes back from what is written") {
  for (const char* type : {"5d", "3d"}) {
    const RobotDirectory directory;
    directory.write("robot.urdf", makeUrdf("1.5708"));
    directory.write("robot.yaml", makeYaml(type));
    const LoadedRobot robot = loadRobot(directory.path());
    CHECK(countWarnings(robot,
                        "loops: read closure 'pin' as a plane linkage: axes of crank_joint, rod_joint, rocker_joint "
                        "made parallel (largest change ") == 1);
    CHECK(countWarnings(robot, directory.path() + "/robot.urdf: ") == static_cast<int>(robot.warnings.size()));
    checkTurns(robot.model);

    const RobotDirectory again;
    writeRobot(robot.model, again.path() + "/written");
    const LoadedRobot read = loadRobot(again.path() + "/written");
    CHECK(countWarnings(read, "rounded") == 0);
    for (int i = 1; i < robot.model.numBodies(); ++i) {
      const SE3 &X = robot.model.joints()[i].X_PJ, &X_read = read.model.joints()[i].X_PJ;
      CHECK((X.p - X_read.p).norm() == 0);
      CHECK((X.R - X_read.R).norm() < kSettled);
    }
    checkTurns(read.model);
  }
}

TEST_CASE("frames of pins that rounding turns out of the plane have no rows of next to nothing") {
  constexpr double kNothing = 1e-14, kSomething = 1e-3;
  const RobotDirectory directory;
  std::string urdf = replaceOnce(makeUrdf("1.5708"), "xyz=\"0.35 0.1 0\" rpy=\"0 0 0\"",
                                 "xyz=\"0.35 0.1 0\" rpy=\"-0.00002 -0.00001 0\"");
  urdf = replaceOnce(urdf, "xyz=\"-0.05 0 0.2\" rpy=\"1.5708 0 0\"", "xyz=\"-0.05 0 0.2\" rpy=\"1.57078 0 -0.00001\"");
  directory.write("robot.urdf", urdf);
  for (const char* type : {"3d", "5d, axis: [0.00001, -0.00002, 1]"}) {
    CAPTURE(type);
    directory.write("robot.yaml", makeYaml(type));
    const LoadedRobot robot = loadRobot(directory.path());
    const Model& model = robot.model;
    CHECK(countWarnings(robot, "as a plane linkage") == 1);
    const Closure& pin = model.closures()[0];
    MatrixXd J = MatrixXd::Zero(getRows(pin.kind), model.nv());
    Workspace ws(model);
    updatePositions(model, ws, closeConfiguration(model, VectorXd::Constant(3, 0.1)).q);
    calcClosureJacobian(ws, pin, J);
    for (Eigen::Index i = 0; i < J.rows(); ++i) CHECK((J.row(i).norm() < kNothing || J.row(i).norm() > kSomething));
    checkTurns(model);

    const RobotDirectory again;
    writeRobot(model, again.path() + "/written");
    const Closure read = loadRobot(again.path() + "/written").model.closures()[0];
    CHECK((read.axis - pin.axis).norm() == 0);
    CHECK((read.X_B1.R - pin.X_B1.R).norm() < kSettled);
  }
}

TEST_CASE("a linkage is as it is written with all digits, or where rounding is 0") {
  const RobotDirectory directory;
  directory.write("robot.yaml", makeYaml("3d"));
  directory.write("robot.urdf", makeUrdf("1.5707963267948966"));
  CHECK(countWarnings(loadRobot(directory.path()), "rounded") == 0);
  directory.write("robot.yaml", makeYaml("3d", "rounding: 0\n"));
  directory.write("robot.urdf", makeUrdf("1.5708"));
  const LoadedRobot locked = loadRobot(directory.path());
  CHECK(countWarnings(locked, "loops: read") == 0);
  CHECK(countWarnings(locked, "mobility 0 is less than the 1 motor in its loops (crank_joint)") == 1);
  // Too many motors are those of the file that names them.
  directory.write("robot.yaml", makeYaml("3d"));
  directory.write("robot.urdf", makeUrdf("1.5707963267948966"));
  const LoadedRobot driven =
      loadRobot(directory.write("driven.yaml", "model: ./robot.urdf\nmotors: {crank_joint: {}, rod_joint: {}}\n"));
  CHECK(countWarnings(driven, directory.path() + "/driven.yaml: closure ") == 1);
  directory.write("robot.yaml", makeYaml("3d", "rounding: 1\n"));
  CHECK_THAT(getError([&] { loadRobot(directory.path()); }),
             Catch::Contains("rounding") && Catch::Contains("0 .. 3e-3"));
}

TEST_CASE("a right angle of five digits beside angles that have all of theirs") {
  const RobotDirectory directory;
  directory.write("robot.urdf", replaceOnce(makeUrdf("1.5708"), "xyz=\"0.1 0.1 0\" rpy=\"0 0 0\"",
                                            "xyz=\"0.1 0.1 0\" rpy=\"0 0 6.283185307179586\""));
  for (const char* type : {"3d", "5d"}) {
    directory.write("robot.yaml", makeYaml(type));
    const LoadedRobot robot = loadRobot(directory.path());
    CHECK(countWarnings(robot, "as a plane linkage") == 1);
    checkTurns(robot.model);
  }
}

TEST_CASE("a gap across the plane, however small, is none") {
  for (const char* gap : {"1e-7", "1e-9", "2e-12"}) {
    CAPTURE(gap);
    const RobotDirectory directory;
    directory.write("robot.urdf", makeUrdf("1.5707963267948966", gap));
    directory.write("robot.yaml", makeYaml("5d", "rounding: 1e-7\n"));
    const LoadedRobot robot = loadRobot(directory.path());
    CHECK(countWarnings(robot, "as a plane linkage") == 1);
    checkTurns(robot.model);
  }
}

TEST_CASE("axes that are farther from parallel than rounding are told, with what would do") {
  const RobotDirectory directory;
  std::string urdf = makeUrdf("1.5708");
  urdf = replaceOnce(urdf, "xyz=\"0.1 0.1 0\" rpy=\"0 0 0\"", "xyz=\"0.1 0.1 0\" rpy=\"0.0008 0 0\"");
  directory.write("robot.urdf", urdf);
  directory.write("robot.yaml", makeYaml("3d"));
  const LoadedRobot robot = loadRobot(directory.path());
  CHECK(countWarnings(robot, "rad from parallel, more than its numbers are rounded") == 1);
  CHECK(countWarnings(robot, "joint 'rod_joint'") == 1);
  CHECK(countWarnings(robot, "mobility would be 1") == 1);
}

TEST_CASE(
    "MuJoCo's quaternions of six decimals, its sites beside the plane, and degrees beside directions with all digits") {
  const auto load = [](const std::string& turn, const std::string& place, const std::string& more = "") {
    const RobotDirectory directory;
    return loadRobot(directory.write("fourbar.xml", R"(<mujoco>
<default><geom type="capsule" size="0.012" density="900"/><joint axis="0 1 0"/></default>
<worldbody>
<body name="crank" pos="0 0 0.5"><joint name="crank"/><geom fromto="0 0 0 0.1 0 0.1"/>
<body name="rod" pos="0.1 0 0.1"><joint name="rod"/><geom fromto="0 0 0 0.35 0 0.1"/><site name="a" pos=")" +
                                                        place + "\"/>" + more + R"(</body></body>
<body name="rocker" pos="0.5 0 0.5" )" + turn + R"(><geom fromto="0 0 0 -0.05 0.2 0"/>
<joint name="rocker" axis="0 0 1"/><site name="b" pos="-0.05 0.2 0"/></body>
</worldbody>
<equality><connect site1="a" site2="b"/></equality><actuator><motor joint="crank"/></actuator></mujoco>)"));
  };
  const std::string turned_site = "<site quat=\"0.923879532511287 0 0.38268343236509 0\"/>";
  for (const char* turn : {R"(euler="89.9999 0 0")", R"(axisangle="1 0 0 89.9999")"}) {
    const LoadedRobot robot = load(turn, "0.35 0 0.1", turned_site);
    CHECK(countWarnings(robot, "as a plane linkage: axes of crank, rod, rocker made parallel") == 1);
    checkTurns(robot.model);
  }
  CHECK(countWarnings(load(R"(euler="89.99990000000000 0 0")", "0.35 0 0.1"), "more than its numbers are rounded") ==
        1);
  for (const auto& [turn, place] : {std::pair("quat=\"0.707107 0.707105 0 0\"", "0.35 0 0.1"),
                                    {"quat=\"0.707107 0.707107 0 0\"", "0.35 0.000001 0.1"}}) {
    const LoadedRobot robot = load(turn, place);
    CHECK(countWarnings(robot, "as a plane linkage: axes of crank, rod, rocker made parallel") == 1);
    checkTurns(robot.model);
  }
}

TEST_CASE("hinges whose axes run through two points that are near to each other") {
  std::mt19937 rng(7);
  for (const Family family : kFamilies)
    for (const int decimals : {5, 6, 8, 9}) {
      const double lever = std::uniform_real_distribution<double>(0.01, 0.04)(rng);
      CAPTURE(getName(family), decimals, lever);
      const RobotDirectory directory;
      const LoadedRobot robot =
          loadRobot(directory.write("net.xml", makeMjcf(makeHingeNet(family, rng), decimals, lever)));
      // Points that are one above another in a plane of the axes stay so.
      const bool is_across = family == Family::Spherical || family == Family::Bennett || family == Family::PlaneInSpace;
      CHECK(countWarnings(robot, "its numbers are rounded") == is_across);
      AssemblyProblem problem;
      problem.q_ref = robot.model.makeNeutral();
      problem.q_ref[0] = 0.05;
      problem.weights = VectorXd::Constant(robot.model.nv(), 1e-4);
      problem.weights[0] = 1;
      const AssemblyResult turned = assemble(robot.model, problem);
      CHECK(turned.status == NumericalStatus::Ok);
      CHECK(turned.q[0] == Approx(0.05).epsilon(0.1));
    }
}

TEST_CASE("two points on each of two bodies are a hinge, though their distances are rounded") {
  std::mt19937 rng(11);
  for (const int decimals : {5, 6, 9}) {
    CAPTURE(decimals);
    const RobotDirectory directory;
    const std::string motors = R"(<actuator><motor joint="hinge1"/><motor joint="hinge2"/></actuator>)";
    const LoadedRobot robot = loadRobot(
        directory.write("net.xml", makeMjcf(makeHingeNet(Family::Spherical, rng), decimals, 0.03, true, motors)));
    REQUIRE(robot.model.closures().size() == 1);
    CHECK(robot.model.closures()[0].kind == ClosureKind::Hinge5D);
    // It moves with one freedom, of which the second motor is told.
    CHECK(countWarnings(robot, "as a spherical linkage") == 1);
    CHECK(countWarnings(robot,
                        "mobility 1 is less than the 2 motors in its loops (hinge1, hinge2): they work against") == 1);
    CHECK(countWarnings(robot, "more than its numbers are rounded") == 0);
  }
}

TEST_CASE("loops that lengths lock are not said to have axes that do") {
  const RobotDirectory directory;
  // Two levers that two rods join, of which one is not turned as far as the other.
  const auto write = [](double x, double z) { return formatNumber(x, "%.17g") + " 0 " + formatNumber(z, "%.17g"); };
  const auto begin = [&](const std::string& name, double x, double z) {
    return "<body name=\"" + name + "\" pos=\"" + write(x, z) + "\"><joint name=\"" + name +
           "\" axis=\"0 1 0\"/><geom size=\"0.02\"/>";
  };
  constexpr double kRadius = 0.05, kApart = 0.3, kTurned = 1.2, kOther = 1.201;
  std::string levers = begin("a", 0, 0), closures;
  for (const double side : {1.0, -1.0}) {
    const double x = side * kRadius * std::cos(kTurned), z = side * kRadius * std::sin(kTurned);
    const double x2 = kApart + side * kRadius * std::cos(kOther), z2 = side * kRadius * std::sin(kOther);
    const std::string rod = side > 0 ? "front" : "back";
    levers += begin(rod, x, z) + "</body>";
    closures += "<connect body1=\"" + rod + "\" body2=\"b\" anchor=\"" + write(x2 - x, z2 - z) + "\"/>";
  }
  levers += "</body>" + begin("b", kApart, 0) + "</body>";
  const LoadedRobot robot =
      loadRobot(directory.write("levers.xml", "<mujoco><worldbody>" + levers + "</worldbody><equality>" + closures +
                                                  "</equality><actuator><motor joint=\"a\"/></actuator></mujoco>"));
  CHECK(countWarnings(robot,
                      "mobility 0 is less than the 1 motor in its loops (a): placements of a, front, back, b do") == 1);
  const nlohmann::json mobility = nlohmann::json::parse(makeRobotInfo(robot))["mobility"];
  CHECK(mobility["mobility"] == 0);
  CHECK(mobility["locked"] == 1);
  CHECK(mobility["rank"] == robot.model.nv());
  // What the warning says to give if it was meant to move.
  const std::string told = *std::find_if(robot.warnings.begin(), robot.warnings.end(), [](const std::string& warning) {
    return warning.find("`rounding: ") != std::string::npos;
  });
  const size_t begin_of = told.find("`rounding: ") + 1;
  directory.write("meant.yaml",
                  "model: levers.xml\n" + told.substr(begin_of, told.find('`', begin_of) - begin_of) + "\n");
  const LoadedRobot meant = loadRobot(directory.path() + "/meant.yaml");
  CHECK(countWarnings(meant, "as a plane linkage") + countWarnings(meant, "as a linkage of mobility 1") == 1);
  CHECK(nlohmann::json::parse(makeRobotInfo(meant))["mobility"]["mobility"] == 1);
}

TEST_CASE("a linkage without motors that is locked by rounding is told, too") {
  const RobotDirectory directory;
  std::mt19937 rng(3);
  directory.write("net.xml", makeMjcf(makeHingeNet(Family::PlaneInSpace, rng), 7, 0.02));
  const LoadedRobot robot = loadRobot(directory.write("net.yaml", "model: net.xml\nrounding: 1e-9\n"));
  CHECK(countWarnings(robot, "it is locked as it is written: axes of ") == 1);
}

TEST_CASE("what does not move at all is described like others") {
  const RobotDirectory directory;
  const LoadedRobot robot = loadRobot(directory.write(
      "truss.xml",
      "<mujoco><worldbody><body name=\"a\"><joint axis=\"0 1 0\"/><geom size=\".1\"/></body><body name=\"b\" "
      "pos=\"1 0 0\"><joint axis=\"0 1 0\"/><geom size=\".1\"/></body></worldbody><equality><connect body1=\"a\" "
      "body2=\"b\" anchor=\".5 0 .3\"/></equality></mujoco>"));
  const nlohmann::json info = nlohmann::json::parse(makeRobotInfo(robot));
  CHECK(info["mobility"]["mobility"] == 0);
  CHECK(info["mobility"]["rank"] == 2);
  CHECK(info.at("dead_points").empty());
}

TEST_CASE("left and right linkages that are mirror images stay so") {
  const SE3 mirror(Matrix3d(Vector3d(1, -1, 1).asDiagonal()), Vector3d::Zero());
  std::mt19937 rng(5);
  for (const Family family : {Family::PlaneInSpace, Family::Spherical}) {
    HingeNet net = makeHingeNet(family, rng);
    const int links = net.bodies - 1, hinges = static_cast<int>(net.hinges.size());
    for (int k = 0; k < hinges; ++k) {
      HingeNet::Hinge right = net.hinges[k];
      for (int* body : {&right.body1, &right.body2}) *body += *body > 0 ? links : 0;
      right.X_W = mirror * right.X_W * mirror;
      net.hinges.push_back(right);
    }
    net.bodies += links;
    for (const int decimals : {5, 8}) {
      CAPTURE(getName(family), decimals);
      const RobotDirectory directory;
      const LoadedRobot robot = loadRobot(directory.write("net.xml", makeMjcf(net, decimals, 0.02)));
      CHECK(countWarnings(robot, "its numbers are rounded") == 1);
      REQUIRE(robot.model.closures().size() == 2);
      const auto check = [&](const SE3& left, const SE3& right) {
        const SE3 image = mirror * left * mirror;
        CHECK(image.R.isApprox(right.R, 1e-14));
        CHECK((image.p - right.p).norm() < 1e-14);
      };
      const Closure &left = robot.model.closures()[0], &right = robot.model.closures()[1];
      check(left.X_B1, right.X_B1);
      check(left.X_B2, right.X_B2);
      for (int k = 1; k < hinges; ++k) {
        const auto place = [&](int number) {
          return robot.model.joints()[robot.model.findJoint("hinge" + std::to_string(number))].X_PJ;
        };
        check(place(k), place(hinges + k));
      }
    }
  }
}

TEST_CASE("linkages of three and four decimals move, or are told with the rounding with which they do") {
  // Whether the first joint turns, and the others with it.
  const auto moves = [](const Model& model) {
    AssemblyProblem problem;
    problem.q_ref = model.makeNeutral();
    problem.q_ref[0] = 0.05;
    problem.weights = VectorXd::Constant(model.nv(), 1e-4);
    problem.weights[0] = 1;
    const AssemblyResult turned = assemble(model, problem);
    return turned.status == NumericalStatus::Ok && std::abs(turned.q[0] - 0.05) < 0.005;
  };
  std::mt19937 rng(13);
  int told = 0;
  for (const Family family : kFamilies)
    for (const int decimals : {3, 4, 3, 4}) {
      const RobotDirectory directory;
      const std::string more = R"(<actuator><motor joint="hinge1"/></actuator>)";
      const LoadedRobot robot =
          loadRobot(directory.write("net.xml", makeMjcf(makeHingeNet(family, rng), decimals, 0.1, false, more)));
      if (moves(robot.model)) continue;
      ++told;
      const auto warning = std::find_if(robot.warnings.begin(), robot.warnings.end(), [](const std::string& text) {
        return text.find("`rounding: ") != std::string::npos;
      });
      CAPTURE(getName(family), decimals, robot.warnings);
      REQUIRE(warning != robot.warnings.end());
      const size_t begin = warning->find("`rounding: ") + 1;
      const LoadedRobot meant = loadRobot(directory.write(
          "meant.yaml", "model: net.xml\n" + warning->substr(begin, warning->find('`', begin) - begin) + "\n"));
      CAPTURE(meant.warnings);
      CHECK(moves(meant.model));
    }
  CHECK(told > 0);
}

TEST_CASE("a linkage with too many motors whose rows are next to nothing is told, however its numbers are taken") {
  // Of the seed of the fuzzer: between those that count and those of `rounding: 0` lie singular values of two loops that share joints.
  const std::string toy = std::string(BIELLE_SOURCE_DIR) + "/tests/fuzz/toy.usda";
  const RobotDirectory directory;
  for (const std::string& path : {toy, directory.write("exact.yaml", "model: " + toy + "\nrounding: 0\n")}) {
    const LoadedRobot robot = loadRobot(path);
    CHECK(countWarnings(robot, "is less than the 2 motors in its loops (shoulder, slide)") == 1);
  }
}
