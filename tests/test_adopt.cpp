// Files that complete the robots of others: feet, postures and serial joints are found again in robots that have lost them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/robot_loader.h"
#include "formats/adopt.h"
#include "get_error.h"
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
    CHECK(posture.status == AssemblyStatus::Closed);
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
  REQUIRE(posture.status == AssemblyStatus::Closed);
  // Knees bent as there, and a little more: the base is lower.
  for (const char* knee : {"knee_left", "knee_right"}) {
    const int i = original.joints()[original.findJoint(knee)].idx_q;
    CHECK(std::abs(posture.q[i] - q[i]) < 0.5);
    CHECK(posture.q[i] * q[i] > 0);
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
    REQUIRE(posture.status == AssemblyStatus::Closed);
    for (const char* knee : {"knee_left", "knee_right"}) {
      const double q = posture.q[adopted.model.joints()[adopted.model.findJoint(knee)].idx_q];
      CHECK(q > lower);
      CHECK(q < upper);
    }
    CHECK(2 * std::asin(posture.q.segment<3>(3).norm()) < 0.1);  // the trunk is upright
  }
}
