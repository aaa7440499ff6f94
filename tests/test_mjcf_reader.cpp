// Files of MuJoCo, ours and those of its users: what is read, what is left out with a warning, what is refused.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <string>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/robots/robot_loader.h"
#include "formats/drake.h"
#include "formats/mjcf.h"
#include "formats/mjcf_coordinates.h"
#include "formats/robot_files.h"
#include "formats/sdf.h"
#include "get_error.h"
#include "mechanisms.h"
#include "published_robots.h"
#include "robot_difference.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;
namespace fs = std::filesystem;

namespace {

Model readMujoco(const std::string& text) {
  const RobotDirectory directory;
  return loadRobot(directory.write("robot.xml", text)).model;
}

std::string formatAssembled(const Model& model) { return formatMjcf(model, findClosedConfiguration(model).q).xml; }

// A swing with a body, into which elements are put.
std::string makeSwing(const std::string& in_body, const std::string& in_root = "", const std::string& in_world = "") {
  return "<mujoco model=\"swing\">" + in_root + "<worldbody>" + in_world + "<body name=\"bob\" pos=\"0 0 1\">" +
         "<joint name=\"swing\" axis=\"0 1 0\"/><inertial pos=\"0 0 -1\" mass=\"2\" diaginertia=\".1 .1 .1\"/>" +
         "<body name=\"tip\"><joint name=\"turn\"/><inertial pos=\"0 0 0\" mass=\"1\" fullinertia=\"3 4 5 .1 .2 "
         ".3\"/>" +
         in_body + "</body></body></worldbody></mujoco>\n";
}

}  // namespace

TEST_CASE("what the reader of MJCF leaves out is reported with its line, and what it cannot leave out is refused") {
  const RobotDirectory directory;
  const auto load = [&](const std::string& text) { return loadRobot(directory.write("swing.xml", text)); };
  const LoadedRobot plain = load(makeSwing(""));
  CHECK(plain.warnings.empty());
  const Matrix3d full = (Matrix3d() << 3, .1, .2, .1, 4, .3, .2, .3, 5).finished();
  CHECK(plain.model.bodies()[2].inertia.I_com == full);

  const auto checkWarning = [&](const std::string& text, const std::string& warning) {
    CAPTURE(warning);
    const std::vector<std::string> found = load(text).warnings;
    REQUIRE(found.size() == 1);
    CHECK(found[0] == directory.path() + "/swing.xml: " + warning);
  };
  // What changes no mechanism is one line, with a list.
  const auto checkHarmless = [&](const std::string& text, const std::vector<std::string>& elements) {
    const std::vector<std::string> found = load(text).warnings;
    REQUIRE(found.size() == 1);
    const std::string path = directory.path() + "/swing.xml", number = std::to_string(elements.size());
    CHECK_THAT(found[0], Catch::StartsWith(path + ": what changes no mechanism is left out (" + number + " kind") &&
                             Catch::Contains("`bielle info " + path + " --verbose` lists them"));
    std::vector<std::string> lines;
    for (const std::string& element : elements) lines.push_back(path + ": " + element);
    CHECK(listHarmless(path) == lines);
  };
  checkHarmless(makeSwing("\n<camera name=\"eye\"/>\n<camera name=\"other\"/>"), {"<camera> (lines 2, 3)"});
  checkHarmless(makeSwing("\n<camera/>\n<geom type=\"plane\" size=\"1 1 1\"/>\n<camera/>\n<light/>"),
                {"<geom> (line 3)", "<camera> (lines 2, 4)", "<light> (line 5)"});
  checkHarmless(makeSwing("", "\n<sensor>\n<gyro site=\"a\"/></sensor>\n<option cone=\"elliptic\" timestep=\"1e-3\"/>"),
                {"<sensor> <gyro> (line 3)", "<option> (line 4): 'cone'"});
  CHECK(load(makeSwing("\n<camera/>", "\n<option wind=\"1 0 0\" cone=\"elliptic\"/>")).warnings.size() == 2);
  checkWarning(makeSwing("", "\n<tendon><spatial/></tendon>"),
               "<spatial> (line 2): it does not run between two sites, and is left out");
  checkWarning(makeSwing("", "\n<actuator><muscle joint=\"swing\"/></actuator>"),
               "<muscle> (line 2): the actuator is left out: motors can only drive joints, and fixed tendons of them");
  checkWarning(makeSwing("", "\n<actuator><position name=\"swing\" joint=\"swing\" forcerange=\"-2 2\"/></actuator>"),
               "<position> (line 2): its servo is left out: it becomes an ideal torque motor");
  checkWarning(makeSwing("", "\n<equality><weld active=\"false\" body1=\"bob\"/></equality>"),
               "<weld> (line 2): it is not active, and left out");
  checkWarning(makeSwing("", "\n<option wind=\"1 0 0\" density=\"1.2\"/>"),
               "<option> (line 2): left out: 'density', 'wind'");

  const auto checkError = [&](const std::string& text, const std::string& element, const std::string& problem) {
    CAPTURE(problem);
    const std::string error = getError([&] { load(text); });
    CHECK_THAT(error, Catch::StartsWith(directory.path() + "/swing.xml: " + element + ": " + problem));
    CHECK(error.find("; ") != std::string::npos);
  };
  checkError("<mujoco>", "line 1", "it is not well-formed XML");
  checkError("<robot/>", "document", "its outermost element is not <mujoco>");
  checkError(makeSwing("", "<include file=\"a.xml\"/>"), "<include> (line 1)", "there is no file 'a.xml'");
  checkError(makeSwing("<replicate/>"), "<replicate> (line 1)", "such elements are not supported");
  checkError(makeSwing("\n<joint name=\"swing\"/>"), "joint 'swing' (line 2)", "two joints have this name");
  checkError(makeSwing("\n<joint name=\"x\" type=\"free\"/>"), "body 'tip' (line 1)", "it has a free joint");
  checkError(makeSwing("\n<joint name=\"x\" axis=\"0 0 0\"/>"), "joint 'x' (line 2)", "its axis is not a direction");
  checkError(makeSwing("\n<joint name=\"x\" range=\"1\"/>"), "joint 'x' (line 2)",
             "its attribute 'range' is not made of 2");
  checkError(makeSwing("\n<joint name=\"x\" damping=\"nan\"/>"), "joint 'x' (line 2)",
             "its attribute 'damping' is not");
  checkError(makeSwing("\n<joint name=\"x\" limited=\"true\"/>"), "joint 'x' (line 2)",
             "it is limited but has no range");
  checkError(makeSwing("\n<site name=\"a\" quat=\"1 0 0 0\" zaxis=\"0 0 1\"/>"), "site 'a' (line 2)", "it has several");
  checkError(makeSwing("\n<geom class=\"none\"/>"), "geom of body 'tip' (line 2)", "there is no default class 'none'");
  checkError(makeSwing("\n<body><geom type=\"mesh\" mesh=\"a\"/></body>"), "geom (line 2)",
             "the mass of the body comes from the mesh 'a', which is not there");
  checkError(makeSwing("", "<equality>\n<flex/></equality>"), "flex (line 2)", "such equalities are not supported");
  checkError(makeSwing("", "<equality>\n<joint joint1=\"swing\"/></equality>"), "joint (line 2)",
             "it constrains a single joint");
  checkError(makeSwing("", "<equality>\n<connect body1=\"none\" anchor=\"0 0 0\"/></equality>"), "connect (line 2)",
             "there is no body 'none'");
  checkError(makeSwing("", "<actuator>\n<motor joint=\"none\"/></actuator>"), "motor (line 2)",
             "there is no joint 'none'");
  checkError(makeSwing("", "<keyframe>\n<key qpos=\"1 2 3\"/></keyframe>"), "key (line 2)",
             "its attribute 'qpos' is not");
  checkError(makeSwing("", "<compiler coordinate=\"global\"/>"), "compiler (line 1)", "its coordinates are global");
}

TEST_CASE("sites of MuJoCo that look like the ends of an open loop are told, unless an equality closes it") {
  const std::string equality = "<equality><connect site1=\"closing_k_1\" site2=\"closing_k_2\"/></equality>";
  const auto load = [](const std::string& in_root) {
    const RobotDirectory directory;
    return loadRobot(directory.write("swing.xml", makeSwing("<site name=\"closing_k_1\" pos=\"0 0 .1\"/>", in_root,
                                                            "<site name=\"closing_k_2\" pos=\"0 0 1.1\"/>")));
  };
  const LoadedRobot open = load("");
  REQUIRE(open.warnings.size() == 1);
  CHECK_THAT(open.warnings[0], Catch::Contains("closures: [{name: k, type: 3d, frames: [closing_k_1, closing_k_2]}]"));
  for (const std::string& warning : load(equality).warnings)
    CHECK_THAT(warning, !Catch::Contains("look like the ends"));
}

TEST_CASE("hinges in place of a ball make its rotation, locked and next to it") {
  Joint joint;
  joint.name = "ball";
  joint.kind = JointKind::Spherical;
  Inertia inertia;
  inertia.mass = 1;
  inertia.I_com = Matrix3d::Identity();
  ModelBuilder builder("ball");
  builder.addLink("bob", "world", joint, inertia);
  const Model model = builder.build();
  const auto turn = [](double angle, const Vector3d& axis) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
  };
  const auto make = [&](double a, double b, double c) {
    return turn(a, Vector3d::UnitX()) * turn(b, Vector3d::UnitY()) * turn(c, Vector3d::UnitZ());
  };
  for (const double off : {0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3, 0.5})
    for (const double sign : {1, -1})
      for (const double a : {0.0, 0.4, -2.0})
        for (const double c : {0.0, 1.3, 3.0}) {
          CAPTURE(off, sign, a, c);
          const Eigen::Quaterniond rotation = make(a, sign * (M_PI / 2 - off), c);
          const VectorXd angles = calcMjcfQpos(model, model.makeNeutral(), rotation.coeffs(), MjcfRotations::Hinges);
          REQUIRE(angles.size() == 3);
          CHECK((make(angles[0], angles[1], angles[2]).toRotationMatrix() - rotation.toRotationMatrix()).norm() <
                1e-14);
        }
}

TEST_CASE("a file of MuJoCo tells how soft its loops are there, which are rigid here") {
  const RobotDirectory directory;
  const auto load = [&](const std::string& options, const std::string& attributes) {
    const std::string text = makeSwing(
        "", options + "<equality><connect name=\"tie\" body1=\"tip\" anchor=\"0 0 0\" " + attributes + "/></equality>");
    return loadRobot(directory.write("swing.xml", text)).warnings;
  };
  const auto check = [&](const std::string& options, const std::string& attributes, const std::string& text) {
    const std::vector<std::string> warnings = load(options, attributes);
    CAPTURE(options, attributes);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0],
               Catch::Contains("<connect> (line 1): it is read as rigid. In MuJoCo, ") && Catch::Contains(text));
  };
  // r = (1 - d) g (d_max T)^2 / d^2
  check("", "", "solref 0.02 1 and solimp 0.9 0.95 0.001 0.5 2 at steps of 2 ms let it give way: 10 % of");
  check("", "", "by about 0.4 mm (mrad) per g at which");
  check("<default><equality solref=\"0.004\"/></default>", "", "by about 0.02 mm");
  check("<option timestep=\"0.01\"/>", "solref=\"0.0005 1\" solimp=\"0.99 0.99\"", "1 % of an acceleration");
  check("", "solref=\"-10000 -10\"", "under the weight of a robot; solimp");
  check("<option timestep=\"0.1\"/>", "solref=\"0.0005 1\" solimp=\"0.9999 0.9999\"", "it closes within 200 ms");
  CHECK(load("<option timestep=\"0.1\"><flag refsafe=\"disable\"/></option>",
             "solref=\"0.0005 1\" solimp=\"0.9999 0.9999\"")
            .empty());
  CHECK(load("<option timestep=\"0.005\"/>", "solref=\"0.0005 1\" solimp=\"0.9999 0.9999\"").empty());
  const std::string own = formatAssembled(loadRobot("bipetto").model);
  for (const std::string& warning : loadRobot(directory.write("own.xml", own)).warnings)
    CHECK_THAT(warning, !Catch::Contains("read as rigid"));
}

TEST_CASE("preloads without a stiffness go out and come in again") {
  ModelParts parts = takeParts(loadRobot("fourbar").model);
  JointForce force;
  force.joint = 1, force.idx_q = parts.joints[1].idx_q, force.dof = parts.joints[1].idx_v;
  force.preload = -2.5, force.damping = 0.1;
  parts.joint_forces = {force};
  PointSpring spring;
  spring.name = "gas", spring.body1 = 0, spring.body2 = 2, spring.point1 = Vector3d(0.1, 0, 0.5);
  spring.preload = -7;
  parts.point_springs = {spring};
  const Model a = ModelBuilder::restore(parts), b = readMujoco(formatAssembled(a));
  REQUIRE(b.jointForces().size() == 1);
  CHECK(b.jointForces()[0].preload == Approx(-2.5));
  CHECK(b.jointForces()[0].stiffness == 0);
  CHECK(b.jointForces()[0].damping == 0.1);
  REQUIRE(b.pointSprings().size() == 1);
  CHECK(b.pointSprings()[0].preload == Approx(-7));
  CHECK(b.pointSprings()[0].stiffness == 0);
}

TEST_CASE("files of today's MuJoCo: frames, sites in equalities, inertia by shapes, classes of defaults") {
  // The same arm twice: by hand, and by frames, defaults and shapes.
  const Model a = readMujoco(R"(<mujoco><compiler angle="radian"/><worldbody>
    <body name="arm" pos="1 2 4"><joint name="lift" axis="0 0 -1" pos="0 0.1 0" armature="0.2" range="-1 2"/>
      <inertial pos="0 0 0" mass="6" diaginertia="0.5 0.26 0.4"/><geom type="box" size="0.2 0.4 0.3"/>
      <body name="rod" pos="0 0 1"><joint name="ball" type="ball"/>
        <inertial pos="0 0 1" mass="1" diaginertia="0.1 0.1 0.01"/><site name="end" pos="0 0 2"/></body></body>
    <site name="wall" pos="0.5 2 7"/></worldbody>
    <equality><connect name="tie" site1="wall" site2="end"/></equality></mujoco>)");
  const Model b = readMujoco(R"(<mujoco><compiler angle="radian"/>
    <default><default class="strong"><joint armature="0.2" range="-1 2" axis="0 1 0"/></default></default><worldbody>
    <frame pos="1 0 0"><frame pos="0 2 4"><body name="arm"><frame euler="-1.5707963267948966 0 0" childclass="strong">
      <joint name="lift" pos="0 0 0.1"/></frame>
      <geom type="box" size="0.2 0.4 0.3" mass="6"/>
      <body name="rod" pos="0 0 1"><joint name="ball" type="ball"/>
        <inertial pos="0 0 1" mass="1" fullinertia="0.1 0.1 0.01 0 0 0"/><site name="end" pos="0 0 2"/></body>
    </body></frame></frame><site name="wall" pos="0.5 2 7"/></worldbody>
    <equality><connect name="tie" site1="wall" site2="end"/></equality></mujoco>)");
  const Difference d = compare(a, b, a.makeNeutral());
  CHECK(d.missing == "");
  CHECK(d.mass_matrix < kTolerance);
  CHECK(d.bias < kTolerance);
  CHECK(d.closures < kTolerance);
}

TEST_CASE("the mass of shapes that only MuJoCo 2 discards counts, and is told") {
  // In MuJoCo 2.2.2 the first of them weighs 1 kg and the second 1.5 kg, in 3.14 both 1.5 kg.
  const RobotDirectory directory;
  const auto load = [&](const std::string& compiler, const std::string& contact, const std::string& inertial) {
    return loadRobot(directory.write("robot.xml", "<mujoco><compiler " + compiler + "/><worldbody><body name=\"b\">" +
                                                      inertial +
                                                      "<joint name=\"j\"/><geom type=\"box\" size=\"1 1 1\" " +
                                                      "mass=\"1\"/>\n<geom type=\"sphere\" size=\"1\" mass=\"0.5\" " +
                                                      contact + "/></body></worldbody></mujoco>"));
  };
  const auto tells = [](const LoadedRobot& robot) {
    return std::any_of(robot.warnings.begin(), robot.warnings.end(), [](const std::string& warning) {
      return warning.find("<geom> (line 2): its mass counts, as in MuJoCo 3; MuJoCo 2 leaves it out") !=
             std::string::npos;
    });
  };
  const std::string discards = "discardvisual=\"true\"", visual = "contype=\"0\" conaffinity=\"0\"",
                    inertial = "<inertial pos=\"0 0 0\" mass=\"4\" diaginertia=\"1 1 1\"/>";
  CHECK(tells(load(discards, visual, "")));
  CHECK(load(discards, visual, "").model.bodies()[1].inertia.mass == Approx(1.5));
  for (const LoadedRobot& robot :
       {load(discards, "contype=\"0\"", ""), load(discards, visual, inertial), load("", visual, "")})
    CHECK_FALSE(tells(robot));
}

TEST_CASE("line breaks mean nothing: equalities and tendons without names may share a line") {
  std::string xml =
      R"(<mujoco><worldbody><body name="a"><joint name="a" axis="0 1 0"/><geom size="0.1"/><site name="s"/></body>
    <body name="b"><joint name="b" axis="0 1 0"/><geom size="0.1"/><site name="t" pos="0 0 0.1"/></body>
    <body name="c"><joint name="c" axis="0 1 0"/><geom size="0.1"/></body></worldbody>
    <tendon><spatial stiffness="1"><site site="s"/><site site="t"/></spatial><spatial stiffness="2"><site site="s"/><site site="t"/></spatial></tendon>
    <equality><joint joint1="a" joint2="b"/><joint joint1="b" joint2="c"/></equality></mujoco>)";
  for (const bool is_one_line : {false, true}) {
    if (is_one_line) std::replace(xml.begin(), xml.end(), '\n', ' ');
    const Model model = readMujoco(xml);
    REQUIRE(model.closures().size() == 2);
    CHECK(model.closures()[0].name != model.closures()[1].name);
    REQUIRE(model.pointSprings().size() == 2);
    CHECK(model.pointSprings()[0].name != model.pointSprings()[1].name);
  }
}

TEST_CASE("what files of others have: limits by default, sites named as bodies, commas, polynomials of joints") {
  const RobotDirectory directory;
  const LoadedRobot robot = loadRobot(directory.write("others.xml", R"(<mujoco><compiler angle="radian"/>
    <default><joint limited="true"/></default><worldbody><body name="trunk" quat="0.6, 0, 0.8, 0"><joint type="free"/>
      <geom size="0.1"/><site name="foot" pos="0 0 0.1"/>
      <body name="leg"><joint name="hip" range="-1 2"/><geom size="0.1"/>
        <body name="foot" pos="0 0 -1"><joint name="ankle" type="ball"/><geom size="0.1"/></body></body>
      <body name="arm"><joint name="shoulder" range="-2 1" ref="0.5"/><geom size="0.1"/></body></body></worldbody>
    <equality><joint name="cam" joint1="hip" joint2="shoulder" polycoef="0.1 0 2 0 0.5"/></equality></mujoco>)"));
  const Model& model = robot.model;
  CHECK(model.hasFreeFlyer());
  CHECK(model.bodies()[model.joints()[model.findJoint("ankle")].parent].name == "leg");
  const int foot = model.findFrame("foot");
  CHECK(model.frames()[foot].body == model.findJoint("ankle"));
  CHECK(model.frames()[model.findFrame("foot_2")].body == 1);
  CHECK_THAT(robot.warnings.at(0), Catch::Contains("the commas between the numbers of its 'quat' are read as spaces"));
  // hip = 0.1 + 2 (s - 0.5)^2 + 0.5 (s - 0.5)^4
  Workspace ws(model);
  VectorXd q = model.makeNeutral();
  const double s = 0.9, hip = 0.1 + 2 * 0.16 + 0.5 * 0.0256;
  q[model.joints()[model.findJoint("shoulder")].idx_q] = s;
  q[model.joints()[model.findJoint("hip")].idx_q] = hip;
  updatePositions(model, ws, q);
  CHECK(std::abs(calcClosureResidual(ws, model.closures().at(0))[0]) < 1e-14);
  CHECK_THAT(getError([&] {
               readMujoco(
                   "<mujoco><worldbody><body name=\"a\"><geom size=\"1\"/></body>\n<body name=\"a\"><geom "
                   "size=\"1\"/></body></worldbody></mujoco>");
             }),
             Catch::Contains("body 'a' (line 2)") && Catch::Contains("its name is taken"));
}

TEST_CASE("two points of the same two bodies make a hinge, whatever their names, where the bodies stand or not") {
  const auto read = [](const std::string& equality, const std::string& second) {
    const RobotDirectory directory;
    return loadRobot(directory.write("bar.xml", R"(<mujoco><compiler angle="radian"/><worldbody>
      <site name="a1" pos="0.3 -0.1 0.2"/><site name="a2" pos="0.3 0.1 0.2"/>
      <body name="crank"><joint name="crank" axis="0 1 0"/><geom size="0.1" pos="0 0 0.1"/>
        <body name="rod" pos="0 0 0.2"><joint name="rod" axis="0 1 0"/><geom size="0.1"/>
          <body name="end" pos="0.2 0 0.1"><joint name="end" axis="0 1 0"/><geom size="0.1" pos="0.1 0 0"/>
            <site name="b1" pos="0.15 -0.1 0"/><site name="b2" pos="0.15 )" +
                                                    second + R"( 0" euler="0.3 0 0"/></body></body></body></worldbody>
      <equality>)" + equality + "</equality></mujoco>"));
  };
  const std::string sites =
      "<connect name=\"p\" site1=\"a1\" site2=\"b1\"/>\n<connect name=\"q\" site1=\"a2\" site2=\"b2\"/>";
  const LoadedRobot pin = read(sites, "0.1");
  REQUIRE(pin.model.closures().size() == 1);
  const Closure& closure = pin.model.closures()[0];
  CHECK(closure.kind == ClosureKind::Hinge5D);
  CHECK(closure.name == "p");
  CHECK((closure.X_B1.R * closure.axis).isApprox(-Vector3d::UnitY(), 1e-12));
  CHECK((closure.X_B2.R * closure.axis).isApprox(-Vector3d::UnitY(), 1e-12));
  CHECK((closure.X_B2.p - Vector3d(0.15, 0, 0)).norm() < 1e-15);
  CHECK(std::any_of(pin.warnings.begin(), pin.warnings.end(), [](const std::string& w) {
    return w.find("together with 'p' it makes a hinge of their two bodies") != std::string::npos;
  }));
  // As it stands open: the same mechanism, closed, as two balls that say one row twice.
  const VectorXd q = findClosedConfiguration(pin.model).q;
  Workspace ws(pin.model);
  updatePositions(pin.model, ws, q);
  CHECK(calcClosureResidual(ws, closure).norm() < 1e-9);
  CHECK(calcMobility(pin.model, q).mobility == 1);
  CHECK(read(sites, "0.12").model.closures().size() == 2);  // not as far apart
  CHECK(read("<connect body1=\"rod\" body2=\"world\" anchor=\"0 -0.1 0\"/><connect body1=\"rod\" "
             "body2=\"world\" anchor=\"0 0.1 0\"/>",
             "0")
            .model.closures()[0]
            .kind == ClosureKind::Hinge5D);
}

TEST_CASE("a weld without torque is a ball, as in MuJoCo, at its anchor") {
  const auto read = [](const std::string& scale) {
    const RobotDirectory directory;
    return loadRobot(directory.write("arm.xml",
                                     "<mujoco><worldbody><body name=\"a\" pos=\"0 0 1\"><joint axis=\"0 1 0\"/>"
                                     "<geom size=\"0.1\"/></body></worldbody><equality><weld body1=\"world\" "
                                     "body2=\"a\" anchor=\"0.1 0 0.2\"" +
                                         scale + "/></equality></mujoco>"));
  };
  CHECK(read("").model.closures()[0].kind == ClosureKind::Weld6D);
  CHECK(read(" torquescale=\"0.5\"").model.closures()[0].kind == ClosureKind::Weld6D);
  const LoadedRobot ball = read(" torquescale=\"0\"");
  CHECK(ball.model.closures()[0].kind == ClosureKind::Ball3D);
  CHECK((ball.model.closures()[0].X_B2.p - Vector3d(0.1, 0, 0.2)).norm() < 1e-15);
  CHECK((ball.model.closures()[0].X_B1.p - Vector3d(0.1, 0, 1.2)).norm() < 1e-15);
}

TEST_CASE("a robot of MuJoCo becomes one of ours and stays the same") {
  const RobotDirectory directory;
  for (const char* name : {"bipetto", "cleobot", "belt_biped", "spring_leg", "delta"}) {
    CAPTURE(name);
    const Model a = readMujoco(formatAssembled(loadRobot(name).model));
    const RobotText text = formatRobot(a);
    const Model b = loadRobot(directory.writeRobot(text.urdf, text.yaml)).model;
    const Difference d = compare(a, b, a.makeNeutral());
    CHECK(d.missing == "");
    CHECK(d.mass_matrix < kTolerance);
    CHECK(d.bias < kTolerance);
    CHECK(d.closures < kTolerance);
  }
}

TEST_CASE(
    "windings, gears and speeds of motors go out and come in again, and other formats tell that energies change") {
  ModelParts parts = takeParts(loadRobot("bipetto").model);
  Motor &first = parts.motors[0], &second = parts.motors[3];
  first.drive = {"rotor \"a\" & <b>", 9, 5.79e-5, 0.095, 0.16, 48, 28, 12, 0.9, 0.8, 0.49};
  first.torque_loss = 0.123456789012;
  first.continuous_effort = 7;
  second.drive.efficiency = 0.7;
  parts.velocity_limits[first.dof] = first.velocity_limit = 4.25;
  const Model a = ModelBuilder::restore(parts);
  const RobotDirectory directory;
  const RobotText text = formatRobot(a);
  const Model ours = loadRobot(directory.writeRobot(text.urdf, text.yaml)).model;
  for (const Model& b : {ours, readMujoco(formatAssembled(a))})
    for (int m : {0, 3, 4}) {
      const Motor &before = a.motors()[m], &after = b.motors()[m];
      const MotorDrive &x = before.drive, &y = after.drive;
      CAPTURE(before.name);
      CHECK(x.isGiven() == y.isGiven());
      CHECK(x.type == y.type);
      for (auto field :
           {&MotorDrive::ratio, &MotorDrive::rotor_inertia, &MotorDrive::torque_constant, &MotorDrive::resistance,
            &MotorDrive::voltage, &MotorDrive::current, &MotorDrive::continuous_current, &MotorDrive::efficiency,
            &MotorDrive::back_efficiency, &MotorDrive::mass})
        CHECK(areSame(x.*field, y.*field));
      CHECK(before.torque_loss.has_value() == after.torque_loss.has_value());
      CHECK(areSame(before.torqueLoss(), after.torqueLoss()));
      CHECK(areSame(before.continuous_effort, after.continuous_effort));
      CHECK(areSame(a.velocityLimits()[before.dof], b.velocityLimits()[after.dof]));
      CHECK(after.armature == before.armature);
    }
  // Written again it is the same file: what follows from the drive is now given.
  CHECK(formatRobot(ours).yaml ==
        formatRobot(loadRobot(directory.writeRobot(text.urdf, formatRobot(ours).yaml)).model).yaml);
  using Catch::Contains;
  const auto join = [](const std::vector<std::string>& warnings) {
    std::string all;
    for (const std::string& warning : warnings) all += warning + "\n";
    return all;
  };
  CHECK_THAT(join(formatMjcf(a, findClosedConfiguration(a).q).warnings), !Contains("motor '"));
  for (const std::string& warnings :
       {join(formatSdf(a, findClosedConfiguration(a).q).warnings), join(formatDrake(a).warnings)})
    CHECK_THAT(warnings, Contains("motor '" + first.name + "': its winding") &&
                             Contains("so electrical energies change") &&
                             Contains("motor '" + second.name + "': its winding"));
}

TEST_CASE("what a file of MuJoCo says of our motors in its own texts is checked as in a YAML file, with its line") {
  ModelParts parts = takeParts(loadRobot("belt_biped").model);
  parts.motors.front().torque_loss = 0.3;
  const std::string xml = formatAssembled(ModelBuilder::restore(parts)), name = parts.motors.front().name;
  const size_t end = xml.find("  </custom>");
  const RobotDirectory directory;
  const auto load = [&](const std::string& text) { return loadRobot(directory.write("robot.xml", text)); };
  REQUIRE(end != std::string::npos);
  const auto insert = [&](const std::string& text) { return std::string(xml).insert(end, text); };
  const auto line = std::to_string(1 + std::count(xml.begin(), xml.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
  CHECK_THAT(getError([&] { load(insert("<text name='bielle:motor:" + name + "' data='resistance: much'/>")); }),
             Catch::Contains("'resistance' (line " + line + "): it is not a number"));
  const auto warns = [&](const std::string& text) {
    std::string all;
    for (const std::string& warning : load(insert(text)).warnings) all += warning + "\n";
    return all;
  };
  CHECK_THAT(warns("<text name='bielle:motor:no' data='mass: 1'/>"), Catch::Contains("<custom> <text>"));
  CHECK_THAT(warns("<numeric name='n' data='1'/>"), Catch::Contains("<custom> <numeric>"));
}
