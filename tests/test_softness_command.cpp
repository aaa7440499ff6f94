// bielle softness: rows, page, settings, and what it refuses.
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli_command.h"
#include "robot_directory.h"

using namespace bielle::testing;
namespace fs = std::filesystem;

namespace {

std::string convertToMjcf(const RobotDirectory& directory, const std::string& robot) {
  const std::string path = directory.path() + "/" + robot + ".xml";
  REQUIRE(run({"convert", robot, "--to", "mjcf", "-o", path}).status == 0);
  return path;
}

// Warnings of the reader come first.
void checkRefusal(const CommandResult& result, const std::string& text) {
  CHECK(result.status == 2);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, Catch::Contains("bielle: error: ") && Catch::Contains(text));
}

std::vector<nlohmann::json> readRows(const std::string& output) {
  std::ifstream stream(output + "/softness.jsonl");
  std::vector<nlohmann::json> rows;
  for (std::string line; std::getline(stream, line);) rows.push_back(nlohmann::json::parse(line));
  rows.erase(rows.begin());
  return rows;
}

}  // namespace

TEST_CASE("Loops of Bipetto have rows, plots and settings", "[softness]") {
  const RobotDirectory directory;
  const std::string file = convertToMjcf(directory, "bipetto"), output = directory.path() + "/soft";
  const CommandResult result = run({"softness", file, "--timestep", "0.002", "--torque", "20", "--json", "-o", output});
  REQUIRE(result.status == 0);
  CHECK_THAT(result.err, Catch::Contains("54 of 54 postures"));
  const nlohmann::json json = nlohmann::json::parse(result.out);
  REQUIRE(json["loops"].size() == 6);
  double largest = 0;
  for (const nlohmann::json& loop : json["loops"]) {
    CHECK(loop["state"] != "diverges");
    CHECK(loop["gap_at_limit"] > 1e-7);
    largest = std::max({largest, loop["gap"].get<double>(), loop["gap_at_limit"].get<double>()});
  }
  CHECK(json["loops"][0]["driven"] == nlohmann::json{"knee_right"});
  // solimp is as stiff as it can be: only a shorter step helps, with the square of which gaps go.
  CHECK(json["timestep"] < 0.002);
  CHECK(json["gap"] <= 1e-4);
  CHECK(json["gap"].get<double>() ==
        Approx(largest * std::pow(json["timestep"].get<double>() / 0.002, 2)).epsilon(0.01));
  CHECK_THAT(readFile(output + "/settings.xml"), Catch::Contains("0.9999 0.9999"));
  const std::string page = readFile(output + "/softness.html");
  for (const nlohmann::json& loop : json["loops"])
    CHECK_THAT(page, Catch::Contains("<h2>" + loop["loop"].get<std::string>()));
  for (const nlohmann::json& row : readRows(output)) CHECK(row["stable_step"] > 0.002);
}

TEST_CASE("Softness that was interrupted goes on to the same bytes", "[softness]") {
  const RobotDirectory directory;
  const std::string file = convertToMjcf(directory, "bipetto"), output = directory.path() + "/soft";
  const std::vector<std::string> arguments = {"softness", file, "--postures", "15", "-o"};
  const auto with = [&](const std::string& place) {
    std::vector<std::string> all = arguments;
    all.push_back(place);
    return all;
  };
  REQUIRE(run(with(output)).status == 0);
  const std::string log = readFile(output + "/softness.jsonl"), page = readFile(output + "/softness.html");

  // Within a row, within a posture
  const std::string cut = directory.path() + "/cut";
  fs::create_directory(cut);
  std::ofstream(cut + "/softness.jsonl", std::ios::binary) << log.substr(0, log.size() / 2);
  REQUIRE(run(with(cut)).status == 0);
  CHECK(readFile(cut + "/softness.jsonl") == log);
  CHECK(readFile(cut + "/softness.html") == page);

  const std::string stopped = directory.path() + "/stopped";
  std::vector<std::string> all = with(stopped);
  all.insert(all.begin(), BIELLE_COMMAND);
  Command command(all);
  for (int i = 0; i < 6000 && countLines(stopped + "/softness.jsonl") < 3; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  command.sendSignal(SIGINT);
  const CommandResult result = command.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains("the same command goes on"));
  const std::string part = readFile(stopped + "/softness.jsonl");
  CHECK(part.size() < log.size());
  CHECK(log.rfind(part, 0) == 0);
  REQUIRE(run(with(stopped)).status == 0);
  CHECK(readFile(stopped + "/softness.jsonl") == log);

  checkRefusal(run({"softness", file, "--postures", "16", "-o", stopped}), "of other settings");
}

TEST_CASE("Steps that are too long diverge, and loops that are too soft give way", "[softness]") {
  const RobotDirectory directory;
  const std::string file = convertToMjcf(directory, "fourbar");
  const auto state = [&](const std::string& name, std::vector<std::string> more) {
    const std::string output = directory.path() + "/" + name;
    more.insert(more.begin(), {"softness", file, "--postures", "3", "-o", output});
    REQUIRE(run(more).status == 0);
    return readRows(output).front()["state"];
  };
  CHECK(state("direct", {"--solref", "-1e6", "-2000", "--timestep", "0.002"}) == "diverges");
  CHECK(state("short", {"--solref", "-1e6", "-2000", "--timestep", "0.0002"}) == "holds");
  CHECK(state("soft", {"--solref", "2", "1", "--solimp", "0.5", "0.5"}) == "gives way");

  // A mast that stands on its pivot falls over, if slowly.
  const std::string mast = directory.write(
      "mast.xml",
      "<mujoco><worldbody><body name=\"mast\"><joint name=\"pivot\" axis=\"0 1 0\"/><inertial pos=\"0 0 1\" mass=\"1\" "
      "diaginertia=\"0.1 0.1 0.1\"/></body></worldbody><equality><connect name=\"stay\" body1=\"mast\" body2=\"world\" "
      "anchor=\"0 0 1\"/></equality></mujoco>");
  for (const std::string step : {"0.0001", "0.01"}) {
    const std::string output = directory.path() + "/mast" + step;
    const CommandResult result = run({"softness", mast, "--solref", "-0.1", "-0.1", "--solimp", "0.5", "0.5",
                                      "--timestep", step, "--json", "-o", output});
    REQUIRE(result.status == 0);
    CHECK(nlohmann::json::parse(result.out)["loops"][0]["state"] == "falls");
    CHECK(readRows(output).front()["stable_step"] > 0.01);
  }
}

TEST_CASE("Loops open along a motion by its forces", "[softness]") {
  const RobotDirectory directory;
  const std::string file = convertToMjcf(directory, "fivebar_leg"), motion = directory.path() + "/squat";
  REQUIRE(run({"solve", "squat", "--robot", "fivebar_leg", "--depth", "0.9", "--duration", "0.4", "--set", "settle=0",
               "--no-check", "--no-report", "-o", motion})
              .status == 0);
  const auto study = [&](const std::string& time, const std::string& version) {
    const std::string output = directory.path() + "/soft" + time + "_" + version;
    const CommandResult result = run({"softness", file, "--motion", motion, "--timestep", "0.0005", "--solref", time,
                                      "1", "--solimp", "0.99", "0.99", "--mujoco", version, "--json", "-o", output});
    REQUIRE(result.status == 0);
    CHECK(nlohmann::json::parse(result.out)["loops"].size() == 1);
    CHECK(nlohmann::json::parse(result.out)["gap"] <= 1e-4);
    CHECK_THAT(readFile(output + "/softness.html"), Catch::Contains("<th>time [s]</th>"));
    return readRows(output);
  };
  const std::vector<nlohmann::json> rows = study("0.004", "3.7"), stiff = study("0.002", "3.7"),
                                    old = study("0.004", "3");
  REQUIRE(rows.size() > 20);
  REQUIRE(old.size() == rows.size());
  double changed = 0;
  for (size_t k = 0; k < rows.size(); ++k) {
    CHECK(rows[k]["state"] == "holds");
    CHECK(rows[k]["time"] == old[k]["time"]);
    CHECK(rows[k]["gap"].get<double>() == Approx(4 * stiff[k]["gap"].get<double>()).epsilon(0.02));
    CHECK(rows[k]["bias"] == 0);
    changed = std::max(changed, old[k]["bias"].get<double>());
  }
  CHECK(changed > 1e-3);  // m/s^2

  const std::string other = convertToMjcf(directory, "fourbar"), output = directory.path() + "/other";
  checkRefusal(run({"softness", other, "--motion", motion, "-o", output}), "the motion does not");
  CHECK_FALSE(fs::exists(output));
}

TEST_CASE("Softness refuses what has no soft loops", "[softness]") {
  const RobotDirectory directory;
  const std::string output = directory.path() + "/soft";
  const std::string tree = directory.write(
      "tree.xml",
      "<mujoco><worldbody><body name=\"arm\"><joint name=\"pivot\"/><geom size=\"0.1\"/></body></worldbody></mujoco>");
  checkRefusal(run({"softness", tree, "-o", output}), "no equalities");
  CHECK_FALSE(fs::exists(output));
  checkRefusal(run({"softness", "fourbar", "-o", output}), "convert");
}
