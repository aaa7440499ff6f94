// The model matches its files: the published format, our own keys, warnings, and the search for robots.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>

#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "formats/robot_files.h"
#include "get_error.h"
#include "infinity.h"
#include "model/stiction.h"
#include "robot_directory.h"
#include "toy_robot.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

std::vector<std::string> getJointNames(const Model& model) {
  std::vector<std::string> names;
  for (int i = 1; i < model.numBodies(); ++i) names.push_back(model.joints()[i].name);
  return names;
}

// $BIELLE_ROBOTS for the time of a test.
class RobotsVariable {
 public:
  explicit RobotsVariable(const std::string& value) { setenv("BIELLE_ROBOTS", value.c_str(), 1); }
  ~RobotsVariable() { unsetenv("BIELLE_ROBOTS"); }
};

}  // namespace

TEST_CASE("the toy robot has what its files say") {
  const Model model = load(kToyUrdf, kToyYaml);
  CHECK(model.name() == "toy");
  CHECK(getJointNames(model) == std::vector<std::string>{"root_joint", "shoulder", "rod_joint"});
  CHECK(model.nv() == 8);
  CHECK(model.mass() == Approx(4.5));
  const Joint& shoulder = getJoint(model, "shoulder");
  CHECK(shoulder.kind == JointKind::Revolute);
  CHECK((shoulder.axis - Vector3d::UnitY()).norm() == 0);
  CHECK((shoulder.X_PJ.p - Vector3d(0, 0, 0.5)).norm() == 0);
  CHECK(model.lowerLimits()[shoulder.idx_v] == -1);
  CHECK(model.upperLimits()[shoulder.idx_v] == 2);
  CHECK(model.velocityLimits()[shoulder.idx_v] == 7);
  CHECK(model.upperLimits()[getJoint(model, "rod_joint").idx_v] == kInf);
  REQUIRE(model.nu() == 1);
  CHECK(model.motors()[0].effort_limit == 5);
  CHECK(model.motors()[0].velocity_limit == 7);
  // The inertial frame is turned by a quarter about z: x and y moments change places.
  const Inertia& arm = model.bodies()[model.findJoint("shoulder")].inertia;
  CHECK((arm.com - Vector3d(0.1, 0, 0)).norm() < 1e-15);
  CHECK((arm.I_com.diagonal() - Vector3d(0.02, 0.01, 0.025)).norm() < 1e-15);
  REQUIRE(model.closures().size() == 1);
  CHECK(model.closures()[0].kind == ClosureKind::Weld6D);
  CHECK(model.closures()[0].name == "hand--rod");
  CHECK((model.closures()[0].X_B1.p - Vector3d(0.2, 0, 0)).norm() == 0);
  REQUIRE(model.visuals().size() == 1);
  CHECK(model.visuals()[0].shape == Visual::Shape::Box);
  CHECK(model.visuals()[0].size == Vector3d(0.2, 0.02, 0.02));
  CHECK(model.visuals()[0].rgba == Eigen::Vector4d(1, 0, 0, 1));
}

TEST_CASE("bodies come depth first, children in the order of the file, not of the alphabet") {
  const std::string links = "<link name='r'/><link name='z'/><link name='a'/><link name='zz'/><link name='b'/>";
  const auto joint = [](const std::string& parent, const std::string& child) {
    return "<joint name='to_" + child + "' type='continuous'><parent link='" + parent + "'/><child link='" + child +
           "'/></joint>";
  };
  const std::string urdf =
      "<robot name='t'>" + links + joint("z", "zz") + joint("r", "z") + joint("r", "a") + joint("z", "b") + "</robot>";
  CHECK(getJointNames(load(urdf, "base: fixed")) == std::vector<std::string>{"to_z", "to_zz", "to_b", "to_a"});
}

TEST_CASE("the base is free, fixed by the file, or what the caller says") {
  CHECK(load(kToyUrdf, kToyYaml).hasFreeFlyer());
  CHECK(loadWith("base: fixed").nv() == 2);
  CHECK(load(kToyUrdf, std::string(kToyYaml) + "base: fixed", {BaseKind::Free}).nv() == 8);
  CHECK(load(kToyUrdf, kToyYaml, {BaseKind::Fixed}).mass() == Approx(1.5));
  std::string grounded = kToyUrdf;
  for (size_t at; (at = grounded.find("\"base\"")) != std::string::npos;) grounded.replace(at, 6, "\"world\"");
  CHECK(load(grounded, kToyYaml).nv() == 2);
}

TEST_CASE(
    "joint types of the YAML replace those of the URDF, in any case, with the axes of universal joints in order") {
  const auto retype = [](const std::string& type) {
    return load(kToyUrdf, "joint_name: [shoulder]\njoint_type: [" + type + "]\n");
  };
  CHECK(getJoint(retype("SPHERICAL"), "shoulder").kind == JointKind::Spherical);
  CHECK(retype("Spherical").upperLimits().maxCoeff() == kInf);
  CHECK(retype("fixed").findJoint("shoulder") == -1);
  CHECK(retype("prismatic").upperLimits().minCoeff() == 2);
  const std::string letters = "XYZ";
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      if (i == j) continue;
      const Model model = retype(std::string("UJOINT_") + letters[i] + letters[j]);
      const Joint& joint = getJoint(model, "shoulder");
      CHECK(joint.kind == JointKind::Universal);
      CHECK((joint.axis - Vector3d::Unit(i)).norm() == 0);
      CHECK((joint.axis2 - Vector3d::Unit(j)).norm() == 0);
    }
}

TEST_CASE("a universal joint with a cross that has inertia is two joints") {
  const std::string yaml = "joint_name: [shoulder]\njoint_type: [UJOINT_ZY]\n";
  const Model plain = load(kToyUrdf, yaml), split = load(kToyUrdf, yaml + "cross_inertia: 0.02\n");
  REQUIRE(split.nv() == plain.nv());
  CHECK(split.findJoint("shoulder") == -1);
  CHECK((getJoint(split, "shoulder_Z").axis - Vector3d::UnitZ()).norm() == 0);
  CHECK((getJoint(split, "shoulder_Y").axis - Vector3d::UnitY()).norm() == 0);
  CHECK(split.frames()[split.findFrame("arm")].body == split.findJoint("shoulder_Y"));
  VectorXd q = plain.makeNeutral();
  q.tail(3) << 0.3, -0.7, 1.1;
  const int first = getJoint(plain, "shoulder").idx_v;
  MatrixXd turn = MatrixXd::Zero(3, plain.nv());  // of the cross, in the axes of the base
  turn.middleCols<3>(3).setIdentity();
  turn.col(first) = Vector3d::UnitZ();
  Workspace of_plain(plain), of_split(split);
  updatePositions(plain, of_plain, q);
  updatePositions(split, of_split, q);
  updateMassMatrix(plain, of_plain);
  updateMassMatrix(split, of_split);
  CHECK((of_split.M - of_plain.M - 0.02 * turn.transpose() * turn).norm() < 1e-8);
}

TEST_CASE("frames of the YAML file are placed in their links, and contacts stand on them") {
  const Model model =
      load(kToyUrdf,
           "frames: {tip: {link: hand, place: [0.1, 0.2, 0.3], rpy: [0.4, 0.5, 0.6]}, bare: {link: arm}}\n"
           "contacts: {point: {frame: tip, type: 3d}}");
  const Model plain = load(kToyUrdf, "");
  const Frame &hand = plain.frames()[plain.findFrame("hand")], &tip = model.frames()[model.findFrame("tip")];
  CHECK(tip.body == hand.body);
  const SE3 X = hand.X_BF.inverse() * tip.X_BF;
  CHECK((X.p - Vector3d(0.1, 0.2, 0.3)).norm() < 1e-15);
  const Eigen::Quaterniond turn(
      std::cos(0.3) * std::cos(0.25) * std::cos(0.2) + std::sin(0.3) * std::sin(0.25) * std::sin(0.2),
      std::cos(0.3) * std::cos(0.25) * std::sin(0.2) - std::sin(0.3) * std::sin(0.25) * std::cos(0.2),
      std::cos(0.3) * std::sin(0.25) * std::cos(0.2) + std::sin(0.3) * std::cos(0.25) * std::sin(0.2),
      std::sin(0.3) * std::cos(0.25) * std::cos(0.2) - std::cos(0.3) * std::sin(0.25) * std::sin(0.2));
  CHECK((X.R - turn.toRotationMatrix()).norm() < 1e-14);
  CHECK((model.contacts()[0].X_BF.p - tip.X_BF.p).norm() == 0);
  CHECK(model.frames()[model.findFrame("bare")].X_BF.R.isIdentity(0));
}

TEST_CASE("closures: joints stand for their child, pairs for their common name, gains and axes arrive") {
  const Model by_joint = load(kToyUrdf, "closed_loop: [[wrist, rod_joint]]\ntype: ['3D']\nclosure_name: [tip]");
  REQUIRE(by_joint.closures().size() == 1);
  CHECK(by_joint.closures()[0].name == "tip");
  CHECK(by_joint.closures()[0].kind == ClosureKind::Ball3D);
  CHECK((by_joint.closures()[0].X_B1.p - Vector3d(0.2, 0, 0)).norm() == 0);
  CHECK(by_joint.closures()[0].body2 == by_joint.findJoint("rod_joint"));

  // A link named as another joint wins over the joint's child.
  const std::string shadow = replaceOnce(replaceOnce(kToyUrdf, "<link name=\"rod\"/>", "<link name=\"wrist\"/>"),
                                         "<child link=\"rod\"/>", "<child link=\"wrist\"/>");
  const Model by_link = load(shadow, "closed_loop: [[wrist, hand]]\ntype: [6d]");
  CHECK(by_link.closures()[0].body1 == by_link.findJoint("rod_joint"));

  std::string ends = replaceOnce(kToyUrdf, "<link name=\"hand\"/>", "<link name=\"loop_1A\"/>");
  ends = replaceOnce(replaceOnce(ends, "<child link=\"hand\"/>", "<child link=\"loop_1A\"/>"), "<link name=\"rod\"/>",
                     "<link name=\"loop_1B\"/>");
  ends = replaceOnce(ends, "<child link=\"rod\"/>", "<child link=\"loop_1B\"/>");
  CHECK(load(ends, "closed_loop: [[loop_1B, loop_1A]]\ntype: [6d]").findClosure("loop_1") == 0);

  const Model ours = load(kToyUrdf,
                          "closures:\n  - {name: pin, frames: [hand, rod], type: 5d, axis: [0, 2, 0], kp: 3, kd: 4}\n"
                          "  - {frames: [rod, world], type: 3d}");
  REQUIRE(ours.closures().size() == 2);
  const Closure& pin = ours.closures()[0];
  CHECK(pin.name == "pin");
  CHECK((pin.axis - Vector3d::UnitY()).norm() == 0);
  CHECK(pin.kp == 3);
  CHECK(pin.kd == 4);
  CHECK(ours.closures()[1].body2 == 0);
}

TEST_CASE("couplers arrive from the YAML file and from <mimic>, with the gains and the offset given") {
  const Model ours =
      load(kToyUrdf,
           "closures:\n  - {name: belt, type: coupler, joints: {shoulder: -2, rod_joint: 0.5}, offset: 0.3, "
           "kp: 3, kd: 4}");
  REQUIRE(ours.closures().size() == 1);
  const Closure& belt = ours.closures()[0];
  CHECK(belt.kind == ClosureKind::Coupler);
  CHECK(belt.name == "belt");
  REQUIRE(belt.terms.size() == 2);
  CHECK(belt.terms[0].joint == ours.findJoint("shoulder"));
  CHECK(belt.terms[0].coefficient == -2);
  CHECK(belt.terms[1].joint == ours.findJoint("rod_joint"));
  CHECK(belt.terms[1].coefficient == 0.5);
  CHECK(belt.offset == 0.3);
  CHECK(belt.kp == 3);
  CHECK(belt.kd == 4);

  const Model cam =
      load(kToyUrdf, "closures:\n  - {name: cam, type: coupler, joints: {shoulder: [0, 0.25, -1], rod_joint: [2]}}");
  const std::vector<CouplerTerm>& terms = cam.closures().at(0).terms;
  CHECK((terms[0].coefficient == 0 && terms[0].higher == std::vector<double>{0.25, -1}));
  CHECK((terms[1].coefficient == 2 && terms[1].isLinear()));

  // rod_joint = 1.5 shoulder + 0.2, beside the closure of the YAML file.
  const std::string mimic =
      replaceOnce(kToyUrdf, "<axis xyz=\"0 0 1\"/>", "<mimic joint=\"shoulder\" multiplier=\"1.5\" offset=\"0.2\"/>");
  const Model model = load(mimic, kToyYaml);
  REQUIRE(model.closures().size() == 2);
  const Closure& coupler = model.closures()[1];
  CHECK(coupler.name == "rod_joint");
  REQUIRE(coupler.terms.size() == 2);
  CHECK(coupler.terms[0].coefficient == -1.5);
  CHECK(coupler.terms[1].coefficient == 1);
  CHECK(coupler.offset == 0.2);
  Workspace ws(model);
  VectorXd q = model.makeNeutral();
  q[coupler.terms[0].idx_q] = 0.4;
  q[coupler.terms[1].idx_q] = 1.5 * 0.4 + 0.2;
  updatePositions(model, ws, q);
  CHECK(std::abs(calcClosureResidual(ws, coupler)[0]) < 1e-15);

  // A joint that cannot move follows nobody.
  const std::string fixed = replaceOnce(mimic, "type=\"continuous\"", "type=\"fixed\"");
  const RobotDirectory directory;
  const LoadedRobot still = loadRobot(directory.writeRobot(fixed, ""));
  CHECK(still.model.closures().empty());
  REQUIRE(still.warnings.size() == 1);
  CHECK_THAT(still.warnings[0], Catch::Contains("joint 'rod_joint': it is fixed, so <mimic> is ignored"));
}

TEST_CASE("springs, dampers and friction arrive, each number in its place") {
  const Model model = loadWith(
      "joint_forces: {shoulder: {stiffness: 1, rest: 2, preload: 3, damping: 4, friction: 5, friction_speed: 6}, "
      "rod_joint: {damping: 7}}");
  REQUIRE(model.jointForces().size() == 2);
  const JointForce &first = model.jointForces()[0], &second = model.jointForces()[1];
  CHECK(first.joint == model.findJoint("shoulder"));
  CHECK(first.dof == getJoint(model, "shoulder").idx_v);
  CHECK(first.idx_q == getJoint(model, "shoulder").idx_q);
  CHECK(first.stiffness == 1);
  CHECK(first.rest == 2);
  CHECK(first.preload == 3);
  CHECK(first.damping == 4);
  CHECK(first.friction == 5);
  CHECK(first.friction_speed == 6);
  CHECK(second.joint == model.findJoint("rod_joint"));
  CHECK(second.damping == 7);
  CHECK(second.friction == 0);
  CHECK(second.friction_speed == 0.01);
}

TEST_CASE("friction that is larger at rest arrives, and is written as it is read") {
  const Model model = loadWith(
      "joint_forces: {shoulder: {damping: 4, friction: 5, stiction: 8, stribeck_speed: 0.25}, rod_joint: {stiction: "
      "1}}");
  REQUIRE(model.jointForces().size() == 4);
  const std::vector<WholeJointForce> read = joinJointForces(model);
  REQUIRE(read.size() == 2);
  CHECK((read[0].force.friction == 5 && read[0].force.damping == 4 && read[0].stiction == 8));
  CHECK((read[0].stribeck_speed == 0.25 && read[0].force.friction_speed == 0.01));
  CHECK((read[1].force.friction == 0 && read[1].stiction == 1 && read[1].stribeck_speed == 0.1));
  const RobotText text = formatRobot(model);
  CHECK_THAT(text.yaml, Catch::Contains("friction: 5, stiction: 8, stribeck_speed: 0.25, friction_speed: 0.01"));
  const Model back = load(text.urdf, text.yaml);
  REQUIRE(back.jointForces().size() == 4);
  for (size_t i = 0; i < 4; ++i) {
    CHECK(back.jointForces()[i].friction == model.jointForces()[i].friction);
    CHECK(back.jointForces()[i].friction_speed == model.jointForces()[i].friction_speed);
  }

  // A file that completes the robot replaces both parts.
  const RobotDirectory directory;
  directory.write("own/own.yaml",
                  "model: " + directory.path() + "/robot.urdf\njoint_forces: {shoulder: {friction: 1, stiction: 2}}\n");
  directory.writeRobot(kToyUrdf, "joint_forces: {shoulder: {friction: 5, stiction: 8}}");
  const std::vector<WholeJointForce> own = joinJointForces(loadRobot(directory.path() + "/own").model);
  REQUIRE(own.size() == 1);
  CHECK((own[0].force.friction == 1 && own[0].stiction == 2));
}

TEST_CASE("play is for worlds: the robot is the one without, and a file that completes it has the last word") {
  const RobotDirectory directory;
  const std::string armature = std::string(kToyYaml) + "armature: {shoulder: 0.01}\n";
  const LoadedRobot toy = loadRobot(directory.writeRobot(kToyUrdf, armature + "play: {shoulder: 0.002}"));
  CHECK(toy.model.nv() == load(kToyUrdf, armature).nv());
  const std::vector<Play>& plays = toy.wear.plays;
  REQUIRE(plays.size() == 1);
  CHECK((plays[0].name == "shoulder" && plays[0].size == 0.002));
  CHECK(addPlay(toy.model, plays).nv() == toy.model.nv() + 1);
  directory.write("own/own.yaml", "model: " + directory.path() + "/robot.urdf\nplay: {\"sh*\": 0.001}\n");
  const LoadedRobot own = loadRobot(directory.path() + "/own");
  const Model played = addPlay(own.model, own.wear.plays);
  CHECK(played.upperLimits()[played.joints()[played.findJoint("shoulder.play")].idx_v] == 0.0005);
}

TEST_CASE("damping and friction of <dynamics> are those of the joint, unless the YAML file says others") {
  const std::string urdf = replaceOnce(kToyUrdf, "<axis xyz=\"0 1 0\"/>",
                                       "<axis xyz=\"0 1 0\"/><dynamics damping=\"0.5\" friction=\"0.25\"/>");
  const Model model = load(urdf, "");
  REQUIRE(model.jointForces().size() == 1);
  const JointForce& force = model.jointForces()[0];
  CHECK(force.joint == model.findJoint("shoulder"));
  CHECK(force.damping == 0.5);
  CHECK(force.friction == 0.25);
  CHECK(force.friction_speed == JointForce().friction_speed);
  CHECK((force.stiffness == 0 && force.rest == 0 && force.preload == 0));
  CHECK(load(kToyUrdf, "").jointForces().empty());

  const RobotDirectory directory;
  const auto getForces = [&](const std::string& yaml, size_t warnings) {
    const LoadedRobot robot = loadRobot(directory.writeRobot(urdf, yaml));
    CHECK(robot.warnings.size() == warnings);
    return robot.model.jointForces();
  };
  const std::vector<JointForce> other = getForces("joint_forces: {rod_joint: {damping: 7}}", 0);
  REQUIRE(other.size() == 2);
  CHECK((other[0].damping == 7 && other[1].damping == 0.5));
  const std::vector<JointForce> own = getForces("joint_forces: {shoulder: {friction: 3, friction_speed: 0.1}}", 0);
  REQUIRE(own.size() == 1);
  CHECK((own[0].damping == 0 && own[0].friction == 3 && own[0].friction_speed == 0.1));
  CHECK(getForces("joint_forces: {shoulder: {}}", 0).empty());
  CHECK(getForces("joint_name: [shoulder]\njoint_type: [SPHERICAL]", 1).empty());
  CHECK(getForces("joint_name: [shoulder]\njoint_type: [CONTINUOUS]", 0).size() == 1);

  // A file that completes the robot has the last word, joint by joint.
  directory.write("own/own.yaml",
                  "model: " + directory.path() + "/robot.urdf\njoint_forces: {rod_joint: {stiffness: 2}}\n");
  directory.writeRobot(urdf, "joint_forces: {shoulder: {damping: 4}, rod_joint: {damping: 5}}");
  const Model completed = loadRobot(directory.path() + "/own").model;
  REQUIRE(completed.jointForces().size() == 2);
  CHECK(completed.jointForces()[0].damping == 4);
  CHECK((completed.jointForces()[1].damping == 0 && completed.jointForces()[1].stiffness == 2));

  for (const char* wrong : {"damping=\"-0.5\"", "friction=\"-0.25\""})
    CHECK_THROWS_WITH(load(replaceOnce(urdf, "damping=\"0.5\" friction=\"0.25\"", wrong), ""),
                      Catch::Contains("joint 'shoulder': the damping or friction of its <dynamics> is negative; give"));
}

TEST_CASE("springs between points arrive, each number in its place") {
  const Model model = loadWith(
      "point_springs: {first: {frames: [hand, world], points: [[1, 2, 3], [4, 5, 6]], stiffness: 7, rest: 8, "
      "preload: -9, damping: 10}, second: {frames: [rod_joint, arm], damping: 11}}");
  REQUIRE(model.pointSprings().size() == 2);
  const PointSpring &first = model.pointSprings()[0], &second = model.pointSprings()[1];
  CHECK(first.name == "first");
  CHECK(first.body1 == model.findJoint("shoulder"));
  CHECK(first.body2 == 0);
  CHECK((first.point1 - Vector3d(1.2, 2, 3)).norm() < 1e-15);  // of the hand, which is fixed to the arm
  CHECK(first.point2 == Vector3d(4, 5, 6));
  CHECK(first.stiffness == 7);
  CHECK(first.rest == 8);
  CHECK(first.preload == -9);
  CHECK(first.damping == 10);
  // The base is free: its dofs move the hand, but not the ground.
  CHECK(first.dofs == model.supportDofs(first.body1));
  CHECK(first.signs == std::vector<int>(7, 1));
  CHECK(second.body1 == model.findJoint("rod_joint"));
  CHECK(second.body2 == first.body1);
  CHECK(second.damping == 11);
  CHECK(second.stiffness == 0);
  CHECK(second.dofs == std::vector<int>{6, 7});
  CHECK(second.signs == std::vector<int>{-1, 1});
}

TEST_CASE("what is possible but odd is a warning") {
  const RobotDirectory directory;
  const auto warn = [&directory](const std::string& urdf, const std::string& yaml) {
    const std::vector<std::string> warnings = loadRobot(directory.writeRobot(urdf, yaml)).warnings;
    REQUIRE(warnings.size() == 1);
    return warnings[0];
  };
  using Catch::Contains;
  const std::string urdf = directory.path() + "/robot.urdf: ", yaml = directory.path() + "/robot.yaml: ";
  CHECK_THAT(warn(kToyUrdf, "joint_name: [elbow]\njoint_type: [SPHERICAL]"),
             Contains(yaml + "key 'joint_name'") && Contains("not in the URDF") && Contains("'elbow'"));
  CHECK_THAT(warn(replaceOnce(kToyUrdf, "<mass value=\"3\"/>", "<mass value=\"1000\"/>"), kToyYaml),
             Contains(urdf + "link 'base': a mass of 1000"));
  CHECK_THAT(
      warn(replaceOnce(kToyUrdf, "<parent link=\"arm\"/>", "<parent link=\"arm\"/>\n<dynamics damping=\"0.1\"/>"),
           kToyYaml),
      Contains(urdf + "joint 'wrist': its <dynamics> (line 33) is left out"));
  CHECK_THAT(warn(replaceOnce(kToyUrdf, "<material name=\"red\"><color rgba=\"1 0 0 1\"/></material>",
                              "<material name=\"orange\"/>"),
                  kToyYaml),
             Contains(urdf + "link 'arm': no <material> 'orange'"));
  CHECK_THAT(warn(replaceOnce(kToyUrdf, "lower=\"-1\" upper=\"2\"", "lower=\"-90\" upper=\"45\""), kToyYaml),
             Contains(urdf + "joints 'shoulder': ranges such as -90 .. 45 rad") && Contains("(-1.5708 .. 0.785398)"));
  for (const char* other : {"lower=\"-10\" upper=\"1e4\"", "lower=\"-174.532925\" upper=\"174.532925\""})
    CHECK(loadRobot(directory.writeRobot(replaceOnce(kToyUrdf, "lower=\"-1\" upper=\"2\"", other), kToyYaml))
              .warnings.empty());
  CHECK_THAT(warn(kToyUrdf, "name_mot: [shoulder]\nmotors: {rod_joint: {}}"), Contains(yaml + "key 'name_mot'"));
}

TEST_CASE("a file with the key model completes a robot that is elsewhere") {
  const RobotDirectory others, own;
  others.write("toy/robot.urdf", kToyUrdf);
  others.write("toy/robot.yaml", kToyYaml);
  const LoadedRobot plain = loadRobot(others.path() + "/toy");
  own.write("mine/mine.yaml",
            "model: [nowhere, toy]\nmotors: {shoulder: {armature: 0.5, effort: .inf}}\n"
            "contacts: {tip: {frame: hand, type: 3d}}\n");
  {
    const RobotsVariable variable(own.path() + ":" + others.path());
    for (const std::string& name : {std::string("mine"), own.path() + "/mine", own.path() + "/mine/mine.yaml"}) {
      const LoadedRobot robot = loadRobot(name);
      CHECK(robot.file == own.path() + "/mine/mine.yaml");
      CHECK(robot.directory == own.path() + "/mine");
      CHECK(robot.model.closures().size() == plain.model.closures().size());
      CHECK(robot.model.contacts().size() == 1);
      CHECK(robot.model.motors().at(0).armature == 0.5);
      CHECK(std::isinf(robot.model.motors().at(0).effort_limit));
    }
    const std::vector<std::string> names = listRobots();
    CHECK(std::find(names.begin(), names.end(), "mine") != names.end());
    CHECK(findRobotFile("toy") == others.path() + "/toy/robot.urdf");
  }
  using Catch::Contains;
  const RobotsVariable variable(own.path());
  const std::vector<std::string> names = listRobots();
  CHECK(std::find(names.begin(), names.end(), "mine") == names.end());
  CHECK_THROWS_WITH(loadRobot("mine"),
                    Contains("mine.yaml: key 'model'") && Contains("nowhere, toy") && Contains("BIELLE_ROBOTS"));
  own.write("near/near.yaml",
            "model: " + others.path() + "/toy/robot.urdf\ncontacts: {tip: {frame: fist, type: 3d}}\n");
  CHECK_THROWS_WITH(loadRobot("near"),
                    Contains("near.yaml: key 'contacts': key 'tip': key 'frame'") && Contains("'fist'"));
  own.write("alone/alone.yaml", "gravity: [0, 0, -1]\n");
  CHECK_THROWS_WITH(loadRobot(own.path() + "/alone"), Contains("it is missing"));
  own.write("both/both.urdf", kToyUrdf);
  own.write("both/both.yaml", "model: toy\n");
  CHECK_THROWS_WITH(loadRobot("both"), Contains("there is a URDF beside this file"));
}

TEST_CASE("robots are found by name, directory and file; the error for an unknown one lists the places searched") {
  const RobotDirectory first, second;
  second.write("toy/toy.urdf", kToyUrdf);
  second.write("toy/toy.yaml", kToyYaml);
  second.write("toy/other.urdf", "<broken>");
  second.write("lonely/any.urdf", kToyUrdf);
  second.write("pair/a.urdf", kToyUrdf);
  second.write("pair/b.urdf", kToyUrdf);
  second.write("empty/readme.txt", "");
  const RobotsVariable variable(first.path() + "::" + second.path());
  const std::vector<std::string> directories = getRobotDirectories();
  REQUIRE(directories.size() >= 3);
  CHECK(directories[0] == first.path());
  CHECK(directories[1] == second.path());

  const LoadedRobot by_name = loadRobot("toy");
  CHECK(by_name.directory == second.path() + "/toy");
  CHECK(by_name.model.nu() == 1);
  first.write("toy/toy.urdf", kToyUrdf);  // an earlier directory wins; it has no YAML
  CHECK(loadRobot("toy").directory == first.path() + "/toy");
  CHECK(loadRobot("toy").model.nu() == 0);
  CHECK(loadRobot(second.path() + "/toy").model.nu() == 1);
  CHECK(loadRobot(second.path() + "/toy/").model.nu() == 1);
  CHECK(loadRobot(second.path() + "/toy/toy.urdf").model.nu() == 1);
  CHECK(loadRobot(second.path() + "/lonely").model.name() == "toy");
  // The settings beside a URDF stand for both.
  CHECK(loadRobot(second.path() + "/toy/toy.yaml").model.nu() == 1);
  CHECK(loadRobot(second.path() + "/toy/toy.yaml").file == second.path() + "/toy/toy.urdf");
  second.write("other/other.yaml", "model: ../toy\n");
  second.write("other/other.urdf", "<broken>");
  CHECK(loadRobot(second.path() + "/other/other.yaml").model.nu() == 1);

  using Catch::Contains;
  const auto say = [](const std::string& name) { return getError([&] { loadRobot(name); }); };
  CHECK_THAT(say("unicorn"), Contains("robot 'unicorn'") && Contains(first.path()) && Contains(second.path()) &&
                                 Contains("known names: ") && Contains("bipetto, ") && Contains("toy"));
  CHECK_THAT(say(second.path() + "/none"), Contains("no such file or directory") && Contains("known names"));
  CHECK_THAT(say(second.path() + "/none.urdf"), Contains("no such file or directory"));
  CHECK_THAT(say(second.path() + "/pair"), Contains("several .urdf files") && Contains("a.urdf"));
  CHECK_THAT(say(second.path() + "/empty"), Contains("no .urdf file"));
  CHECK_THAT(say(""), Contains("robot ''"));
  const std::vector<std::string> names = listRobots();
  for (const char* name : {"bipetto", "fivebar", "fourbar", "toy"})
    CHECK(std::find(names.begin(), names.end(), name) != names.end());
  CHECK(std::is_sorted(names.begin(), names.end()));
}
