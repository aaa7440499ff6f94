// The command, run like a user does. Oracles: the library's own functions on the same states.
#include <signal.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/io/names.h"
#include "bielle/io/record.h"
#include "bielle/model/reader.h"
#include "bielle/motion/motion.h"
#include "bielle/motion/squat.h"
#include "run_command.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using nlohmann::json;

namespace {

CommandResult run(std::vector<std::string> arguments, const std::string& input = "") {
  arguments.insert(arguments.begin(), BIELLE_COMMAND);
  return runCommand(arguments, input);
}

// Bad input: status 2, nothing on the standard output, one line of error.
void checkRefused(const CommandResult& result, const std::string& text) {
  INFO(result.err);
  CHECK(result.status == 2);
  CHECK(result.out.empty());
  CHECK(result.err.rfind("bielle: error: ", 0) == 0);
  CHECK(result.err.find('\n') == result.err.size() - 1);
  CHECK_THAT(result.err, Catch::Contains(text));
}

class OutputDirectory {
 public:
  OutputDirectory() {
    std::string pattern = (fs::temp_directory_path() / "bielle_cli_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~OutputDirectory() { fs::remove_all(path_); }
  std::string str() const { return (path_ / "result").string(); }
  json readSummary() const { return json::parse(std::ifstream(path_ / "result/summary.json")); }
  // The three files, the report and no other, the two trajectories whole and the same.
  MotionRecord readTrajectory() const {
    CHECK(std::distance(fs::directory_iterator(path_ / "result"), fs::directory_iterator()) == 4);
    const MotionRecord npz = readRecord(str() + "/trajectory.npz"), csv = readRecord(str() + "/trajectory.csv");
    CHECK(npz.q == csv.q);
    return npz;
  }

 private:
  fs::path path_;
};

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

const std::vector<std::string> kShortSquat = {"solve",        "squat", "--robot",    "bipetto", "--set",
                                              "duration=0.6", "--set", "settle=0",   "--set",   "time_step=0.02",
                                              "--depth",      "0.95",  "--no-check", "-o"};

std::vector<std::string> makeShortSquat(const std::string& directory, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = kShortSquat;
  arguments.push_back(directory);
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
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
  for (const OptionEntry& option : listOptions(options)) {
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
  checkRefused(run({"info", "nobody"}), "robot 'nobody': there is none of this name");
  checkRefused(run({"info", "/no/such.urdf"}), "there is no such file");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "depht=0.7"})), "option 'depht'");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "friction"})), "name=number");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "friction=0.7m"})), "name=number");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "friction=nan"})), "not finite");
  checkRefused(run(makeShortSquat(directory.str(), {"--set", "depth=-1"})), "option 'depth'");
  checkRefused(run(makeShortSquat(directory.str(), {"--formulation", "best"})), "best");
  checkRefused(run(makeShortSquat(directory.str(), {"--max-iterations", "0"})), "--max-iterations");
  checkRefused(run({"solve", "squat", "--robot", "fourbar", "-o", directory.str()}), "needs feet");
  CHECK_FALSE(fs::exists(directory.str()));
  checkRefused(run(makeShortSquat("/dev/null/results")), "results cannot be written there");
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
  CHECK_THAT(result.err, Catch::Contains(directory.str()));
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
  REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, calcMotorForces(model, u)) == DynamicsStatus::Ok);
  REQUIRE(updateConstrainedDerivatives(model, ws, cws, set) == DynamicsStatus::Ok);
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
  refuse(R"({"joints": {"wheel": 1}})", "joint 'wheel': it is no object");
  refuse(R"({"joints": {"world": {"q": 1}}})", "joint 'world': the robot has no such joint; its joints are: wheel");
  refuse(R"({"joints": {"wheel": {}, "wheel": {"q": 1}}})", "key 'wheel': it is given twice");
  refuse(R"({"torque": {}})", "state: there is no key 'torque'");
  refuse(R"([1])", "state: it is no object");
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

TEST_CASE("solve writes a converged squat and says so") {
  const OutputDirectory directory;
  const CommandResult result = run(makeShortSquat(directory.str()));
  INFO(result.out << result.err);
  CHECK(result.status == 0);
  CHECK_THAT(result.out, Catch::Contains("iter") && Catch::Contains("converged") && Catch::Contains("peak torques"));
  const json summary = directory.readSummary();
  const MotionRecord record = directory.readTrajectory();
  CHECK(summary["converged"] == true);
  CHECK(summary["interrupted"] == false);
  CHECK(summary["formulation"] == "reduced");
  CHECK(summary["requested"]["duration"] == 0.6);
  CHECK(summary["requested"]["depth"] == 0.95);
  CHECK(summary["command"].size() == kShortSquat.size() + 2);
  CHECK(record.time.size() == 31);
  CHECK(summary["closure_gap"]["position_m"] == record.gap.col(0).maxCoeff());
  CHECK(record.gap.maxCoeff() < 1e-9);
  const auto& motors = record.u_names;
  const auto knee = std::find(motors.begin(), motors.end(), "motor_knee_left") - motors.begin();
  CHECK(summary["peak_torques"]["motor_knee_left"] == record.u.col(knee).cwiseAbs().maxCoeff());
  // The feet carry the weight of a robot that ends where it began.
  CHECK(record.com.col(2).minCoeff() < 0.97 * record.com(0, 2));
  const Model model = loadRobot("bipetto").model;
  const double mean = (record.contact_wrenches.col(2) + record.contact_wrenches.col(8)).mean();
  CHECK(mean == Approx(model.mass() * 9.81).epsilon(0.02));

  const CommandResult quiet = run(makeShortSquat(directory.str(), {"--quiet", "--threads", "1"}));
  CHECK(quiet.status == 0);
  CHECK_THAT(quiet.out, !Catch::Contains("iter ") && Catch::Contains("converged"));
  CHECK(directory.readTrajectory().u == record.u);  // whatever the number of threads
}

TEST_CASE("solve says what was asked and what came out; a goal that is missed is a warning, no failure") {
  const OutputDirectory directory;
  const CommandResult met = run(makeShortSquat(directory.str(), {"--quiet"}));
  INFO(met.out << met.err);
  CHECK(met.status == 0);
  CHECK_THAT(met.out, Catch::Contains("depth  asked 0.95, came out 0.9") && !Catch::Contains("missed"));
  CHECK_THAT(met.err, !Catch::Contains("warning"));
  CHECK(directory.readSummary()["goals"][0]["met"] == true);
  const CommandResult missed = run(makeShortSquat(directory.str(), {"--quiet", "--set", "com_weight=1"}));
  INFO(missed.out << missed.err);
  CHECK(missed.status == 0);
  CHECK_THAT(missed.out, Catch::Contains("missed (tolerance 0.01)"));
  CHECK_THAT(missed.err, Catch::Contains("bielle: warning: depth asked 0.95, came out "));
  const json goal = directory.readSummary()["goals"][0];
  CHECK(goal["met"] == false);
  CHECK(goal["asked"] == 0.95);
  CHECK(goal["came_out"] > 0.96);
}

TEST_CASE("solve minimizes energy or peak torque, from the motion of least effort or another result") {
  const OutputDirectory directory;
  const std::string effort = directory.str() + "/effort", other = directory.str() + "/other";
  const auto getEnergy = [](const json& summary) { return summary["electrical_energy"]["total_J"].get<double>(); };
  const auto readSummary = [](const std::string& path) { return json::parse(std::ifstream(path + "/summary.json")); };
  CHECK(run(makeShortSquat(effort, {"--quiet"})).status == 0);
  const json first = readSummary(effort);
  CHECK(first["objective"]["kind"] == "effort");
  CHECK(first["electrical_energy"]["cost_of_transport"].is_null());
  CHECK(first["electrical_energy"]["motors_of_assumed_loss"] == 12);
  for (const std::string objective : {"energy", "peak-torque"}) {
    const CommandResult result = run(makeShortSquat(other, {"--objective", objective}));
    INFO(result.out << result.err);
    CHECK(result.status == 0);
    CHECK_THAT(result.out, Catch::Contains("first, the motion of least effort") &&
                               Catch::Contains("electrical energy") &&
                               Catch::Contains("losses of 12 motors assumed: 0.25"));
    const json summary = readSummary(other);
    CHECK(summary["objective"]["kind"] == objective);
    const auto getPeak = [](const json& of) {
      double peak = 0;
      for (const auto& [motor, value] : of["peak_torques"].items()) peak = std::max(peak, value.get<double>());
      return peak;
    };
    if (objective == "energy") CHECK(getEnergy(summary) < 0.95 * getEnergy(first));
    if (objective == "peak-torque") CHECK(getPeak(summary) < 0.95 * getPeak(first));
    // From the files of the same effort: the same problem, but for a scale that is taken where the base of a warm start is,
    // by the slip of the feet (3e-6 m) from that of the effort.
    const CommandResult warm =
        run(makeShortSquat(other, {"--quiet", "--objective", objective, "--warm-start", effort}));
    CHECK(warm.status == 0);
    CHECK_THAT(warm.out, !Catch::Contains("least effort"));
    CHECK(readSummary(other)["cost"].get<double>() == Approx(summary["cost"].get<double>()).epsilon(1e-4));
  }
  checkRefused(run(makeShortSquat(other, {"--objective", "time"})), "effort,energy,peak-torque");
  checkRefused(run(makeShortSquat(other, {"--objective", "energy", "--regularization", "-1"})), "regularization");
  checkRefused(run(makeShortSquat(other, {"--regeneration", "2"})), "regeneration");
}

TEST_CASE("solve ends by the check of its result, whose failure is its own") {
  const OutputDirectory directory;
  fs::create_directory(directory.str());
  const std::string copy = directory.str() + "/bielle", checker = directory.str() + "/bielle-check";
  fs::copy_file(BIELLE_COMMAND, copy);
  std::vector<std::string> arguments = makeShortSquat(directory.str() + "/motion");
  arguments.erase(std::find(arguments.begin(), arguments.end(), "--no-check"));
  arguments.insert(arguments.begin(), copy);
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  const CommandResult absent = runCommand(arguments);
  setenv("PATH", path.c_str(), 1);
  CHECK(absent.status == 0);
  CHECK_THAT(absent.out, Catch::Contains("not checked: bielle-check is not built"));
  // How the check ends, the status of the command, and its error line.
  const std::tuple<const char*, int, const char*> ends[] = {
      {"exit 0", 0, ""},
      {"exit 1", 1, ""},
      {"exit 2", 1, "bielle-check broke off with status 2"},
      {"exit 77", 1, "bielle-check broke off with status 77"},
      {"kill -KILL $$", 1, "bielle-check was ended by signal 9"},
  };
  for (const auto& [end, status, error] : ends) {
    std::ofstream(checker) << "#!/bin/sh\necho \"<$@>\"\n" << end << "\n";
    fs::permissions(checker, fs::perms::owner_all);
    const CommandResult result = runCommand(arguments);
    INFO(end << "\n" << result.err);
    CHECK(result.status == status);
    CHECK_THAT(result.out, Catch::Contains("<--brief " + directory.str() + "/motion>\n"));
    CHECK_THAT(result.err, Catch::Contains(error));
    CHECK(result.err.empty() == (*error == 0));
  }
  std::ofstream(checker) << "#!/nonexistent/interpreter\n";
  const CommandResult unable = runCommand(arguments);
  CHECK(unable.status == 1);
  CHECK_THAT(unable.err, Catch::Contains("bielle-check cannot be started"));
}

TEST_CASE("in the full formulation velocities follow accelerations") {
  const OutputDirectory directory;
  CHECK(run(makeShortSquat(directory.str(), {"--formulation", "full"})).status == 0);
  CHECK(directory.readSummary()["formulation"] == "full");
  const MotionRecord record = directory.readTrajectory();
  for (int k = 0; k + 1 < record.time.size(); ++k)
    CHECK((record.v.row(k + 1) - record.v.row(k) - 0.02 * record.a.row(k)).norm() < 1e-8);
}

TEST_CASE("the rule of the steps is what was asked for") {
  const OutputDirectory directory;
  CHECK(run(makeShortSquat(directory.str(), {"--formulation", "full", "--step", "midpoint"})).status == 0);
  CHECK(directory.readSummary()["step"] == "midpoint");
  CHECK(run(makeShortSquat(directory.str(), {"--step", "euler"})).status == 0);
  CHECK(directory.readSummary()["step"] == "euler");
  checkRefused(run(makeShortSquat(directory.str(), {"--step", "best"})), "best");
}

TEST_CASE("scripts that name a kind of barrier get the limits that motions keep anyway") {
  const OutputDirectory directory;
  for (const char* kind : {"quadratic", "log"})
    CHECK(run(makeShortSquat(directory.str(), {"--limits", kind, "--limit", "motor_knee_right=80"})).status == 0);
  // Without limits there is none for one motor either.
  checkRefused(run(makeShortSquat(directory.str(), {"--limits", "none", "--limit", "motor_knee_right=80"})), "limit");
  checkRefused(run(makeShortSquat(directory.str(), {"--no-limits", "--limit", "motor_knee_right=80"})), "limit");
  checkRefused(run(makeShortSquat(directory.str(), {"--limits", "soft"})), "soft");
}

TEST_CASE("durations are free within the bounds given, or as planned") {
  const OutputDirectory directory;
  const auto solve = [&](std::vector<std::string> options) {
    const CommandResult result = run(makeShortSquat(directory.str(), options));
    CHECK(result.status == 0);
    return directory.readSummary();
  };
  CHECK(solve({}).at("free_timings").empty());
  const double planned = solve({}).at("duration_s");
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--free-timings"},
        std::vector<std::string>{"--free-timings", "double support=0.5:0.8"}}) {
    const bool all = options.size() == 1;
    const json summary = solve(options), &timing = summary.at("free_timings").at(0);
    CHECK(timing.at("nominal_s").get<double>() == Approx(planned));
    CHECK(timing.at("lower_s").get<double>() == Approx((all ? 0.6 : 0.5) * planned));
    CHECK(timing.at("upper_s").get<double>() == Approx((all ? 1.6 : 0.8) * planned));
    CHECK(timing.at("chosen_s").get<double>() == Approx(summary.at("duration_s").get<double>()));
    CHECK(std::abs(timing.at("chosen_s").get<double>() - planned) > 1e-3);
  }
  for (const char* wrong :
       {"double support", "double support=1", "double support=a:b", "double support=2:1", "swing=1:2"})
    checkRefused(run(makeShortSquat(directory.str(), {"--free-timings", wrong})), "free");
  checkRefused(run(makeShortSquat(directory.str(), {"--time-weight", "1"})), "time-weight");
  checkRefused(run(makeShortSquat(directory.str(), {"--free-timings", "--time-weight", "-1"})), "time-weight");
}

TEST_CASE("a squat that does not converge is written, marked, and status 1") {
  const OutputDirectory directory;
  const CommandResult result = run(makeShortSquat(directory.str(), {"--max-iterations", "1"}));
  CHECK(result.status == 1);
  const json summary = directory.readSummary();
  CHECK(summary["converged"] == false);
  CHECK(summary["interrupted"] == false);
  CHECK(summary["termination"] == "maximum of iterations");
  CHECK(directory.readTrajectory().time.size() == 31);
}

TEST_CASE("an interrupted squat leaves whole files that say so") {
  const OutputDirectory directory;
  // Long enough that the signal comes first.
  Command command({BIELLE_COMMAND, "solve", "squat", "--robot", "bipetto", "--set", "duration=30", "--no-check", "-o",
                   directory.str()});
  REQUIRE(command.waitForOutput("\n    1 ", 60));
  command.sendSignal(SIGINT);
  const CommandResult result = command.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.out, Catch::Contains("interrupted"));
  const json summary = directory.readSummary();
  CHECK(summary["interrupted"] == true);
  CHECK(summary["converged"] == false);
  CHECK(directory.readTrajectory().time.size() == 2041);
}
