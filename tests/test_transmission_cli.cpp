// The commands of the transmission, run as a user runs them. Oracles: the library's own functions.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/robots/robot_loader.h"
#include "robot_directory.h"
#include "run_bielle.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using nlohmann::json;

namespace {

void checkRefused(const CommandResult& result, const std::string& text) {
  INFO(result.err);
  CHECK(result.status == 2);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, Catch::StartsWith("bielle: error: ") && Catch::Contains(text));
}

class OutputDirectory {
 public:
  OutputDirectory() {
    std::string pattern = (fs::temp_directory_path() / "bielle_transmission_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~OutputDirectory() { fs::remove_all(path_); }
  std::string str(const std::string& name = "result") const { return (path_ / name).string(); }
  std::vector<std::string> list(const std::string& name = "result") const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path_ / name)) names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }

 private:
  fs::path path_;
};

}  // namespace

TEST_CASE("ratio prints a table, and the same numbers as JSON, CSV and a figure") {
  const Model model = loadRobot("bipetto").model;
  const VectorXd q = findClosedConfiguration(model).q;
  const RatioSweep sweep = sweepRatio(model, makeLinkage(model, q, {"knee_right"}), q);
  const OutputDirectory directory;
  const CommandResult result = run({"ratio", "bipetto", "--joint", "knee_right", "-o", directory.str(), "--json"});
  INFO(result.err);
  REQUIRE(result.status == 0);
  const json out = json::parse(result.out);
  CHECK(out == json::parse(readFile(directory.str() + "/ratio.json")));
  CHECK(out["motors"] == json{"motor_knee_right"});
  CHECK(out["full_turn"] == true);
  CHECK(out["balance_error"].get<double>() < 1e-10);
  REQUIRE(out["samples"].size() == sweep.samples.size());
  // The command and this executable have copies of Eigen's functions of their own, which round differently.
  const auto rounded = [](double value) { return Approx(value).epsilon(1e-11); };
  for (size_t i = 0; i < sweep.samples.size(); ++i) {
    CHECK(out["samples"][i]["joints"][0].get<double>() == rounded(sweep.samples[i].joints[0]));
    if (sweep.samples[i].dead == DeadPointKind::None)
      CHECK(out["samples"][i]["R"][0].get<double>() == rounded(sweep.samples[i].ratio.R(0, 0)));
    else
      CHECK(out["samples"][i]["R"][0].is_null());
  }
  REQUIRE(out["dead_points"].size() == 2);
  CHECK(out["dead_points"][1]["joints"][0].get<double>() == Approx(1.325557).margin(1e-6));
  CHECK(out["dead_points"][1]["dead"] == "output");
  CHECK(out["dead_points"][1]["distance"] == 0);

  std::istringstream csv(readFile(directory.str() + "/ratio.csv"));
  std::string line;
  std::getline(csv, line);
  CHECK(line ==
        "s,branch,q.knee_right,q.motor_knee_right,R.motor_knee_right/knee_right,"
        "dR.motor_knee_right/knee_right,condition,distance,dead");
  size_t lines = 0;
  while (std::getline(csv, line)) {
    CHECK(std::count(line.begin(), line.end(), ',') == 8);
    ++lines;
  }
  CHECK(lines == sweep.samples.size());
  if (std::system("command -v gnuplot >/dev/null") == 0) {
    CHECK(directory.list() == std::vector<std::string>{"ratio.csv", "ratio.json", "ratio.svg"});
    const std::string figure = readFile(directory.str() + "/ratio.svg");
    CHECK_THAT(figure, Catch::Contains("<svg") && Catch::Contains("knee_right [rad]") && Catch::Contains("</svg>"));
  }

  const CommandResult text = run({"ratio", "bipetto", "--joint", "knee_right"});
  CHECK(text.status == 0);
  CHECK_THAT(text.out, Catch::Contains("1.325557") && Catch::Contains("virtual work") && Catch::Contains("1.3589"));
}

TEST_CASE("ratio without gnuplot says so and writes the rest") {
  const OutputDirectory directory;
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  const CommandResult result = run({"ratio", "fourbar", "--joint", "rocker_joint", "-o", directory.str()});
  setenv("PATH", path.c_str(), 1);
  CHECK(result.status == 0);
  CHECK_THAT(result.out, Catch::Contains("no figure: gnuplot is not installed"));
  CHECK(directory.list() == std::vector<std::string>{"ratio.csv", "ratio.json"});
}

TEST_CASE("ratio of a linkage with two motors has a map") {
  const OutputDirectory directory;
  const CommandResult result =
      run({"ratio", "bipetto", "--joint", "ankley_left", "--grid", "5", "-o", directory.str()});
  CHECK(result.status == 0);
  CHECK_THAT(result.out, Catch::Contains("condition") && Catch::Contains("map over both joints"));
  const json out = json::parse(readFile(directory.str() + "/ratio.json"));
  CHECK(out["joints"] == json{"ankley_left", "anklex_left"});
  CHECK(out["map"]["rows"].size() == 5);
  CHECK(out["samples"][0]["R"].size() == 4);
  CHECK(fs::exists(directory.str() + "/map.csv"));
}

TEST_CASE("ratio refuses what has none") {
  checkRefused(run({"ratio", "bipetto"}), "--joint");
  checkRefused(run({"ratio", "bipetto", "--joint", "knee"}), "joint 'knee': there is no moving joint of this name");
  checkRefused(run({"ratio", "fivebar", "--joint", "elbow_left"}), "name 2 joints");
  checkRefused(run({"ratio", "bipetto", "--joint", "knee_left", "--reference", "lying"}), "reference 'lying'");
  checkRefused(run({"ratio", "bipetto", "--joint", "knee_left", "-o", "/dev/null/x"}), "results cannot be written");
}

TEST_CASE("solve --model serial tells what it leaves out, lift carries the motion over") {
  const OutputDirectory directory;
  const std::vector<std::string> squat = {"solve", "squat",          "--robot",  "bipetto",   "--depth",
                                          "0.95",  "--set",          "settle=0", "--set",     "duration=0.6",
                                          "--set", "time_step=0.02", "--quiet",  "--no-check"};
  std::vector<std::string> serial = squat;
  // Far limits, which the lift has no need of.
  serial.insert(serial.end(), {"--model", "serial", "--limit", "knee_right=500", "--velocity-limit", "knee_left=500",
                               "-o", directory.str("serial")});
  const CommandResult solved = run(serial);
  INFO(solved.out << solved.err);
  REQUIRE(solved.status == 0);
  CHECK_THAT(solved.out, Catch::Contains("closures dropped") && Catch::Contains("free_knee_left") &&
                             Catch::Contains("motor_knee_left -> knee_left") && Catch::Contains("converged"));
  CHECK(json::parse(readFile(directory.str("serial") + "/summary.json"))["model"] == "serial");

  for (const std::string method : {"newton", "nlopt"}) {
    const CommandResult result =
        run({"lift", directory.str("serial"), "-o", directory.str(method), "--method", method});
    INFO(result.out << result.err);
    CHECK(result.status == 0);
    CHECK_THAT(result.out, Catch::Contains("lifted: all 31 nodes") && Catch::Contains("motor_knee_left"));
    CHECK(directory.list(method) ==
          std::vector<std::string>{"lift.json", "mechanism.urdf", "mechanism.yaml", "summary.json", "trajectory.csv", "trajectory.npz"});
    const json summary = json::parse(readFile(directory.str(method) + "/summary.json"));
    CHECK(summary["model"] == "closed");
    CHECK(summary["converged"] == true);
    CHECK(summary["closure_gap"]["position_m"].get<double>() < 1e-9);
    CHECK(summary["peak_torques"].contains("motor_knee_left"));
    const json lifted = json::parse(readFile(directory.str(method) + "/lift.json"));
    CHECK(lifted["lifted"] == true);
    CHECK(lifted["nodes"].size() == 31);
  }
  checkRefused(run({"lift", directory.str("newton"), "-o", directory.str("again")}),
               "not a motion of the serial model");
  checkRefused(run({"lift", "/no/such/place", "-o", directory.str("again")}), "cannot be read");
  std::vector<std::string> wrong = squat;
  wrong.insert(wrong.end(), {"--model", "serial", "--serial-armature", "much", "-o", directory.str("again")});
  checkRefused(run(wrong), "armature 'much' of the serial model");
}
