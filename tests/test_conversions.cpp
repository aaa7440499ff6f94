// Robots out into other formats and in again: mass matrix, bias, closures and motors are the same, and wrong numbers show.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <regex>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/robot_loader.h"
#include "formats/drake.h"
#include "formats/mjcf.h"
#include "formats/mjcf_coordinates.h"
#include "formats/sdf.h"
#include "get_error.h"
#include "mechanisms.h"
#include "published_robots.h"
#include "robot_difference.h"
#include "robot_directory.h"
#include "robot_trial.h"

using namespace bielle;
using namespace bielle::testing;
namespace fs = std::filesystem;

namespace {

Model readMjcfText(const std::string& text) {
  const RobotDirectory directory;
  return loadRobot(directory.write("robot.xml", text)).model;
}

// A file and the way that the original stands in it.
struct Written {
  std::string xml;
  VectorXd q_ref;
};

Written write(const Model& model) {
  const VectorXd q_ref = findClosedConfiguration(model).q;
  return {formatMjcf(model, q_ref).xml, q_ref};
}

void checkMjcfRoundTrip(const Model& model, ConstVectorRef q_ref) {
  const Difference d = compare(model, readMjcfText(formatMjcf(model, q_ref).xml), q_ref);
  CHECK(d.missing == "");
  CHECK(d.mass_matrix < kTolerance);
  CHECK(d.bias < kTolerance);
  CHECK(d.closures < kTolerance);
}

}  // namespace

TEST_CASE("every robot comes back from MJCF with its mass matrix, closures, motors and soles") {
  for (const char* published : {"battobot_6d", "digit_like_2legs"}) findPublished(published);  // warns without them
  for (const std::string& name : listRobots()) {
    CAPTURE(name);
    const Model model = loadRobot(name).model;
    const Written written = write(model);
    checkMjcfRoundTrip(model, written.q_ref);
    // The loops close from the postures that came along.
    const Model back = readMjcfText(written.xml);
    CHECK(findClosedConfiguration(back).status == AssemblyStatus::Closed);
    for (const Reference& reference : model.references()) {
      const AssemblyResult a = assembleReference(model, reference.name), b = assembleReference(back, reference.name);
      const VectorXd q = mapConfiguration(model, back, written.q_ref, a.q);
      CHECK(back.difference(q, b.q).cwiseAbs().maxCoeff() < 1e-9);
    }
  }
}

TEST_CASE("generated robots come back from MJCF") {
  for (const Generator& generator : listGenerators()) {
    CAPTURE(generator.name);
    const Model model = generator.make(generator.parameters);
    checkMjcfRoundTrip(model, findClosedConfiguration(model).q);
  }
}

TEST_CASE("random mechanisms come back from MJCF: every joint, closure, base, springs and belts") {
  unsigned seed = 0;
  for (JointKind joint : kJointKinds)
    for (ClosureKind closure : kClosureKinds)
      for (MechanismBase base : {MechanismBase::Fixed, MechanismBase::FreeFlyer}) {
        CAPTURE(getName(joint), getName(closure), base == MechanismBase::FreeFlyer);
        std::mt19937 rng(++seed);
        const Mechanism plain = makeRandomMechanism(rng, joint, closure, base);
        checkMjcfRoundTrip(plain.model, plain.q_closed);
        const Mechanism belted = makeBeltedMechanism(rng, joint, closure, base, true);
        checkMjcfRoundTrip(belted.model, belted.q_closed);
        const Mechanism sprung = makeSprungMechanism(rng, joint, closure, base);
        const Model back = readMjcfText(formatMjcf(sprung.model, sprung.q_closed).xml);
        REQUIRE(back.jointForces().size() == sprung.model.jointForces().size());
        for (const JointForce& force : sprung.model.jointForces()) {
          const auto same = [&](const JointForce& other) {
            return back.joints()[other.joint].name == sprung.model.joints()[force.joint].name &&
                   other.stiffness == force.stiffness && other.damping == force.damping &&
                   other.friction == force.friction &&
                   // A preload is the rest of a spring there, and lost without one.
                   (force.stiffness == 0 ||
                    std::abs(other.stiffness * other.rest - force.stiffness * force.rest - force.preload) < 1e-12);
          };
          CHECK(std::any_of(back.jointForces().begin(), back.jointForces().end(), same));
        }
        ModelParts parts = takeParts(plain.model);  // without friction, which MuJoCo has otherwise
        parts.point_springs = sprung.model.pointSprings();
        REQUIRE(parts.point_springs.size() >= 3);
        checkMjcfRoundTrip(ModelBuilder::restore(parts), plain.q_closed);
      }
}

TEST_CASE("springs between points in MJCF: what it cannot say, other tendons, and a poisoned number") {
  ModelBuilder builder("springs");
  Joint joint;
  joint.name = "slide", joint.kind = JointKind::Prismatic;
  builder.addLink("mass", "world", joint, {2, Vector3d::Zero(), 0.1 * Matrix3d::Identity()});
  builder.addFrame("spring.1", "mass", {Matrix3d::Identity(), {0, 1, 0}});  // the name of a site that would be made
  PointSpring spring;
  spring.name = "spring", spring.point1 = {0.2, 0, 0}, spring.stiffness = 10, spring.rest = 0.5, spring.preload = 2.5;
  spring.damping = 2;
  builder.addPointSpring("world", "mass", spring);
  const Model good = builder.build();
  const MjcfText text = formatMjcf(good, VectorXd::Zero(1));
  CHECK(text.warnings.empty());
  CHECK(compare(good, readMjcfText(text.xml), VectorXd::Zero(1)).bias < kTolerance);
  CHECK(readMjcfText(text.xml).pointSprings()[0].rest == 0.25);
  for (const char* number : {"stiffness=\"10\"", "springlength=\"0.25", "damping=\"2\""}) {
    CAPTURE(number);
    const size_t at = text.xml.find(number);
    REQUIRE(at != std::string::npos);
    std::string poisoned = text.xml;
    poisoned.insert(at + std::string(number).size() - (poisoned[at + std::string(number).size() - 1] == '"' ? 1 : 0),
                    std::string(number).find('.') == std::string::npos ? ".001" : "001");
    CHECK(compare(good, readMjcfText(poisoned), VectorXd::Zero(1)).bias > 1e-6);
  }

  spring.name = "short", spring.preload = 6;
  builder.addPointSpring("world", "mass", spring);
  spring.name = "constant", spring.stiffness = 0;
  builder.addPointSpring("world", "mass", spring);
  const std::vector<std::string> warnings = formatMjcf(builder.build(), VectorXd::Zero(1)).warnings;
  REQUIRE(warnings.size() == 2);
  CHECK_THAT(warnings[0], Catch::Contains("point spring 'short': its length without tension would be negative"));
  CHECK_THAT(warnings[1], Catch::Contains("point spring 'constant': its preload without a stiffness is left out"));

  const RobotDirectory directory;
  const LoadedRobot other = loadRobot(directory.write("robot.xml", R"(<mujoco>
  <worldbody><site name="a"/><body name="mass" pos="0 0 0.5"><joint name="slide" type="slide"/>
    <inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/><site name="b"/><site name="c"/></body></worldbody>
  <default><tendon stiffness="3"/></default>
  <tendon>
    <spatial><site site="a"/><site site="b"/></spatial>
    <spatial name="bent"><site site="a"/><site site="b"/><site site="c"/></spatial>
    <spatial name="pulley"><site site="a"/><pulley divisor="2"/><site site="b"/></spatial>
    <spatial name="slack" springlength="0.1 0.2"><site site="a"/><site site="b"/></spatial>
    <spatial name="cable" stiffness="0"><site site="a"/><site site="b"/></spatial>
    <spatial name="rope" damping="1" frictionloss="1" range="0 1" limited="true"><site site="a"/><site site="b"/></spatial>
  </tendon></mujoco>)"));
  REQUIRE(other.model.pointSprings().size() == 2);
  CHECK(other.model.pointSprings()[0].name == "tendon_6");
  CHECK(other.model.pointSprings()[0].rest == Approx(0.5));  // as the file stands
  CHECK(other.model.pointSprings()[0].stiffness == 3);
  CHECK(other.model.pointSprings()[1].damping == 1);
  for (const char* told : {"does not run between two sites", "bends about a <pulley>", "slack between two lengths",
                           "no spring or damper", "frictionloss is left out", "limits of its length are left out"})
    CHECK(std::any_of(other.warnings.begin(), other.warnings.end(),
                      [&](const std::string& w) { return w.find(told) != std::string::npos; }));
}

TEST_CASE("a number of the file that is wrong by a millionth shows") {
  struct Poison {
    const char *robot, *tag, *attribute;
    int number;  // of the attribute, of which the first with a value is changed
    double Difference::*shows;
  };
  const Poison poisons[] = {{"belt_biped", "inertial", "mass", 0, &Difference::mass_matrix},
                            {"belt_biped", "inertial", "diaginertia", 2, &Difference::mass_matrix},
                            {"belt_biped", "inertial", "pos", 2, &Difference::bias},
                            {"belt_biped", "body name=\"shank_left\"", "pos", 2, &Difference::mass_matrix},
                            {"belt_biped", "joint", "coef", 0, &Difference::closures},
                            {"belt_biped", "joint", "polycoef", 1, &Difference::closures},
                            {"belt_biped", "joint", "ref", 0, &Difference::mass_matrix},
                            {"bipetto", "weld", "anchor", 2, &Difference::closures},
                            {"cleobot", "connect", "anchor", 0, &Difference::closures},
                            {"spring_leg", "connect", "anchor", 0, &Difference::closures},
                            {"bipetto", "joint", "armature", 0, nullptr},
                            {"bipetto", "joint", "range", 1, nullptr},
                            {"fourbar", "motor", "ctrlrange", 1, nullptr}};
  for (const Poison& poison : poisons) {
    CAPTURE(poison.robot, poison.tag, poison.attribute);
    const Model model = loadRobot(poison.robot).model;
    const Written written = write(model);
    REQUIRE(compare(model, readMjcfText(written.xml), written.q_ref).isZero());
    const std::regex pattern("<" + std::string(poison.tag) + " [^>]*\\b" + poison.attribute + "=\"(?:[^ \"]+ ){" +
                             std::to_string(poison.number) + "}([^ \"]+)");
    bool changed = false;
    for (std::sregex_iterator it(written.xml.begin(), written.xml.end(), pattern), end; it != end && !changed; ++it) {
      const double value = std::stod((*it)[1]);
      if (std::abs(value) < 1e-3) continue;
      changed = true;
      char text[40];
      std::snprintf(text, sizeof text, "%.17g", value * (1 - 1e-6));
      std::string xml = written.xml;
      xml.replace(it->position(1), it->length(1), text);
      const Difference d = compare(model, readMjcfText(xml), written.q_ref);
      if (poison.shows)
        CHECK(d.*poison.shows > 10 * kTolerance);
      else
        CHECK(d.missing != "");
    }
    CHECK(changed);
  }
}

namespace {

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
  checkWarning(makeSwing("\n<camera name=\"eye\"/>\n<camera name=\"other\"/>"), "<camera> (lines 2, 3): left out");
  checkWarning(makeSwing("\n<geom type=\"plane\" size=\"1 1 1\"/>"),
               "<geom> (line 2): a geom of type 'plane' is left out");
  checkWarning(makeSwing("", "\n<sensor>\n<gyro site=\"a\"/></sensor>"), "<sensor> <gyro> (line 3): left out");
  checkWarning(makeSwing("", "\n<tendon><spatial/></tendon>"),
               "<spatial> (line 2): it does not run between two sites, and is left out");
  checkWarning(makeSwing("", "\n<actuator><muscle joint=\"swing\"/></actuator>"),
               "<muscle> (line 2): the actuator is left out: motors can only drive joints");
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
  checkError(makeSwing("\n<geom class=\"none\"/>"), "geom (line 2)", "there is no default class 'none'");
  checkError(makeSwing("\n<body><geom type=\"mesh\" mesh=\"a\"/></body>"), "geom (line 2)",
             "the mass of the body comes from the mesh 'a', which is not there");
  checkError(makeSwing("", "<equality>\n<flex/></equality>"), "flex (line 2)", "such equalities are not supported");
  checkError(makeSwing("", "<equality>\n<joint joint1=\"swing\" joint2=\"turn\" polycoef=\"0 1 2 0 0\"/></equality>"),
             "joint (line 2)", "its polycoef is of degree 2 or more");
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

TEST_CASE("files of today's MuJoCo: frames, sites in equalities, inertia by shapes, classes of defaults") {
  // The same arm twice: by hand, and by frames, defaults and shapes.
  const Model a = readMjcfText(R"(<mujoco><compiler angle="radian"/><worldbody>
    <body name="arm" pos="1 2 4"><joint name="lift" axis="0 0 -1" pos="0 0.1 0" armature="0.2" range="-1 2"/>
      <inertial pos="0 0 0" mass="6" diaginertia="0.5 0.26 0.4"/><geom type="box" size="0.2 0.4 0.3"/>
      <body name="rod" pos="0 0 1"><joint name="ball" type="ball"/>
        <inertial pos="0 0 1" mass="1" diaginertia="0.1 0.1 0.01"/><site name="end" pos="0 0 2"/></body></body>
    <site name="wall" pos="0.5 2 7"/></worldbody>
    <equality><connect name="tie" site1="wall" site2="end"/></equality></mujoco>)");
  const Model b = readMjcfText(R"(<mujoco><compiler angle="radian"/>
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

TEST_CASE("a robot of MuJoCo becomes one of ours and stays the same") {
  const RobotDirectory directory;
  for (const char* name : {"bipetto", "cleobot", "belt_biped", "spring_leg", "delta"}) {
    CAPTURE(name);
    const Model a = readMjcfText(write(loadRobot(name).model).xml);
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
  for (const Model& b : {ours, readMjcfText(write(a).xml)})
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
  CHECK_THAT(join(formatMjcf(a, write(a).q_ref).warnings), !Contains("motor '"));
  for (const std::string& warnings : {join(formatSdf(a, write(a).q_ref).warnings), join(formatDrake(a).warnings)})
    CHECK_THAT(warnings, Contains("motor '" + first.name + "': its winding") &&
                             Contains("so electrical energies change") &&
                             Contains("motor '" + second.name + "': its winding"));
}

TEST_CASE("what a file of MuJoCo says of our motors in its own texts is checked as in a YAML file, with its line") {
  ModelParts parts = takeParts(loadRobot("belt_biped").model);
  parts.motors.front().torque_loss = 0.3;
  const std::string xml = write(ModelBuilder::restore(parts)).xml, name = parts.motors.front().name;
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

TEST_CASE("shapes go out and come in again") {
  ModelParts parts = takeParts(loadRobot("bipetto").model);
  const auto fitted = parts.shapes;
  Shape ball, rod = makeCapsule(0, {0.1, 0.2, 0}, {0.1, -0.3, 0.05}, 0.03), box;
  ball.radius = 0.1;
  box.half = {0.1, 0.2, 0.05};
  box.X_BS = {Eigen::AngleAxisd(0.3, Vector3d::UnitY()).toRotationMatrix(), Vector3d(0.01, 0.02, 0.03)};
  int body = 3;
  for (Shape* shape : {&ball, &rod, &box}) {
    shape->body = body++;
    parts.shapes.push_back(*shape);
  }
  const Model a = ModelBuilder::restore(parts);
  CHECK(a.shapes().size() < fitted.size() + 3);  // three bodies have shapes of their own
  const RobotDirectory directory;
  const RobotText text = formatRobot(a);
  for (const Model& b : {loadRobot(directory.writeRobot(text.urdf, text.yaml)).model, readMjcfText(write(a).xml)}) {
    REQUIRE(b.visuals().size() == a.visuals().size());  // shapes of files are not drawn
    REQUIRE(b.shapes().size() == a.shapes().size());
    for (const Shape& before : a.shapes()) {
      const std::string& name = a.bodies()[before.body].name;
      CAPTURE(name);
      CHECK(std::any_of(b.shapes().begin(), b.shapes().end(), [&](const Shape& after) {
        return b.bodies()[after.body].name == name && after.fitted == before.fitted &&
               (after.half - before.half).norm() < 1e-11 && areSame(after.radius, before.radius) &&
               (after.X_BS.p - before.X_BS.p).norm() < 1e-11 && (after.X_BS.R - before.X_BS.R).norm() < 1e-10;
      }));
    }
  }
}

TEST_CASE("a URDF alone is the tree with its mimics, friction and limits, and tells what it lost") {
  ModelBuilder builder("gripper");
  const Inertia inertia = {1, Vector3d(0, 0, 0.1), 0.01 * Matrix3d::Identity()};
  std::string parent = "world";
  for (const char* name : {"a", "b", "c", "d"}) {
    Joint joint;
    joint.name = std::string("joint_") + name;
    joint.kind = JointKind::Revolute;
    joint.axis = Vector3d::UnitY();
    joint.X_PJ.p = {0, 0, 0.3};
    builder.addLink(name, parent, joint, inertia);
    parent = name;
  }
  builder.addCoupler("pair", {{"joint_a", 2}, {"joint_b", -3}}, 0.6);
  builder.addCoupler("same", {{"joint_b", 1}, {"joint_c", 1}});
  builder.addCoupler("three", {{"joint_a", 2}, {"joint_b", -3}, {"joint_c", 1}});
  builder.addMotor("joint_a", 0.1, 7, 3);
  JointForce force;
  force.stiffness = 2, force.damping = 0.5, force.friction = 0.25, force.friction_speed = 0.02;
  builder.addJointForce("joint_d", force);
  const Model model = builder.build();
  const UrdfText text = formatUrdf(model);
  for (const char* lost : {"closure 'three'", "joint 'joint_d': its spring", "joint 'joint_d': its friction_speed",
                           "'joint_a': their armature", "motors"})
    CHECK(std::any_of(text.warnings.begin(), text.warnings.end(),
                      [&](const std::string& w) { return w.find(lost) != std::string::npos; }));
  CHECK(text.warnings.size() == 5);
  CHECK(text.urdf.find("<dynamics damping=\"0.5\" friction=\"0.25\"/>") != std::string::npos);
  CHECK(text.urdf.find("effort=\"7\" velocity=\"3\"") != std::string::npos);
  const RobotDirectory directory;
  const Model back = loadRobot(directory.writeRobot(text.urdf, "")).model;
  REQUIRE(back.jointForces().size() == 1);
  CHECK((back.jointForces()[0].damping == 0.5 && back.jointForces()[0].friction == 0.25));
  REQUIRE(back.closures().size() == 2);
  // Both say the same of every configuration on them: q_b = 2/3 q_a - 0.2, q_c = -q_b.
  for (const Closure& closure : back.closures()) {
    const bool is_pair = closure.name == "joint_b";
    CHECK((is_pair || closure.name == "joint_c"));
    const VectorXd q = (VectorXd(4) << 0.9, 0.4, -0.4, 0).finished();
    double residual = -closure.offset;
    for (const CouplerTerm& term : closure.terms) residual += term.coefficient * q[term.idx_q];
    CHECK(std::abs(residual) < 1e-15);
    CHECK(closure.terms.size() == 2);
  }
  CHECK_THAT(getError([] { formatUrdf(loadRobot("cleobot").model); }),
             Catch::Contains("URDF does not support such joints"));
}
