// Drake's URDF as its users write it: what is read, completed and reported, whatever becomes of the file.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "get_error.h"
#include "robot_directory.h"
#include "robot_trial.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

const char* const kDrakeFile = R"(<robot name="swing" xmlns:drake="http://drake.mit.edu">
<link name="world"/>
<link name="bob"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="tip"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="turn" type="revolute"><parent link="world"/><child link="bob"/><axis xyz="0 1 0"/><limit upper="2"/></joint>
<drake:joint name="ball" type="ball"><parent link="bob"/><child link="tip"/><origin xyz="0 0 1"/></drake:joint>
<transmission type="SimpleTransmission"><joint name="turn"/><actuator name="motor">
<drake:rotor_inertia value="1.5"/><drake:gear_ratio value="300"/></actuator></transmission>
<drake:ball_constraint>
<drake:ball_constraint_body_A name="world"/><drake:ball_constraint_body_B name="tip"/>
<drake:ball_constraint_p_AP value="0 0 3"/><drake:ball_constraint_p_BQ value="0 0 2"/></drake:ball_constraint>
<drake:linear_spring_damper>
<drake:linear_spring_damper_body_A name="bob"/><drake:linear_spring_damper_p_AP value="1 2 3"/>
<drake:linear_spring_damper_body_B name="tip"/><drake:linear_spring_damper_p_BQ value="4 5 6"/>
<drake:linear_spring_damper_free_length value="7"/><drake:linear_spring_damper_stiffness value="8"/>
<drake:linear_spring_damper_damping value="9"/></drake:linear_spring_damper>
</robot>
)";

}  // namespace

TEST_CASE("files of Drake's users are read, completed by a YAML file, and their mistakes are reported") {
  const RobotDirectory directory;
  const auto load = [&](const std::string& urdf) { return loadRobot(directory.writeRobot(urdf, "")); };
  const LoadedRobot robot = load(kDrakeFile);
  const Model& model = robot.model;
  CHECK(robot.warnings.empty());
  CHECK(model.joints()[2].kind == JointKind::Spherical);
  REQUIRE(model.nu() == 1);
  CHECK(model.motors()[0].armature == 300 * 300 * 1.5);
  CHECK(model.upperLimits()[0] == 2);
  CHECK(std::isinf(model.lowerLimits()[0]));
  REQUIRE(model.closures().size() == 1);
  CHECK(model.closures()[0].name == "ball_9");
  CHECK(model.closures()[0].X_B2.p == Vector3d(0, 0, 2));
  Workspace ws(model);
  updatePositions(model, ws, model.makeNeutral());
  CHECK(calcLargestGap(ws, makeConstraintSet(model)) == 0);
  REQUIRE(model.pointSprings().size() == 1);
  const PointSpring& spring = model.pointSprings()[0];
  CHECK(spring.point1 == Vector3d(1, 2, 3));
  CHECK(spring.point2 == Vector3d(4, 5, 6));
  CHECK((spring.rest == 7 && spring.stiffness == 8 && spring.damping == 9));

  const auto change = [](const std::string& from, const std::string& to) { return replaceOnce(kDrakeFile, from, to); };
  // Keys of a YAML file replace what the URDF says of their subject, and leave the rest.
  const RobotDirectory other;
  const Model mine = loadRobot(other.writeRobot(kDrakeFile, "motors: {turn: {armature: 2}}\n")).model;
  CHECK(mine.motors()[0].armature == 2);
  CHECK(mine.closures().size() == 1);

  const auto checkWarning = [&](const std::string& urdf, const std::string& warning) {
    CAPTURE(warning);
    const std::vector<std::string> found = load(urdf).warnings;
    REQUIRE(found.size() == 1);
    CHECK_THAT(found[0], Catch::Contains("robot.urdf: " + warning));
  };
  checkWarning(change("</robot>", "<drake:tendon_constraint/></robot>"), "<drake:tendon_constraint> (line 17): it is");
  checkWarning(change("\"SimpleTransmission", "\"FourBarTransmission"), "<transmission> (line 7): it is left out");
  checkWarning(change("<joint name=\"turn\"/>", "<joint name=\"ball\"/>"), "<transmission> (line 7): it is left out");
  checkWarning(change("upper=\"2\"", "upper=\"2\" effort=\"0\""), "<transmission> (line 7): it is left out");
  checkWarning(change("<drake:gear_ratio", "<drake:controller_gains p=\"1\" d=\"1\"/><drake:gear_ratio"),
               "<drake:controller_gains> (line 8): it is left out");
  checkWarning(change("<drake:gear_ratio", "<mechanicalReduction>50</mechanicalReduction><drake:gear_ratio"),
               "<mechanicalReduction> (line 8): it is left out, as by Drake");
  CHECK(load(change("<drake:gear_ratio", "<mechanicalReduction>1</mechanicalReduction><drake:gear_ratio"))
            .warnings.empty());
  checkWarning(change("<origin xyz=\"0 0 1\"/>", "<origin xyz=\"0 0 1\"/><dynamics damping=\"1\"/>"),
               "joint 'ball': its <dynamics> (line 6) is left out");
  const std::string plane =
      change("type=\"ball\">", "type=\"planar\"><axis xyz=\"0 0 1\"/><dynamics damping=\"0 0 2\"/>");
  checkWarning(plane, "joint 'ball': its <dynamics> (line 6) is left out");
  CHECK(load(replaceOnce(plane, "damping=\"0 0 2", "damping=\"0 0 0")).warnings.empty());

  const auto checkError = [&](const std::string& urdf, const std::string& problem) {
    CAPTURE(problem);
    const std::string error = getError([&] { load(urdf); });
    CHECK_THAT(error, Catch::StartsWith(directory.path()) && Catch::Contains("robot.urdf: " + problem));
    CHECK(error.find("; ") != std::string::npos);
  };
  checkError(change("type=\"ball\"", "type=\"screw\""), "joint 'ball': its type 'screw' is unknown; use one of ball");
  checkError(change("name=\"ball\" type=", "name=\"turn\" type="), "joint 'turn': it is declared twice (line 6)");
  checkError(change("type=\"SimpleTransmission\"", ""), "<transmission> (line 7): it has no <type>");
  checkError(change("<joint name=\"turn\"/>", "<joint name=\"none\"/>"), "<joint> (line 7): there is no joint 'none'");
  checkError(change("<joint name=\"turn\"/>", ""), "<transmission> (line 7): it has no <joint>");
  checkError(change("inertia value=\"1.5\"", "inertia value=\"-1\""), "<drake:rotor_inertia> (line 8): its value");
  checkError(change("\"300\"", "\"0\""), "<drake:gear_ratio> (line 8): its value is not positive");
  checkError(change("\"300\"", "\"nan\""), "<drake:gear_ratio> (line 8): its attribute 'value', \"nan\", is not");
  checkError(change("body_A name=\"world\"", "body_A name=\"wrld\""),
             "<drake:ball_constraint_body_A> (line 10): there is no link 'wrld'");
  checkError(change("value=\"0 0 3\"", "value=\"0 0\""), "<drake:ball_constraint_p_AP> (line 11): its attribute");
  checkError(change("value=\"0 0 3\"", "value=\"0 0 3 4\""), "<drake:ball_constraint_p_AP> (line 11): its attribute");
  checkError(change("value=\"0 0 3\"", ""), "<drake:ball_constraint_p_AP> (line 11): its attribute 'value', \"\", is");
  checkError(change("<drake:ball_constraint_p_BQ value=\"0 0 2\"/>", ""),
             "<drake:ball_constraint> (line 9): it has no <drake:ball_constraint_p_BQ>");
  checkError(change("length value=\"7\"", "length value=\"0\""),
             "<drake:linear_spring_damper_free_length> (line 15): its value is not positive");
  checkError(change("stiffness value=\"8\"", "stiffness value=\"1e999\""),
             "<drake:linear_spring_damper_stiffness> (line 15): its attribute");
  checkError(change("ball_constraint_body_B name=\"tip\"", "ball_constraint_body_B name=\"world\""),
             "closure 'ball_9'");
}

TEST_CASE("Drake's bushings are the joints that they stand for, and its tendons with little play are couplers") {
  const auto load = [](const std::string& elements) {
    const RobotDirectory directory;
    std::string urdf = R"(<robot name="arms" xmlns:drake="http://drake.mit.edu"><link name="world"/>)";
    for (const std::string name : {"a", "b"})
      urdf += "<link name=\"" + name +
              "\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>"
              "</inertial></link><joint name=\"j" +
              name + "\" type=\"revolute\"><parent link=\"world\"/><child link=\"" + name +
              "\"/><axis xyz=\"0 1 0\"/></joint>";
    return loadRobot(directory.writeRobot(urdf + "\n" + elements + "</robot>", "base: fixed\n"));
  };
  const auto bushing = [](const std::string& torque) {
    return R"(<frame name="f" link="b" xyz="0.1 0 0.2" rpy="1.5707963267948966 0 0"/><drake:linear_bushing_rpy>
<drake:bushing_frameA name="a"/><drake:bushing_frameC name="f"/><drake:bushing_torque_stiffness value=")" +
           torque + R"("/><drake:bushing_force_stiffness value="1e4 1e4 1e4"/></drake:linear_bushing_rpy>)";
  };
  const auto says = [](const LoadedRobot& robot, const std::string& text) {
    return std::any_of(robot.warnings.begin(), robot.warnings.end(),
                       [&](const std::string& warning) { return warning.find(text) != std::string::npos; });
  };
  const LoadedRobot hinge = load(bushing("3000 3000 0"));
  REQUIRE(hinge.model.closures().size() == 1);
  const Closure& closure = hinge.model.closures()[0];
  CHECK(closure.kind == ClosureKind::Hinge5D);
  CHECK((closure.X_B2.p - Vector3d(0.1, 0, 0.2)).norm() < 1e-15);
  CHECK((closure.X_B2.R * closure.axis + Vector3d::UnitY()).norm() < 1e-12);
  CHECK(says(hinge, "its springs become a hinge that does not give"));
  CHECK_FALSE(says(hinge, "<frame>"));
  CHECK(load(bushing("0 0 0")).model.closures()[0].kind == ClosureKind::Ball3D);
  CHECK_THAT(getError([&] { load(bushing("1 0 0")); }), Catch::Contains("it is not as stiff as a ball, a hinge"));

  const auto tendon = [](const std::string& joint, const std::string& upper) {
    return R"(<drake:tendon_constraint><drake:tendon_constraint_joint name="ja" a="2"/><drake:tendon_constraint_joint name=")" +
           joint + R"(" a="-1"/><drake:tendon_constraint_offset value="0.3"/>
<drake:tendon_constraint_lower_limit value="-0.02"/><drake:tendon_constraint_upper_limit value=")" +
           upper + R"("/></drake:tendon_constraint>)";
  };
  const LoadedRobot coupled = load(tendon("jb", "0.06"));
  REQUIRE(coupled.model.closures().size() == 1);
  CHECK(says(coupled, "it is read as a coupler; its play of 0.04 to either side is left out"));
  // 2 qa - qb + 0.3 = 0.02, the middle.
  Workspace ws(coupled.model);
  updatePositions(coupled.model, ws, Eigen::Vector2d(0.1, 2 * 0.1 + 0.28));
  CHECK(calcClosureResidual(ws, coupled.model.closures()[0]).norm() < 1e-15);
  const LoadedRobot wide = load(tendon("jb", "inf"));
  CHECK(wide.model.closures().empty());
  CHECK(says(wide, "<drake:tendon_constraint> (line 2): it is left out"));
  CHECK_THAT(getError([&] { load(tendon("none", "0")); }), Catch::Contains("'none' is no joint with one coordinate"));
  CHECK_THAT(getError([&] { load(tendon("ja", "0")); }), Catch::Contains("joint 'ja' is listed twice"));
}

TEST_CASE("whatever becomes of a file of Drake, it is a robot or one clear error") {
  const RobotDirectory directory;
  const std::string file = kDrakeFile;
  std::mt19937 rng(5);
  const auto draw = [&rng](size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(rng); };
  const char* const words[] = {"nan", "1e300", "-1e300", "1e-300", "0", "-1", "world", "tip", "", "<drake:joint/>"};
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    // One attribute, or some characters.
    std::string text = file;
    if (i % 2 == 0) {
      size_t at = draw(file.size() - 200);
      at = file.find("=\"", at) + 2;
      text.replace(at, file.find('"', at) - at, words[draw(std::size(words))]);
    } else {
      text.erase(draw(file.size() - 30), 1 + draw(30));
    }
    const TrialResult result = tryRobot(directory.writeRobot(text, ""));
    CAPTURE(text, result.message);
    CHECK(result.trial != Trial::Wrong);
    refused += result.trial == Trial::Refused;
  }
  CHECK(refused > 100);
  CHECK(refused < 400);
}
