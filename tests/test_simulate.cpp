// The command `bielle simulate`: what it writes, its exit statuses, and that it repeats itself to the byte.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bielle/results/result.h"
#include "robot_directory.h"
#include "run_command.h"

namespace bielle {
namespace {

namespace fs = std::filesystem;
using testing::CommandResult;
using testing::readFile;
using testing::runCommand;

nlohmann::json parseSummary(const fs::path& directory) {
  return nlohmann::json::parse(readFile(directory / "summary.json"));
}

std::string solve(const std::string& motion, const std::vector<std::string>& options) {
  const std::string directory = (fs::temp_directory_path() / ("bielle_simulate_" + motion)).string();
  std::vector<std::string> arguments = {
      BIELLE_COMMAND, "solve",   motion,    "--robot",     BIELLE_SOURCE_DIR "/robots/bipetto",
      "-o",           directory, "--quiet", "--no-report", "--no-check"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const CommandResult solved = runCommand(arguments);
  CAPTURE(solved.err);
  REQUIRE(solved.status == 0);
  return directory;
}

// A walk of two steps, solved once.
const std::string& getWalk() {
  static const std::string walk = solve("walk", {"--speed", "0.4", "--steps", "2"});
  return walk;
}

// A squat of 40 stages, whose gains are found at once.
const std::string& getSquat() {
  static const std::string squat =
      solve("squat", {"--depth", "0.9", "--set", "duration=0.6", "--set", "settle=0.1", "--set", "time_step=0.02"});
  return squat;
}

CommandResult simulate(const std::string& output, std::vector<std::string> options,
                       const std::string& motion = getWalk()) {
  std::vector<std::string> arguments = {BIELLE_COMMAND, "simulate", motion, "-o", output};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return runCommand(arguments);
}

struct Scratch {
  Scratch() : path(fs::temp_directory_path() / "bielle_simulate_test") { fs::create_directories(path); }
  ~Scratch() { fs::remove_all(path); }
  fs::path path;
};

}  // namespace

TEST_CASE("simulate: with gains a walk stands, and its numbers are written") {
  const Scratch scratch;
  const std::string output = (scratch.path / "walk").string();
  const CommandResult result = simulate(output, {"--control", "gains"});
  CAPTURE(result.out, result.err);
  REQUIRE(result.status == 0);
  const nlohmann::json summary = parseSummary(output);
  CHECK(summary["control"] == "gains");
  CHECK(summary["fell"] == false);
  CHECK(summary["fall_time"].is_null());
  CHECK(summary["distance"].get<double>() > 0.1);
  CHECK(summary["mean_speed"].get<double>() ==
        Approx(summary["distance"].get<double>() / summary["duration"].get<double>()));
  CHECK(std::abs(summary["energy_balance"].get<double>()) < 0.01);
  CHECK(summary["largest_gap"].get<double>() < 1e-9);
  CHECK(summary["largest_slip"].get<double>() < 0.005);
  CHECK(summary["saturated_share"].get<double>() == 0);
  // Of the whole, on the clock; world and control are parts of it.
  const nlohmann::json& seconds = summary["seconds"];
  const double whole = seconds["whole"], world = seconds["world"], control = seconds["control"];
  CHECK(summary["real_time_factor"].get<double>() == Approx(summary["duration"].get<double>() / whole));
  CHECK((world > 0 && control > 0 && world + control < whole));
  CHECK_THAT(result.out, Catch::Contains("times real time; world "));
  // Nothing is left of how the plan was solved.
  for (const char* of_solving :
       {"formulation", "step", "goals", "converged", "interrupted", "termination", "acceptable", "cost", "iterations",
        "solver_gap", "constraints", "free_timings", "log"})
    CHECK_FALSE(summary.contains(of_solving));
  const MotionRecord record = readRecord(output + "/trajectory.npz");
  CHECK(record.time[record.time.size() - 1] == Approx(summary["duration"].get<double>()));
  CHECK(record.q.allFinite());
}

TEST_CASE("simulate: the speed in steady steps is told beside that of the whole; pushes are told") {
  const Scratch scratch;
  const std::string plan = (scratch.path / "plan").string(), output = (scratch.path / "walked").string();
  const std::string robot = BIELLE_SOURCE_DIR "/robots/bipetto";
  REQUIRE(runCommand({BIELLE_COMMAND, "solve", "walk", "--robot", robot, "--speed", "0.4", "--steps", "4", "-o", plan,
                      "--quiet", "--no-report", "--no-check"})
              .status == 0);
  const CommandResult walked = runCommand({BIELLE_COMMAND, "simulate", plan, "--control", "gains", "-o", output,
                                           "--summary-only", "--push", "t=0.5,impulse=0.25,direction=90,duration=0.2"});
  CAPTURE(walked.out, walked.err);
  REQUIRE(walked.status == 0);
  CHECK_THAT(walked.out, Catch::Contains("with the time that it stands, 0."));
  CHECK_THAT(walked.out, Catch::Contains("0.25 N s at 0.5 s, for 0.2 s, direction 90 degrees"));
  const nlohmann::json summary = parseSummary(output), goal = parseSummary(plan)["goals"][0];
  REQUIRE(goal["name"] == "speed");
  CHECK(summary["steady_speed"].get<double>() == Approx(goal["achieved"].get<double>()).epsilon(0.03));
  CHECK(summary["mean_speed"].get<double>() < 0.7 * summary["steady_speed"].get<double>());
  REQUIRE(runCommand({BIELLE_COMMAND, "simulate", plan, "-o", output, "--summary-only", "--duration", "0.3"}).status ==
          0);
  CHECK(parseSummary(output)["steady_speed"].is_null());
}

TEST_CASE("simulate: the plan is not overwritten, and a motion carried out is no plan") {
  const Scratch scratch;
  const std::string plan = (scratch.path / "plan").string(), link = (scratch.path / "link").string();
  fs::copy(getWalk(), plan);
  fs::create_directory_symlink(plan, link);
  const std::string before = readFile(plan + "/summary.json");
  for (const std::string& same : {plan, link, plan + "/", plan + "/../plan", link + "/."})
    for (const bool is_input : {false, true}) {
      const CommandResult result = runCommand(
          {BIELLE_COMMAND, "simulate", is_input ? same : plan, "-o", is_input ? plan : same, "--duration", "0.05"});
      CAPTURE(same, result.err);
      CHECK(result.status == 2);
      CHECK_THAT(result.err, Catch::Contains("it is also an input") && Catch::Contains("-o"));
    }
  CHECK(readFile(plan + "/summary.json") == before);
  const std::string output = (scratch.path / "output").string(), again = (scratch.path / "again").string();
  REQUIRE(simulate(output, {"--duration", "0.05"}).status == 0);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"simulate", output, "-o", again}, {"lift", output, "-o", again}, {"check", output}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.begin(), BIELLE_COMMAND);
    const CommandResult result = runCommand(arguments);
    CAPTURE(command[0], result.out, result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Catch::Contains("output/summary.json") &&
                               Catch::Contains("a motion carried out, not a plan") &&
                               Catch::Contains("give the directory of `bielle solve`"));
  }
  CHECK_FALSE(fs::exists(again));
}

TEST_CASE("simulate: a controller may believe in another model than that of the motion") {
  const Scratch scratch;
  const std::string output = (scratch.path / "serial").string();
  for (const std::string model : {"serial", "ratio"}) {
    const CommandResult result = simulate(output, {"--model", model, "--control", "gains", "--summary-only"});
    CAPTURE(model, result.out, result.err);
    CHECK(result.status <= 1);  // it may well fall
    CHECK(result.err.empty());
    CHECK_THAT(result.out, Catch::Contains("with model " + model));
    const nlohmann::json summary = parseSummary(output);
    CHECK(summary["believed_model"] == model);
    CHECK(summary["duration"].get<double>() > 0.5);
    CHECK(summary["fell"] == (result.status == 1));
    CHECK(summary["plan_reachable_until"].is_null());
  }
  CHECK(simulate(output, {"--model", "gears"}).status == 2);
}

TEST_CASE("simulate: the plan lies beside what happened, and the page shows both") {
  const Scratch scratch;
  const std::string output = (scratch.path / "shown").string();
  REQUIRE(
      simulate(output, {"--control", "gains", "--push", "t=0.2,impulse=1,direction=90", "--duration", "0.5"}).status ==
      0);
  const MotionRecord record = readRecord(output + "/trajectory.npz"), plan = readRecord(output + "/plan.npz");
  REQUIRE(plan.time == record.time);
  CHECK(plan.q.row(0) == record.q.row(0));
  CHECK(plan.q.row(20).isApprox(record.q.row(20), 1e-3));
  CHECK_FALSE(plan.q.row(80).isApprox(record.q.row(80), 1e-3));  // it was pushed
  // At a node of the solved motion the plan is that node.
  const MotionRecord solved = readRecord(getWalk() + "/trajectory.npz");
  REQUIRE(solved.time[5] == Approx(plan.time[12]).margin(1e-12));  // 0.06 s: steps of 12 and of 5 ms
  CHECK(plan.q.row(12).isApprox(solved.q.row(5), 1e-6));
  CHECK(plan.u.allFinite());
  const nlohmann::json pushes = parseSummary(output)["pushes"];
  REQUIRE(pushes.size() == 1);
  CHECK(pushes[0]["direction_deg"] == 90);
  CHECK(readFile(output + "/report.html").find("\"plan\":{") != std::string::npos);
  const std::string bare = (scratch.path / "bare").string();
  REQUIRE(simulate(bare, {"--no-report", "--duration", "0.1"}).status == 0);
  CHECK_FALSE(fs::exists(bare + "/report.html"));
}

TEST_CASE("simulate: the summary alone is that of the whole result; a dry run only checks") {
  const Scratch scratch;
  const std::string whole = (scratch.path / "whole").string(), alone = (scratch.path / "alone").string();
  const std::vector<std::string> options = {"--control", "gains", "--duration", "0.3"};
  const auto simulateWith = [&options](const std::string& output, const std::string& files) {
    std::vector<std::string> all = options;
    all.push_back(files);
    return simulate(output, all).status;
  };
  REQUIRE(simulateWith(whole, "--no-report") == 0);
  REQUIRE(simulateWith(alone, "--summary-only") == 0);
  CHECK(std::distance(fs::directory_iterator(alone), fs::directory_iterator()) == 1);
  nlohmann::json summaries[] = {parseSummary(whole), parseSummary(alone)};
  for (nlohmann::json& summary : summaries)
    for (const char* of_the_run : {"command", "real_time_factor", "seconds"}) summary.erase(of_the_run);
  CHECK(summaries[0] == summaries[1]);
  const std::string none = (scratch.path / "none").string();
  const auto check = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {BIELLE_COMMAND, "simulate", "/nowhere", "-o", none, "--dry-run"});
    return runCommand(options).status;
  };
  CHECK(check({"--friction", "0.5", "--push", "t=1,impulse=2"}) == 0);
  CHECK(check({"--push", "t=1,force=2"}) == 2);
  CHECK(check({"--terrain", "hills=3"}) == 2);
  CHECK(check({"--frictoin", "0.5"}) == 2);
  CHECK_FALSE(fs::exists(none));
}

TEST_CASE("simulate: without gains the walk falls, with status 1") {
  const Scratch scratch;
  const std::string output = (scratch.path / "open").string();
  const CommandResult result = simulate(output, {"--control", "open"});
  CHECK(result.status == 1);
  const nlohmann::json summary = parseSummary(output);
  CHECK(summary["fell"] == true);
  CHECK(summary["fall_time"] == summary["duration"]);
  CHECK(summary["duration"].get<double>() < 2);
  CHECK(result.out.find("fell") != std::string::npos);
}

TEST_CASE("simulate: with real sensors a walk stands on flat and on uneven ground, and the estimate hardly drifts") {
  const Scratch scratch;
  const std::string output = (scratch.path / "real").string();
  for (const std::string terrain : {"flat", "tiles=0.003"})
    for (const std::string seed : {"1", "2"}) {
      CAPTURE(terrain, seed);
      const CommandResult result =
          simulate(output, {"--control", "gains", "--sensors", "real", "--terrain", terrain, "--seed", seed});
      CAPTURE(result.out, result.err);
      CHECK(result.status == 0);
      CHECK(result.out.find("estimated trunk") != std::string::npos);
      const nlohmann::json summary = parseSummary(output);
      CHECK(summary["sensors"] == "real");
      CHECK(summary["noise"] == 1);
      const nlohmann::json& estimator = summary["estimator"];
      CHECK(estimator["drift_share"].get<double>() < 0.01);
      CHECK(estimator["velocity_error"]["rms"].get<double>() < 0.03);
      CHECK(estimator["velocity_error"]["rms"].get<double>() > 1e-4);
      CHECK(estimator["position_error"]["max"].get<double>() < 0.01);
      CHECK(estimator["tilt_error"]["max"].get<double>() < 0.01);
      CHECK(estimator["contact_errors"].get<double>() < 0.05);
    }
}

TEST_CASE("simulate: the same command writes the same bytes; ground, robot, pushes and seeds matter") {
  const Scratch scratch;
  const auto record = [&](const std::string& name, std::vector<std::string> options,
                          const std::string& motion = getSquat()) {
    const std::string output = (scratch.path / name).string();
    if (std::find(options.begin(), options.end(), "--control") == options.end())
      options.insert(options.end(), {"--control", "gains"});
    options.insert(options.end(), {"--no-report"});
    const CommandResult result = simulate(output, options, motion);
    REQUIRE(result.status < 2);
    return readFile(output + "/trajectory.csv");
  };
  const std::string first = record("first", {});
  CHECK(record("again", {}) == first);
  CHECK(record("pushed", {"--push", "t=0.2,impulse=1,direction=90"}) != first);
  CHECK(record("icy", {"--friction", "0.1"}) != first);
  const std::string delayed = record("delayed", {"--delay", "2", "--jitter", "0.7"});
  CHECK(delayed != first);
  CHECK(record("delayed again", {"--delay", "2", "--jitter", "0.7"}) == delayed);
  CHECK(record("delayed otherwise", {"--delay", "2", "--jitter", "0.7", "--seed", "2"}) != delayed);
  const std::string felt = record("felt", {"--sensors", "real"});
  CHECK(felt != first);
  CHECK(record("felt again", {"--sensors", "real"}) == felt);
  CHECK(record("felt otherwise", {"--sensors", "real", "--seed", "2"}) != felt);
  CHECK(record("felt exactly", {"--sensors", "real", "--noise", "0"}) != felt);
  const std::string heavy = record("heavy", {"--mass-error", "0.02"});
  CHECK(heavy != first);
  CHECK(record("heavy again", {"--mass-error", "0.02"}) == heavy);
  CHECK(record("heavy otherwise", {"--mass-error", "0.02", "--seed", "2"}) != heavy);
  CHECK(record("crooked", {"--rod-error", "0.0002"}) != first);
  const auto predict = [&](const std::string& name, const std::string& threads) {
    return record(name, {"--control", "mpc", "--threads", threads, "--duration", "0.4"});
  };
  CHECK(predict("predicted", "1") == predict("predicted again", "2"));
  // Around the start every ground is level.
  const auto walk = [&](const std::string& terrain, const std::string& seed) {
    return record(terrain + seed, {"--terrain", terrain, "--seed", seed, "--duration", "0.9"}, getWalk());
  };
  const std::string tiles = walk("tiles=0.005", "1");
  CHECK(tiles != walk("flat", "1"));
  CHECK(tiles != walk("tiles=0.005", "2"));
}

TEST_CASE("simulate: a motion of least energy is carried out as such; one of least peak torque has no gains") {
  const Scratch scratch;
  const auto solve = [&](const std::string& objective) {
    const std::string directory = (scratch.path / objective).string();
    const CommandResult solved =
        runCommand({BIELLE_COMMAND, "solve",   "squat",          "--robot",      BIELLE_SOURCE_DIR "/robots/bipetto",
                    "--depth",      "0.9",     "--set",          "duration=0.6", "--set",
                    "settle=0.1",   "--set",   "time_step=0.02", "--objective",  objective,
                    "-o",           directory, "--quiet",        "--no-report",  "--no-check"});
    CAPTURE(solved.err);
    REQUIRE(solved.status == 0);
    return directory;
  };
  const auto simulate = [&](const std::string& directory, std::vector<std::string> options) {
    std::vector<std::string> arguments = {BIELLE_COMMAND, "simulate", directory, "-o", directory + "/carried-out"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return runCommand(arguments);
  };
  const auto getEnergy = [](const std::string& directory) {
    return parseSummary(directory)["electrical_energy"]["total_J"].get<double>();
  };
  const std::string least = solve("energy");
  REQUIRE(simulate(least, {"--control", "gains", "--hold", "0"}).status == 0);
  CHECK(parseSummary(least + "/carried-out")["objective"]["kind"] == "energy");
  CHECK(getEnergy(least + "/carried-out") == Approx(getEnergy(least)).epsilon(0.02));
  const std::string peak = solve("peak-torque");
  const CommandResult refused = simulate(peak, {});
  CHECK(refused.status == 2);
  CHECK_THAT(refused.err, Catch::Contains("peak-torque") && Catch::Contains("give --control open"));
  CHECK(simulate(peak, {"--control", "open"}).status < 2);
}

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
  CHECK(solves["parts"].size() == 6);
  for (const auto& part : solves["parts"]) {
    CHECK(part["median_ms"].get<double>() > 0);
    CHECK(part["p99_ms"].get<double>() >= part["median_ms"].get<double>());
  }
  CHECK(solves["step"]["median"].get<double>() <= 1);
  CHECK(solves["step"]["p1"].get<double>() > 0);
  CHECK(solves["regularization"]["median"].get<double>() > 0);
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

TEST_CASE("simulate: bad input is refused in one line, with status 2") {
  const Scratch scratch;
  const std::string output = (scratch.path / "bad").string();
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--push", "t=1,force=3"}, "force"},
      {{"--push", "t=-1,impulse=3"}, "--push"},
      {{"--push", "t=1,impulse=inf"}, "--push"},
      {{"--push", "t=1,impulse=nan"}, "--push"},
      {{"--push", ""}, "it has no impulse"},
      {{"--push", "t=1"}, "it has no impulse"},
      {{"--push", "t=1,impulse="}, "--push 'impulse='"},
      {{"--push", "t=1,impulse=2,impulse=3"}, "'impulse' is given twice"},
      {{"--push", "t=1,impulse=1e300,duration=1e-300"}, "its impulse is not within"},
      {{"--push", "t=1,impulse=1,duration=1e-300"}, "its duration is not within"},
      {{"--push", "t=1,impulse=1,direction=1e300"}, "its direction is not within"},
      {{"--rod-error", "0.1"}, "--rod-error"},
      {{"--terrain", "tiles=nan"}, "tiles"},
      {{"--speed", "0.3"}, "--speed"},
      {{"--terrain", "hills=3"}, "hills"},
      {{"--terrain", "moon"}, "moon"},
      {{"--delay", "1", "--jitter", "2"}, "--jitter"},
      {{"--real-time", "--control", "gains"}, "--real-time"},
      {{"--world", "moon"}, "moon"}};
  for (const auto& [options, named] : cases) {
    const CommandResult result = simulate(output, options);
    CAPTURE(named, result.err);
    CHECK(result.status == 2);
    CHECK(result.err.find(named) != std::string::npos);
  }
  for (const std::string number : {"friction", "duration", "hold", "time-step", "control-period", "record-period",
                                   "noise", "look-ahead", "mass-error", "rod-error", "delay", "jitter", "speed"})
    for (const std::string value : {"nan", "-nan", "inf", "-inf", "1e400", "1e300", "much"}) {
      const CommandResult result = simulate(output, {"--" + number, value, "--dry-run"});
      CAPTURE(number, value, result.err);
      if (number == "speed" && value == "1e300")
        continue;  // finite; without a robot there is nothing to compare it with
      CHECK(result.status == 2);
      CHECK_THAT(result.err, Catch::Contains("--" + number) && Catch::Contains("'" + value + "' is not a "));
      CHECK(result.err.size() < 200);
    }
  const CommandResult none = runCommand({BIELLE_COMMAND, "simulate", "/nowhere", "-o", output});
  CHECK(none.status == 2);
  CHECK(none.err.find("/nowhere") != std::string::npos);
}

}  // namespace bielle
