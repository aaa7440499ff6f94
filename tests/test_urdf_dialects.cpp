// What other programs add to a URDF: loops, couplers, motors, and the account of all other elements.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/reader.h"
#include "get_error.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

LoadedRobot loadUrdf(const std::string& content, const std::string& yaml = "") {
  const RobotDirectory directory;
  if (!yaml.empty()) directory.write("robot.yaml", yaml);
  LoadOptions options;
  options.base = BaseKind::Fixed;
  return loadRobot(directory.write("robot.urdf", "<robot name=\"tried\">\n" + content + "</robot>\n"), options);
}

std::string writeLink(const std::string& name) {
  return "<link name=\"" + name +
         "\"><inertial><origin xyz=\"0.1 0 0\"/><mass value=\"0.5\"/><inertia ixx=\"0.01\" iyy=\"0.02\" izz=\"0.02\" "
         "ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n";
}
std::string writeJoint(const std::string& name, const std::string& parent, const std::string& child,
                       const std::string& place, const std::string& type = "continuous") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/><origin xyz=\"" + place + "\"/><axis xyz=\"0 1 0\"/></joint>\n";
}

// A four-bar in the plane of x and z, open between coupler and rocker, at the place of pin c in both.
const std::string kCoupler = "0.35 0 0.1", kRocker = "-0.05 0 0.2";
std::string writeFourBar() {
  return "<link name=\"world\"/>\n" + writeLink("crank") + writeLink("coupler") + writeLink("rocker") +
         writeJoint("crank", "world", "crank", "0 0 0.5") + writeJoint("pin_b", "crank", "coupler", "0.1 0 0.1") +
         writeJoint("rocker", "world", "rocker", "0.5 0 0.5");
}

// Mobility where it stands and after a swing along the loop.
void checkMobility(const Model& model, int mobility) {
  VectorXd q = model.makeNeutral();
  for (int i = 0; i < 2; ++i) {
    CHECK(calcMobility(model, q).mobility == mobility);
    const AssemblyResult closed =
        closeConfiguration(model, model.integrate(q, VectorXd::LinSpaced(model.nv(), 0.1, -0.1)));
    REQUIRE(closed.status == NumericalStatus::Ok);
    q = closed.q;
  }
  CHECK(findClosedConfiguration(model).status == NumericalStatus::Ok);
}

bool says(const LoadedRobot& robot, const std::string& text) {
  for (const std::string& warning : robot.warnings)
    if (warning.find(text) != std::string::npos) return true;
  return false;
}

std::string getLoadError(const std::string& content) {
  return getError([&] { loadUrdf(content); });
}

VectorXd calcAccelerations(const Model& model, const VectorXd& q, const VectorXd& tau) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), q, VectorXd::Zero(model.nv()), tau) ==
          NumericalStatus::Ok);
  return cws.a;
}

}  // namespace

TEST_CASE("URDF dialects: loops of four kinds of files close a four-bar") {
  const std::string hinges[] = {
      // as proposed for urdfdom; the axis in the second frame, which is turned
      "<constraint name=\"c\" type=\"revolute\"><parent link=\"coupler\"/><parent_origin xyz=\"" + kCoupler +
          "\"/><parent_axis xyz=\"0 2 0\"/><child link=\"rocker\"/><child_origin xyz=\"" + kRocker +
          "\" rpy=\"1.5707963267948966 0 0\"/><child_axis xyz=\"0 0 -1\"/></constraint>",
      // URDF+
      "<loop name=\"c\" type=\"revolute\"><predecessor link=\"coupler\"><origin xyz=\"" + kCoupler +
          "\"/></predecessor><successor link=\"rocker\"><origin xyz=\"" + kRocker +
          "\"/></successor><axis xyz=\"0 1 0\"/></loop>",
      // of CAD exporters, the axis in the link
      "<loop_joint name=\"c\" type=\"revolute\"><parent link=\"coupler\"/><child link=\"rocker\"/><parent_origin "
      "xyz=\"" +
          kCoupler + "\" rpy=\"0 0 0.4\"/><child_origin xyz=\"" + kRocker +
          "\" rpy=\"0 0 0.4\"/><axis xyz=\"0 1 0\" frame=\"parent\"/></loop_joint>"};
  for (const std::string& hinge : hinges) {
    CAPTURE(hinge);
    const LoadedRobot robot = loadUrdf(writeFourBar() + hinge);
    REQUIRE(robot.model.closures().size() == 1);
    CHECK(robot.model.closures()[0].name == "c");
    CHECK(robot.model.closures()[0].kind == ClosureKind::Hinge5D);
    CHECK(robot.warnings.empty());
    checkMobility(robot.model, 1);
  }
  CHECK_THAT(getLoadError(writeFourBar() + "<loop name=\"c\" type=\"screw\"/>"),
             Catch::Contains("<loop> (line 9): its type 'screw' cannot close a loop; use spherical"));
  CHECK_THAT(getLoadError(writeFourBar() + "<constraint type=\"fixed\"><parent link=\"crank\"/></constraint>"),
             Catch::Contains("<constraint> (line 9): it has no <child>; name the link"));
  CHECK_THAT(getLoadError(writeFourBar() +
                          "<loop type=\"fixed\"><predecessor link=\"rod\"/><successor link=\"rocker\"/></loop>"),
             Catch::Contains("<predecessor> (line 9): there is no link 'rod'"));
}

TEST_CASE("URDF dialects: a joint of Gazebo closes a loop where the links stand") {
  // The coupler in two halves.
  const std::string halves = writeFourBar() + writeLink("half") + writeJoint("pin_c", "rocker", "half", kRocker);
  const auto close = [](const std::string& type, const std::string& more = "") {
    return "<gazebo><joint name=\"weld\" type=\"" + type + "\"><parent>coupler</parent><child>half</child>" + more +
           "</joint></gazebo>";
  };
  const LoadedRobot welded = loadUrdf(halves + close("fixed", "<pose>-0.175 0 -0.05 0 0.3 0</pose>"));
  CHECK(welded.model.closures()[0].kind == ClosureKind::Weld6D);
  checkMobility(welded.model, 1);
  CHECK(welded.warnings.empty());
  const LoadedRobot hinged =
      loadUrdf(halves + close("revolute", "<pose>-0.1 0 0 0 0 1.5707963267948966</pose><axis><xyz>1 0 0</xyz></axis>"));
  CHECK(hinged.model.closures()[0].kind == ClosureKind::Hinge5D);
  checkMobility(hinged.model, 2);
  const LoadedRobot model_axis = loadUrdf(
      halves +
      close("revolute", "<pose>-0.1 0 0 0 0 1.57</pose><axis><xyz expressed_in=\"__model__\">0 1 0</xyz></axis>"));
  checkMobility(model_axis.model, 2);
  // In the words of SDF up to 1.6, and with a pose in another link.
  const LoadedRobot old_axis = loadUrdf(
      halves +
      close("revolute",
            "<pose relative_to=\"coupler\">-0.1 0 0.1 0 0 1.57</pose><axis><xyz>0 1 0</xyz>"
            "<use_parent_model_frame>1</use_parent_model_frame></axis><screw_thread_pitch>1</screw_thread_pitch>"));
  checkMobility(old_axis.model, 2);
  const Closure& old_weld = old_axis.model.closures()[0];
  CHECK((old_weld.X_B1.p - Vector3d(-0.1, 0, 0.1)).norm() < 1e-12);
  CHECK((old_weld.X_B1.R * old_weld.axis - Vector3d::UnitY()).norm() < 1e-12);
  CHECK(says(old_axis, "<screw_thread_pitch> (line 11): it is left out"));
  CHECK(loadUrdf(halves + close("ball")).model.closures()[0].kind == ClosureKind::Ball3D);
  CHECK_THAT(getLoadError(halves + close("screw")), Catch::Contains("its type 'screw' cannot close a loop"));
  CHECK_THAT(getLoadError(halves + close("revolute")), Catch::Contains("it has no <axis>; give one"));
  CHECK(says(loadUrdf(halves + "<gazebo reference=\"crank\"><springStiffness>3</springStiffness></gazebo>"),
             "<springStiffness> (line 11): it is left out"));
  CHECK(loadUrdf(halves + "<gazebo reference=\"crank\"><material>Gazebo/Orange</material></gazebo>").warnings.empty());
}

TEST_CASE("URDF dialects: a plugin of Gazebo that mimics is a coupler, others change no mechanism") {
  const std::string open = writeFourBar();
  const auto plug = [&](const std::string& more) {
    return open + "<gazebo><plugin name=\"p\" filename=\"libplugin.so\">" + more + "</plugin></gazebo>";
  };
  const std::string pair = "<joint>crank</joint><mimicJoint>rocker</mimicJoint>";
  const LoadedRobot robot = loadUrdf(plug(pair + "<multiplier>-2</multiplier><offset>0.3</offset><hasPID/>"));
  REQUIRE(robot.model.closures().size() == 1);
  const Closure& coupler = robot.model.closures()[0];
  CHECK(coupler.kind == ClosureKind::Coupler);
  VectorXd q = robot.model.makeNeutral();
  q[robot.model.joints()[robot.model.findJoint("crank")].idx_q] = 0.2;
  q[robot.model.joints()[robot.model.findJoint("rocker")].idx_q] = -2 * 0.2 + 0.3;
  Workspace ws(robot.model);
  updatePositions(robot.model, ws, q);
  CHECK(calcClosureResidual(ws, coupler).norm() < 1e-15);
  const LoadedRobot other = loadUrdf(plug("<robotNamespace>/r</robotNamespace>"));
  CHECK(other.model.closures().empty());
  CHECK(says(other, "what changes no mechanism is left out (1 kind"));
  CHECK_THAT(getLoadError(plug("<joint>none</joint><mimicJoint>rocker</mimicJoint>")),
             Catch::Contains("'none' is no joint with one coordinate; name one"));
  CHECK_THAT(getLoadError(plug(pair + "<offset>nan</offset>")),
             Catch::Contains("<offset> (line 9): it is not a finite number"));
}

TEST_CASE("URDF dialects: a coupling is between sums of coordinates from the nearest common ancestor") {
  const std::string arms = "<link name=\"world\"/>\n" + writeLink("base") + writeLink("a1") + writeLink("a2") +
                           writeLink("b1") + writeJoint("base", "world", "base", "0 0 0") +
                           writeJoint("a1", "base", "a1", "0 0 0.1") + writeJoint("a2", "a1", "a2", "0.2 0 0") +
                           writeJoint("b1", "base", "b1", "0 0.1 0.1");
  const LoadedRobot robot = loadUrdf(
      arms +
      "<coupling name=\"gear\"><predecessor link=\"a2\"/><successor link=\"b1\"/><ratio value=\"-3\"/></coupling>");
  REQUIRE(robot.model.closures().size() == 1);
  const Closure& gear = robot.model.closures()[0];
  CHECK(gear.kind == ClosureKind::Coupler);
  checkMobility(robot.model, 3);
  // b1 = -3 (a1 + a2)
  const Model& model = robot.model;
  VectorXd q = model.makeNeutral();
  const auto set = [&](const std::string& name, double value) {
    q[model.joints()[model.findJoint(name)].idx_q] = value;
  };
  set("base", 0.7), set("a1", 0.2), set("a2", -0.3), set("b1", 0.3);
  CHECK(closeConfiguration(model, q).q.isApprox(q, 1e-9));
  set("b1", -0.3);
  CHECK(!closeConfiguration(model, q).q.isApprox(q, 1e-3));
  CHECK_THAT(getLoadError(arms + "<coupling><predecessor link=\"a2\"/><successor link=\"b1\"/></coupling>"),
             Catch::Contains("<coupling> (line 11): it has no <ratio>"));
}

TEST_CASE("URDF dialects: transmissions are motors whose torques do the same work as at the joints") {
  const std::string arm = "<link name=\"world\"/>\n" + writeLink("upper") + writeLink("lower") +
                          writeJoint("shoulder", "world", "upper", "0 0 1") +
                          writeJoint("elbow", "upper", "lower", "0.3 0 0");
  const auto transmit = [](const std::string& kind) {
    return "<transmission name=\"t\"><type>transmission_interface/" + kind +
           "</type><actuator "
           "name=\"m2\"><role>actuator2</role><mechanicalReduction>-40</mechanicalReduction></actuator>"
           "<actuator name=\"m1\"><role>actuator1</role><mechanicalReduction>50</mechanicalReduction></actuator>"
           "<joint "
           "name=\"shoulder\"><role>joint1</role><offset>0.1</offset><mechanicalReduction>1.5</mechanicalReduction></"
           "joint>"
           "<joint "
           "name=\"elbow\"><role>joint2</role><offset>0.2</offset><mechanicalReduction>2</mechanicalReduction></joint>"
           "</transmission>";
  };
  const Model plain = loadUrdf(arm).model;
  const double a1 = 50, a2 = -40, j1 = 1.5, j2 = 2;
  for (const bool is_differential : {false, true}) {
    CAPTURE(is_differential);
    const LoadedRobot robot =
        loadUrdf(arm + transmit(is_differential ? "DifferentialTransmission" : "FourBarLinkageTransmission"));
    const Model& model = robot.model;
    CHECK(says(robot, "'m1' and 'm2' are rotors without inertia"));
    REQUIRE(model.nu() == 2);
    checkMobility(model, 2);
    const int s = model.joints()[model.findJoint("shoulder")].idx_v, e = model.joints()[model.findJoint("elbow")].idx_v,
              m1 = model.joints()[model.findJoint("m1")].idx_v, m2 = model.joints()[model.findJoint("m2")].idx_v;
    VectorXd q = model.makeNeutral();
    // Turns of rotors per turn of joints, and where they are.
    Eigen::Matrix2d G;
    G << a1 * j1, is_differential ? a1 * j2 : 0, is_differential ? a2 * j1 : a2, is_differential ? -a2 * j2 : a2 * j2;
    q[s] = 0.4, q[e] = -0.7;
    const Eigen::Vector2d offset(0.1, 0.2), rotors = G * (Eigen::Vector2d(q[s], q[e]) - offset);
    q[m1] = rotors[0], q[m2] = rotors[1];
    if (!is_differential) CHECK(q[m1] == Approx(a1 * j1 * 0.3));
    REQUIRE(closeConfiguration(model, q).q.isApprox(q, 1e-9));
    for (const Eigen::Vector2d& torque : {Eigen::Vector2d(0.1, 0), Eigen::Vector2d(0, 0.1)}) {
      VectorXd tau = VectorXd::Zero(4);
      tau[m1] = torque[0], tau[m2] = torque[1];
      const VectorXd a = calcAccelerations(model, q, tau);
      // The plain arm under the torques that do the same work, less what turns the rotors of 1e-9 kg m^2.
      const Eigen::Vector2d turn = G * Eigen::Vector2d(a[s], a[e]);
      const VectorXd expected =
          calcAccelerations(plain, Eigen::Vector2d(0.4, -0.7), G.transpose() * (torque - 1e-9 * turn));
      CHECK(a[s] == Approx(expected[0]).epsilon(1e-6));
      CHECK(a[e] == Approx(expected[1]).epsilon(1e-6));
      CHECK(a[m1] == Approx(G.row(0) * Eigen::Vector2d(a[s], a[e])).epsilon(1e-6));
    }
  }
  const LoadedRobot simple =
      loadUrdf(arm +
               "<transmission name=\"t\"><type>SimpleTransmission</type><joint name=\"elbow\"/><actuator "
               "name=\"m\"><mechanicalReduction>-30</mechanicalReduction></actuator></transmission>");
  REQUIRE(simple.model.nu() == 1);
  CHECK(simple.model.motors()[0].name == "elbow");
  CHECK(simple.model.motors()[0].drive.ratio == 30);
  CHECK(simple.warnings.empty());
  // ros2_control's place and words.
  const LoadedRobot control =
      loadUrdf(arm +
               "<ros2_control name=\"c\" type=\"system\"><transmission "
               "name=\"t\"><plugin>transmission_interface/SimpleTransmission</plugin><joint name=\"elbow\" "
               "role=\"joint1\"><mechanical_reduction>7</mechanical_reduction></joint><actuator name=\"m\" "
               "role=\"actuator1\"/></transmission></ros2_control>");
  REQUIRE(control.model.nu() == 1);
  CHECK(control.model.motors()[0].drive.ratio == 7);
  // Motors of the YAML file come before these.
  const LoadedRobot own = loadUrdf(arm + transmit("DifferentialTransmission"), "motors: {shoulder: {}}\n");
  CHECK(own.model.nu() == 1);
  CHECK(says(own, "key 'motors': it replaces that of the robot: left out are"));
  CHECK(
      says(loadUrdf(arm + transmit("HarmonicTransmission")), "<transmission> (line 7): it is left out: transmissions"));
  CHECK_THAT(getLoadError(arm + "<transmission><type>SimpleTransmission</type><joint name=\"knee\"/></transmission>"),
             Catch::Contains("there is no joint 'knee'"));
}

TEST_CASE("URDF dialects: joints of ros2_control with commands have motors, and those that mimic are coupled") {
  const std::string pair = "<link name=\"world\"/>\n" + writeLink("left") + writeLink("right") +
                           writeJoint("l", "world", "left", "0 0.1 0") + writeJoint("r", "world", "right", "0 -0.1 0");
  const auto control = [&](const std::string& more, const std::string& left = "") {
    return pair + "<ros2_control name=\"s\" type=\"system\"><joint name=\"l\">" + left +
           "<command_interface name=\"position\"/></joint><joint name=\"r\">" + more +
           "</joint><joint name=\"of_another_file\"><command_interface name=\"effort\"/></joint></ros2_control>";
  };
  const LoadedRobot robot =
      loadUrdf(control("<param name=\"mimic\">l</param><param name=\"multiplier\">-2</param>"
                       "<command_interface name=\"position\"/>"));
  CHECK(robot.warnings.empty());
  REQUIRE(robot.model.nu() == 1);
  CHECK(robot.model.motors()[0].name == "l");
  REQUIRE(robot.model.closures().size() == 1);
  VectorXd q = robot.model.makeNeutral();
  q[robot.model.joints()[robot.model.findJoint("l")].idx_q] = 0.2;
  q[robot.model.joints()[robot.model.findJoint("r")].idx_q] = -0.4;
  Workspace ws(robot.model);
  updatePositions(robot.model, ws, q);
  CHECK(calcClosureResidual(ws, robot.model.closures()[0]).norm() < 1e-15);
  CHECK(loadUrdf(control("<state_interface name=\"position\"/>")).model.nu() == 1);
  CHECK(loadUrdf(control("<command_interface name=\"effort\"/>")).model.nu() == 2);
  CHECK_THAT(getLoadError(control("<param name=\"mimic\">none</param>")),
             Catch::Contains("<param> (line") && Catch::Contains("'none' is no joint with one coordinate; name one"));
  // A transmission has the gear.
  const std::string geared =
      "<transmission><type>SimpleTransmission</type><joint name=\"l\"/><actuator name=\"a\">"
      "<mechanicalReduction>30</mechanicalReduction></actuator></transmission>";
  const LoadedRobot driven = loadUrdf(control("") + geared);
  CHECK(driven.warnings.empty());
  REQUIRE(driven.model.nu() == 1);
  CHECK(driven.model.motors()[0].drive.ratio == 30);
}

TEST_CASE("URDF dialects: balls, a world of another name, ends of loops, and elements that nobody knows") {
  const LoadedRobot ball = loadUrdf("<link name=\"world\"/>\n" + writeLink("bob") +
                                    writeJoint("pivot", "world", "bob", "0 0 1", "spherical"));
  REQUIRE(ball.model.nv() == 3);
  CHECK(ball.model.joints()[1].kind == JointKind::Spherical);

  const std::string floating = "<link name=\"odom\"/>\n" + writeLink("trunk") + writeLink("leg") +
                               writeJoint("float", "odom", "trunk", "0 0 0", "floating") +
                               writeJoint("hip", "trunk", "leg", "0 0 0");
  {
    const RobotDirectory directory;
    const LoadedRobot robot = loadRobot(directory.write("robot.urdf", "<robot name=\"r\">" + floating + "</robot>"));
    CHECK(robot.model.nv() == 7);
    CHECK(says(robot, "link 'odom': it is the world"));
  }
  CHECK(loadUrdf(floating).model.nv() == 1);  // with a fixed base

  const std::string ends = writeFourBar() + "<link name=\"closing_c_1\"/><link name=\"closing_c_2\"/>" +
                           writeJoint("end_1", "coupler", "closing_c_1", kCoupler, "fixed") +
                           writeJoint("end_2", "rocker", "closing_c_2", kRocker, "fixed");
  const LoadedRobot open = loadUrdf(ends);
  const std::string remedy = "closures: [{name: c, type: 3d, frames: [closing_c_1, closing_c_2]}]";
  CHECK(says(open, remedy));
  // Megabot's names: two loops, one warning.
  std::string others = ends;
  for (size_t at = 0; (at = others.find("closing_c_", at)) != std::string::npos;) others.replace(at, 10, "l1_cl4_");
  CHECK(says(loadUrdf(others), "closures: [{name: l1_cl4, type: 3d, frames: [l1_cl4_1, l1_cl4_2]}]"));
  for (const char* name : {"l1_clip_", "l1_clip4_", "closing_"}) {
    std::string named = ends;
    for (size_t at = 0; (at = named.find("closing_c_", at)) != std::string::npos;) named.replace(at, 10, name);
    CHECK_FALSE(says(loadUrdf(named), "look like the ends"));
  }
  const LoadedRobot closed = loadUrdf(ends, remedy + "\n");
  CHECK(closed.warnings.empty());
  checkMobility(closed.model, 1);
  {  // by a file of another name
    const RobotDirectory directory;
    directory.write("drawn.urdf", "<robot name=\"r\">" + ends + "</robot>");
    const LoadedRobot completed =
        loadRobot(directory.write("robot.yaml", "model: drawn.urdf\nbase: fixed\n" + remedy + "\n"));
    CHECK(completed.warnings.empty());
    checkMobility(completed.model, 1);
  }

  std::string dependent = writeFourBar();
  dependent.replace(dependent.find("<joint name=\"pin_b\""), 6, "<joint independent=\"false\"");
  const std::string told =
      "joint 'pin_b' is said to depend on others (independent=\"false\"), but no <loop> or <coupling>";
  CHECK(says(loadUrdf(dependent), told));
  CHECK_FALSE(says(loadUrdf(dependent, "closures: [{name: c, type: coupler, joints: {crank: 1, pin_b: 1}}]\n"), told));

  const LoadedRobot strange =
      loadUrdf(writeFourBar() + "<spring_between/>\n<spring_between/>\n<gazebo/><sensor/><mujoco/>");
  REQUIRE(strange.warnings.size() == 1);
  CHECK(says(strange, "<spring_between> (lines 9, 10): it is left out: no such element is known here"));
  const auto joint_with = [](const char* friction) {
    return writeFourBar() + writeLink("c") +
           "<joint name=\"j\" type=\"fixed\"><parent link=\"crank\"/><child link=\"c\"/><joint_properties friction=\"" +
           friction + "\"/></joint>";
  };
  CHECK(loadUrdf(joint_with("0.0")).warnings.empty());
  CHECK(says(loadUrdf(joint_with("0.1")), "<joint_properties> (line 10): it is left out"));
}
