// Studies, run as a user runs them. Oracles: the results of their cases, read by themselves.
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "bielle/results/result.h"
#include "read_table.h"
#include "robot_directory.h"
#include "run_command.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using nlohmann::json;

namespace {

class StudyDirectory {
 public:
  StudyDirectory() {
    std::string pattern = (fs::temp_directory_path() / "bielle_study_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~StudyDirectory() { fs::remove_all(path_); }

  std::vector<std::string> makeCommand(const std::string& name, const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {BIELLE_PAPER, "study", name, "-o", path_.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  CommandResult run(const std::string& name, const std::vector<std::string>& more) const {
    return runCommand(makeCommand(name, more));
  }
  fs::path operator/(const std::string& name) const { return path_ / name; }
  std::string str() const { return path_.string(); }

 private:
  fs::path path_;
};

double calcPeak(const MotionRecord& record, const std::vector<std::string>& motors) {
  double peak = 0;
  for (size_t i = 0; i < record.u_names.size(); ++i)
    if (std::find(motors.begin(), motors.end(), record.u_names[i]) != motors.end())
      peak = std::max(peak, record.u.col(i).cwiseAbs().maxCoeff());
  return peak;
}

// Whether a process other than this one has the text in its command line.
bool isAtWork(const std::string& text) {
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos || name == std::to_string(getpid())) continue;
    if (readFile(entry.path() / "cmdline").find(text) != std::string::npos) return true;
  }
  return false;
}

// The closed model beside the lifted serial one at two depths, once for all.
const StudyDirectory& getStudy() {
  static const StudyDirectory directory;
  static const CommandResult result = directory.run("squat", {"--values", "0.9", "0.95", "--jobs", "2"});
  INFO(result.out << result.err);
  REQUIRE(result.status == 0);
  return directory;
}

bool waitUntilIdle(const std::string& text) {
  for (int i = 0; i < 400; ++i) {
    if (!isAtWork(text)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(25));
  }
  return false;
}

}  // namespace

TEST_CASE("a study compares the closed model with the lifted serial one") {
  const StudyDirectory& directory = getStudy();
  const auto rows = readTable(directory / "squat.csv");
  REQUIRE(rows.size() == 8);
  const std::vector<std::string> motors = {"motor_knee_left", "motor_knee_right"};
  const std::map<std::string, std::vector<std::string>> driven = {
      {"closed", motors}, {"lifted", motors}, {"stepped", motors}, {"serial", {"knee_left", "knee_right"}}};
  for (const auto& row : rows) {
    const std::string model = row.at("model");
    CAPTURE(model, row.at("depth"));
    CHECK(row.at("outcome") == (model == "lifted" || model == "stepped" ? "lifted" : "converged"));
    const fs::path place =
        directory / ("cases/squat-depth-" + row.at("depth") + "-" + (model == "closed" ? model : "serial"));
    const MotionRecord record = readRecord(place / model / "trajectory.npz");
    CHECK(std::stod(row.at("knee_peak_Nm")) == calcPeak(record, driven.at(model)));
    CHECK(std::stod(row.at("com_mean_m")) == Approx(record.com.col(2).mean()).epsilon(1e-12));
    CHECK(std::stod(row.at("com_lowest_m")) == record.com.col(2).minCoeff());
    CHECK(std::stod(row.at("knee_mean_Nm")) < std::stod(row.at("knee_peak_Nm")));
  }
  // One line per value in the page, with the numbers of the table; the figure is there.
  const std::string page = readFile(directory / "squat.md");
  CHECK_THAT(page,
             Catch::Contains("\n| 0.9 | converged | converged | lifted | lifted |") &&
                 Catch::Contains("\n| 0.95 | converged | converged | lifted | lifted |") &&
                 Catch::Contains("closed: 2 of 2 converge, serial: 2 of 2") &&
                 Catch::Contains(
                     "targets whose lift fails: none; for lack of accuracy alone: none; lifted step by step: none") &&
                 Catch::Contains("(squat.svg)"));
  char peak[32];
  std::snprintf(peak, sizeof peak, "| %.1f |", std::stod(rows[0].at("knee_peak_Nm")));
  CHECK_THAT(page, Catch::Contains(peak));
  CHECK_THAT(readFile(directory / "squat.svg"), Catch::Contains("<svg") && Catch::Contains("serial, lifted"));
}

TEST_CASE("what a motion refuses is a result of the study") {
  const StudyDirectory directory;
  const CommandResult result = directory.run("squat", {"--values", "-0.5", "-1"});
  INFO(result.out << result.err);
  REQUIRE(result.status == 0);
  CHECK_THAT(result.out, Catch::Contains("squat-depth--0.5-closed: refused: "));
  for (const auto& row : readTable(directory / "squat.csv")) {
    CHECK_THAT(row.at("outcome"),
               Catch::Contains(row.at("model") == "lifted" || row.at("model") == "stepped" ? "not done" : "refused: "));
    CHECK(row.at("knee_peak_Nm").empty());
  }
  CHECK_THAT(readFile(directory / "squat.md"),
             Catch::Contains("closed: 0 of 2 converge") && Catch::Contains("| differs |"));
  CHECK_THAT(readFile(directory / "squat.svg"), Catch::Contains("no results"));
}

TEST_CASE("a killed study leaves no process behind and goes on where it was") {
  const StudyDirectory directory;
  const std::vector<std::string> values = {"--jobs", "1", "--values", "0.92", "0.94"};
  Command study(directory.makeCommand("squat", values));
  REQUIRE(study.waitForOutput("[2/4]", 120));
  study.sendSignal(SIGKILL);
  CHECK(study.wait().status == 128 + SIGKILL);
  CHECK(waitUntilIdle(directory.str() + "/cases"));
  const fs::path first = directory / "cases/squat-depth-0.92-closed",
                 third = directory / "cases/squat-depth-0.94-closed";
  const std::string kept = readFile(first / "case.json");
  CHECK(json::parse(kept).at("outcome").at(0).at("status") == 0);
  CHECK_FALSE(fs::exists(directory / "squat.csv"));
  // The case that was cut short is done anew: nothing of it stays.
  fs::create_directories(third);
  fs::remove(third / "case.json");
  std::ofstream(third / "half") << "half";

  const CommandResult again = directory.run("squat", values);
  INFO(again.out << again.err);
  CHECK(again.status == 0);
  CHECK_THAT(again.out, Catch::Contains("squat-depth-0.92-closed: kept") &&
                            Catch::Contains("squat-depth-0.92-serial: kept") &&
                            Catch::Contains("squat-depth-0.94-closed: done (") &&
                            Catch::Contains("squat-depth-0.94-serial: done ("));
  CHECK(readFile(first / "case.json") == kept);
  CHECK_FALSE(fs::exists(third / "half"));
  CHECK(readTable(directory / "squat.csv").size() == 8);
}

TEST_CASE("a study that is interrupted says so; cases of another request are done anew") {
  const StudyDirectory directory;
  Command study(directory.makeCommand("squat", {"--jobs", "1", "--values", "0.92", "0.94"}));
  REQUIRE(study.waitForOutput("[1/4]", 120));
  // Nobody else may work in the same directory meanwhile.
  const CommandResult other = directory.run("squat", {"--values", "0.93"});
  CHECK(other.status == 2);
  CHECK_THAT(other.err, Catch::Contains("another study is using it"));
  study.sendSignal(SIGINT);
  const CommandResult end = study.wait();
  CHECK(end.status == 1);
  CHECK_THAT(end.err, Catch::Contains("interrupted"));
  CHECK(waitUntilIdle(directory.str() + "/cases"));

  const fs::path record = directory / "cases/squat-depth-0.92-closed/case.json";
  json changed = json::parse(readFile(record));
  changed["request"]["identity"] = "another version";
  std::ofstream(record) << changed;
  const CommandResult again = directory.run("squat", {"--values", "0.92"});
  CHECK(again.status == 0);
  CHECK_THAT(again.out, Catch::Contains("squat-depth-0.92-closed: done ("));
  CHECK(json::parse(readFile(record)) != changed);
}

TEST_CASE("without gnuplot a study has no figures, and says so") {
  const StudyDirectory directory;
  fs::copy(getStudy() / "cases", directory / "cases", fs::copy_options::recursive);
  std::vector<std::string> arguments = directory.makeCommand("squat", {"--values", "0.9", "0.95"});
  arguments.insert(arguments.begin(), {"/usr/bin/env", "PATH=/nowhere"});
  const CommandResult result = runCommand(arguments);
  CHECK(result.status == 0);
  CHECK_THAT(result.err, Catch::Contains("squat.svg: not drawn: gnuplot is not installed"));
  CHECK_FALSE(fs::exists(directory / "squat.svg"));
  CHECK(fs::exists(directory / "squat.csv"));
  CHECK_THAT(readFile(directory / "squat.md"), Catch::Contains("gnuplot is not installed"));
}

TEST_CASE("bad studies are refused") {
  const StudyDirectory directory;
  const auto refuse = [&](const std::string& name, const std::vector<std::string>& more, const char* text) {
    const CommandResult result = directory.run(name, more);
    INFO(result.err);
    CHECK(result.status == 2);
    CHECK(result.out.empty());
    CHECK_THAT(result.err, Catch::StartsWith("bielle: error: ") && Catch::Contains(text));
  };
  refuse("hop", {}, "hop");
  refuse("all", {"--values", "1"}, "not a study of one parameter");
  refuse("ratio", {"--values", "1"}, "not a study of one parameter");
  refuse("squat", {"--jobs", "0"}, "--jobs");
  refuse("squat", {"--robot", "fourbar"}, "knee_right");
  CHECK_FALSE(fs::exists(directory / "cases"));
}
