// `bielle simulate ROBOT`: mechanisms that move by themselves.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "robot_directory.h"
#include "run_command.h"

namespace bielle {
namespace {

namespace fs = std::filesystem;
using testing::CommandResult;
using testing::readFile;
using testing::runCommand;

struct FreeScratch {
  FreeScratch() : path(fs::temp_directory_path() / "bielle_free_motion_test") { fs::create_directories(path); }
  ~FreeScratch() { fs::remove_all(path); }
  fs::path path;

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name) << text;
    return (path / name).string();
  }
};

CommandResult move(const std::string& robot, const fs::path& output, std::vector<std::string> options) {
  std::vector<std::string> arguments = {BIELLE_COMMAND, "simulate", robot, "-o", output.string()};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return runCommand(arguments);
}

nlohmann::json parseFreeSummary(const fs::path& directory) {
  return nlohmann::json::parse(readFile(directory / "summary.json"));
}

const std::string kFreeFourbar = BIELLE_SOURCE_DIR "/robots/fourbar",
                  kFreeFivebar = BIELLE_SOURCE_DIR "/robots/fivebar";

}  // namespace

TEST_CASE(
    "free motion: the play of a rod lets a linkage rattle alike in two worlds, and is refused where there is no rod") {
  const FreeScratch scratch;
  const CommandResult result =
      move(kFreeFourbar, scratch.path / "worn",
           {"--play", "coupler=0.002", "--world", "bielle,simbody", "--duration", "0.5", "--no-report"});
  CAPTURE(result.out, result.err);
  REQUIRE(result.status == 0);
  const MotionRecord own = readRecord((scratch.path / "worn/bielle/trajectory.npz").string()),
                     other = readRecord((scratch.path / "worn/simbody/trajectory.npz").string());
  const Eigen::Index last = own.q.rows() - 1;
  CHECK((own.q.row(last) - own.q.row(0)).cwiseAbs().maxCoeff() > 0.1);
  CHECK((own.q.row(last) - other.q.row(last)).cwiseAbs().maxCoeff() < 1e-5);
  const nlohmann::json summary = parseFreeSummary(scratch.path / "worn/bielle");
  CHECK(summary["play"]["coupler"] == 0.002);
  CHECK(summary["books"]["stop_loss_J"].get<double>() > 1e-3);
  const CommandResult wrong = move(kFreeFourbar, scratch.path / "wrong", {"--play", "rope=0.002"});
  CHECK(wrong.status == 2);
  CHECK_THAT(wrong.err, Catch::Contains("play of 'rope': there is no such joint or closure"));
}

TEST_CASE("free motion: a linkage swings from a state, and keeps its energy and its loops") {
  const FreeScratch scratch;
  const std::string state = scratch.write("state.json", R"({"joints": {"crank_joint": {"q": 1.2, "v": 3}}})");
  const CommandResult result = move(kFreeFourbar, scratch.path / "swing", {"--state", state, "--duration", "1"});
  CAPTURE(result.out, result.err);
  REQUIRE(result.status == 0);
  const nlohmann::json summary = parseFreeSummary(scratch.path / "swing");
  CHECK(summary["outcome"] == "ended");
  CHECK(summary["largest_gap"].get<double>() < 1e-12);
  const double start = summary["books"]["energy_start_J"], end = summary["books"]["energy_end_J"];
  CHECK(std::abs(end - start) < 1e-8);
  const MotionRecord record = readRecord((scratch.path / "swing/trajectory.npz").string());
  CHECK(record.q(0, 0) == Approx(1.2));
  CHECK(record.v(0, 0) == Approx(3));
  CHECK(record.v.row(0).cwiseAbs().minCoeff() > 0);  // the other joints follow
  CHECK(record.closure_wrenches.allFinite());
  CHECK(readFile(scratch.path / "swing/report.html").find("<html") != std::string::npos);
  CHECK(readFile(scratch.path / "swing/energy.csv").find("time,kinetic,potential") == 0);
}

TEST_CASE(
    "free motion: whole turns of a far angle are left out where nothing counts them, and the motion is the same") {
  const FreeScratch scratch;
  const auto swing = [&](double turns, const std::string& name) {
    const std::string state =
        scratch.write(name + ".json",
                      nlohmann::json{{"joints", {{"crank_joint", {{"q", 1.2 + 2 * M_PI * turns}, {"v", 3}}}}}}.dump());
    return move(kFreeFourbar, scratch.path / name, {"--state", state, "--duration", "0.1"});
  };
  REQUIRE(swing(0, "near").status == 0);
  const CommandResult far = swing(1e6, "far"), farthest = swing(1e15, "farthest");
  CAPTURE(far.err, farthest.err);
  REQUIRE(far.status == 0);
  CHECK(farthest.status == 0);
  CHECK(far.err.find("whole turns are left out; it starts with 1.2") != std::string::npos);
  const MotionRecord a = readRecord((scratch.path / "near/trajectory.npz").string()),
                     b = readRecord((scratch.path / "far/trajectory.npz").string());
  CHECK((a.q - b.q).cwiseAbs().maxCoeff() < 1e-7);  // the angle was rounded by 1e-9
}

TEST_CASE("free motion: it is told where a world did not hold the loops, and only there") {
  const FreeScratch scratch;
  const auto spin = [&](double speed, const std::string& world) {
    const std::string state =
        scratch.write("spin.json", nlohmann::json{{"joints", {{"crank_joint", {{"q", 1}, {"v", speed}}}}}}.dump());
    return move(kFreeFourbar, scratch.path / "spin", {"--state", state, "--duration", "0.02", "--world", world});
  };
  const CommandResult open = spin(1e3, "mujoco");
  CHECK(open.status == 0);
  CHECK(open.err.find("world mujoco: closures opened by up to 0.0") != std::string::npos);
  CHECK(readFile(scratch.path / "spin/summary.json").find("closures opened by") != std::string::npos);
  CHECK(spin(1e2, "mujoco").err.find("closures opened") == std::string::npos);
  CHECK(spin(1e3, "bielle").err.find("closures opened") == std::string::npos);
}

TEST_CASE("free motion: several worlds agree, and are compared on one page") {
  const FreeScratch scratch;
  const std::string torques =
      scratch.write("torques.yaml", "torques: [{time: 0, shoulder_left: 0.5}, {time: 0.2, shoulder_left: 0}]\n");
  const CommandResult result = move(kFreeFivebar, scratch.path / "both",
                                    {"--torques", torques, "--spring", "stiffness=20,damping=0.2", "--duration", "0.4",
                                     "--world", "bielle,simbody", "--accuracy", "1e-8"});
  CAPTURE(result.out, result.err);
  REQUIRE(result.status == 0);
  const MotionRecord own = readRecord((scratch.path / "both/bielle/trajectory.npz").string());
  const MotionRecord simbody = readRecord((scratch.path / "both/simbody/trajectory.npz").string());
  REQUIRE(own.q.rows() == simbody.q.rows());
  CHECK((own.q - simbody.q).cwiseAbs().maxCoeff() < 1e-5);
  CHECK((own.q.row(0) - own.q.row(own.q.rows() - 1)).cwiseAbs().maxCoeff() > 1e-3);
  CHECK(own.u(0, 0) == Approx(0.5));
  CHECK(own.u(own.u.rows() - 1, 0) == Approx(0));
  CHECK(result.out.find("simbody differs from bielle by at most") != std::string::npos);
  CHECK(std::abs(parseFreeSummary(scratch.path / "both/bielle")["energy_balance"].get<double>()) < 1e-6);
  CHECK(readFile(scratch.path / "both/report.html").find("simbody") != std::string::npos);
}

TEST_CASE("free motion: a robot with feet falls to the ground") {
  const FreeScratch scratch;
  const CommandResult result = move(BIELLE_SOURCE_DIR "/robots/bipetto", scratch.path / "fall",
                                    {"--duration", "0.3", "--accuracy", "1e-5", "--no-report"});
  CAPTURE(result.out, result.err);
  REQUIRE(result.status == 0);
  const MotionRecord record = readRecord((scratch.path / "fall/trajectory.npz").string());
  CHECK(record.com(record.com.rows() - 1, 2) < record.com(0, 2));
  CHECK(record.contact_wrenches.cwiseAbs().maxCoeff() > 10);
}

TEST_CASE("free motion: a push of any body is the same in all worlds, and gives a pendulum its momentum") {
  const FreeScratch scratch;
  // Two links without gravity in the plane of the push; the second one is pushed for a tenth of a second, and then all is free.
  const std::string robot = scratch.write("two.urdf", R"(<robot name="two"><link name="world"/>
    <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="2"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <link name="lower"><inertial><origin xyz="0 0 -0.3"/><mass value="1"/>
      <inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="slide" type="prismatic"><parent link="world"/><child link="upper"/><axis xyz="1 0 0"/>
      <limit lower="-9" upper="9" effort="0" velocity="0"/></joint>
    <joint name="hinge" type="continuous"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/></joint></robot>)");
  scratch.write("two.yaml", "base: fixed\ngravity: [0, 0, 0]\n");
  MatrixXd ends[3];
  const std::string worlds[] = {"bielle", "simbody", "mujoco"};
  for (int w = 0; w < 3; ++w) {
    CAPTURE(worlds[w]);
    const CommandResult result = move(robot, scratch.path / worlds[w],
                                      {"--push", "t=0,impulse=0.6,duration=0.1", "--push-body", "lower", "--duration",
                                       "0.5", "--world", worlds[w], "--no-report"});
    CAPTURE(result.out, result.err);
    if (result.err.find("there is no world") != std::string::npos) continue;
    REQUIRE(result.status == 0);
    const MotionRecord record = readRecord((scratch.path / worlds[w] / "trajectory.npz").string());
    const Eigen::Index last = record.q.rows() - 1;
    // Momentum along the slide: (m1 + m2) x' + m2 c cos(angle) angle' with the centre of mass at -c: p = impulse.
    const double angle = record.q(last, 1);
    const double momentum = 3 * record.v(last, 0) - 0.3 * std::cos(angle) * record.v(last, 1);
    CHECK(momentum == Approx(0.6).epsilon(2e-3));
    CHECK(record.v(last, 1) < -0.5);  // pushed, the upper link would turn the lower one the other way
    CHECK(parseFreeSummary(scratch.path / worlds[w])["pushed_body"]["index"] == 2);
    ends[w] = record.q.row(last);
    if (w > 0) CHECK((ends[w] - ends[0]).cwiseAbs().maxCoeff() < 2e-3);
  }
  const CommandResult upper = move(robot, scratch.path / "upper",
                                   {"--push", "t=0,impulse=0.6,duration=0.1", "--duration", "0.5", "--no-report"});
  REQUIRE(upper.status == 0);
  const MotionRecord other = readRecord((scratch.path / "upper/trajectory.npz").string());
  CHECK(other.v(other.v.rows() - 1, 1) > 0.3);
  const CommandResult result = move(robot, scratch.path / "no", {"--push-body", "middle"});
  CHECK(result.status == 2);
  CHECK(result.err.find("the robot has no such link") != std::string::npos);
}

TEST_CASE("free motion: each world tells its steps, and a preload without a spring is the same in all of them") {
  const FreeScratch scratch;
  const std::string robot = scratch.write("swing.urdf", R"(<robot name="swing"><link name="world"/>
    <link name="bob"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="hinge" type="continuous"><parent link="world"/><child link="bob"/><axis xyz="0 1 0"/></joint></robot>)");
  scratch.write("swing.yaml", "base: fixed\njoint_forces: {hinge: {preload: 2}}\n");
  const CommandResult result =
      move(robot, scratch.path / "all",
           {"--duration", "0.3", "--time-step", "0.0005", "--world", "bielle,simbody,mujoco", "--no-report"});
  CAPTURE(result.out, result.err);
  if (result.err.find("there is no world") != std::string::npos) return;
  REQUIRE(result.status == 0);
  CHECK(result.err.empty());
  MatrixXd ends[3];
  const std::string worlds[] = {"bielle", "simbody", "mujoco"};
  for (int w = 0; w < 3; ++w) {
    CAPTURE(worlds[w]);
    const MotionRecord record = readRecord((scratch.path / "all" / worlds[w] / "trajectory.npz").string());
    ends[w] = record.q.row(record.q.rows() - 1);
    CHECK(std::abs(ends[w](0, 0)) > 0.5);
    CHECK((ends[w] - ends[0]).cwiseAbs().maxCoeff() < 3e-3);  // MuJoCo's are of first order
    const nlohmann::json summary = parseFreeSummary(scratch.path / "all" / worlds[w]);
    const nlohmann::json& integration = summary["integration"];
    CHECK(integration["integrator"].get<std::string>().size() > 4);
    CHECK(integration["longest_step_s"].get<double>() == Approx(5e-4));
    CHECK(integration["shortest_step_s"].get<double>() > 0);
    CHECK(integration["tolerance"].is_null() == (worlds[w] == "mujoco"));
    CHECK(integration["closure_tolerance"].is_null() == (worlds[w] != "simbody"));
    CHECK(summary["warnings"].empty());
  }
  const CommandResult idle = move(robot, scratch.path / "idle",
                                  {"--duration", "0.1", "--accuracy", "1e-6", "--world", "mujoco", "--friction", "0.5",
                                   "--push", "t=0.2,impulse=1", "--seed", "3", "--push-body", "bob", "--no-report"});
  CAPTURE(idle.err);
  REQUIRE(idle.status == 0);
  for (const char* what : {"--accuracy has no effect: the steps of world mujoco", "--friction has no effect",
                           "--push at 0.2 s has no effect", "--seed has no effect"})
    CHECK(idle.err.find(what) != std::string::npos);
  CHECK(parseFreeSummary(scratch.path / "idle")["warnings"].size() == 4);
}

TEST_CASE("free motion: neutral is another posture than that of the reference, with the feet on the ground") {
  const FreeScratch scratch;
  VectorXd starts[2];
  for (const bool is_neutral : {false, true}) {
    std::vector<std::string> options = {"--duration", "0.01", "--accuracy", "1e-5", "--no-report"};
    if (is_neutral) options.insert(options.end(), {"--posture", "neutral"});
    const CommandResult result = move(BIELLE_SOURCE_DIR "/robots/bipetto", scratch.path / "start", options);
    CAPTURE(result.out, result.err);
    REQUIRE(result.status == 0);
    starts[is_neutral] = readRecord((scratch.path / "start/trajectory.npz").string()).q.row(0).transpose();
  }
  const Model model = loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto").model;
  const VectorXd closed = closeConfiguration(model, model.makeNeutral()).q;
  CHECK((starts[1] - closed).tail(model.nq() - 7).cwiseAbs().maxCoeff() < 1e-12);
  CHECK((starts[0] - closed).tail(model.nq() - 7).cwiseAbs().maxCoeff() > 0.1);
  Workspace ws(model);
  updatePositions(model, ws, starts[1]);
  double lowest = 1;
  for (const ContactFrame& contact : model.contacts())
    for (double x : {-1, 1})
      for (double y : {-1, 1}) {
        const Vector3d corner(x * contact.half_length, y * contact.half_width, 0);
        lowest = std::min(lowest, getPlacement(ws, contact.body, contact.X_BF).act(corner).z());
      }
  CHECK(std::abs(lowest) < 1e-12);
}

TEST_CASE("free motion: what does not fit is refused, with the remedy") {
  const FreeScratch scratch;
  const auto refuse = [&](const std::string& robot, const std::vector<std::string>& options, const std::string& text) {
    const CommandResult result = move(robot, scratch.path / "no", options);
    CAPTURE(result.err, text);
    CHECK(result.status == 2);
    CHECK(result.err.find(text) != std::string::npos);
  };
  refuse(kFreeFourbar, {"--control", "mpc"}, "is a robot without a plan");
  refuse(kFreeFourbar, {"--control-period", "0.01"}, "--control-period");
  refuse(kFreeFourbar, {"--hold", "2"}, "--hold");
  refuse(kFreeFourbar, {"--noise", "2"}, "--noise");
  refuse(kFreeFourbar, {"--world", "bielle,bielle"}, "given twice");
  refuse(kFreeFourbar, {"--time-step", "0.01", "--record-period", "0.005"}, "it is longer than --record-period");
  refuse(kFreeFivebar, {"--spring", "stiffness=5,motor=elbow_left"}, "the robot has no motor 'elbow_left'");
  refuse(kFreeFivebar, {"--spring", "stiffness=-5"}, "negative");
  refuse(kFreeFivebar, {"--spring", "spring=5"}, "there is no 'spring'");
  refuse(kFreeFivebar, {"--posture", "away"}, "away");
  refuse(kFreeFivebar, {"--world", "earth"}, "there is no world 'earth'");
  refuse("no-such-thing", {}, "neither the directory of a solved motion nor a robot");
  refuse(kFreeFivebar, {"--torques", scratch.write("a.yaml", "torques: [{time: 0, elbow: 1}]")},
         "the robot has no such motor");
  refuse(kFreeFivebar, {"--torques", scratch.write("b.yaml", "torques: [{shoulder_left: 1}]")}, "it has no time");
  refuse(kFreeFivebar, {"--torques", scratch.write("c.yaml", "torques: [{time: -1, shoulder_left: 1}]")},
         "its time is negative");
  refuse(kFreeFourbar, {"--state", scratch.write("c.json", R"({"joints": {"crank": {"q": 1}}})")},
         "the robot has no such joint");
}

}  // namespace bielle
