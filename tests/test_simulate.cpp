// The command `bielle simulate`: what it writes, its exit statuses, and that it repeats itself to the byte.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "bielle/results/result.h"
#include "robot_directory.h"
#include "selection.h"
#include "simulate_trials.h"

namespace bielle {

namespace fs = std::filesystem;
using namespace testing;

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
  CHECK(summary["integration"]["integrator"] == "leapfrog");
  CHECK(summary["integration"]["longest_step_s"].get<double>() == Approx(2.5e-4));
  CHECK(summary["integration"]["tolerance"].is_null());
  CHECK(summary["warnings"].empty());
  // Of the whole, on the clock; world and control are parts of it.
  const nlohmann::json& seconds = summary["seconds"];
  const double whole = seconds["whole"], world = seconds["world"], control = seconds["control"];
  CHECK(summary["real_time_factor"].get<double>() == Approx(summary["duration"].get<double>() / whole));
  CHECK((world > 0 && control > 0 && world + control < whole));
  CHECK_THAT(result.out, Catch::Contains("times real time; world "));
  // Nothing is left of how the plan was solved.
  for (const char* of_solving : {"formulation", "step", "converged", "interrupted", "termination", "acceptable", "cost",
                                 "iterations", "solver_gap", "constraints", "free_timings", "log"})
    CHECK_FALSE(summary.contains(of_solving));
  const MotionRecord record = readRecord(output + "/trajectory.npz");
  CHECK(record.time[record.time.size() - 1] == Approx(summary["duration"].get<double>()));
  CHECK(record.q.allFinite());
}

TEST_CASE("simulate: the speed in steady steps is told beside that of the whole; pushes are told", "[long]") {
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
       {std::vector<std::string>{"simulate", output, "-o", again}, {"lift", output, "-o", again}}) {
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
  const CommandResult checked = runCommand({BIELLE_COMMAND, "check", output});
  INFO(checked.out << checked.err);
  CHECK(checked.status == 0);
  CHECK_THAT(checked.out, Catch::Contains("loops: gap") && !Catch::Contains("equations of motion"));
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
    CHECK(summary["maps"] == "library");
  }
  CHECK(simulate(output, {"--model", "gears"}).status == 2);
}

TEST_CASE("simulate: maps as firmware has them stand between a serial controller and the motors") {
  const Scratch scratch;
  const std::string output = (scratch.path / "generated").string();
  const CommandResult result =
      simulate(output, {"--model", "serial", "--maps", "generated", "--control", "gains", "--summary-only"});
  CAPTURE(result.out, result.err);
  CHECK(result.status <= 1);  // as with the library's
  CHECK_THAT(result.out, Catch::Contains("with model serial and generated maps"));
  const nlohmann::json summary = parseSummary(output), &counts = summary["map_counts"];
  CHECK(summary["maps"] == "generated");
  CHECK(counts["measured"].get<int>() > 1000);
  CHECK(counts["not_reached"] == 0);
  const auto refuse = [&](const std::vector<std::string>& options) {
    const CommandResult refused = simulate((scratch.path / "none").string(), options);
    CHECK(refused.status == 2);
    return refused.err;
  };
  CHECK_THAT(refuse({"--maps", "generated"}), Catch::Contains("--maps generated: the controller knows the robot with"));
  CHECK_THAT(refuse({"--maps", "generated", "--model", "closed", "--dry-run"}), Catch::Contains("give --model serial"));
  CHECK_FALSE(fs::exists(scratch.path / "none"));
  const CommandResult free = runCommand({BIELLE_COMMAND, "simulate", BIELLE_SOURCE_DIR "/robots/fourbar", "--maps",
                                         "generated", "-o", (scratch.path / "none").string()});
  CHECK(free.status == 2);
  CHECK_THAT(free.err, Catch::Contains("--maps") && Catch::Contains("moves freely"));
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

TEST_CASE("simulate: with real sensors a walk stands on flat and on uneven ground, and the estimate hardly drifts",
          "[long]") {
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

TEST_CASE("simulate: the same command writes the same bytes; ground, robot, pushes and seeds matter", "[long]") {
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

TEST_CASE("simulate: a motion of least energy is carried out as such; one of least peak torque has no gains",
          "[long]") {
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

TEST_CASE("simulate: options that others make useless are told, and periods that cannot be met") {
  const Scratch scratch;
  const std::string output = (scratch.path / "idle").string();
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--accuracy", "1e-6", "--world", "mujoco"}, "--accuracy has no effect: the steps of world mujoco"},
      {{"--nodes", "50", "--control", "gains"}, "--nodes has no effect: control is not predictive"},
      {{"--fine-nodes", "20", "--control", "open"}, "--fine-nodes has no effect"},
      {{"--iterations", "2", "--control", "gains"}, "--iterations has no effect"},
      {{"--nodes", "20", "--fine-nodes", "40"}, "--fine-nodes has no effect: all 20 --nodes are one stage long"},
      {{"--look-ahead", "20", "--control", "open"}, "--look-ahead has no effect: open control has no gains"},
      {{"--noise", "2"}, "--noise has no effect: ideal sensors have none"},
      {{"--hold", "2", "--duration", "3"}, "--hold has no effect: --duration ends the motion"},
      {{"--seed", "4", "--terrain", "ramp=0.1"}, "--seed has no effect: nothing is random"}};
  for (const auto& [options, told] : cases) {
    std::vector<std::string> checked = options;
    checked.push_back("--dry-run");
    const CommandResult result = simulate(output, checked);
    CAPTURE(told, result.err);
    if (result.err.find("there is no world") != std::string::npos) continue;
    CHECK(result.status == 0);
    CHECK_THAT(result.err, Catch::StartsWith("bielle: warning: ") && Catch::Contains(told));
  }
  for (const std::vector<std::string>& options : {std::vector<std::string>{"--nodes", "50"},
                                                  {"--nodes", "20"},
                                                  {"--accuracy", "1e-6"},
                                                  {"--hold", "2"},
                                                  {"--time-step", "0.001"},
                                                  {"--seed", "4", "--terrain", "tiles=0.01"},
                                                  {"--noise", "2", "--sensors", "real"}}) {
    std::vector<std::string> checked = options;
    checked.push_back("--dry-run");
    CHECK(simulate(output, checked).err.empty());
  }
  const CommandResult result = simulate(output, {"--control", "gains", "--duration", "0.1", "--summary-only",
                                                 "--time-step", "0.0007", "--record-period", "0.0015"});
  CAPTURE(result.err);
  REQUIRE(result.status == 0);
  for (const char* told :
       {"--time-step 0.0007: steps are of 0.0005 s at most", "--record-period 0.0015: rows are recorded every 0.002 s"})
    CHECK_THAT(result.err, Catch::Contains(told));
  const nlohmann::json summary = parseSummary(output);
  CHECK(summary["warnings"].size() == 1);
  CHECK(summary["integration"]["longest_step_s"].get<double>() == Approx(5e-4));  // half a period
  const CommandResult controlled = simulate(output, {"--control", "gains", "--duration", "0.02", "--summary-only",
                                                     "--time-step", "0.0007", "--accuracy", "1e-3"});
  CAPTURE(controlled.err);
  CHECK(controlled.err.empty());  // steps of controlled error are as long as they may be
  const CommandResult early = simulate(output, {"--duration", "0.02", "--summary-only", "--lead", "500"});
  CHECK_THAT(early.err, Catch::Contains("--lead has no effect: stages last "));
}

TEST_CASE(
    "simulate: what a push near the end leads to is what a longer simulation shows; one that is over later is "
    "refused",
    "[sweep]") {
  const Scratch scratch;
  const std::string output = (scratch.path / "pushed").string();
  int stood = 0, fell = 0;
  Selection selection(4);
  for (const double time : {0.9, 1.45, 1.7})
    for (const int impulse : {1, 3, 6, 12, 20}) {
      if (selection.isLeftOut()) continue;
      std::vector<std::string> options = {
          "--control", "gains", "--summary-only", "--push",
          "t=" + std::to_string(time) + ",impulse=" + std::to_string(impulse) + ",direction=0"};
      const int status = simulate(output, options, getSquat()).status;
      const nlohmann::json summary = parseSummary(output);
      options.insert(options.end(), {"--hold", "4"});
      CAPTURE(time, impulse, summary["outcome"].dump(), summary["duration"].dump());
      CHECK(simulate(output, options, getSquat()).status == status);
      CHECK(status == (summary["outcome"] == "stood" ? 0 : 1));
      CHECK(summary["extension"].get<double>() ==
            Approx(std::max(0.0, summary["duration"].get<double>() - 1.8)).margin(1e-9));
      (status == 0 ? stood : fell) += 1;
    }
  CHECK(5 * stood >= stood + fell);
  CHECK(5 * fell >= stood + fell);
  for (const auto& [options, remedy] :
       {std::pair<std::vector<std::string>, std::vector<std::string>>{{"--push", "t=1.75,impulse=1"},
                                                                      {"--hold", "2.05"}},
        {{"--push", "t=0.45,impulse=1", "--duration", "0.5"}, {"--duration", "1.55"}}}) {
    std::vector<std::string> all = options;
    all.insert(all.end(), {"--control", "gains", "--summary-only"});
    const CommandResult refused = simulate(output, all, getSquat());
    CAPTURE(refused.err);
    CHECK(refused.status == 2);
    CHECK_THAT(refused.err, Catch::Contains("the simulation ends at") && Catch::Contains(remedy[0] + " " + remedy[1]));
    all.insert(all.end(), remedy.begin(), remedy.end());
    if (remedy[0] == "--hold") CHECK(simulate(output, all, getSquat()).status == 0);
  }
}

TEST_CASE("simulate: the robot of the world alone may carry a load, or be another file of the same joints") {
  const Scratch scratch;
  const std::string output = (scratch.path / "loaded").string();
  const std::vector<std::string> usual = {"--control", "gains", "--duration", "0.05"};
  const auto carry = [&](std::vector<std::string> options) {
    options.insert(options.end(), usual.begin(), usual.end());
    const CommandResult result = simulate(output, options, getSquat());
    CAPTURE(result.out, result.err);
    REQUIRE(result.status == 0);
    return readRecord(output + "/trajectory.npz");
  };
  // What the ground carries, N.
  const auto weigh = [](const MotionRecord& record) {
    const Eigen::Index last = record.contact_wrenches.rows() - 1;
    return record.contact_wrenches(last, 2) + record.contact_wrenches(last, 8);
  };
  const MotionRecord bare = carry({});
  CHECK_FALSE(parseSummary(output).contains("payload"));
  const MotionRecord loaded = carry({"--payload", "3", "--at", "thigh_left,0.01,0.02,-0.03"});
  const nlohmann::json payload = parseSummary(output)["payload"];
  CHECK((payload["mass_kg"] == 3 && payload["link"] == "thigh_left"));
  CHECK(payload["at_m"] == std::vector<double>{0.01, 0.02, -0.03});
  CHECK(weigh(loaded) - weigh(bare) == Approx(3 * 9.81).epsilon(0.15));  // it sinks a little, for 0.05 s

  // A file of the robot with the same load on its trunk does the same; it is the robot of the result.
  const std::string heavy = (scratch.path / "heavy").string();
  REQUIRE(runCommand({BIELLE_COMMAND, "convert", BIELLE_SOURCE_DIR "/robots/bipetto", "--payload", "3", "--payload-at",
                      "0.05", "0", "0.1", "-o", heavy})
              .status == 0);
  const MotionRecord other = carry({"--robot", heavy}), same = carry({"--payload", "3", "--payload-at", "0.05,0,0.1"});
  CHECK(other.q.row(other.q.rows() - 1).isApprox(same.q.row(same.q.rows() - 1), 1e-6));
  CHECK_FALSE(other.q.row(other.q.rows() - 1).isApprox(bare.q.row(bare.q.rows() - 1), 1e-6));
  carry({"--robot", heavy});
  CHECK_THAT(parseSummary(output)["robot_file"].get<std::string>(), Catch::Contains("heavy"));

  for (const auto& [options, told] : std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>>{
           {{"--robot", BIELLE_SOURCE_DIR "/robots/cleobot"}, {"cleobot", "of the same joints, motors and contacts"}},
           {{"--robot", heavy, "--speed", "0.3"}, {"--speed", "a solved motion has its own"}},
           {{"--payload", "3", "--payload-at", "tail,0,0,0"}, {"link 'tail' does not exist", "name a link that moves"}},
           {{"--payload", "3", "--at", "0,0,0", "--payload-at", "0,0,0"}, {"--at", "excludes"}},
           {{"--payload", "3", "--payload-at", "0,0"}, {"--payload-at 0,0", "e.g. --payload-at trunk,0.15,0,0.1"}},
           {{"--payload", "3", "--payload-at", "0,x,0"}, {"--payload-at 0,x,0", "it is not a place"}}}) {
    const CommandResult refused = simulate(output, options, getSquat());
    CAPTURE(refused.err);
    CHECK(refused.status == 2);
    for (const std::string& word : told) CHECK_THAT(refused.err, Catch::Contains(word));
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
      {{"--solve-time", "5", "--control", "gains"}, "--solve-time"},
      {{"--time-step", "0.002"}, "it is longer than --control-period, 0.001 s"},
      {{"--time-step", "0.005", "--control-period", "0.004", "--dry-run"},
       "it is longer than --control-period, 0.004 s"},
      {{"--robot", "bipetto", "--set", "steps=4", "--set", "steps=6"}, "'steps' is given twice"},
      {{"--robot", "bipetto", "--speed", "0.4", "--set", "speed=0.5"}, "'speed' is given twice"},
      {{"--world", "moon"}, "moon"}};
  for (const auto& [options, named] : cases) {
    const CommandResult result = simulate(output, options);
    CAPTURE(named, result.err);
    CHECK(result.status == 2);
    CHECK(result.err.find(named) != std::string::npos);
  }
  for (const std::string number :
       {"friction", "duration", "hold", "time-step", "control-period", "record-period", "noise", "look-ahead",
        "mass-error", "rod-error", "delay", "jitter", "lead", "solve-time", "speed"})
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
