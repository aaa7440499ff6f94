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
#include "bielle/results/result.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/robot_loader.h"
#include "change_model.h"
#include "formats/drake.h"
#include "formats/mjcf.h"
#include "formats/mjcf_bodies.h"
#include "formats/mjcf_coordinates.h"
#include "formats/sdf.h"
#include "get_error.h"
#include "math/so3.h"
#include "mechanisms.h"
#include "published_robots.h"
#include "robot_difference.h"
#include "robot_directory.h"
#include "robot_trial.h"
#include "selection.h"

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
    CHECK(findClosedConfiguration(back).status == NumericalStatus::Ok);
    for (const Reference& reference : model.references()) {
      const AssemblyResult a = assembleReference(model, reference.name), b = assembleReference(back, reference.name);
      const VectorXd q = mapConfiguration(model, back, written.q_ref, a.q);
      CHECK(back.difference(q, b.q).cwiseAbs().maxCoeff() < 1e-9);
    }
  }
}

TEST_CASE("feet of every kind come back from MJCF, and soles of spheres at their corners") {
  const auto checkContact = [](const std::string& xml, const ContactFrame& contact) {
    const Model back = readMjcfText(xml);
    REQUIRE(back.contacts().size() == 2);
    const ContactFrame& found = back.contacts()[back.findContact(contact.name)];
    CHECK(found.kind == contact.kind);
    CHECK(found.half_length == Approx(contact.half_length).margin(1e-12));
    CHECK(found.half_width == Approx(contact.half_width).margin(1e-12));
    CHECK((found.X_BF.R - contact.X_BF.R).norm() + (found.X_BF.p - contact.X_BF.p).norm() < 1e-12);
  };
  const Model sole = loadRobot("bipetto").model;
  const VectorXd q_ref = findClosedConfiguration(sole).q;
  for (const ContactKind kind : {ContactKind::Point3D, ContactKind::Edge5D, ContactKind::Surface6D}) {
    CAPTURE(int(kind));
    const Model model = changeModel(sole, [kind](ModelParts& parts) {
      if (kind != ContactKind::Surface6D) parts.contacts[0].half_width = 0;
      if (kind == ContactKind::Point3D) parts.contacts[0].half_length = 0;
      parts.contacts[0].kind = kind;
      parts.contacts[0].X_BF.R = exp3(Vector3d(0.1, 0.2, 0.3));
    });
    checkContact(formatMjcf(model, q_ref).xml, model.contacts()[0]);
  }
  std::string xml = formatMjcf(sole, q_ref).xml;
  const ContactFrame& contact = sole.contacts()[0];
  const size_t from = xml.rfind('<', xml.find("name=\"" + contact.name + ".1\"")), to = xml.find('>', from) + 1;
  std::string spheres;
  for (int i = 0; i < 4; ++i) {
    const Vector3d at = contact.X_BF.act(
        Vector3d((i < 2 ? 1 : -1) * contact.half_length, (i % 2 == 0 ? 1 : -1) * contact.half_width, 0.005));
    spheres += "<geom class='sole' size='0.005' name='" + contact.name + "." + std::to_string(i + 1) + "' pos='" +
               formatMjcf(at) + "'/>";
  }
  checkContact(xml.replace(from, to - from, spheres), contact);
}

// Of another version of the program, a comment in the text stands for its way of writing.
TEST_CASE("every robot comes back from a result, and is known again by its text, whatever version wrote it") {
  for (const std::string& name : listRobots()) {
    CAPTURE(name);
    const LoadedRobot robot = loadRobot(name);
    RunInfo run = makeRunInfo(name, robot);
    REQUIRE(run.mechanism.urdf != "");
    CHECK(calcFingerprint(run.mechanism).size() == 16);
    const RobotDirectory directory;
    const auto load = [&](const std::string& file) {
      directory.write("mechanism.urdf", run.mechanism.urdf);
      directory.write("mechanism.yaml", run.mechanism.yaml);
      directory.write("summary.json", R"({"robot": ")" + name + R"(", "robot_file": ")" + file +
                                          R"(", "robot_fingerprint": ")" + calcFingerprint(run.mechanism) + R"("})");
      return loadRobotOf(directory.path());
    };
    const LoadedRobot alone = load("/gone.urdf");
    const Difference d = compare(robot.model, alone.model, robot.model.makeNeutral());
    CHECK(d.missing == "");
    CHECK(d.isZero());
    CHECK(alone.warnings.empty());
    CHECK(fs::path(alone.file).filename() == "mechanism.urdf");
    CHECK(load(robot.file).file == robot.file);
    run.mechanism.yaml = "# of another version\n" + run.mechanism.yaml;
    const LoadedRobot known = load(robot.file);
    CHECK(known.file == robot.file);
    CHECK(known.warnings.empty());
  }
}

TEST_CASE("generated robots come back from MJCF") {
  for (const Generator& generator : listGenerators()) {
    CAPTURE(generator.name);
    const Model model = generator.make(generator.parameters);
    checkMjcfRoundTrip(model, findClosedConfiguration(model).q);
  }
}

TEST_CASE("random mechanisms come back from MJCF: every joint, closure, base, springs and belts", "[sweep]") {
  unsigned seed = 0;
  Selection selection;
  for (const MechanismKind& kind : listMechanismKinds()) {
    if (kind.closure == ClosureKind::Slider) continue;  // which MuJoCo does not have
    CAPTURE(kind);
    std::mt19937 rng(++seed);
    if (selection.isLeftOut()) continue;
    const Mechanism plain = makeRandomMechanism(rng, kind.joint, kind.closure, kind.base);
    checkMjcfRoundTrip(plain.model, plain.q_closed);
    const Mechanism belted = makeBeltedMechanism(rng, kind.joint, kind.closure, kind.base, true);
    checkMjcfRoundTrip(belted.model, belted.q_closed);
    if (getNv(kind.joint) != 1) {  // couplers of two joints
      const Mechanism cammed = makeCammedMechanism(rng, kind.joint, kind.closure, kind.base);
      checkMjcfRoundTrip(cammed.model, cammed.q_closed);
    }
    const Mechanism sprung = makeSprungMechanism(rng, kind.joint, kind.closure, kind.base);
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
  CHECK_THAT(warnings[1],
             Catch::Contains("point spring 'constant': its preload without a stiffness pulls, and is left out"));

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
  // Limits that there are not are large numbers, because zeros lock a joint elsewhere, and come back as none.
  CHECK(text.urdf.find("lower=\"-1e+16\" upper=\"1e+16\" effort=\"7\" velocity=\"3\"") != std::string::npos);
  CHECK(text.urdf.find("upper=\"1e+16\" effort=\"1e+16\" velocity=\"1e+16\"") != std::string::npos);
  const RobotDirectory directory;
  const Model back = loadRobot(directory.writeRobot(text.urdf, "")).model;
  CHECK((-back.lowerLimits().array() == HUGE_VAL && back.upperLimits().array() == HUGE_VAL).all());
  CHECK((back.velocityLimits().array() == HUGE_VAL).count() == 3);
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
             Catch::Contains("URDF has no such joints") && Catch::Contains("--to bielle"));
}

TEST_CASE("polynomials of couplers: exact in YAML, refused or told where a format cannot say them") {
  std::mt19937 rng(9);
  const Mechanism cam = makeCammedMechanism(rng, JointKind::Spherical, ClosureKind::Coupler, MechanismBase::Fixed);
  const RobotDirectory directory;
  const RobotText text = formatRobot(cam.model);
  const Model back = loadRobot(directory.writeRobot(text.urdf, text.yaml)).model;
  REQUIRE(back.closures().size() == 2);
  for (size_t t = 0; t < 2; ++t) {
    const CouplerTerm &a = cam.model.closures()[1].terms[t], &b = back.closures()[1].terms[t];
    CHECK((a.coefficient == b.coefficient && a.higher == b.higher));
    CHECK(a.isLinear() == (t == 0));
  }
  const std::vector<std::string> warnings = formatDrake(cam.model).warnings;
  CHECK(std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) {
    return w.find("closure 'belt': it is left out: <mimic> is linear") != std::string::npos;
  }));

  // Of three joints, or of two polynomials, or of the fifth degree: what the message asks for is taken.
  const auto make = [](const std::function<void(ModelBuilder&)>& couple) {
    ModelBuilder builder("arm");
    for (const char* name : {"a", "b", "c", "between"}) {
      Joint joint;
      joint.name = name;
      joint.kind = JointKind::Revolute;
      builder.addLink(std::string("link_") + name, "world", joint, {1, Vector3d::Zero(), Matrix3d::Identity()});
    }
    couple(builder);
    return builder.build();
  };
  const std::vector<double> square{1};
  for (const auto& couple : std::vector<std::function<void(ModelBuilder&)>>{
           [&](ModelBuilder& b) {
             b.addCoupler("cam", {{"a", 1}, {"b", 1}, {"c", 2}}, 0, 0, 0, {{"c", square}});
           },
           [&](ModelBuilder& b) {
             b.addCoupler("cam", {{"a", 1}, {"b", 1}}, 0, 0, 0, {{"a", square}, {"b", square}});
           },
           [&](ModelBuilder& b) {
             b.addCoupler("cam", {{"a", 1}, {"b", 1}}, 0, 0, 0, {{"b", {0, 0, 0, 1}}});
           }})
    CHECK_THAT(getError([&] { formatMjcf(make(couple), VectorXd::Zero(4)); }),
               Catch::Contains("closure 'cam'") && Catch::Contains("add a light link"));
  const Model split = make([&](ModelBuilder& b) {
    b.addCoupler("one", {{"between", 1}, {"b", 1}}, 0, 0, 0, {{"b", square}});
    b.addCoupler("other", {{"a", 1}, {"between", -1}}, 0, 0, 0, {{"a", square}});
  });
  checkMjcfRoundTrip(split, VectorXd::Zero(4));
}

TEST_CASE("feet of a reference keep their places and yaws in YAML; what is no yaw is refused") {
  const RobotDirectory directory;
  const std::string head = "tree:\n  biped: {part: rsu_biped}\nreferences:\n  half_sitting: {feet: {foot_left: ";
  const Model model =
      loadRobot(directory.write("toes/toes.yaml", head + "{place: [1, 2.125, 0.5], yaw: 0.3}}}\n")).model;
  const Reference& given = model.references().at(0);
  CHECK(given.feet.at("foot_left") == Vector3d(1, 2.125, 0.5));
  CHECK(given.yaws == std::map<std::string, double>{{"foot_left", 0.3}});
  const RobotText text = formatRobot(model);
  const Model again = loadRobot(directory.writeRobot(text.urdf, text.yaml)).model;
  CHECK(again.references().at(0).feet == given.feet);
  CHECK(again.references().at(0).yaws == given.yaws);
  for (const auto& [foot, problem] : {std::pair("{yaw: 0.3}", "place"),
                                      {"{place: [0, 0, 0], yaw: 20}", "half a turn"},
                                      {"{place: [0, 0, 0], turn: 1}", "turn"}}) {
    CAPTURE(foot);
    const std::string error =
        getError([&, foot = foot] { loadRobot(directory.write("wrong/wrong.yaml", head + foot + "}}\n")); });
    CHECK(error.find(problem) != std::string::npos);
    CHECK(error.find("wrong.yaml") != std::string::npos);
  }
}
