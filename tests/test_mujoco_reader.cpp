// MuJoCo and the reader of its files agree: masses of meshes, and where free bases made of several joints stand.
#include <algorithm>
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "load_mujoco.h"
#include "robot_directory.h"
#include "worlds/mujoco_model.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// A plate of the shape of an L, not convex, and thick; seen from outside.
const char* const kAngle = R"(v 0 0 0
v 3 0 0
v 3 1 0
v 1 1 0
v 1 4 0
v 0 4 0
v 0 0 0.5
v 3 0 0.5
v 3 1 0.5
v 1 1 0.5
v 1 4 0.5
v 0 4 0.5
f 4 3 2
f 4 2 1
f 4 1 6
f 4 6 5
f 10 8 9
f 10 7 8
f 10 12 7
f 10 11 12
f 1 2 8
f 1 8 7
f 2 3 9
f 2 9 8
f 3 4 10
f 3 10 9
f 4 5 11
f 4 11 10
f 5 6 12
f 5 12 11
f 6 1 7
f 6 7 12
)";

}  // namespace

TEST_CASE("MuJoCo has the masses of meshes that the reader has, by both of its ways") {
  const RobotDirectory directory;
  directory.write("angle.obj", kAngle);
  // By its older way, MuJoCo 2.2.2 takes another volume for the mass than its successors.
  for (const auto& [exact, mass] : {std::pair("false", "mass=\"3\""), std::pair("true", "density=\"700\"")}) {
    CAPTURE(exact);
    const std::string path = directory.write(
        "robot.xml",
        std::string("<mujoco><compiler exactmeshinertia=\"") + exact +
            R"("/><asset><mesh file="angle.obj" scale="0.1 0.2 -0.3" refpos="0.3 0.2 0.1" refquat="0.8 0.1 0.2 0.3"/></asset>
      <worldbody><body name="a" pos="0 0 1"><joint/><geom type="mesh" mesh="angle" )" +
            mass + R"( pos="0.1 0.2 0.3"
        euler="10 20 30"/></body></worldbody></mujoco>)");
    const Inertia ours = loadRobot(path).model.bodies()[1].inertia;
    const MjModel mj = loadMujoco(path);
    CHECK(ours.mass == Approx(mj->body_mass[1]).epsilon(1e-5));  // its vertices are of single precision
    CHECK((ours.com - Eigen::Map<Vector3d>(mj->body_ipos + 3)).norm() < 1e-5);
    const double* wxyz = mj->body_iquat + 4;
    const Matrix3d R = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).toRotationMatrix();
    const Matrix3d I = R * Eigen::Map<Vector3d>(mj->body_inertia + 3).asDiagonal() * R.transpose();
    CHECK((ours.I_com - I).norm() < 1e-5 * I.norm());
  }
}

TEST_CASE("it is told where MuJoCo 2 gives meshes another mass than its successors") {
  const RobotDirectory directory;
  directory.write("angle.obj", kAngle);
  directory.write("tetrahedron.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  directory.write("box.obj", R"(v 0 0 0
v 1 0 0
v 1 2 0
v 0 2 0
v 0 0 3
v 1 0 3
v 1 2 3
v 0 2 3
f 1 3 2
f 1 4 3
f 5 6 7
f 5 7 8
f 1 2 6
f 1 6 5
f 2 3 7
f 2 7 6
f 3 4 8
f 3 8 7
f 4 1 5
f 4 5 8
)");
  const std::string exact = "exactmeshinertia=\"true\"";
  for (const auto& [mesh, compiler, geom, share] : {std::tuple("tetrahedron", "", "", 1.394),
                                                    {"box", "", "", 1.0},
                                                    {"angle", "", "", 0.0},
                                                    {"tetrahedron", exact.c_str(), "", 1.0},
                                                    {"tetrahedron", "", "mass=\"2\"", 1.0}}) {
    CAPTURE(mesh, compiler, geom);
    const std::string path = directory.write(
        "robot.xml", std::string("<mujoco><compiler ") + compiler + "/><asset><mesh file=\"" + mesh +
                         ".obj\"/></asset><worldbody><body name=\"a\"><joint/><geom type=\"mesh\" mesh=\"" + mesh +
                         "\" euler=\"10 20 30\" " + geom + "/></body></worldbody></mujoco>");
    const LoadedRobot ours = loadRobot(path);
    const double relative = loadMujoco(path)->body_mass[1] / ours.model.bodies()[1].inertia.mass;
    if (share > 0) CHECK(relative == Approx(share).epsilon(1e-3));
    const bool is_told = std::any_of(ours.warnings.begin(), ours.warnings.end(), [](const std::string& warning) {
      return warning.find("MuJoCo 2 takes the volume of a box") != std::string::npos;
    });
    CHECK(is_told == (std::abs(relative - 1) > 0.01));
  }
}

TEST_CASE("a free base of several joints stands where MuJoCo puts it") {
  const RobotDirectory directory;
  const std::string slides =
      "<joint type=\"slide\" axis=\"0 0 1\" ref=\"0.4\"/><joint type=\"slide\" axis=\"1 1 0\"/>"
      "<joint type=\"slide\" axis=\"1 -1 0\" ref=\"-1\"/>";
  const std::string hinges =
      "<joint axis=\"0 1 0\" pos=\"0.1 0.2 0.3\"/><joint axis=\"1 0 0\" ref=\"20\" pos=\"0.1 0 0.3\"/><joint axis=\"0 "
      "0 1\"/>";
  const std::string ball = "<joint type=\"ball\" pos=\"0.3 0.1 0\"/>";
  for (const auto& [joints, qpos] : {std::pair(slides + ball, "0.3 0.5 -0.7 0.8 0.2 -0.3 0.4 0.6"),
                                     std::pair(slides + hinges, "0.3 0.5 -0.7 0.2 0.6 -1.3 0.6")}) {
    CAPTURE(qpos);
    const std::string path = directory.write(
        "robot.xml",
        "<mujoco><worldbody><body pos=\"0 0.5 0\" euler=\"0 30 0\"><geom size=\"0.1\"/><body name=\"trunk\" "
        "pos=\"0.1 0.2 1\" euler=\"20 0 10\">" +
            joints +
            "<geom size=\"0.2\"/><body name=\"leg\" pos=\"0 0 -0.2\"><joint name=\"hip\"/><geom size=\"0.1\" pos=\"0 0 "
            "-1\"/>"
            "</body></body></body></worldbody><keyframe><key name=\"k\" qpos=\"" +
            qpos + "\"/></keyframe></mujoco>");
    const Model model = loadRobot(path).model;
    REQUIRE(model.hasFreeFlyer());
    Workspace ws(model);
    updatePositions(model, ws, assembleReference(model, "k").q);
    const MjModel mj = loadMujoco(path);
    const MjData data(mj_makeData(mj.get()), mj_deleteData);
    mj_resetDataKeyframe(mj.get(), data.get(), 0);
    mj_kinematics(mj.get(), data.get());
    for (const char* name : {"trunk", "leg"}) {
      const int body = mj_name2id(mj.get(), mjOBJ_BODY, name);
      const Frame& frame = model.frames()[model.findFrame(name)];
      const SE3 X = getPlacement(ws, frame.body, frame.X_BF);
      CHECK((X.p - Eigen::Map<Vector3d>(data->xpos + 3 * body)).norm() < 1e-12);
      CHECK((X.R - Eigen::Map<RowMatrixXd>(data->xmat + 9 * body, 3, 3)).norm() < 1e-12);
    }
  }
}

namespace {

// A gripper of two fingers and a slide, driven by the sum of their coordinates.
std::string makeGripper(const std::string& tendon, const std::string& rest) {
  return R"(<mujoco><compiler angle="radian"/><option gravity="0 0 -3"/>
    <default><geom density="100000"/></default><worldbody><body name="palm" pos="0 0 1">
    <joint name="wrist" axis="1 0 0"/><geom size="0.1" pos="0.05 0 0"/>
    <body name="left" pos="0.1 0 0"><joint name="l" axis="0 1 0" ref="0.3"/><geom size="0.05" pos="0.05 0 0.2"/>
      <body name="tip" pos="0 0 0.3"><joint name="t" axis="0 1 0.2"/><geom size="0.03" pos="0 0.02 0.1"/></body></body>
    <body name="right" pos="-0.1 0 0"><joint name="r" axis="0 1 0"/><geom size="0.05" pos="-0.05 0 0.2"/></body>
    <body name="bolt"><joint name="s" type="slide" axis="0 1 0"/><geom size="0.04"/></body></body></worldbody>
    <tendon><fixed name="pull" )" +
         tendon +
         R"(><joint joint="l" coef="0.5"/><joint joint="t" coef="-1.5"/><joint joint="s" coef="2"/></fixed>
      <fixed name="alone"><joint joint="r" coef="-0.7"/></fixed></tendon>)" +
         rest + "</mujoco>";
}

}  // namespace

TEST_CASE("motors on fixed tendons drive joints as in MuJoCo, with the tendon's springs and limits") {
  const RobotDirectory directory;
  const std::string path = directory.write(
      "gripper.xml",
      makeGripper(
          "stiffness=\"4\" damping=\"0.6\" springlength=\"0.2\" limited=\"true\" range=\"-3 4\"",
          "<actuator><motor name=\"close\" tendon=\"pull\" gear=\"3\" ctrllimited=\"true\" ctrlrange=\"-2 2\"/>"
          "<motor name=\"one\" tendon=\"alone\" gear=\"5\" ctrllimited=\"true\" ctrlrange=\"-2 2\"/></actuator>"));
  const LoadedRobot robot = loadRobot(path);
  const Model& model = robot.model;
  const MjModel mj = loadMujoco(path);
  const MjData data(mj_makeData(mj.get()), mj_deleteData);
  REQUIRE(model.nv() == mj->nv + 1);
  REQUIRE(model.nu() == 2);
  CHECK(model.motors()[0].name == "pull");
  CHECK(model.motors()[0].effort_limit == 6);
  CHECK(model.motors()[1].name == "r");
  CHECK(model.motors()[1].effort_limit == Approx(7).epsilon(1e-15));
  CHECK(calcMobility(model, model.makeNeutral()).mobility == mj->nv);
  const int length = model.motors()[0].dof;
  CHECK(model.lowerLimits()[length] == -3);
  CHECK(model.upperLimits()[length] == 4);
  CHECK(model.bodies()[model.joints()[model.motors()[0].joint].parent].name == "palm");

  // At a posture, speeds and inputs: forces of actuators and accelerations. Rotors have next to no inertia.
  const Closure& coupler = model.closures().at(0);
  VectorXd q(model.nq()), v(model.nv()), tau = VectorXd::Zero(model.nv());
  double at = 0.1;
  for (int j = 0; j < mj->njnt; ++j, at += 0.15) {
    const Joint& joint = model.joints()[model.findJoint(mj_id2name(mj.get(), mjOBJ_JOINT, j))];
    data->qpos[j] = q[joint.idx_q] = at;
    data->qvel[j] = v[joint.idx_v] = 1 - 2 * at;
  }
  double sum = 0, rate = 0;
  for (const CouplerTerm& term : coupler.terms)
    if (term.dof != length) sum -= term.coefficient * q[term.idx_q], rate -= term.coefficient * v[term.dof];
  q[model.joints()[model.motors()[0].joint].idx_q] = sum, v[length] = rate;
  data->ctrl[0] = 1.3, data->ctrl[1] = -0.4;
  mj_forward(mj.get(), data.get());
  CHECK(data->ten_length[0] == Approx(sum).epsilon(1e-14));
  tau[length] = 3 * 1.3;
  tau[model.motors()[1].dof] = -0.7 * 5 * -0.4;
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), q, v, tau) == NumericalStatus::Ok);
  REQUIRE(cws.J.rows() == 1);
  const double multiplier = -tau[length] / cws.J(0, length);  // of a rotor without inertia and springs
  for (int j = 0; j < mj->njnt; ++j) {
    const int dof = model.joints()[model.findJoint(mj_id2name(mj.get(), mjOBJ_JOINT, j))].idx_v;
    CAPTURE(mj_id2name(mj.get(), mjOBJ_JOINT, j));
    CHECK(tau[dof] + cws.J(0, dof) * multiplier == Approx(data->qfrc_actuator[j]).epsilon(1e-12).margin(1e-12));
    CHECK(cws.a[dof] == Approx(data->qacc[j]).epsilon(1e-6).margin(1e-6));
  }
}

TEST_CASE("a fixed tendon of a narrow range is a coupler with play; a wide one is told") {
  const RobotDirectory directory;
  const auto load = [&](const std::string& range) {
    return loadRobot(directory.write("play.xml", makeGripper("limited=\"true\" range=\"" + range + "\"", "")));
  };
  const LoadedRobot narrow = load("0.295 0.305");
  REQUIRE(narrow.model.closures().size() == 1);
  const Closure& coupler = narrow.model.closures()[0];
  CHECK(coupler.name == "pull");
  CHECK(coupler.offset == Approx(0.3).epsilon(1e-15));
  REQUIRE(coupler.terms.size() == 3);
  CHECK(coupler.terms[0].coefficient == 0.5);
  const auto tells = [](const LoadedRobot& robot, const std::string& text) {
    return std::any_of(robot.warnings.begin(), robot.warnings.end(),
                       [&](const std::string& w) { return w.find(text) != std::string::npos; });
  };
  CHECK(tells(narrow, "a coupler that keeps its length of 0.3; its play of 0.005 to either side is left out"));
  const LoadedRobot wide = load("-0.5 0.5");
  CHECK(wide.model.closures().empty());
  CHECK(tells(wide, "its range is too wide for a coupler with play"));
}
