// Loops that others add to a URDF, inside it and in a file beside it.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/robots/robot_loader.h"
#include "get_error.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// A square of four bars in the plane of x and z, cut in its upper right corner; a joint of it turns the other way round.
std::string makeSquare(const std::string& in_robot = "") {
  const auto link = [](const std::string& name) {
    return "<link name=\"" + name +
           "\"><inertial><origin xyz=\"0 0 0.5\"/><mass value=\"1\"/><inertia ixx=\"0.1\" iyy=\"0.1\" "
           "izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n";
  };
  const auto joint = [](const std::string& name, const std::string& parent, const std::string& child,
                        const std::string& origin, const std::string& more = "") {
    return "<joint name=\"" + name + "\" type=\"continuous\"><parent link=\"" + parent + "\"/><child link=\"" + child +
           "\"/><origin " + origin + "/><axis xyz=\"0 1 0\"/>" + more + "</joint>\n";
  };
  return "<robot name=\"square\">\n" + link("ground") + link("left") + link("top") + link("right") +
         joint("turn", "ground", "left", "xyz=\"0 0 0\"") +
         joint("bend", "left", "top", "xyz=\"0 0 1\" rpy=\"0 1.5707963267948966 0\"",
               "<mimic joint=\"turn\" multiplier=\"-1\"/>") +
         joint("swing", "ground", "right", "xyz=\"1 0 0\"") + in_robot + "</robot>\n";
}

LoadedRobot loadIn(const RobotDirectory& directory, const std::string& urdf) {
  LoadOptions options;
  options.base = BaseKind::Fixed;
  return loadRobot(directory.write("urdf/robot.urdf", urdf), options);
}

void checkLoop(const LoadedRobot& robot, ClosureKind kind, int mobility) {
  const Model& model = robot.model;
  int loops = 0;
  for (const Closure& closure : model.closures()) {
    if (closure.kind == ClosureKind::Coupler) continue;
    ++loops;
    CHECK(closure.kind == kind);
  }
  CHECK(loops == 1);
  CHECK(findClosedConfiguration(model).status == NumericalStatus::Ok);
  // Elsewhere the loop closes too, so that its frames are where the axes are.
  const VectorXd apart = model.integrate(model.makeNeutral(), VectorXd::Constant(model.nv(), 0.1));
  const AssemblyResult closed = closeConfiguration(model, apart);
  CHECK((closed.status == NumericalStatus::Ok) == (mobility > 0));
}

bool tells(const LoadedRobot& robot, const std::string& text) {
  for (const std::string& warning : robot.warnings)
    if (warning.find(text) != std::string::npos) return true;
  return false;
}

}  // namespace

TEST_CASE("a <loop_joint> of a URDF closes a loop") {
  const RobotDirectory directory;
  const auto makeLoop = [](const std::string& type, const std::string& more = "") {
    return "<loop_joint name=\"corner\" type=\"" + type +
           "\">\n<link1 link=\"top\" xyz=\"0 0 1\"/><link2 link=\"right\" xyz=\"0 0 1\" rpy=\"0 0.5 0\"/>" + more +
           "</loop_joint>";
  };
  checkLoop(loadIn(directory, makeSquare(makeLoop("spherical"))), ClosureKind::Ball3D, 1);
  checkLoop(loadIn(directory, makeSquare(makeLoop("continuous", "<axis xyz=\"0 1 0\"/>"))), ClosureKind::Hinge5D, 1);
  const Model slider = loadIn(directory, makeSquare(makeLoop("prismatic", "<axis xyz=\"0 0 1\"/>"))).model;
  CHECK(slider.closures()[0].kind == ClosureKind::Slider);
  CHECK(slider.closures()[0].axis == Vector3d::UnitZ());
  const auto getLoopError = [&](const std::string& loop) {
    return getError([&] { loadIn(directory, makeSquare(loop)); });
  };
  CHECK_THAT(getLoopError(makeLoop("screw")),
             Catch::Contains("robot.urdf: <loop_joint> (line 9): its type 'screw' cannot close a loop; use spherical"));
  CHECK_THAT(getLoopError(replaceOnce(makeLoop("fixed"), "\"right\"", "\"none\"")),
             Catch::Contains("<link2> (line 10): there is no link 'none'; declare"));
  CHECK_THAT(getLoopError(replaceOnce(makeLoop("fixed"), "0 0.5 0", "0 nan 0")),
             Catch::Contains("<link2> (line 10): its attribute 'rpy' is not made of 3 finite numbers; correct it"));
  CHECK_THAT(getLoopError("<loop_joint type=\"fixed\"/>"),
             Catch::Contains("<loop_joint> (line 9): it has no <link1>; name"));
}

TEST_CASE("a file loop_closures.yaml beside a URDF closes loops, by hinges in the root link") {
  const RobotDirectory directory;
  const std::string loops = R"(closures:
- {link_a: top, link_b: right, point: [1, 0, 1], axis: [0, -2, 0]}
dependent: [bend, swing]
independent: [turn]
)";
  const std::string path = directory.write("loop_closures.yaml", loops);
  const LoadedRobot robot = loadIn(directory, makeSquare());
  checkLoop(robot, ClosureKind::Hinge5D, 1);
  CHECK(robot.model.closures().size() == 1);  // not the <mimic>
  REQUIRE(robot.model.nu() == 1);
  CHECK(robot.model.motors()[0].name == "turn");
  CHECK(tells(robot, "urdf/robot.urdf: its loops are those of " + path));
  CHECK(tells(robot, "joint 'bend': its <mimic> is left out"));

  const auto getLoopError = [&](const std::string& from, const std::string& to) {
    directory.write("loop_closures.yaml", replaceOnce(loops, from, to));
    return getError([&] { loadIn(directory, makeSquare()); });
  };
  CHECK_THAT(getLoopError("link_b: right", "link_b: none"), Catch::Contains("loop_closures.yaml: ") &&
                                                                Catch::Contains("(line 2)") &&
                                                                Catch::Contains("there is no link 'none'; correct"));
  CHECK_THAT(getLoopError("[1, 0, 1]", "[1, .nan, 1]"), Catch::Contains("(line 2)") && Catch::Contains("not finite"));
  CHECK_THAT(getLoopError("[0, -2, 0]", "[0, 0, 0]"), Catch::Contains("it is not a direction; give a non-zero vector"));
  CHECK_THAT(getLoopError("bend, swing", "bend, none"),
             Catch::Contains("(line 3)") && Catch::Contains("there is no joint 'none'"));
  CHECK_THAT(getLoopError(", axis: [0, -2, 0]}", "}"), Catch::Contains("axis"));
  CHECK_THAT(getLoopError("independent: [turn]", "independent: [turn"), Catch::Contains("loop_closures.yaml: line "));
  CHECK(getLoopError("independent: [turn]", "version: 3") == "");
  directory.write("loop_closures.yaml", "closures: [{link_a: x, link_b: y, point: [1, 0, 1], axis: [0, 1, 0]}]");
  const LoadedRobot other = loadIn(directory, makeSquare());
  CHECK(tells(other, "loop_closures.yaml: it is left out: it names no link of "));
  // The YAML file of the robot takes precedence.
  directory.write("loop_closures.yaml", loops);
  directory.write("urdf/robot.yaml", "closures: [{name: own, frames: [top, right], type: 3d}]");
  CHECK(loadIn(directory, makeSquare()).model.findClosure("own") >= 0);
  CHECK(loadIn(directory, makeSquare()).model.nu() == 0);
}

TEST_CASE("a file loop_closures.yaml beside a URDF closes loops, by balls and pins in their links") {
  const RobotDirectory directory;
  directory.write("config/loop_closures.yaml", R"(
pin_loops:
  - name: corner
    parent: top
    child: right
    parent_xyz: [0, 0, 1]
    child_xyz: [0, 0, 1]
    axis: [0, 1, 0]
ball_upgrades: [bend]
ball_limit_deg: 15
actuated_joints: [turn]
)");
  const LoadedRobot robot =
      loadIn(directory, replaceOnce(makeSquare(), "<mimic joint=\"turn\" multiplier=\"-1\"/>", ""));
  checkLoop(robot, ClosureKind::Hinge5D, 1);
  CHECK(robot.model.joints()[robot.model.findJoint("bend")].kind == JointKind::Spherical);
  CHECK(robot.model.nu() == 1);
  CHECK(tells(robot, "key 'ball_limit_deg'"));
}

TEST_CASE("a file robot_data.yaml beside a URDF closes loops by joints in their parents") {
  const RobotDirectory directory;
  const std::string urdf = replaceOnce(makeSquare(), "<mimic joint=\"turn\" multiplier=\"-1\"/>", "");
  const std::string data = R"(metadata: {exporter_version: '3.0.0'}
joints:
  turn: {type: continuous, passive: false}
  swing: {type: continuous, passive: true}
  mount: {type: fixed, passive: false}
closing_joints:
  - name: jaw
    source: user_tag
    type: prismatic
    parent: top
    child: right
    origin_xyz_m: [0.0, 0.0, 1.0]
    origin_rpy_rad: [0.0, -1.5707963267948966, 0.0]
    axis: [1.0, 0.0, 0.0]
    limits: {lower: -0.05, upper: 0.05}
)";
  const std::string path = directory.write("robot_data.yaml", data);
  const LoadedRobot robot = loadIn(directory, urdf);
  const Model& model = robot.model;
  REQUIRE(model.closures().size() == 1);
  const Closure& jaw = model.closures()[0];
  CHECK(jaw.kind == ClosureKind::Slider);
  CHECK(jaw.axis == Vector3d::UnitX());
  CHECK(jaw.X_B1.p == Vector3d::UnitZ());
  // Closed with all joints at zero, at the corner of the square, and parallel to the ground.
  CHECK((jaw.X_B2.p - Vector3d::UnitZ()).norm() < 1e-15);
  CHECK(jaw.X_B2.R.isIdentity(1e-15));
  REQUIRE(model.nu() == 1);
  CHECK(model.motors()[0].name == "turn");
  CHECK(tells(robot, "its loops are those of " + path));
  CHECK(tells(robot, "limits'"));
  for (const auto& [type, kind] :
       {std::pair("revolute", ClosureKind::Hinge5D), {"fixed", ClosureKind::Weld6D}, {"ball", ClosureKind::Ball3D}}) {
    directory.write("robot_data.yaml", replaceOnce(data, "type: prismatic", std::string("type: ") + type));
    CHECK(loadIn(directory, urdf).model.closures()[0].kind == kind);
  }
  const auto getDataError = [&](const std::string& from, const std::string& to) {
    directory.write("robot_data.yaml", replaceOnce(data, from, to));
    return getError([&] { loadIn(directory, urdf); });
  };
  CHECK_THAT(getDataError("prismatic", "screw"), Catch::Contains("robot_data.yaml: ") && Catch::Contains("(line 9)") &&
                                                     Catch::Contains("a joint 'screw' cannot close a loop; use prism"));
  CHECK_THAT(getDataError("child: right", "child: none"), Catch::Contains("there is no link 'none'; correct the name"));
  CHECK_THAT(getDataError("[1.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]"), Catch::Contains("it is not a direction"));
  // Without loops, or with those of another file, it has no effect.
  directory.write("robot_data.yaml", "joints: {turn: {passive: false}}");
  CHECK(loadIn(directory, urdf).model.nu() == 0);
  directory.write("robot_data.yaml", data);
  directory.write("loop_closures.yaml", "closures: [{link_a: top, link_b: right, point: [1, 0, 1], axis: [0, 1, 0]}]");
  CHECK(loadIn(directory, urdf).model.closures()[0].kind == ClosureKind::Hinge5D);
}
