// Results as files: whole, read back, and refused with their place.
#include <fcntl.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "formats/text_file.h"
#include "get_error.h"
#include "get_error_of_reading.h"
#include "results/plot.h"
#include "robot_directory.h"
#include "short_squat.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;

TEST_CASE("a result is three whole files, written again over the old ones") {
  const TemporaryDirectory directory;
  ShortSquat squat;
  FddpSummary summary;
  summary.termination = FddpTermination::Interrupted;
  summary.cost = 2.5;
  summary.log.resize(3);
  const MotionResult result =
      makeResult({"bipetto", "/r.urdf", {"bielle", "solve"}}, {squat.motion, squat.motion.guess, summary});
  CHECK(result.interrupted());
  CHECK_FALSE(result.converged());
  for (size_t m = 1; m < result.peak_torques.size(); ++m)
    CHECK(result.peak_torques[m - 1].second >= result.peak_torques[m].second);
  CHECK(result.gap_position == result.record.gap.col(0).maxCoeff());
  CHECK(result.slip_position > 1e-3);  // the moved guess does not stand still
  const std::string place = directory / "deep/er";
  for (int repetition = 0; repetition < 2; ++repetition) {
    const std::vector<std::string> paths = writeResult(place, result);
    CHECK(paths.size() == 3);
    CHECK(std::distance(fs::directory_iterator(place), fs::directory_iterator()) == 3);
    checkEqual(readRecord(paths[1]), result.record);
    CHECK_THAT(readFile(paths[2]), Catch::Contains("\"termination\": \"interrupted\"") &&
                                       Catch::Contains("\"interrupted\": true") && Catch::Contains("\"cost\": 2.5"));
  }
}

TEST_CASE("a summary reads back: phases, stances, ground; what is none is refused with its file") {
  const TemporaryDirectory directory;
  ShortSquat squat;
  squat.motion.ground.height = -0.25;
  squat.motion.ground.steps.push_back({Vector3d(0.5, 0.1, 0.15), 0.3, 0.6, 0.2});
  const MotionResult result = makeResult({"bipetto", "/r.urdf", {}}, {squat.motion, squat.motion.guess, {}});
  writeResult(directory / "", result);
  const MotionSummary summary = readSummary(directory / "");
  CHECK(summary.motion == "squat");
  CHECK(summary.run.robot_file == "/r.urdf");
  CHECK(summary.formulation == result.formulation);
  CHECK(summary.step == result.step);
  CHECK_FALSE(summary.converged);
  CHECK(summary.options == result.options);
  REQUIRE(summary.goals.size() == 1);
  CHECK(summary.goals[0].goal.name == "depth");
  CHECK(summary.goals[0].goal.kind == GoalKind::Height);
  CHECK(summary.goals[0].goal.requested == result.goals[0].goal.requested);
  CHECK(summary.goals[0].goal.tolerance == result.goals[0].goal.tolerance);
  CHECK(summary.goals[0].goal.last == squat.motion.problem->numStages());
  CHECK(summary.goals[0].goal.contacts == result.record.contact_names);
  CHECK(summary.goals[0].achieved == result.goals[0].achieved);
  CHECK_FALSE(summary.goals[0].met());  // the guess stands
  REQUIRE(summary.phases.size() == 1);
  CHECK(summary.phases[0].time_step == result.schedule.phases[0].dt);
  CHECK(summary.phases[0].nodes == squat.motion.problem->numStages());
  REQUIRE(summary.phases[0].stances.size() == 2);
  for (int c = 0; c < 2; ++c) {
    const ContactTarget& target = squat.motion.schedule.phases[0].contacts[c];
    const MotionSummary::Stance& stance = summary.phases[0].stances[c];
    CHECK(stance.contact == result.record.contact_names[target.contact]);
    CHECK(stance.X_WT.p == target.X_WT.p);
    CHECK(stance.X_WT.R.isApprox(target.X_WT.R, 1e-15));
  }
  CHECK(summary.ground.height == -0.25);
  CHECK(summary.ground.friction == result.ground.friction);
  REQUIRE(summary.ground.steps.size() == 1);
  CHECK(summary.ground.calcHeight(0.5, 0.1) == 0.15);
  CHECK(summary.ground.calcHeight(0.5, 0.5) == -0.25);

  const std::string whole = readFile(directory / "summary.json");
  const auto getErrorOf = [&](const std::string& text) {
    writeText(directory / "summary.json", text);
    return getError([&] { readSummary(directory / ""); });
  };
  CHECK_THAT(getErrorOf(""), Catch::Contains("summary.json: file: "));
  for (const char* key : {"motion", "step", "objective", "goals", "free_timings"}) {
    nlohmann::json json = nlohmann::json::parse(whole);
    REQUIRE(json.erase(key) == 1);
    CHECK_THAT(getErrorOf(json.dump()),
               Catch::Contains("summary.json: file: it has no entry '" + std::string(key) + "'"));
  }
  CHECK_THAT(getErrorOf("[1]"), Catch::Contains("summary.json"));
  fs::remove(directory / "summary.json");
  CHECK_THROWS_WITH(readSummary(directory / ""), Catch::Contains("it cannot be read"));
}

TEST_CASE("the slip is zero for feet that stand still") {
  const LoadedRobot robot = loadRobot("bipetto");
  SquatOptions options;
  options.duration = 0.12;
  Motion motion = makeSquat(robot.model, options);
  const MotionResult result = makeResult({}, {motion, motion.guess, {}});
  CHECK(result.slip_position == 0);
  CHECK(result.slip_angle < 1e-15);
  CHECK(result.gap_position < 1e-12);
}

TEST_CASE("figures of values that are all the same are drawn without a complaint of gnuplot") {
  const TemporaryDirectory directory;
  std::vector<Plot> plots;
  for (const PlotScale scale : {PlotScale::Free, PlotScale::Logarithmic, PlotScale::Polar})
    plots.push_back({"it's flat", "x", "y", {{"curve", "#000000", {{0, 2}, {1, 2}}}}, scale});
  plots.push_back({"point", "x", "y", {{"", "#000000", {{0, 0}}, CurveStyle::Crosses}}});
  plots.push_back({"", "x", "y", {{"", "#000000", {{0, 0}, {90, 0}}, CurveStyle::LinesPoints}}, PlotScale::Polar});
  plots.push_back({"shades", "x", "y", {}, PlotScale::Free, {}, {"value", 0.1, {{0, 0, 3}, {0, 0.1, 3}}}});
  plots.push_back({"nothing", "x", "y"});
  const std::string errors = directory / "errors";
  const int before = dup(STDERR_FILENO), file = open(errors.c_str(), O_WRONLY | O_CREAT, 0600);
  dup2(file, STDERR_FILENO);
  const bool drawn = drawPlots(directory / "t.svg", plots);
  dup2(before, STDERR_FILENO);
  close(before), close(file);
  if (!drawn) return;  // gnuplot is not installed
  CHECK(readFile(errors).empty());
  CHECK_THAT(readFile(directory / "t.svg"), Catch::Contains("it's flat") && Catch::Contains("no results"));
}

TEST_CASE("a place that cannot be written to is an error that says why") {
  const TemporaryDirectory directory;
  writeText(directory / "file", "");
  CHECK_THROWS_WITH(makeOutputDirectory(directory / "file"), Catch::Contains("file: directory: results cannot be"));
  CHECK_THROWS_WITH(makeOutputDirectory(directory / "file/below"), Catch::Contains("Not a directory"));
  CHECK_THROWS_AS(makeOutputDirectory("/proc/bielle"), InputError);
  ShortSquat squat;
  const MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  CHECK_THROWS_WITH(writeCsv(directory / "none/t.csv", record), Catch::Contains("No such file or directory"));
  fs::create_directory(directory / "t.npz");
  CHECK_THROWS_WITH(writeNpz(directory / "t.npz", record), Catch::Contains("Is a directory"));
  CHECK(std::distance(fs::directory_iterator(directory / ""), fs::directory_iterator()) == 2);  // nothing half written
}
