// Files of MuJoCo as people write them: free bases made of several joints, included files, masses of meshes, and everything else
// around a mechanism.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "formats/mesh_inertia.h"
#include "get_error.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

const std::string kInertial = "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\".1 .1 .1\"/>";

// A trunk with these joints, and a leg.
std::string makeTrunk(const std::string& joints, const std::string& in_root = "", const std::string& in_world = "") {
  return "<mujoco model=\"trunk\">" + in_root + "<worldbody>" + in_world +
         "<body name=\"trunk\" pos=\"0.1 0.2 1\" euler=\"0 0 90\">" + kInertial + joints +
         "<body name=\"leg\"><joint name=\"hip\" axis=\"0 1 0\"/>" + kInertial +
         "</body></body></worldbody></mujoco>\n";
}

LoadedRobot load(const std::string& text) {
  const RobotDirectory directory;
  return loadRobot(directory.write("robot.xml", text));
}

bool warns(const LoadedRobot& robot, const std::string& text) {
  for (const std::string& warning : robot.warnings)
    if (warning.find(text) != std::string::npos) return true;
  return false;
}

// Of a body at a reference, in the world.
SE3 getPlace(const Model& model, const std::string& reference, const std::string& frame) {
  Workspace ws(model);
  updatePositions(model, ws, assembleReference(model, reference).q);
  const Frame& f = model.frames()[model.findFrame(frame)];
  return getPlacement(ws, f.body, f.X_BF);
}

Matrix3d makeTurn(double angle, const Vector3d& axis) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

}  // namespace

TEST_CASE("a site between two points stands half way, with z along them") {
  const LoadedRobot robot =
      load(makeTrunk("<freejoint/><site name=\"range\" type=\"cylinder\" size=\"0.01 0.1\" fromto=\"1 0 0 1 2 0\" "
                     "rgba=\"1 0 0 1\"/>"));
  CHECK(robot.warnings.empty());
  const Frame& frame = robot.model.frames()[robot.model.findFrame("range")];
  CHECK((frame.X_BF.p - Vector3d(1, 1, 0)).norm() < 1e-15);
  CHECK((frame.X_BF.R.col(2) - Vector3d(0, -1, 0)).norm() < 1e-12);
}

TEST_CASE("three slides and a ball are a free base, which stands where the keyframes put it") {
  const std::string slides =
      "<joint type=\"slide\" axis=\"0 0 2\" ref=\"1\" range=\"-3 3\"/>\n<joint type=\"slide\" axis=\"1 0 0\"/>"
      "<joint type=\"slide\" axis=\"0 1 0\"/><joint type=\"ball\" pos=\"0 0 0.5\"/>";
  const std::string key =
      "<keyframe><key name=\"up\" qpos=\"3 0.5 0.25 0.70710678118654757 0.70710678118654757 0 0 0.3\"/></keyframe>";
  const LoadedRobot robot = load(makeTrunk(slides, key));
  const Model& model = robot.model;
  REQUIRE(model.hasFreeFlyer());
  CHECK(model.joints()[1].name == "root_joint");
  CHECK(model.nv() == 7);
  REQUIRE(robot.warnings.size() == 2);
  CHECK(warns(robot, "<body> (line 1): its slides and ball are read as one free joint, 'root_joint'"));
  CHECK(warns(robot, "<joint> (line 1): its range is left out, because the base is free"));
  // The body is turned by a quarter about z; then by a quarter about its x, around a point half a metre above it.
  const Matrix3d Z = makeTurn(EIGEN_PI / 2, Vector3d::UnitZ()), X = makeTurn(EIGEN_PI / 2, Vector3d::UnitX());
  const Vector3d above(0, 0, 0.5), p = Vector3d(0.1, 0.2, 1) + Z * (Vector3d(0.5, 0.25, 2) + above - X * above);
  const SE3 place = getPlace(model, "up", "trunk");
  CHECK((place.p - p).norm() < 1e-12);
  CHECK((place.R - Z * X).norm() < 1e-12);
  const Reference& up = model.references()[0];
  CHECK(up.joints.at("hip") == std::vector<double>{0.3});
}

TEST_CASE("three slides and three hinges on something that stands still are a free base") {
  const std::string joints =
      "<joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/><joint type=\"slide\" axis=\"0 0 "
      "1\"/>"
      "<joint axis=\"0 0 1\"/><joint axis=\"0 1 0\" ref=\"10\"/><joint axis=\"1 0 0\"/>";
  const LoadedRobot robot =
      load("<mujoco><compiler angle=\"degree\"/><worldbody><body pos=\"0 0 2\"><body name=\"trunk\" pos=\"1 0 0\">" +
           kInertial + joints +
           "</body></body></worldbody><keyframe><key name=\"k\" qpos=\"1 2 3 0.1 0.2 0.3\"/></keyframe></mujoco>");
  REQUIRE(robot.model.hasFreeFlyer());
  CHECK(robot.model.nv() == 6);
  const SE3 place = getPlace(robot.model, "k", "trunk");
  const Matrix3d R = makeTurn(0.1, Vector3d::UnitZ()) * makeTurn(0.2 - EIGEN_PI / 18, Vector3d::UnitY()) *
                     makeTurn(0.3, Vector3d::UnitX());
  CHECK((place.p - Vector3d(2, 2, 5)).norm() < 1e-12);
  CHECK((place.R - R).norm() < 1e-12);
}

TEST_CASE("joints of a base that say more than where it is stay what they are") {
  const std::string slides = "<joint name=\"x\" type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/>";
  const std::string rest = "<joint type=\"slide\" axis=\"0 0 1\"/><joint type=\"ball\"/>";
  const auto isFree = [](const std::string& joints, const std::string& in_root = "") {
    const Model model = load(makeTrunk(joints, in_root)).model;
    CHECK(model.nv() == 7);
    return model.hasFreeFlyer();
  };
  CHECK(isFree(slides + rest));
  CHECK(isFree(slides + rest, "<default><joint armature=\"0.1\"/></default>"));
  CHECK_FALSE(isFree(slides + "<joint type=\"slide\" damping=\"3\"/><joint type=\"ball\"/>"));
  CHECK_FALSE(isFree(slides + "<joint type=\"slide\" armature=\"3\"/><joint type=\"ball\"/>"));
  CHECK_FALSE(isFree(slides + "<joint type=\"slide\" axis=\"1 0 1\"/><joint type=\"ball\"/>"));
  CHECK_FALSE(isFree(slides + rest, "<actuator><motor joint=\"x\"/></actuator>"));
  CHECK_FALSE(isFree(slides + rest, "<equality><joint joint1=\"hip\" joint2=\"x\"/></equality>"));
  CHECK_FALSE(isFree(slides + rest, "<tendon><fixed name=\"t\"><joint joint=\"x\" coef=\"1\"/></fixed></tendon>"));
}

TEST_CASE("what is in other files is read where it is included, and errors name these files") {
  const RobotDirectory directory;
  const std::string path = directory.write("scene.xml",
                                           "<mujoco model=\"scene\"><include file=\"parts/settings.xml\"/><worldbody>\n"
                                           "<include file=\"parts/trunk.xml\"/></worldbody></mujoco>");
  directory.write("parts/settings.xml",
                  "<mujocoinclude><compiler angle=\"radian\"/><default><include file=\"joint.xml\"/></default>"
                  "<option gravity=\"0 0 -3\"/></mujocoinclude>");
  directory.write("parts/joint.xml",
                  "<x>\n<joint range=\"-1 2\" margin=\"1\"/></x>");  // beside the file that includes it
  const auto writeTrunk = [&](const std::string& more) {
    directory.write("parts/trunk.xml", "<mujoco>\n<light/><body name=\"trunk\">" + kInertial +
                                           "<freejoint/><body name=\"leg\"><joint name=\"hip\"/>" + kInertial + more +
                                           "</body></body></mujoco>");
  };
  writeTrunk("");
  const LoadedRobot robot = loadRobot(path);
  CHECK(robot.model.name() == "scene");
  CHECK(robot.model.upperLimits()[6] == 2);
  CHECK(robot.model.gravity().z() == -3);
  CHECK(warns(robot, directory.path() + "/parts/trunk.xml: <light> (line 2): left out"));
  CHECK(warns(robot, directory.path() + "/parts/joint.xml: <joint> (line 2): left out: 'margin'"));

  const auto checkError = [&](const std::string& more, const std::string& error) {
    writeTrunk(more);
    CHECK_THAT(getError([&] { loadRobot(path); }), Catch::Contains("/parts/trunk.xml: " + error));
  };
  checkError("\n<joint name=\"hip\"/>", "joint 'hip' (line 3): two joints have this name; rename one of them");
  checkError("\n<geom size=\"nan\"/>", "geom (line 3): its attribute 'size' is not made of 1 to 3 finite number(s)");
  checkError("\n<include/>", "<include> (line 3): it names no file; give its attribute 'file'");
  checkError("\n<include file=\"none.xml\"/>", "<include> (line 3): there is no file 'none.xml'; correct the name");
  checkError("\n<include file=\"parts/settings.xml\"/>",
             "<include> (line 3): the file '" + directory.path() + "/parts/settings.xml' is included twice");
  checkError("\n<include file=\"scene.xml\"/>",
             "<include> (line 3): the files include each other: " + directory.path() + "/scene.xml -> " +
                 directory.path() + "/parts/trunk.xml -> " + directory.path() +
                 "/scene.xml; remove one of these <include>");
  directory.write("parts/trunk.xml", "<mujoco>\n<body>");
  CHECK_THAT(getError([&] { loadRobot(path); }),
             Catch::Contains("/parts/trunk.xml: line 2: it is not well-formed XML"));
}

TEST_CASE("two sites are welded together wherever their bodies stand") {
  const Model model =
      load(
          "<mujoco><worldbody><site name=\"wall\" pos=\"1 2 3\" euler=\"0 0 90\"/><body name=\"arm\"><joint "
          "name=\"turn\"/>" +
          kInertial +
          "<site name=\"end\" pos=\"0 1 0\"/></body></worldbody><equality><weld name=\"w\" "
          "site1=\"wall\" site2=\"end\"/></equality></mujoco>")
          .model;
  REQUIRE(model.closures().size() == 1);
  const Closure& weld = model.closures()[0];
  CHECK(weld.kind == ClosureKind::Weld6D);
  CHECK((weld.X_B1.p - Vector3d(1, 2, 3)).norm() < 1e-15);
  CHECK((weld.X_B2.p - Vector3d(0, 1, 0)).norm() < 1e-15);
}

TEST_CASE("the compiler of MuJoCo bounds, balances and scales masses, and takes them from some groups of geoms") {
  const auto getInertia = [](const std::string& compiler, const std::string& in_body) {
    return load("<mujoco><compiler " + compiler + "/><worldbody><body name=\"a\"><joint/>" + in_body +
                "</body></worldbody></mujoco>")
        .model.bodies()[1]
        .inertia;
  };
  const std::string given = "<inertial pos=\"1 2 3\" mass=\"2\" diaginertia=\"1 2 4\"/>";
  const std::string fine = "<inertial pos=\"1 2 3\" mass=\"2\" diaginertia=\"3 2 4\"/>";
  const Inertia balanced = getInertia("balanceinertia=\"true\"", given);
  CHECK((balanced.I_com - 7. / 3 * Matrix3d::Identity()).norm() < 1e-14);
  const Inertia bounded = getInertia("boundmass=\"5\" boundinertia=\"2.5\"", fine);
  CHECK(bounded.mass == 5);
  CHECK((bounded.I_com - Matrix3d(Vector3d(3, 2.5, 4).asDiagonal())).norm() < 1e-14);
  const Inertia scaled = getInertia("settotalmass=\"10\"", fine);
  CHECK(scaled.mass == 10);
  CHECK(scaled.I_com(2, 2) == 20);
  CHECK(scaled.com == Vector3d(1, 2, 3));
  const std::string geoms = "<geom size=\"1\" mass=\"1\" group=\"1\"/><geom size=\"1\" mass=\"4\" group=\"3\"/>";
  CHECK(getInertia("", geoms).mass == 5);
  CHECK(getInertia("inertiagrouprange=\"2 4\"", geoms).mass == 4);
}

namespace {

// A box of 2 x 4 x 6 with one corner at the origin, seen from outside.
const char* const kBoxObj = R"(v 0 0 0
v 2 0 0
v 2 4 0
v 0 4 0
v 0 0 6
v 2 0 6
v 2 4 6
v 0 4 6
f 4 3 2 1
f 5/1 6/2/3 7 8
f 1 2 6 5
f -7 -6 -2 -3
f 3 4 8 7
f 4 1 5 8
)";

}  // namespace

TEST_CASE("a mesh gives its body the mass that it encloses") {
  const RobotDirectory directory;
  directory.write("meshes/box.obj", kBoxObj);
  const auto load = [&](const std::string& mesh, const std::string& geom) {
    return loadRobot(directory.write(
        "robot.xml", "<mujoco><compiler meshdir=\"meshes\"/><asset><mesh " + mesh +
                         "/></asset><worldbody><body name=\"a\"><joint/>\n<geom type=\"mesh\" mesh=\"box\" " + geom +
                         "/></body></worldbody></mujoco>"));
  };
  const auto getInertia = [&](const std::string& mesh, const std::string& geom) {
    return load(mesh, geom).model.bodies()[1].inertia;
  };
  // m / 12 (a^2 + b^2)
  const Matrix3d expected = Vector3d(16 + 36, 4 + 36, 4 + 16).asDiagonal();
  const Inertia plain = getInertia("file=\"box.obj\"", "density=\"10\"");
  CHECK(plain.mass == Approx(480));
  CHECK((plain.com - Vector3d(1, 2, 3)).norm() < 1e-12);
  CHECK((plain.I_com - 40 * expected).norm() < 1e-9);
  const Inertia moved = getInertia("file=\"box.obj\" refpos=\"1 2 0\" scale=\"0.1 0.1 -0.1\" inertia=\"exact\"",
                                   "mass=\"12\" pos=\"0 0 1\"");
  CHECK(moved.mass == 12);
  CHECK((moved.com - Vector3d(0, 0, 0.7)).norm() < 1e-12);
  CHECK((moved.I_com - 0.01 * expected).norm() < 1e-12);
  // Its walls: pairs of 4 x 6, 2 x 6 and 2 x 4. About x, a pair across x has A (b^2 + c^2) / 12 each, the others also their
  // distance.
  const Inertia shell = getInertia("file=\"box.obj\" inertia=\"shell\"", "density=\"1\"");
  CHECK(shell.mass == Approx(2 * (24 + 12 + 8)));
  CHECK(shell.I_com(0, 0) == Approx(2 * (24 * 52. / 12 + 12 * (36. / 12 + 4) + 8 * (16. / 12 + 9))));

  const auto checkError = [&](const std::string& mesh, const std::string& problem) {
    const std::string error = getError([&] { load(mesh, ""); });
    CHECK_THAT(error, Catch::Contains("geom (line 2): the mass of the body comes from the mesh 'box'" + problem));
    CHECK_THAT(error, Catch::Contains("give the body an <inertial>"));
  };
  checkError("file=\"none.obj\" name=\"box\"", ", but meshes/none.obj is missing");
  checkError("file=\"other.obj\"", ", which is not there");
  checkError("file=\"box.obj\" inertia=\"convex\"", " by its convex hull");
  directory.write("meshes/box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  checkError("file=\"box.obj\"", ", but meshes/box.obj is missing, damaged, of another kind, or encloses nothing");
  directory.write("meshes/box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  checkError("file=\"box.obj\"", ", but meshes/box.obj is missing, damaged");
  // Found by fuzzing: a huge triangle, whose volume is rounding.
  Eigen::Matrix3Xd huge(3, 3);
  huge << 1.3563156426940112e-19, 4.3368084314480763e-19, 1.3563178398925133e-19,  //
      -2.1284328186216697e+38, 1.3563156426940112e-19, 1.3563156426940112e-19,     //
      -2.1293607388610368e+38, 1.4918429822062306e-19, 1.3563156426940112e-19;
  for (MeshSolid solid : {MeshSolid::Enclosed, MeshSolid::Overlapping, MeshSolid::Surface})
    if (const std::optional<Inertia> inertia = calcMeshInertia(huge, solid)) CHECK(inertia->mass > 0);
}

TEST_CASE("what does not change the mechanism is left out by name and line, what bends is refused") {
  const LoadedRobot robot = load(makeTrunk("<freejoint/>", R"(
    <asset><texture type="skybox" builtin="flat" width="8" height="8"/><material name="m"/></asset>
    <extension><plugin plugin="mujoco.elasticity.cable"/></extension>
    <contact><exclude body1="trunk" body2="leg"/></contact>
    <deformable><skin/></deformable>
    <sensor><rangefinder site="a"/></sensor><statistic extent="1"/><visual><map znear="1"/></visual><size njmax="3"/>
    <tendon><spatial name="t"><site site="a"/><geom geom="g"/><site site="b"/></spatial></tendon>)"));
  for (const char* left_out :
       {"<texture> (line 2): left out", "<material> (line 2): left out", "<extension> <plugin> (line 3): left out",
        "<contact> <exclude> (line 4): left out", "<deformable> <skin> (line 5): left out",
        "<sensor> <rangefinder> (line 6): left out", "<statistic> (line 6): left out",
        "<visual> <map> (line 6): left out", "<size> (line 6): left out",
        "<spatial> (line 7): it bends about a <geom>, and is left out"})
    CHECK(warns(robot, left_out));
  CHECK(robot.warnings.size() == 10);
  CHECK_THAT(getError([] { load(makeTrunk("", "<deformable>\n<flex/></deformable>")); }),
             Catch::Contains("<flex> (line 2): bodies that bend are not supported; remove it"));
  CHECK_THAT(getError([] { load(makeTrunk("<freejoint/>\n<composite/>")); }),
             Catch::Contains("<composite> (line 2): such elements are not supported; save the model with MuJoCo"));
  const LoadedRobot idle =
      load(makeTrunk("<freejoint/>", R"(<option><flag gravity="disable" equality="disable"/></option>
    <equality><connect body1="leg" anchor="0 0 0"/></equality>)"));
  CHECK(idle.model.gravity().norm() == 0);
  CHECK(idle.model.closures().empty());
  CHECK(warns(idle, "<connect> (line 2): it is left out, because <flag> disables equalities"));
}

TEST_CASE("a file of MuJoCo that ends early is an error at one of its lines") {
  const std::string text = makeTrunk("<freejoint/>\n<site name=\"s\" fromto=\"0 0 0 0 0 1\"/>\n",
                                     "<keyframe>\n<key qpos=\"0 0 1 1 0 0 0 0\"/></keyframe>\n");
  for (size_t length = 0; length + 12 < text.size(); length += 7) {
    const std::string error = getError([&] { load(text.substr(0, length)); });
    CAPTURE(length, error);
    CHECK(error.find("robot.xml: ") != std::string::npos);
    CHECK((error.find(": line ") != std::string::npos || length == 0));
  }
}
