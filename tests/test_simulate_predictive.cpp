// The command `bielle simulate` under predictive control: pushes, springs, commands, real time.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "bielle/results/result.h"
#include "simulate_trials.h"

namespace bielle {

namespace fs = std::filesystem;
using namespace testing;

TEST_CASE("simulate: predictive control survives a push that gains do not") {
  const Scratch scratch;
  const auto simulate = [&](const std::string& control) {
    const std::string directory = (scratch.path / control).string();
    const CommandResult result =
        runCommand({BIELLE_COMMAND, "simulate", "walk", "--robot", BIELLE_SOURCE_DIR "/robots/bipetto", "--speed",
                    "0.4", "--duration", "2.8", "--control", control, "--push", "t=1.15,impulse=5,direction=180", "-o",
                    directory, "--no-report"});
    CAPTURE(result.err);
    const auto summary = parseSummary(directory);
    CHECK(result.status == (summary["fell"].get<bool>() ? 1 : 0));
    CHECK(summary["commanded_speed"] == 0.4);
    return summary;
  };
  CHECK(simulate("gains")["fell"] == true);
  const auto summary = simulate("mpc");
  CHECK(summary["fell"] == false);
  CHECK(summary["duration"].get<double>() == Approx(2.8));
  CHECK(summary["largest_slip"].get<double>() < 0.01);
  CHECK(summary["solves"]["failed"] == 0);
  CHECK(summary["solves"]["count"] == 234);  // one for every 12 ms
  CHECK(summary["solves"]["early_landings"].get<int>() >= 0);
  // When and where each foot is to land next; of what is not planned anew nothing is foreseen.
  const MotionRecord record = readRecord((scratch.path / "mpc" / "trajectory.npz").string());
  REQUIRE(record.footholds.rows() == record.time.size());
  REQUIRE(record.footholds.cols() == 2 * MotionRecord::kFootholdEntries);
  for (int k = 0; k < record.time.size(); ++k)
    for (int foot = 0; foot < 2; ++foot) {
      const auto foothold = record.footholds.row(k).segment<3>(foot * MotionRecord::kFootholdEntries);
      if (std::isnan(foothold[0])) continue;
      CHECK(foothold[0] > record.time[k] - 0.06);  // a late foot is waited for
      CHECK(foothold[0] < record.time[k] + 1.25);
      CHECK(std::abs(foothold[1] - record.com(k, 0)) < 0.6);
    }
  CHECK(std::isfinite(record.footholds(100, 0)));
  CHECK(readRecord((scratch.path / "gains" / "trajectory.npz").string()).footholds.size() == 0);
  const auto& solves = summary["solves"];
  CHECK(solves["worst_ms"].get<double>() >= solves["median_ms"].get<double>());
  CHECK(solves["parts"].size() == 7);
  for (const auto& part : solves["parts"]) {
    CHECK(part["median_ms"].get<double>() > 0);
    CHECK(part["p99_ms"].get<double>() >= part["median_ms"].get<double>());
  }
  CHECK(solves["step"]["median"] == 1);
  CHECK(solves["step"]["p1"].get<double>() < 1);
  CHECK(solves["regularization"]["median"].get<double>() > 0);
  // Solve by solve: one at the beginning of each stage.
  REQUIRE(solves["log"].size() == solves["count"]);
  const auto columns = solves["log_columns"].get<std::vector<std::string>>();
  const auto find = [&columns](const char* name) {
    return std::find(columns.begin(), columns.end(), name) - columns.begin();
  };
  double worst = 0;
  for (size_t i = 0; i < solves["log"].size(); ++i) {
    const auto row = solves["log"][i].get<std::vector<double>>();
    REQUIRE(row.size() == columns.size());
    CHECK(row[find("time_s")] == Approx(0.012 * static_cast<double>(i)).margin(0.0011));
    const double step = row[find("step")];
    CHECK((step == 0 || step == 1 || step == 1. / 4 || step == 1. / 16 || step == 1. / 64));
    CHECK(row[find("regularization")] > 0);
    worst = std::max(worst, row[find("whole")]);
  }
  CHECK(worst == Approx(solves["worst_ms"].get<double>()).margin(0.001));
}

TEST_CASE("simulate: where a push leaves large gaps, predictive control takes short steps instead of none") {
  const Scratch scratch;
  const std::string output = (scratch.path / "pushed").string();
  const CommandResult result =
      runCommand({BIELLE_COMMAND, "simulate", "walk", "--robot", BIELLE_SOURCE_DIR "/robots/bipetto", "--speed", "0.4",
                  "--duration", "3.4", "--push", "t=1.124,impulse=10,direction=180", "-o", output, "--summary-only"});
  CAPTURE(result.out, result.err);
  CHECK(result.status == 0);
}

TEST_CASE(
    "simulate: on leaf springs a walk stands to its end and beyond, pushed under predictive control, with gains as "
    "well") {
  const Scratch scratch;
  const std::string plan = (scratch.path / "springs").string(), output = (scratch.path / "walked").string();
  REQUIRE(runCommand({BIELLE_COMMAND, "solve", "walk", "--robot", BIELLE_SOURCE_DIR "/robots/spring_biped", "--speed",
                      "0.3", "--steps", "2", "-o", plan, "--quiet", "--no-report", "--no-check"})
              .status == 0);
  for (const std::string control : {"mpc", "gains"}) {
    CAPTURE(control);
    std::vector<std::string> arguments = {BIELLE_COMMAND, "simulate", plan,   "--control",
                                          control,        "-o",       output, "--summary-only"};
    if (control == "mpc") arguments.insert(arguments.end(), {"--push", "t=0.9,impulse=4,direction=90"});
    const CommandResult result = runCommand(arguments);
    CAPTURE(result.out, result.err);
    CHECK(result.status == 0);
    CHECK(parseSummary(output)["largest_slip"].get<double>() < 0.01);
  }
}

TEST_CASE("simulate: on leaf springs a robot stands where it is for as long as is asked, in every world") {
  const Scratch scratch;
  const std::string plan = (scratch.path / "springs").string(), output = (scratch.path / "stood").string();
  REQUIRE(runCommand({BIELLE_COMMAND, "solve", "walk", "--robot", BIELLE_SOURCE_DIR "/robots/spring_biped", "--speed",
                      "0.3", "--steps", "2", "-o", plan, "--quiet", "--no-report", "--no-check"})
              .status == 0);
  for (const std::string world : {"bielle", "mujoco"}) {
    CAPTURE(world);
    const CommandResult result = runCommand({BIELLE_COMMAND, "simulate", plan, "--control", "mpc", "--world", world,
                                             "--duration", "15", "-o", output, "--summary-only"});
    CAPTURE(result.out, result.err);
    if (world == "mujoco" && result.status == 2) continue;  // built without it
    CHECK(result.status == 0);
    CHECK(parseSummary(output)["largest_deviation"].get<double>() < 0.02);
  }
}

TEST_CASE("simulate: a cycle is repeated, at its speed, and stands") {
  const Scratch scratch;
  const std::string plan = (scratch.path / "cycle").string(), output = (scratch.path / "walked").string();
  REQUIRE(runCommand({BIELLE_COMMAND, "solve", "walk", "--robot", BIELLE_SOURCE_DIR "/robots/bipetto", "--speed", "0.4",
                      "--periodic", "-o", plan, "--quiet", "--no-report", "--no-check"})
              .status == 0);
  for (const std::string control : {"mpc", "gains"}) {
    const CommandResult result =
        runCommand({BIELLE_COMMAND, "simulate", plan, "--control", control, "-o", output, "--summary-only"});
    CAPTURE(result.out, result.err);
    CHECK(result.status == 0);
    const nlohmann::json summary = parseSummary(output);
    const double period = parseSummary(plan)["periodic"]["period_s"];
    CHECK(summary["duration"].get<double>() == Approx(10 * period).margin(0.002));
    CHECK(summary["distance"].get<double>() == Approx(10 * 0.4 * period).epsilon(0.02));
    CHECK(summary["largest_deviation"].get<double>() < 0.02);
  }
}

TEST_CASE("simulate: down stairs under predictive control, feet pass the edges of the treads above") {
  const Scratch scratch;
  const std::string plan = (scratch.path / "down").string(), output = (scratch.path / "walked").string();
  REQUIRE(runCommand({BIELLE_COMMAND, "solve", "stairs", "--robot", BIELLE_SOURCE_DIR "/robots/bipetto", "--height",
                      "-0.06", "--stairs", "3", "-o", plan, "--quiet", "--no-report", "--no-check"})
              .status == 0);
  const CommandResult result = runCommand({BIELLE_COMMAND, "simulate", plan, "-o", output, "--summary-only"});
  CAPTURE(result.out, result.err);
  CHECK(result.status == 0);
  const nlohmann::json summary = parseSummary(output);
  CHECK(summary["largest_tilt"].get<double>() < 0.01);
  CHECK(summary["largest_slip"].get<double>() < 2e-3);
}

TEST_CASE("simulate: predictive control is the default, and gains where it cannot carry a motion out") {
  const Scratch scratch;
  const std::string output = (scratch.path / "out").string(), full = (scratch.path / "full").string();
  const CommandResult predicted = simulate(output, {"--summary-only"}, getSquat());
  CAPTURE(predicted.out, predicted.err);
  REQUIRE(predicted.status == 0);
  CHECK_THAT(predicted.out, Catch::Contains("control mpc: it stood"));
  const nlohmann::json summary = parseSummary(output), &solves = summary["solves"];
  CHECK(summary["control"] == "mpc");
  CHECK(summary["largest_deviation"].get<double>() < 5e-3);
  CHECK(solves["stages"] == 90);  // 0.8 s of the squat and 1 s more, in stages of 20 ms
  CHECK(solves["count"] == 90);
  CHECK(solves["failed"] == 0);
  CHECK_FALSE(summary.contains("real_time"));

  REQUIRE(runCommand({BIELLE_COMMAND, "solve", "squat", "--robot", BIELLE_SOURCE_DIR "/robots/bipetto", "--depth",
                      "0.95", "--formulation", "full", "-o", full, "--quiet", "--no-report", "--no-check"})
              .status == 0);
  const CommandResult other = simulate(output, {"--summary-only", "--duration", "0.1"}, full);
  CAPTURE(other.out, other.err);
  CHECK(other.status == 0);
  CHECK_THAT(other.out, Catch::Contains("control gains (mpc cannot carry out motions solved with --formulation full)"));
  CHECK(parseSummary(output)["control"] == "gains");
  for (const std::vector<std::string>& wanted : {std::vector<std::string>{"--control", "mpc"}, {"--real-time"}}) {
    const CommandResult refused = simulate(output, wanted, full);
    CAPTURE(refused.err);
    CHECK(refused.status == 2);
    CHECK_THAT(refused.err, Catch::Contains("formulation 'full'") && Catch::Contains("--control gains"));
  }
}

// Sizes and relations only: how fast a machine is under what load is not known.
TEST_CASE("simulate: in real time the times of solves, stages without one and latencies are told") {
  const Scratch scratch;
  const std::string output = (scratch.path / "live").string();
  const CommandResult result = simulate(
      output, {"--real-time", "--nodes", "10", "--iterations", "1", "--duration", "1", "--summary-only"}, getSquat());
  CAPTURE(result.out, result.err);
  REQUIRE(result.status < 2);
  const nlohmann::json summary = parseSummary(output), &solves = summary["solves"], &clock = summary["real_time"];
  const int stages = solves["stages"], count = solves["count"], missed = solves["missed"];
  CHECK((stages > 0 && stages <= 50));
  CHECK(count > 0);
  // The last solve may not be over, and the last stage still wait for its own.
  CHECK((count + missed <= stages && count + missed >= stages - 2));
  for (const nlohmann::json* times : {&solves, &clock["update"], &clock["new_policy"]}) {
    const double median = (*times)["median_ms"], most = (*times)["p99_ms"], worst = (*times)["worst_ms"];
    CHECK((0 < median && median <= most && most <= worst));
  }
  CHECK(clock["largest_lag_ms"].get<double>() > 0);
  CHECK((clock["peak_memory_MB"].get<double>() > 1 && clock["peak_memory_MB"].get<double>() < 4000));
  CHECK_THAT(result.out, Catch::Contains(std::to_string(missed) + " of " + std::to_string(stages) +
                                         " stages had no solve of their own\n") &&
                             Catch::Contains("until torques       median ") &&
                             Catch::Contains("until a new policy  median ") && Catch::Contains("MB at most"));
}

TEST_CASE("simulate: a walk follows commands, turns on the way and stops") {
  const Scratch scratch;
  const std::string commands = (scratch.path / "commands.yaml").string(), output = (scratch.path / "walked").string();
  std::ofstream(commands) << "commands:\n  - {time: 0.1, forward: 0.3}\n  - {time: 1.2, forward: 0.2, turning: 0.5}\n"
                             "  - {time: 2.4}\n";
  const auto walk = [&](const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {
        BIELLE_COMMAND, "simulate", "walk",       "--robot", BIELLE_SOURCE_DIR "/robots/bipetto",
        "-o",           output,     "--no-report"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return runCommand(arguments);
  };
  const CommandResult result = walk({"--command", commands, "--duration", "4.2"});
  CAPTURE(result.out, result.err);
  REQUIRE(result.status == 0);
  const auto summary = parseSummary(output);
  CHECK(summary["solves"]["failed"] == 0);
  CHECK(summary["commanded_speed"].get<double>() == Approx((1.1 * 0.3 + 1.2 * 0.2) / 4.2));
  CHECK(summary["commands"].size() == 3);
  CHECK(summary["commands"][1]["turning"] == 0.5);
  CHECK(summary["distance"].get<double>() == Approx(1.1 * 0.3 + 1.2 * 0.2).margin(0.2));
  const MotionRecord record = readRecord(output + "/trajectory.npz");
  const auto getHeading = [&](Eigen::Index row) {
    return 2 * std::atan2(record.q(row, 5), record.q(row, 6));  // of an upright trunk
  };
  const Eigen::Index last = record.q.rows() - 1;
  CHECK(getHeading(last) == Approx(1.2 * 0.5).margin(0.25));
  CHECK(std::abs(getHeading(240)) < 0.1);              // not yet
  CHECK(record.v.row(last).head(6).norm() < 0.02);     // it stands
  CHECK(record.v.row(last / 2).head(6).norm() > 0.1);  // it walked
  CHECK(walk({"--command", commands, "--control", "gains"}).err.find("mpc") != std::string::npos);
  CHECK(walk({"--command", commands, "--control", "mpc", "--speed", "1"}).err.find("--speed") != std::string::npos);
  for (const std::string velocity :
       {"forward: 7", "forward: 1e300", "sideways: 1e300", "turning: 5", "turning: 1e300"}) {
    std::ofstream(commands) << "commands:\n  - {time: 0, " + velocity + "}\n";
    const CommandResult refused = walk({"--command", commands, "--control", "mpc"});
    CAPTURE(velocity, refused.err);
    CHECK(refused.status == 2);
    CHECK(refused.err.find("commands.yaml, command 1") != std::string::npos);
    CHECK(refused.err.size() < 400);
  }
}

}  // namespace bielle
