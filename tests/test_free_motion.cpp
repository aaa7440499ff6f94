// `bielle simulate ROBOT`: mechanisms that move by themselves.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bielle/results/record_files.h"
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

TEST_CASE("free motion: what does not fit is refused, with the remedy") {
  const FreeScratch scratch;
  const auto refuse = [&](const std::string& robot, const std::vector<std::string>& options, const std::string& text) {
    const CommandResult result = move(robot, scratch.path / "no", options);
    CAPTURE(result.err, text);
    CHECK(result.status == 2);
    CHECK(result.err.find(text) != std::string::npos);
  };
  refuse(kFreeFourbar, {"--control", "mpc"}, "is a robot without a plan");
  refuse(kFreeFivebar, {"--spring", "stiffness=5,motor=elbow_left"}, "the robot has no motor 'elbow_left'");
  refuse(kFreeFivebar, {"--spring", "stiffness=-5"}, "negative");
  refuse(kFreeFivebar, {"--spring", "spring=5"}, "there is no 'spring'");
  refuse(kFreeFivebar, {"--posture", "away"}, "away");
  refuse(kFreeFivebar, {"--world", "earth"}, "there is no world 'earth'");
  refuse("no-such-thing", {}, "neither the directory of a solved motion nor a robot");
  refuse(kFreeFivebar, {"--torques", scratch.write("a.yaml", "torques: [{time: 0, elbow: 1}]")},
         "the robot has no such motor");
  refuse(kFreeFivebar, {"--torques", scratch.write("b.yaml", "torques: [{shoulder_left: 1}]")}, "it has no time");
  refuse(kFreeFourbar, {"--state", scratch.write("c.json", R"({"joints": {"crank": {"q": 1}}})")},
         "the robot has no such joint");
}

}  // namespace bielle
