// The command, run like a user does. Oracles: the library's own functions on the same states.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/names.h"
#include "bielle/motion/motion.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "cli_command.h"
#include "model/number_text.h"
#include "robot_directory.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using nlohmann::json;

namespace {

VectorXd toVector(const json& list) {
  const auto numbers = list.get<std::vector<double>>();
  return VectorXd::Map(numbers.data(), numbers.size());
}

MatrixXd toMatrix(const json& rows) {
  MatrixXd matrix(rows.size(), rows.at(0).size());
  for (size_t i = 0; i < rows.size(); ++i) matrix.row(i) = toVector(rows[i]).transpose();
  return matrix;
}

// The state file of (q, v, u) with every joint given.
json makeState(const Model& model, const VectorXd& q, const VectorXd& v, const VectorXd& u) {
  json state;
  const auto list = [](const VectorXd& x) { return std::vector<double>(x.begin(), x.end()); };
  for (const Joint& joint : model.joints())
    if (joint.nv)
      state["joints"][joint.name] = {{"q", list(q.segment(joint.idx_q, joint.nq))},
                                     {"v", list(v.segment(joint.idx_v, joint.nv))}};
  for (int m = 0; m < model.nu(); ++m) state["torques"][model.motors()[m].name] = u[m];
  return state;
}

}  // namespace

TEST_CASE("help and version are on the standard output, with examples") {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--help"},
                                                    {"solve", "--help"},
                                                    {"solve", "squat", "--help"},
                                                    {"info", "--help"},
                                                    {"eval", "--help"},
                                                    {"robots", "--help"}}) {
    const CommandResult result = run(arguments);
    CHECK(result.status == 0);
    CHECK(result.err.empty());
    CHECK_THAT(result.out, Catch::Contains("Examples:") && Catch::Contains("bielle "));
  }
  CHECK_THAT(run({"--version"}).out, Catch::Contains("bielle 0."));
  const std::string help = run({"solve", "squat", "--help"}).out;
  SquatOptions options;
  for (const Option& option : listOptions(options)) {
    CHECK_THAT(help, Catch::Contains("\n  " + option.name + " ") && Catch::Contains("[" + option.unit + "]") &&
                         Catch::Contains(option.help));
  }
}

TEST_CASE("bad input is one line of error and status 2") {
  const OutputDirectory directory;
  checkRefused(run({}), "command is required");
  checkRefused(run({"dance"}), "dance");
  checkRefused(run({"solve"}), "motion is required");
  checkRefused(run({"solve", "squat", "-o", "x"}), "--robot");
  checkRefused(run({"info", "nobody"}), "robot 'nobody': there is no robot of this name");
  checkRefused(run({"info", "/no/such.urdf"}), "there is no such file");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "depht=0.7"})), "option 'depht'");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "friction"})), "name=value");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "friction=0.7m"})), "'0.7m' is not a number");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "friction=nan"})), "not finite");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "depth=-1"})), "'depth' is given twice");
  checkRefused(run({"solve", "squat", "--robot", "bipetto", "--set", "depth=-1", "-o", directory.str()}),
               "option 'depth'");
  checkRefused(run(makeShortSquat(directory.str(), {"--formulation", "best"})), "best");
  checkRefused(run(makeShortSquat(directory.str(), {"--max-iterations", "0"})), "--max-iterations");
  checkRefused(run({"solve", "squat", "--robot", "fourbar", "-o", directory.str()}), "needs feet");
  CHECK_FALSE(fs::exists(directory.str()));
  checkRefused(run(makeShortSquat("/dev/null/results")), "results cannot be written there");
}

TEST_CASE("numbers of every command are finite, and messages show bounds in a few digits") {
  const OutputDirectory directory;
  const std::vector<std::vector<std::string>> commands = {
      {"solve", "squat", "--robot", "bipetto", "-o", directory.str(), "--depth"},
      {"solve", "squat", "--robot", "bipetto", "-o", directory.str(), "--dead-point-margin"},
      {"solve", "squat", "--robot", "bipetto", "-o", directory.str(), "--time-weight"},
      {"solve", "squat", "--robot", "bipetto", "-o", directory.str(), "--regularization"},
      {"convert", "bipetto", "-o", directory.str(), "--payload"},
      {"convert", "bipetto", "-o", directory.str(), "--payload", "1", "--payload-at", "0", "0"},
      {"report", directory.str(), "--rate"},
      {"report", directory.str(), "--times"},
      {"lift", directory.str(), "-o", directory.str(), "--singular"},
      {"lift", directory.str(), "-o", directory.str(), "--velocity-tolerance"},
      {"ratio", "bipetto", "--joint", "knee_right", "--step"}};
  for (std::vector<std::string> command : commands)
    for (const std::string value : {"nan", "inf", "1e400"}) {
      command.push_back(value);
      const CommandResult result = run(command);
      checkRefused(result, "'" + value + "' is not a ");
      CHECK(result.err.size() < 200);
      command.pop_back();
    }
  for (const std::string value : {"1e300", "-1"})
    checkRefused(run({"convert", "bipetto", "-o", directory.str(), "--payload", value}),
                 "not a number from 0 to 1e+06");
  checkRefused(run({"lift", directory.str(), "-o", directory.str(), "--velocity-tolerance", "0"}),
               "finite positive number");
  CHECK_FALSE(fs::exists(directory.str()));
}

TEST_CASE("an output that is an input is refused, by whatever path") {
  const OutputDirectory directory;
  const fs::path place = fs::path(directory.str()).parent_path();
  const std::string squat = (place / "squat").string(), link = (place / "link").string();
  REQUIRE(run(makeShortSquat(squat, {"--quiet", "--no-report"})).status == 0);
  fs::create_directory_symlink(squat, link);
  const std::string robot = (place / "robot").string(), urdf = robot + "/robot.urdf";
  REQUIRE(run({"convert", "bipetto", "-o", robot}).status == 0);
  const std::string spec = (place / "spec.yaml").string();
  std::ofstream(spec) << "motions: [squat]\npush: {time: 0.1, direction: 0, impulse: 1}\n";
  const std::vector<std::vector<std::string>> commands = {
      makeShortSquat(squat, {"--warm-start", squat}),
      makeShortSquat(link, {"--warm-start", squat + "/."}),
      {"export", squat, "-o", link + "/trajectory.npz"},
      {"report", squat, "-o", squat + "/../squat/summary.json"},
      {"report", squat, "--png", squat + "/trajectory.csv"},
      {"lift", squat, "-o", link},
      {"convert", robot, "-o", robot},
      {"convert", urdf, "--to", "urdf", "-o", urdf},
      {"convert", robot, "--to", "mjcf", "-o", robot + "/robot.yaml"},
      {"view", robot, "-o", robot + "/../robot/robot.urdf"},
      {"campaign", spec, "-o", link},
      {"design", BIELLE_SOURCE_DIR "/examples/knee_design/knee.yaml", "--evaluate", spec, "-o", spec}};
  const auto readAll = [&] {
    std::string text;
    for (const char* name : {"squat/trajectory.npz", "squat/trajectory.csv", "squat/summary.json", "robot/robot.urdf",
                             "robot/robot.yaml", "spec.yaml"})
      text += readFile(place / name);
    return text;
  };
  const std::string before = readAll();
  for (const std::vector<std::string>& command : commands) {
    CAPTURE(command);
    checkRefused(run(command), "it is also an input");
  }
  CHECK(readAll() == before);
}

TEST_CASE("the serial chain of a robot is written with tables of its linkages") {
  const OutputDirectory directory;
  const fs::path place = fs::path(directory.str()).parent_path();
  for (const std::string format : {"mjcf", "urdf"}) {
    const std::string file = (place / ("chain." + format)).string();
    const CommandResult result = run({"convert", "rsu_biped", "--to", format, "--serial", "-o", file});
    CAPTURE(result.err);
    REQUIRE(result.status == 0);
    CHECK_THAT(result.err,
               Catch::Contains("joints of linkages frozen: 8, with 0.64 kg of their bodies; closures left out: 4"));
    const std::string text = readFile(file);
    for (const char* loop : {"<connect", "<weld", "<mimic"}) CHECK(text.find(loop) == std::string::npos);
    const json tables = json::parse(readFile(place / "chain.linkages.json"));
    CHECK(tables["model"] == "chain." + format);
    REQUIRE(tables["linkages"].size() == 2);
    for (const json& table : tables["linkages"]) {
      const size_t m = table["joints"].size();
      REQUIRE(m == 2);
      size_t count = 1;
      for (size_t i = 0; i < m; ++i) {
        CHECK(table["axes"][i].size() == table["shape"][i]);
        CHECK_THAT(text, Catch::Contains(table["joints"][i].get<std::string>()));
        count *= table["shape"][i].get<size_t>();
      }
      for (const auto& [name, entries] : {std::pair("ratio", m * m),
                                          {"inertia", m * m},
                                          {"weight", 3 * m},
                                          {"held", m},
                                          {"damping", m * m},
                                          {"friction", m},
                                          {"torque_alone", m},
                                          {"speed_most", m}}) {
        CAPTURE(name);
        REQUIRE(table[name].size() == count);
        for (const json& row : table[name]) CHECK(row.size() == entries);
      }
    }
  }
  checkRefused(run({"convert", "rsu_biped", "--to", "sdf", "--serial", "-o", directory.str()}),
               "add --to mjcf or --to urdf");
  checkRefused(run({"convert", "fivebar", "--to", "mjcf", "--serial", "-o", directory.str()}),
               "no equivalent serial chain");
  CHECK_FALSE(fs::exists(directory.str()));
}

TEST_CASE("a loop that cannot be closed is refused with the file, the closure and its gap") {
  const OutputDirectory directory;
  fs::create_directories(directory.str());
  const fs::path robot = fs::path(BIELLE_SOURCE_DIR) / "robots/fourbar/fourbar";
  std::ifstream original(robot.string() + ".urdf");
  std::stringstream text;
  text << original.rdbuf();
  std::string urdf = text.str();
  const std::string pivot = "<origin xyz=\"0.4 0 0\"/>";  // of the rocker; the bars reach 0.8 m
  REQUIRE(urdf.find(pivot) != std::string::npos);
  urdf.replace(urdf.find(pivot), pivot.size(), "<origin xyz=\"2.4 0 0\"/>");
  std::ofstream(directory.str() + "/stretched.urdf") << urdf;
  fs::copy_file(robot.string() + ".yaml", directory.str() + "/stretched.yaml");
  const CommandResult result = run({"info", directory.str()});
  checkRefused(result, "closure 'coupler': its loop cannot be closed");
  CHECK_THAT(result.err, Catch::Contains(directory.str() + "/stretched.urdf: closure"));
}

TEST_CASE("robots are listed with their places") {
  const CommandResult result = run({"robots"});
  CHECK(result.status == 0);
  for (const char* name : {"bipetto", "fourbar", "fivebar"})
    CHECK_THAT(result.out, Catch::Contains(std::string(name) + "/" + name + ".urdf"));
}

TEST_CASE("info describes the model, in words and in JSON") {
  const Model model = loadRobot("bipetto").model;
  const CommandResult text = run({"info", "bipetto"});
  CHECK(text.status == 0);
  for (const Joint& joint : model.joints())
    if (joint.nv) CHECK_THAT(text.out, Catch::Contains("\n  " + joint.name + " "));
  const json info = json::parse(run({"info", "bipetto", "--json"}).out);
  CHECK(info["mass"].get<double>() == model.mass());
  CHECK(info["nv"] == model.nv());
  CHECK(info["joints"].size() == model.joints().size() - 1);
  CHECK(info["motors"].size() == model.motors().size());
  CHECK(info["clusters"].size() == model.clusters().size());
  CHECK(info["mobility"]["rank"] == 36);
  CHECK(info["mobility"]["mobility"] == 18);
  Workspace ws(model);
  updatePositions(model, ws, model.makeNeutral());
  for (size_t c = 0; c < model.closures().size(); ++c) {
    const Vector6d gap = calcClosureResidual(ws, model.closures()[c]);
    const json& closure = info["closures"][c];
    CHECK(closure["name"] == model.closures()[c].name);
    CHECK(closure["gap neutral"][0].get<double>() == Approx(gap.head<3>().norm()));
    CHECK(closure["gap neutral"][1].get<double>() == Approx(gap.tail<3>().norm()));
    CHECK(closure["gap half_sitting"][0].get<double>() < 1e-11);
  }
  const json fixed = json::parse(run({"info", "bipetto", "--json", "--fixed-base"}).out);
  CHECK(fixed["base"] == "fixed");
  CHECK(fixed["nv"] == model.nv() - 6);
  CHECK(json::parse(run({"info", "fourbar", "--json"}).out)["mobility"]["mobility"] == 1);
}

TEST_CASE("what changes no mechanism is one line of a robot's warnings, and a list if that is asked for") {
  const RobotDirectory directory;
  const std::string path = directory.write("arm.xml", R"(<mujoco model="arm">
<option cone="elliptic"/>
<worldbody><light/><camera/>
<body name="link"><joint name="turn" axis="0 1 0"/><camera/><geom type="capsule" size="0.1 0.1" contype="0" conaffinity="0"/><inertial pos="0 0 1" mass="1" diaginertia="1 1 1"/></body>
</worldbody>
<actuator><motor joint="turn"/></actuator>
<sensor><jointpos joint="turn"/></sensor>
</mujoco>)");
  const std::string told =
      "bielle: warning: " + path + ": what changes no mechanism is left out (5 kinds of elements; ";
  const std::string list = "bielle: left out: " + path + ": ";
  for (std::vector<std::string> command : std::vector<std::vector<std::string>>{
           {"info", path}, {"convert", path, "-o", directory.path() + "/copy"}, {"ratio", path, "--joint", "turn"}}) {
    const CommandResult result = run(command);
    CAPTURE(command[0], result.err);
    CHECK_THAT(result.err, Catch::Contains(told) && !Catch::Contains("camera") && !Catch::Contains(list));
    command.push_back("--verbose");
    for (const char* element : {"<light> (line 3)", "<camera> (lines 3, 4)", "<option> (line 2): 'cone'",
                                "<geom> (line 4): a capsule is drawn as a cylinder", "<sensor> <jointpos> (line 7)"})
      CHECK_THAT(run(command).err, Catch::Contains(told) && Catch::Contains(list + element + "\n"));
  }
  for (const std::string command : {"info", "eval", "view", "convert", "adopt", "ratio", "modes", "bench"})
    CHECK_THAT(run({command, "--help"}).out, Catch::Contains("--verbose"));
  CHECK_THAT(run({"solve", "walk", "--help"}).out, Catch::Contains("--verbose"));
}

TEST_CASE("info lists the joints of references as given and as assembled, and tells where these differ") {
  const RobotDirectory directory;
  const fs::path fourbar = fs::path(BIELLE_SOURCE_DIR) / "robots/fourbar";
  const std::string urdf = readFile(fourbar / "fourbar.urdf"), yaml = readFile(fourbar / "fourbar.yaml");
  const auto inform = [&](const std::string& limit, const std::string& reference) {
    const std::string axis = "<child link=\"rocker\"/>\n    <axis xyz=\"0 -1 0\"/>\n    <limit ",
                      none = "lower=\"-1e16\" upper=\"1e16\" ";
    return run(
        {"info", directory.writeRobot(replaceOnce(urdf, axis + none, axis + limit), yaml + reference), "--json"});
  };
  const CommandResult as_it_is = run({"info", fourbar.string()});
  CHECK(as_it_is.err.empty());
  CHECK_THAT(as_it_is.out, Catch::Contains("  crank_at_60_degrees  crank_joint     1.0472     1.0472"));

  // Loops come first: the angle moves, the robot says so.
  const std::string bent = "  bent: {joints: {crank_joint: 1.047198, rocker_joint: 0.2}}\n";
  const CommandResult result = inform("", bent);
  CHECK(result.status == 0);
  CHECK_THAT(result.err, Catch::Contains("robot.yaml: reference 'bent': it is assembled with") &&
                             Catch::Contains("'rocker_joint' at ") && Catch::Contains(" instead of 0.2"));
  // By the path that was given, as all other messages name it.
  const std::string given = fs::relative(directory.path()).string();
  CHECK_THAT(run({"info", given}).err, Catch::Contains("bielle: warning: " + given + "/robot.yaml: reference 'bent'"));
  const json info = json::parse(result.out);
  CHECK(info["warnings"].size() == 1);
  const auto joint = std::find_if(info["reference_joints"].begin(), info["reference_joints"].end(), [](const json& of) {
    return of["reference"] == "bent" && of["joint"] == "rocker_joint";
  });
  REQUIRE(joint != info["reference_joints"].end());
  CHECK((*joint)["given"] == 0.2);
  CHECK((*joint)["assembled"].get<double>() > 0.21);

  CHECK_THAT(inform("", "  turned: {joints: {crank_joint: 60}}\n").err,
             Catch::Contains("reference 'turned': 'crank_joint' at 60 rad is more than a turn; give radians"));

  // Out of its range and not reached it is a mistake; reached, a warning.
  checkRefused(
      inform("lower=\"0.5\" upper=\"3\" ", bent),
      "robot.yaml: reference 'bent': joint 'rocker_joint' cannot be at 0.2, outside its range of 0.5 to 3; give a");
  CHECK(inform("lower=\"0.1\" upper=\"3\" ", bent).status == 0);
  const CommandResult reached = inform("lower=\"-1\" upper=\"1\" ", "");
  CHECK(reached.status == 0);
  CHECK_THAT(reached.err, Catch::Contains("'rocker_joint' is outside its range of -1 to 1"));
}

TEST_CASE("eval gives the library's dynamics, forces and derivatives") {
  const Model model = loadRobot("bipetto").model;
  const VectorXd q = makeStandingPosture(model), v = VectorXd::LinSpaced(model.nv(), -0.3, 0.4);
  const VectorXd u = VectorXd::LinSpaced(model.nu(), -2, 5);
  json state = makeState(model, q, v, u);
  state["contacts"] = {"foot_right"};
  const CommandResult result = run({"eval", "bipetto", "--state", "-", "--derivatives"}, state.dump());
  REQUIRE(result.status == 0);
  const json out = json::parse(result.out);

  const int foot = model.findContact("foot_right");
  const ConstraintSet set = makeConstraintSet(model, makeContactTargets(model, q, {foot}, 0, 0));
  Workspace ws(model);
  ConstrainedWorkspace cws;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, calcMotorForces(model, u)) == NumericalStatus::Ok);
  REQUIRE(updateConstrainedDerivatives(model, ws, cws, set) == NumericalStatus::Ok);
  for (const Joint& joint : model.joints())
    if (joint.nv) {
      const VectorXd a = cws.a.segment(joint.idx_v, joint.nv);
      CHECK((toVector(out["accelerations"][joint.name]) - a).norm() <= 1e-9 * (1 + a.norm()));
    }
  CHECK((toVector(out["contact_wrenches"]["foot_right"]) - cws.lambda.tail(6)).norm() < 1e-9 * cws.lambda.norm());
  CHECK((toVector(out["closure_wrenches"]["closure_knee_left"]) - cws.lambda.head(6)).norm() <
        1e-9 * cws.lambda.norm());
  const auto checkMatrix = [&out](const char* name, const MatrixXd& expected) {
    CAPTURE(name);
    CHECK((toMatrix(out[name]) - expected).norm() <= 1e-9 * expected.norm());
  };
  checkMatrix("da_dq", cws.da_dq);
  checkMatrix("da_dv", cws.da_dv);
  checkMatrix("da_du", cws.da_du);
  checkMatrix("dlambda_dq", cws.dlambda_dq);
  checkMatrix("dlambda_dv", cws.dlambda_dv);
  checkMatrix("dlambda_du", cws.dlambda_du);
  CHECK(out["order"]["v"].get<std::vector<std::string>>() == makeVelocityNames(model));
  CHECK(out["order"]["lambda"].size() == 42);
  CHECK(out["kinetic_energy"].get<double>() == Approx(calcKineticEnergy(model, ws)));
  CHECK(out["potential_energy"].get<double>() == Approx(calcPotentialEnergy(model, ws)));
  CHECK((toVector(out["com"]) - calcCom(model, ws)).norm() < 1e-12);
  CHECK((toVector(out["bias"]) - ws.b).norm() < 1e-9 * ws.b.norm());
  CHECK((toVector(out["mass_matrix_diagonal"]) - ws.M.diagonal()).norm() < 1e-12);
  CHECK(out["rank"] == 36);
  CHECK_FALSE(json::parse(run({"eval", "bipetto", "--state", "-"}, "{}").out).contains("da_dq"));
}

TEST_CASE("eval tells that loops are open, and closes them around the joints of the state") {
  const auto eval = [](std::vector<std::string> more, const std::string& state) {
    more.insert(more.begin(), {"eval", "fourbar", "--state", "-"});
    return run(more, state);
  };
  const std::string open = R"({"joints": {"crank_joint": {"q": 0.4}}})";
  const CommandResult told = eval({}, open), closed = eval({"--close"}, open);
  REQUIRE(told.status == 0);
  const double gap = json::parse(told.out)["largest_gap"];
  CHECK(gap > 0.01);
  CHECK_THAT(told.err, Catch::Contains("standard input: closure") &&
                           Catch::Contains("is open by " + formatNumber(gap, "%.3g")) && Catch::Contains("--close"));
  REQUIRE(closed.status == 0);
  CHECK(closed.err.empty());
  const json out = json::parse(closed.out);
  CHECK(out["largest_gap"].get<double>() < 1e-12);
  const Model model = loadRobot("fourbar").model;
  CHECK(out["q"][model.joints()[model.findJoint("crank_joint")].idx_q].get<double>() == Approx(0.4).margin(1e-9));
  // What the state gives as it came out is closed, and stays so to the bit.
  json again;
  for (const Joint& joint : model.joints())
    if (joint.nq == 1) again["joints"][joint.name]["q"] = out["q"][joint.idx_q];
  CHECK(json::parse(eval({}, again.dump()).out)["q"] == out["q"]);
  CHECK(eval({}, again.dump()).err.empty());
  // So are speeds: of the joint that moves, and of those that follow.
  again["joints"]["crank_joint"]["v"] = 0.7;
  const CommandResult opening = eval({}, again.dump()), moving = eval({"--close"}, again.dump());
  const double speed = json::parse(opening.out)["largest_opening_speed"];
  CHECK(speed > 0.01);
  CHECK_THAT(opening.err, Catch::Contains("closure 'coupler' opens at " + formatNumber(speed, "%.3g")) &&
                              Catch::Contains("--close"));
  CHECK(moving.err.empty());
  const json moved = json::parse(moving.out);
  const Joint& crank = model.joints()[model.findJoint("crank_joint")];
  CHECK(moved["v"][crank.idx_v].get<double>() == Approx(0.7).margin(1e-9));
  CHECK(moved["largest_opening_speed"].get<double>() < 1e-12);
  // As fast as the closed configurations beside this one change.
  constexpr double h = 1e-5;
  VectorXd q = Eigen::Map<const VectorXd>(moved["q"].get<std::vector<double>>().data(), model.nq());
  const auto at = [&](double step) {
    VectorXd beside = q;
    beside[crank.idx_q] += 0.7 * step;
    return closeConfiguration(model, beside, {"crank_joint"}).q;
  };
  const VectorXd rates = model.difference(at(-h), at(h)) / (2 * h);
  for (int k = 0; k < model.nv(); ++k) CHECK(moved["v"][k].get<double>() == Approx(rates[k]).margin(1e-7));
}

TEST_CASE("eval understands other ways to write a configuration") {
  const OutputDirectory directory;
  const std::string robot = directory.str() + ".urdf", settings = directory.str() + ".yaml";
  std::ofstream(robot) << R"(<robot name="kinds"><link name="world"/>
    <link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <link name="c"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="wheel" type="continuous"><parent link="world"/><child link="a"/><axis xyz="0 1 0"/></joint>
    <joint name="sled" type="planar"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
    <joint name="ball" type="floating"><parent link="b"/><child link="c"/></joint></robot>)";
  std::ofstream(settings) << "joint_name: [ball]\njoint_type: [SPHERICAL]\nbase: fixed\n";
  const auto getQ = [&](const std::string& state) {
    const CommandResult result = run({"eval", robot, "--state", "-"}, state);
    INFO(result.err);
    REQUIRE(result.status == 0);
    return toVector(json::parse(result.out)["q"]);
  };
  const VectorXd q = getQ(R"({"joints": {"wheel": {"q": [-0.6, 0.8]}, "sled": {"q": [1, 2, 0, -3]},
                                        "ball": {"q": [0, 0, 3, 4]}}})");
  REQUIRE(q.size() == 8);
  CHECK(q[0] == Approx(std::atan2(0.8, -0.6)));
  CHECK(q[3] == Approx(-M_PI / 2));
  CHECK(q[6] == Approx(0.6));
  CHECK(q[7] == Approx(0.8));
  CHECK(getQ(R"({"joints": {"wheel": {"q": 2}}})")[0] == 2);
  CHECK(getQ(R"({"joints": {"sled": {"q": [1, 2, 3]}}})")[3] == 3);
  const auto refuse = [&](const std::string& state, const std::string& text) {
    checkRefused(run({"eval", robot, "--state", "-"}, state), "standard input: " + text);
  };
  refuse(R"({"joints": {"ball": {"q": [0, 0, 0, 0]}}})", "joint 'ball': q: its quaternion is zero");
  refuse(R"({"joints": {"wheel": {"q": [0, 0]}}})", "joint 'wheel': q: cos and sin are both zero");
  refuse(R"({"joints": {"ball": {"q": [0, 0, 1]}}})", "joint 'ball': q: 3 numbers for a spherical joint; give 4");
  refuse(R"({"joints": {"ball": {"v": 1}}})", "joint 'ball': v: 1 numbers");
  refuse(R"({"joints": {"wheel": {"q": "1"}}})", "joint 'wheel': q: \"1\" is not a number");
  refuse(R"({"joints": {"wheel": {"q": null}}})", "joint 'wheel': q: null is not a number");
  refuse(R"({"joints": {"wheel": {"q": NaN}}})", "JSON: ");
  refuse(R"({"joints": {"wheel": {"q": 1e999}}})", "JSON: ");
  refuse(R"({"joints": {"wheel": {"w": 1}}})", "joint 'wheel': there is no key 'w'");
  refuse(R"({"joints": {"wheel": 1}})", "joint 'wheel': it is not an object");
  refuse(R"({"joints": {"world": {"q": 1}}})", "joint 'world': the robot has no such joint; its joints are: wheel");
  refuse(R"({"joints": {"wheel": {}, "wheel": {"q": 1}}})", "key 'wheel': it is given twice");
  refuse(R"({"torque": {}})", "state: there is no key 'torque'");
  refuse(R"([1])", "state: it is not an object");
  refuse(R"({"contacts": ["foot"]})", "contact 'foot': the robot has no such contact");
  refuse(R"({"torques": {"wheel": 1}})", "torque 'wheel': this joint has no motor; the motors are: none");
  refuse("", "JSON: ");
  checkRefused(run({"eval", robot, "--state", "/no/file"}), "/no/file: file: it cannot be read");
  checkRefused(run({"eval", "bipetto", "--state", "-"}, R"({"contacts": ["foot_left", "foot_left"]})"), "twice");
  checkRefused(run({"eval", "bipetto", "--state", "-"}, R"({"torques": {"knee_left": 1}})"), "motor_knee_left");
}

TEST_CASE("validate hands its arguments to the program beside, or says what is missing") {
  const OutputDirectory directory;
  fs::create_directory(directory.str());
  const std::string copy = directory.str() + "/bielle", other = directory.str() + "/bielle-validate";
  fs::copy_file(BIELLE_COMMAND, copy);
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  checkRefused(runCommand({copy, "validate"}), "build Bielle with -DBIELLE_BUILD_VALIDATION=ON");
  setenv("PATH", path.c_str(), 1);
  std::ofstream(other) << "#!/bin/sh\necho \"<$@>\"\nexit 1\n";
  fs::permissions(other, fs::perms::owner_all);
  const CommandResult result = runCommand({copy, "validate", "bipetto", "--samples", "3", "--help"});
  CHECK(result.status == 1);
  CHECK(result.out == "<bipetto --samples 3 --help>\n");
}

TEST_CASE("bench measures, and tells what meanwhile") {
  const CommandResult result = run({"bench", "--quick", "--json"});
  CHECK(result.status == 0);
  CHECK_THAT(result.err, Catch::Contains("measuring benchmark walk"));
  const json report = json::parse(result.out);
  CHECK(report["robot"] == "bipetto");
  CHECK(report["unit [us]"].get<double>() > 0);
  CHECK(report["walk, FDDP iteration per node"].size() == 4);
}
