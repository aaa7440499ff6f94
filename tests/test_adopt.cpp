// Files that complete the robots of others: feet, postures and serial joints are found again in robots that have lost them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/motion/motion.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/robot_loader.h"
#include "dynamics/smooth_friction.h"
#include "formats/adopt.h"
#include "get_error.h"
#include "math/so3.h"
#include "model/number_text.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("an adopted robot has the feet, the serial joints and a posture of the one that it was") {
  for (const char* name : {"rsu_biped", "cleobot", "bipetto"}) {
    CAPTURE(name);
    const Model original = loadRobot(name).model;
    ModelParts parts = takeParts(original);
    parts.contacts.clear();
    parts.references.clear();
    parts.serial_joints.clear();
    for (Motor& motor : parts.motors) motor.armature = 0, motor.effort_limit = 1;
    parts.armature.setZero();
    const RobotText bare = formatRobot(ModelBuilder::restore(parts));
    const RobotDirectory directory;
    const LoadedRobot published = loadRobot(directory.writeRobot(bare.urdf, bare.yaml));
    const Adoption adoption = adoptRobot(published, "../robot.urdf");
    CAPTURE(adoption.yaml);
    const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;

    REQUIRE(model.contacts().size() == 2);
    for (const ContactFrame& contact : original.contacts()) {
      const int i = model.findContact(contact.name);
      REQUIRE(i >= 0);
      CHECK(model.bodies()[model.contacts()[i].body].name == original.bodies()[contact.body].name);
      CHECK((model.contacts()[i].X_BF.p - contact.X_BF.p).norm() < 0.05);
    }
    REQUIRE(model.references().size() == 1);
    const AssemblyResult posture = assembleReference(model, "half_sitting");
    CHECK(posture.status == NumericalStatus::Ok);
    Workspace ws(model);
    updatePositions(model, ws, posture.q);
    for (const ContactFrame& contact : model.contacts()) {
      const SE3 X = getPlacement(ws, contact.body, contact.X_BF);
      CHECK(std::abs(X.p.z()) < 1e-9);
      CHECK(X.R(2, 2) > 1 - 1e-9);
      CHECK((X.p.y() > 0) == (contact.name == "foot_left"));
    }
    for (const Motor& motor : model.motors()) {
      CHECK(motor.armature == 1e-3);
      CHECK(std::isinf(motor.effort_limit));
    }
    CHECK(adoption.guesses.size() >= 5);
    if (name == std::string("rsu_biped")) CHECK(model.serialJoints().size() == 12);
  }
  const LoadedRobot delta = loadRobot("delta");
  CHECK_THAT(getError([&] { adoptRobot(delta, "delta"); }),
             Catch::Contains("it has a fixed base; only robots that stand"));
}

TEST_CASE("an adopted foot is a sole, a blade or a point by its shape") {
  struct Case {
    Vector3d half;  // in the axes of the foot, m
    double radius;
    ContactKind kind;
    double length;
  };
  for (const Case& c :
       {Case{{0.1, 0.04, 0.01}, 0, ContactKind::Surface6D, 0.2}, Case{{0.1, 0.01, 0.01}, 0, ContactKind::Edge5D, 0.2},
        Case{{0.08, 0, 0}, 0.02, ContactKind::Edge5D, 0.16}, Case{{0, 0, 0}, 0.03, ContactKind::Point3D, 0}}) {
    CAPTURE(getName(c.kind), c.radius);
    const Model original = loadRobot("rsu_biped").model;
    ModelParts parts = takeParts(original);
    for (const ContactFrame& contact : parts.contacts) {
      parts.shapes.erase(std::remove_if(parts.shapes.begin(), parts.shapes.end(),
                                        [&](const Shape& shape) { return shape.body == contact.body; }),
                         parts.shapes.end());
      parts.visuals.erase(std::remove_if(parts.visuals.begin(), parts.visuals.end(),
                                         [&](const Visual& visual) { return visual.body == contact.body; }),
                          parts.visuals.end());
      Shape shape;
      shape.body = contact.body;
      shape.X_BS = contact.X_BF;
      shape.half = c.half;
      shape.radius = c.radius;
      if (c.radius > 0 && c.half.x() > 0) {  // a capsule lies along z of its own frame
        shape.X_BS.R = contact.X_BF.R * Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()).toRotationMatrix();
        shape.half = {0, 0, c.half.x()};
      }
      parts.shapes.push_back(shape);
    }
    parts.contacts.clear();
    parts.references.clear();
    const RobotText bare = formatRobot(ModelBuilder::restore(parts));
    const RobotDirectory directory;
    const Adoption adoption = adoptRobot(loadRobot(directory.writeRobot(bare.urdf, bare.yaml)), "../robot.urdf");
    CAPTURE(adoption.yaml);
    const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
    REQUIRE(model.contacts().size() == 2);
    for (const ContactFrame& contact : model.contacts()) {
      CHECK(contact.kind == c.kind);
      CHECK(2 * contact.half_length == Approx(c.length).margin(1e-3));
    }
  }
}

TEST_CASE("an adopted robot starts from the posture of its file, if it has one") {
  const Model original = loadRobot("rsu_biped").model;
  const VectorXd q = assembleReference(original, "half_sitting").q;
  ModelParts parts = takeParts(original);
  parts.contacts.clear();
  parts.references.clear();
  Reference home;
  home.name = "home";
  for (const Joint& joint : original.joints())
    if (joint.nq > 0)
      home.joints[joint.name] = std::vector<double>(q.data() + joint.idx_q, q.data() + joint.idx_q + joint.nq);
  parts.references.push_back(home);
  const RobotText bare = formatRobot(ModelBuilder::restore(parts));
  const RobotDirectory directory;
  const Adoption adoption = adoptRobot(loadRobot(directory.writeRobot(bare.urdf, bare.yaml)), "../robot.urdf");
  CAPTURE(adoption.yaml);
  CHECK(adoption.yaml.find("the posture 'home' of the robot") != std::string::npos);
  const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
  const AssemblyResult posture = assembleReference(model, "half_sitting");
  REQUIRE(posture.status == NumericalStatus::Ok);
  // Knees bent as there, and a little more: the base is lower.
  for (const char* knee : {"knee_left", "knee_right"}) {
    const int i = original.joints()[original.findJoint(knee)].idx_q;
    CHECK(std::abs(posture.q[i] - q[i]) < 0.5);
    CHECK(posture.q[i] * q[i] > 0);
  }
}

TEST_CASE("an adopted robot stands at home, wherever the posture of its file is") {
  const Model original = loadRobot("rsu_biped").model;
  const VectorXd q = assembleReference(original, "half_sitting").q;
  std::string at_home;
  for (const double heading : {0.0, 1.9}) {
    CAPTURE(heading);
    ModelParts parts = takeParts(original);
    parts.contacts.clear();
    parts.references.clear();
    const SE3 X{makeAxisRotation(Vector3d::UnitZ(), heading), heading * Vector3d(1, -2, 0.5)};
    const VectorXd carried = carryPosture(original, q, X);
    Reference home;
    home.name = "home";
    for (const Joint& joint : original.joints())
      if (joint.nq > 0)
        home.joints[joint.name] =
            std::vector<double>(carried.data() + joint.idx_q, carried.data() + joint.idx_q + joint.nq);
    parts.references.push_back(home);
    const RobotText bare = formatRobot(ModelBuilder::restore(parts));
    const RobotDirectory directory;
    const Adoption adoption = adoptRobot(loadRobot(directory.writeRobot(bare.urdf, bare.yaml)), "../robot.urdf");
    if (heading == 0) at_home = adoption.yaml;
    CHECK(adoption.yaml == at_home);
  }
}

TEST_CASE("an adopted robot bends its knees the way that their ranges allow") {
  for (const auto& [lower, upper] : {std::pair{0.02, 2.0}, {-2.0, -0.02}}) {
    CAPTURE(lower);
    ModelParts parts = takeParts(loadRobot("rsu_biped").model);
    parts.contacts.clear();
    parts.references.clear();
    for (const Joint& joint : parts.joints)
      if (joint.name.rfind("knee", 0) == 0)
        parts.lower_limits[joint.idx_v] = lower, parts.upper_limits[joint.idx_v] = upper;
    const RobotText bare = formatRobot(ModelBuilder::restore(parts));
    const RobotDirectory directory;
    const Adoption adoption = adoptRobot(loadRobot(directory.writeRobot(bare.urdf, bare.yaml)), "../robot.urdf");
    CAPTURE(adoption.yaml);
    const LoadedRobot adopted = loadRobot(directory.write("mine/mine.yaml", adoption.yaml));
    REQUIRE(adopted.model.references().size() == 1);
    CHECK(checkReferences(adopted).empty());
    const AssemblyResult posture = assembleReference(adopted.model, "half_sitting");
    REQUIRE(posture.status == NumericalStatus::Ok);
    for (const char* knee : {"knee_left", "knee_right"}) {
      const double q = posture.q[adopted.model.joints()[adopted.model.findJoint(knee)].idx_q];
      CHECK(q > lower);
      CHECK(q < upper);
    }
    CHECK(2 * std::asin(posture.q.segment<3>(3).norm()) < 0.1);  // the trunk is upright
  }
}

TEST_CASE("a frame that is named like a foot is no sole where its shapes reach below it") {
  // Legs of six joints; the frames of the last bodies are at the ankles.
  const auto makeLeg = [](const std::string& last, const std::string& side, const std::string& y) {
    const auto body = [&side](const std::string& name, const std::string& place, const std::string& joints,
                              double mass) {
      std::string text = "<body name='" + name + "_" + side + "' pos='" + place + "'><inertial pos='0 0 -.1' mass='" +
                         formatNumber(mass) + "' diaginertia='.01 .01 .01'/>";
      for (size_t at = 0; at + 1 < joints.size(); at += 2)
        text += "<joint name='" + name + joints.substr(at, 2) + "_" + side + "' axis='" +
                (joints[at + 1] == 'x'   ? "1 0 0"
                 : joints[at + 1] == 'y' ? "0 1 0"
                                         : "0 0 1") +
                "'/>";
      return text;
    };
    return body("thigh", "0 " + y + " 0", "_z_x_y", 3) + body("shank", "0 0 -.4", "_y", 2) +
           body(last, "0 0 -.4", "_y_x", 1) +
           "<geom type='box' pos='.03 0 -.045' size='.09 .035 .01'/></body></body></body>";
  };
  for (const std::string last : {"foot", "ankle_roll_link"}) {
    const RobotDirectory directory;
    const std::string path = directory.write(
        "biped.xml",
        "<mujoco><compiler angle='radian'/><worldbody><body name='trunk' pos='0 0 .9'><freejoint/><inertial "
        "pos='0 0 .2' mass='20' diaginertia='.5 .5 .5'/>" +
            makeLeg(last, "left", ".1") + makeLeg(last, "right", "-.1") + "</body></worldbody></mujoco>");
    const Adoption adoption = adoptRobot(loadRobot(path), "../biped.xml");
    CAPTURE(last, adoption.yaml);
    const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
    REQUIRE(model.contacts().size() == 2);
    for (const ContactFrame& contact : model.contacts()) {
      CHECK((contact.X_BF.p - Vector3d(0.03, 0, -0.055)).norm() < 1e-6);
      CHECK(contact.half_length == Approx(0.09));
      CHECK(contact.half_width == Approx(0.035));
    }
    Workspace ws(model);
    updatePositions(model, ws, assembleReference(model, "half_sitting").q);
    for (const ContactFrame& contact : model.contacts())
      CHECK(std::abs(getPlacement(ws, contact.body, contact.X_BF).p.z()) < 1e-6);
  }
}

TEST_CASE("a robot that cannot be adopted is named as in all other messages") {
  const RobotDirectory directory;
  const std::string path = directory.write(
      "arm.xml",
      "<mujoco><worldbody><body name='arm'><joint name='turn' axis='0 1 0'/><inertial pos='0 0 1' mass='1' "
      "diaginertia='1 1 1'/></body></worldbody></mujoco>");
  CHECK(getError([&] { adoptRobot(loadRobot(path), "../../arm.xml"); }).rfind(path + ": robot ", 0) == 0);
}

TEST_CASE("a robot whose gravity is not along -z cannot be adopted, since the ground is level there") {
  const RobotDirectory directory;
  const LoadedRobot robot = loadRobot(directory.write(
      "robot.xml",
      "<mujoco><option gravity='0 -9.81 0'/><worldbody><body name='trunk'><freejoint/><geom size='.1'/><body "
      "name='leg'><joint name='hip' axis='0 0 1'/><geom pos='0 -.4 0' "
      "size='.03'/></body></body></worldbody></mujoco>"));
  CHECK_THAT(getError([&] { adoptRobot(robot, "robot.xml"); }),
             Catch::Contains("gravity points along (0, -9.81, 0)") && Catch::Contains("turn it"));
}

TEST_CASE("an adopted robot says where the dead points of its linkages are") {
  // A four-bar at the knee whose crank turns wholly (robots/parts/knee/four_bar.yaml): the knee turns back where crank and rod are in
  // line, l +- c from the motor to the end of the arm, which is at the angle psi from the thigh, cos psi = sin(knee - middle).
  const double thigh = 0.22, crank = 0.04, arm = 0.05, rod = std::hypot(thigh, crank - arm);
  for (const double middle : {1.2, 1.6}) {
    CAPTURE(middle);
    const OptionValues values = {{"knee", "four_bar"},  {"ankle", "serial"}, {"thigh_length", thigh},
                                 {"knee_crank", crank}, {"knee_arm", arm},   {"knee_middle", middle}};
    const Generator generator = findGenerator("leg_biped", values);
    OptionSet parameters = generator.parameters;
    for (const auto& [name, value] : values) parameters.set(name, value);
    ModelParts parts = takeParts(generator.make(parameters));
    parts.contacts.clear();
    parts.references.clear();
    const RobotText bare = formatRobot(ModelBuilder::restore(parts));
    const RobotDirectory directory;
    const Adoption adoption = adoptRobot(loadRobot(directory.writeRobot(bare.urdf, bare.yaml)), "../robot.urdf");
    CAPTURE(adoption.yaml);
    CHECK(loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model.references().size() == 1);
    for (const double reach : {rod - crank, rod + crank}) {
      const double knee = middle + std::asin((thigh * thigh + arm * arm - reach * reach) / (2 * thigh * arm));
      const std::string text = "knee_left at " + formatNumber(knee, "%.4g") + ", ";
      CAPTURE(text);
      CHECK(std::any_of(adoption.guesses.begin(), adoption.guesses.end(), [&](const std::string& guess) {
        return guess.find(text) != std::string::npos && guess.find("it turns back") != std::string::npos;
      }));
    }
  }
}

namespace {

// A leg of a biped of MuJoCo, straight down from the hip. The frames of thigh, shank and toe have x down, and the toe's
// is turned by another 40 degrees; that of the hip alone is upright.
// \param geom  of the toe, without its place: 3 cm before and 5 cm below the ankle
std::string makeBareLeg(const std::string& side, double y, const std::string& geom) {
  const auto begin = [&side](const std::string& name, const std::string& place, const std::string& joint) {
    return "<body name='" + name + "_" + side + "' " + place +
           "><inertial pos='0.1 0 0' mass='0.5' diaginertia='.01 .01 .01'/>" + "<joint name='" + joint + "_" + side +
           "' ";
  };
  return begin("hip", "pos='0 " + std::to_string(y) + " 0'", "roll") +
         "axis='1 0 0'/><geom type='sphere' size='.05'/>" + begin("thigh", "euler='0 90 0'", "pitch") +
         "axis='0 1 0'/><geom type='capsule' size='.04' fromto='0 0 0 .4 0 0'/>" +
         begin("shank", "pos='.4 0 0'", "knee") +
         "axis='0 1 0' range='-5 120'/><geom type='capsule' size='.03' fromto='0 0 0 .4 0 0'/>" +
         begin("toe", "pos='.4 0 0' euler='0 40 0'", "ankle") + "axis='0 1 0'/><geom pos='.0190185 0 .0551207' " +
         geom + "/></body></body></body></body>";
}

}  // namespace

TEST_CASE("feet without an upright frame are made on the lowest points of their shapes, along their flat side") {
  struct Case {
    std::string shape;
    double turn;  // about y, of x of the sole from the axes of the shape, degrees
    ContactKind kind;
    double length, thickness;  // m, from the middle of the shape to the sole
  };
  for (const Case& c : {Case{"type='capsule' size='.02 .07'", 90, ContactKind::Edge5D, 0.14, 0.02},
                        Case{"type='box' size='.1 .04 .01'", 0, ContactKind::Surface6D, 0.2, 0.01}})
    for (double tilt : {0.0, 10.0}) {  // of the toe in the posture of the file, degrees
      CAPTURE(c.shape, tilt);
      const std::string geom = c.shape + " euler='0 " + std::to_string(c.turn + tilt - 130) + " 0'";
      const RobotDirectory directory;
      const LoadedRobot bare = loadRobot(directory.write(
          "bare.xml",
          "<mujoco><worldbody><body name='trunk' pos='0 0 0.9'><freejoint/><inertial pos='0 0 0' mass='5' "
          "diaginertia='.1 .1 .1'/>" +
              makeBareLeg("left", 0.1, geom) + makeBareLeg("right", -0.1, geom) + "</body></worldbody></mujoco>"));
      const Adoption adoption = adoptRobot(bare, "../bare.xml");
      CAPTURE(adoption.yaml);
      const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
      REQUIRE(model.contacts().size() == 2);
      Workspace ws(model);
      updatePositions(model, ws, model.makeNeutral());  // the legs straight down
      const Vector3d hip = ws.X_WB[1].p;
      const double angle = tilt * M_PI / 180;
      for (const ContactFrame& contact : model.contacts()) {
        const double side = contact.name == "foot_left" ? 1 : -1;
        CHECK(model.bodies()[contact.body].name == (side > 0 ? "toe_left" : "toe_right"));
        CHECK(contact.kind == c.kind);
        CHECK(2 * contact.half_length == Approx(c.length));
        const SE3 X = getPlacement(ws, contact.body, contact.X_BF);
        const Vector3d ahead(std::cos(angle), 0, -std::sin(angle)), up(std::sin(angle), 0, std::cos(angle));
        const Vector3d place = hip + Vector3d(0.03, side * 0.1, -0.85) - c.thickness * up;
        CHECK((X.p - place).norm() < 1e-6);
        CHECK((X.R.col(0) - ahead).norm() < 1e-6);
        CHECK((X.R.col(2) - up).norm() < 1e-6);
      }
      CHECK(assembleReference(model, "half_sitting").status == NumericalStatus::Ok);
    }
}

TEST_CASE("friction of an adopted robot is such that steps of motions follow it near rest") {
  const RobotDirectory directory;
  const std::string geom = "type='box' size='.1 .04 .01' euler='0 -130 0'";
  const LoadedRobot bare = loadRobot(directory.write(
      "bare.xml",
      "<mujoco><default><joint frictionloss='.3' damping='.05' armature='.002'/></default><worldbody><body "
      "name='trunk' "
      "pos='0 0 0.9'><freejoint/><inertial pos='0 0 0' mass='5' diaginertia='.1 .1 .1'/>" +
          makeBareLeg("left", 0.1, geom) + makeBareLeg("right", -0.1, geom) + "</body></worldbody></mujoco>"));
  const Adoption adoption = adoptRobot(bare, "../bare.xml");
  CAPTURE(adoption.yaml);
  const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
  const VectorXd q = assembleReference(model, "half_sitting").q;
  const auto listRaised = [&](const Model& robot) {
    return calcSmoothFriction(robot, makeConstraintSet(robot), q, 0.015).raised;
  };
  CHECK(listRaised(bare.model).size() == 8);
  CHECK(listRaised(model).empty());
  REQUIRE(model.jointForces().size() == 8);
  for (const JointForce& force : model.jointForces()) {
    CHECK(force.friction == 0.3);
    CHECK(force.damping == 0.05);
    CHECK(force.friction_speed > 0.01);
    CHECK(force.friction_speed < 2);
  }
}

TEST_CASE("an adopted robot stands on legs that cannot be as they are in the neutral configuration") {
  // Legs are slides, whose feet are at the hips at zero.
  const auto makeLeg = [](const std::string& side, const std::string& y) {
    const auto body = [&side](const std::string& name, const std::string& place, const std::string& joints) {
      return "<body name='" + name + "_" + side + "' pos='" + place +
             "'><inertial pos='0 0 0' mass='1' diaginertia='.01 .01 .01'/>" + joints;
    };
    const auto joint = [&side](const std::string& name, const std::string& more) {
      return "<joint name='" + name + "_" + side + "' " + more + "/>";
    };
    return body("thigh", "0 " + y + " 0",
                joint("roll", "axis='1 0 0' range='-.5 .5'") + joint("pitch", "axis='0 1 0' range='-.8 .8'")) +
           body("shank", "0 0 0", joint("length", "type='slide' axis='0 0 -1' range='.3 .7'")) +
           body("foot", "0 0 0",
                joint("ankle_pitch", "axis='0 1 0' range='-.8 .8'") +
                    joint("ankle_roll", "axis='1 0 0' range='-.5 .5'")) +
           "<geom type='box' pos='.02 0 -.03' size='.09 .035 .01'/></body></body></body>";
  };
  const RobotDirectory directory;
  const std::string path = directory.write(
      "biped.xml",
      "<mujoco><compiler angle='radian'/><worldbody><body name='trunk' pos='0 0 .9'><freejoint/><inertial "
      "pos='0 0 .2' mass='20' diaginertia='.5 .5 .5'/>" +
          makeLeg("left", ".1") + makeLeg("right", "-.1") + "</body></worldbody></mujoco>");
  const Adoption adoption = adoptRobot(loadRobot(path), "../biped.xml");
  CAPTURE(adoption.yaml);
  const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
  REQUIRE(model.references().size() == 1);
  const AssemblyResult posture = assembleReference(model, "half_sitting");
  REQUIRE(posture.status == NumericalStatus::Ok);
  for (const char* leg : {"length_left", "length_right"}) {
    const double length = posture.q[model.joints()[model.findJoint(leg)].idx_q];
    CHECK(length > 0.3);
    CHECK(length < 0.7);
  }
}

namespace {

// A machine of MuJoCo on legs of a roll, a pitch and a knee, with balls for feet, at these places below the trunk.
std::string makeBalls(const std::vector<Vector3d>& hips) {
  std::string legs;
  for (size_t i = 0; i < hips.size(); ++i) {
    const std::string number = std::to_string(i);
    const auto begin = [&number](const std::string& name, const std::string& place, const std::string& axis) {
      return "<body name='" + name + number + "' pos='" + place +
             "'><inertial pos='0 0 -.1' mass='.5' diaginertia='.01 .01 .01'/>" + "<joint name='" + name + number +
             "' axis='" + axis + "'/>";
    };
    legs += begin("roll", std::to_string(hips[i].x()) + " " + std::to_string(hips[i].y()) + " 0", "1 0 0") +
            begin("pitch", "0 0 0", "0 1 0") + begin("knee", "0 0 -.2", "0 1 0' range='5 120") +
            "<geom type='sphere' size='.02' pos='0 0 -.2'/></body></body></body>";
  }
  return "<mujoco><worldbody><body name='trunk' pos='0 0 .5'><freejoint/><inertial pos='0 0 0' mass='8' "
         "diaginertia='.1 .2 .2'/>"
         "<geom type='box' size='.3 .1 .05'/>" +
         legs + "</body></worldbody></mujoco>";
}

}  // namespace

TEST_CASE("a robot of more than two legs is adopted with a point for each foot, and motors where none are given") {
  struct Case {
    std::vector<Vector3d> hips;
    std::vector<std::string> names;
  };
  for (const Case& c :
       {Case{{{-0.25, 0.1, 0}, {0.25, -0.1, 0}, {-0.25, -0.1, 0}, {0.25, 0.1, 0}},
             {"foot_back_left", "foot_front_right", "foot_back_right", "foot_front_left"}},
        Case{{{0, -0.2, 0}, {0.25, 0, 0}, {0, 0.2, 0}, {-0.25, 0, 0}}, {"foot_3", "foot_1", "foot_2", "foot_4"}}}) {
    const RobotDirectory directory;
    const Adoption adoption = adoptRobot(loadRobot(directory.write("bare.xml", makeBalls(c.hips))), "../bare.xml");
    CAPTURE(adoption.yaml);
    const LoadedRobot robot = loadRobot(directory.write("mine/mine.yaml", adoption.yaml));
    const Model& model = robot.model;
    REQUIRE(model.contacts().size() == 4);
    CHECK(model.nu() == 12);
    const AssemblyResult posture = assembleReference(model, "half_sitting");
    REQUIRE(posture.status == NumericalStatus::Ok);
    Workspace ws(model);
    updatePositions(model, ws, posture.q);
    for (size_t i = 0; i < 4; ++i) {
      CAPTURE(c.names[i]);
      const int k = model.findContact(c.names[i]);
      REQUIRE(k >= 0);
      const ContactFrame& contact = model.contacts()[static_cast<size_t>(k)];
      CHECK(model.bodies()[static_cast<size_t>(contact.body)].name == "knee" + std::to_string(i));
      CHECK(contact.kind == ContactKind::Point3D);
      const Vector3d place = getPlacement(ws, contact.body, contact.X_BF).p;
      CHECK((place - c.hips[i]).norm() < 1e-9);  // on the ground, where the hips were
    }
  }
}

TEST_CASE("legs of a robot without shapes end where their last links do, if these are rods, on points") {
  const auto link = [](const std::string& name, double length) {  // a rod of that length downwards
    const double mass = 0.3, moment = mass * length * length / 12;
    return "<link name=\"" + name + "\"><inertial><origin xyz=\"0 0 " + formatNumber(-length / 2) +
           "\"/><mass value=\"" + formatNumber(mass) + "\"/><inertia ixx=\"" + formatNumber(moment) +
           "\" ixy=\"0\" ixz=\"0\" iyy=\"" + formatNumber(moment) + "\" iyz=\"0\" izz=\"0\"/></inertial></link>";
  };
  const auto joint = [](const std::string& parent, const std::string& child, const std::string& place,
                        const std::string& axis) {
    return "<joint name=\"to_" + child + "\" type=\"revolute\"><parent link=\"" + parent + "\"/><child link=\"" +
           child + "\"/><origin xyz=\"" + place + "\"/><axis xyz=\"" + axis +
           "\"/><limit lower=\"-10\" upper=\"10\" effort=\"9\" velocity=\"9\"/></joint>";
  };
  std::string urdf =
      "<robot name=\"cheetah\"><link name=\"trunk\"><inertial><mass value=\"5\"/><inertia ixx=\"0.1\" ixy=\"0\" "
      "ixz=\"0\" "
      "iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial></link>";
  for (const auto& [leg, hip] :
       {std::pair("fl", "0.2 0.1 0"), {"fr", "0.2 -0.1 0"}, {"bl", "-0.2 0.1 0"}, {"br", "-0.2 -0.1 0"}}) {
    const std::string name = leg;
    urdf += link(name + "_hip", 0.05) + link(name + "_thigh", 0.2) + link(name + "_shank", 0.18) +
            joint("trunk", name + "_hip", hip, "1 0 0") + joint(name + "_hip", name + "_thigh", "0 0 0", "0 1 0") +
            joint(name + "_thigh", name + "_shank", "0 0 -0.2", "0 1 0");
  }
  const RobotDirectory directory;
  const Adoption adoption = adoptRobot(loadRobot(directory.writeRobot(urdf + "</robot>", "")), "../robot.urdf");
  CAPTURE(adoption.yaml);
  CHECK_THAT(adoption.yaml, Catch::Contains("uniform rods"));
  const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
  REQUIRE(model.contacts().size() == 4);
  const AssemblyResult posture = assembleReference(model, "half_sitting");
  REQUIRE(posture.status == NumericalStatus::Ok);
  Workspace ws(model);
  updatePositions(model, ws, posture.q);
  for (const ContactFrame& contact : model.contacts()) {
    CHECK(contact.kind == ContactKind::Point3D);
    CHECK(model.bodies()[static_cast<size_t>(contact.body)].name.find("_shank") != std::string::npos);
    CHECK((contact.X_BF.p - Vector3d(0, 0, -0.18)).norm() < 1e-6);
    CHECK(std::abs(getPlacement(ws, contact.body, contact.X_BF).p.z()) < 1e-9);
  }
}

TEST_CASE("feet whose frames face backward get frames that face forward, so that they can stand") {
  // Four legs without shapes whose thighs are turned by half a turn.
  const auto link = [](const std::string& name, double mass) {
    return "<link name=\"" + name + "\"><inertial><mass value=\"" + std::to_string(mass) +
           "\"/><inertia ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.02\" iyz=\"0\" izz=\"0.02\"/></inertial></link>";
  };
  const auto joint = [](const std::string& parent, const std::string& child, const std::string& place,
                        const std::string& axis) {
    return "<joint name=\"to_" + child + "\" type=\"revolute\"><parent link=\"" + parent + "\"/><child link=\"" +
           child + "\"/><origin " + place + "/><axis xyz=\"" + axis +
           "\"/><limit lower=\"-10\" upper=\"10\" effort=\"9\" " + "velocity=\"9\"/></joint>";
  };
  std::string urdf = "<robot name=\"cat\">" + link("trunk", 5);
  for (const auto& [leg, hip] :
       {std::pair("fl", "0.2 0.1 0"), {"fr", "0.2 -0.1 0"}, {"bl", "-0.2 0.1 0"}, {"br", "-0.2 -0.1 0"}}) {
    const std::string name = leg;
    urdf += link(name + "_hip", 0.5) + link(name + "_thigh", 0.5) + link(name + "_shank", 0.1) +
            link(name + "_toes", 0.1) + joint("trunk", name + "_hip", "xyz=\"" + std::string(hip) + "\"", "1 0 0") +
            joint(name + "_hip", name + "_thigh", "rpy=\"0 0 3.141592653589793\"", "0 1 0") +
            joint(name + "_thigh", name + "_shank", "xyz=\"0 0 -0.2\"", "0 1 0") +
            joint(name + "_shank", name + "_toes", "xyz=\"0 0 -0.2\"", "0 1 0");
  }
  const RobotDirectory directory;
  const Adoption adoption = adoptRobot(loadRobot(directory.writeRobot(urdf + "</robot>", "")), "../robot.urdf");
  CAPTURE(adoption.yaml);
  CHECK(adoption.yaml.find("add a link without mass under each foot, z up and x forward") != std::string::npos);
  const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
  const AssemblyResult posture = assembleReference(model, "half_sitting");
  REQUIRE(posture.status == NumericalStatus::Ok);
  Workspace ws(model);
  updatePositions(model, ws, posture.q);
  REQUIRE(model.contacts().size() == 4);
  for (const ContactFrame& contact : model.contacts()) {
    const SE3 X = getPlacement(ws, contact.body, contact.X_BF);
    CHECK((X.R - Matrix3d::Identity()).norm() < 1e-9);
    CHECK(std::abs(X.p.z()) < 1e-9);
    CHECK(model.bodies()[static_cast<size_t>(contact.body)].name.find("_toes") != std::string::npos);
  }
  CHECK(std::abs(calcCom(model, ws).x()) < 0.01);
  CHECK_THAT(adoption.yaml, Catch::Contains("Where legs reach below these frames"));
}

TEST_CASE(
    "motors that are guessed move a robot as its mobility is, in loops by their cranks, with the efforts of the file") {
  // A biped without its motors: joints of knees that four-bars drive, and free ones.
  const OptionValues values = {{"knee", "four_bar"}, {"ankle", "serial"}};
  const Generator generator = findGenerator("leg_biped", values);
  OptionSet parameters = generator.parameters;
  for (const auto& [name, value] : values) parameters.set(name, value);
  const Model whole = generator.make(parameters);
  ModelParts parts = takeParts(whole);
  parts.motors.clear();
  const RobotText bare = formatRobot(ModelBuilder::restore(parts));
  const RobotDirectory directory;
  std::string urdf = bare.urdf;
  const size_t effort = urdf.find("effort=\"") + 8;
  urdf.replace(effort, urdf.find('"', effort) - effort, "47");
  const Adoption adoption = adoptRobot(loadRobot(directory.writeRobot(urdf, bare.yaml)), "../robot.urdf");
  CAPTURE(adoption.yaml);
  CHECK(adoption.guesses[0].rfind("Motors: none are given; these 12 joints", 0) == 0);
  const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
  std::set<std::string> guessed, own;
  for (const Motor& motor : model.motors()) guessed.insert(motor.name);
  for (const Motor& motor : whole.motors()) own.insert(motor.name);
  CHECK(guessed == own);
  CHECK(std::count_if(model.motors().begin(), model.motors().end(),
                      [](const Motor& motor) { return motor.effort_limit == 47; }) == 1);
}
