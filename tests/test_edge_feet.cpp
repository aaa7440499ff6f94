// A robot on blades: feet that stand on an edge and may roll about it, from a solved motion to one that is carried out.
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "bielle/results/result.h"
#include "robot_directory.h"
#include "run_command.h"

namespace bielle {
namespace {

namespace fs = std::filesystem;
using testing::CommandResult;
using testing::readFile;
using testing::replaceOnce;
using testing::runCommand;

// Bipetto, whose soles of 0.1 by 0.1 m have shrunk to edges.
std::string writeBlades(const testing::RobotDirectory& directory) {
  const fs::path source = BIELLE_SOURCE_DIR "/robots/bipetto";
  std::string yaml = readFile(source / "bipetto.yaml");
  for (const std::string side : {"left", "right"}) {
    const std::string foot = "foot_" + side + ": {frame: foot_" + side + ", type: ";
    yaml = replaceOnce(yaml, foot + "6d, sole: [0.10, 0.10]}", foot + "5d, length: 0.10}");
  }
  return directory.writeRobot(readFile(source / "bipetto.urdf"), yaml);
}

CommandResult runOnBlades(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), BIELLE_COMMAND);
  return runCommand(arguments);
}

}  // namespace

TEST_CASE("edge feet: a robot on blades walks, passes the check, and is carried out", "[long]") {
  const testing::RobotDirectory directory;
  const std::string robot = writeBlades(directory), walk = directory.path() + "/walk";
  const CommandResult solved = runOnBlades(
      {"solve", "walk", "--robot", robot, "--speed", "0.4", "--steps", "2", "-o", walk, "--quiet", "--no-report"});
  CAPTURE(solved.out, solved.err);
  REQUIRE(solved.status == 0);
  CHECK(solved.out.find("nodes: passed") != std::string::npos);
  const nlohmann::json check = nlohmann::json::parse(readFile(walk + "/check.json"));
  CHECK(check.dump().find("about an edge") != std::string::npos);

  // The edges bear no moment about themselves, but one across, within their length.
  const MotionRecord record = readRecord(walk + "/trajectory.npz");
  CHECK(record.contact_wrenches.col(3).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(record.contact_wrenches.col(4).cwiseAbs().maxCoeff() > 0.5);
  CHECK((record.contact_wrenches.col(4).array().abs() - 0.05 * record.contact_wrenches.col(2).array()).maxCoeff() <
        1e-3);

  for (const std::string world : {"bielle", "mujoco"}) {
    const CommandResult happened =
        runOnBlades({"simulate", walk, "-o", directory.path() + "/" + world, "--world", world, "--duration", "1.6",
                     "--summary-only", "--push", "t=1,impulse=3,direction=90"});
    CAPTURE(world, happened.out, happened.err);
    if (happened.err.find("there is no world") != std::string::npos) continue;  // built without MuJoCo
    CHECK(happened.status == 0);
  }
}

TEST_CASE("edge feet: a robot on blades is pushed while it knows itself by its own sensors alone", "[long]") {
  const testing::RobotDirectory directory;
  const std::string robot = writeBlades(directory), walk = directory.path() + "/walk";
  REQUIRE(runOnBlades({"solve", "walk", "--robot", robot, "--speed", "0.4", "--steps", "6", "-o", walk, "--quiet",
                       "--no-report", "--no-check"})
              .status == 0);
  // With the component along the edge among the rows of the estimator, two of three fall.
  for (const auto& [impulse, seed] : {std::pair("4", "1"), {"5", "2"}, {"6", "3"}}) {
    const CommandResult happened =
        runOnBlades({"simulate", walk, "-o", directory.path() + "/pushed", "--sensors", "real", "--seed", seed,
                     "--summary-only", "--push", std::string("t=1.5,impulse=") + impulse + ",direction=0"});
    CAPTURE(impulse, seed, happened.out, happened.err);
    CHECK(happened.status == 0);
  }
}

TEST_CASE("edge feet: a squat keeps its pressure in the middle of its edges") {
  const testing::RobotDirectory directory;
  const std::string robot = writeBlades(directory), squat = directory.path() + "/squat";
  const auto calcFarthest = [&](const std::string& weight) {
    const CommandResult solved =
        runOnBlades({"solve", "squat", "--robot", robot, "--set", "time_step=0.03", "--set",
                     "pressure_weight=" + weight, "-o", squat, "--quiet", "--no-report", "--no-check"});
    CAPTURE(solved.err);
    REQUIRE(solved.status == 0);
    const MatrixXd wrenches = readRecord(squat + "/trajectory.npz").contact_wrenches;
    return (wrenches.col(4).array() / wrenches.col(2).array()).abs().maxCoeff();  // m
  };
  const double middle = calcFarthest("10"), free = calcFarthest("0");
  CAPTURE(middle, free);
  CHECK(middle < 0.01);
  CHECK(free > 3 * middle);
}

TEST_CASE("edge feet: what does not describe an edge is refused") {
  const testing::RobotDirectory directory;
  const std::string source = readFile(BIELLE_SOURCE_DIR "/robots/bipetto/bipetto.yaml");
  const auto refuse = [&](const std::string& type, const std::string& text) {
    directory.writeRobot(readFile(BIELLE_SOURCE_DIR "/robots/bipetto/bipetto.urdf"),
                         replaceOnce(source, "foot_left: {frame: foot_left, type: 6d, sole: [0.10, 0.10]}",
                                     "foot_left: {frame: foot_left, " + type + "}"));
    const CommandResult result = runOnBlades({"info", directory.path()});
    CAPTURE(type, result.err);
    CHECK(result.status == 2);
    CHECK(result.err.find(text) != std::string::npos);
  };
  refuse("type: 5d", "an edge needs a length");
  refuse("type: 5d, sole: [0.1, 0.1]", "an edge has no sole");
  refuse("type: 3d, length: 0.1", "only an edge has a length");
  refuse("type: 4d", "use 6d (sole), 5d (edge) or 3d (point)");
}

}  // namespace bielle
