// bielle campaign, run as a user runs it. Oracles: `bielle simulate`, run by itself.
#include <signal.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "robot_directory.h"
#include "run_command.h"
#include "tasks/campaign_command.h"
#include "tasks/campaign_report.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

const char* const kMotion =
    "{name: walk, solve: walk, robot: " BIELLE_SOURCE_DIR "/robots/bipetto, set: {speed: 0.4, steps: 2}}";

// Eight short runs.
std::string makeGrid() {
  return std::string("motions: [") + kMotion +
         "]\noptions:\n  control: gains\n  friction: [0.7, 0.1]\n  duration: 0.9\n"
         "push: {phase: 1.5, direction: [0, 90], impulse: [1, 60]}\n";
}

CommandResult runCampaign(const std::string& spec, const std::string& out, const std::string& jobs = "2") {
  return runCommand({BIELLE_COMMAND, "campaign", spec, "-o", out, "--jobs", jobs});
}

// Where a campaign finds its motion already solved.
std::string makeOutput(const RobotDirectory& directory) {
  static const RobotDirectory first;
  static const CommandResult solved =
      runCampaign(first.write("spec.yaml", std::string("motions: [") + kMotion + "]\noptions: {duration: 0.1}\n"),
                  first.path() + "/out");
  REQUIRE(solved.status == 0);
  const std::string out = directory.path() + "/out";
  fs::create_directories(out);
  fs::copy(first.path() + "/out/motions", out + "/motions", fs::copy_options::recursive);
  return out;
}

// The text of everything that a campaign writes but the log, whose order is that of arrival.
std::string readResults(const fs::path& out) {
  std::string text;
  for (const char* name : {"runs.csv", "campaign.md", "summary.json", "map.svg"}) text += readFile(out / name);
  return text;
}

// Runs that tasks under way have done.
int countDone(const fs::path& out) {
  int count = 0;
  for (const char* slot : {"0", "1"}) count += countLines(out / "running" / slot / "out/runs.jsonl");
  return count;
}

int countProgress(const CommandResult& result) {
  int count = 0;
  std::istringstream stream(result.err);
  for (std::string line; std::getline(stream, line);)
    count += line.rfind("[", 0) == 0 && line.find("--push") < line.size();
  return count;
}

tasks::CampaignRun makeRun(std::vector<std::string> values, bool stood) {
  tasks::CampaignRun run;
  run.values = std::move(values);
  run.result = {{"outcome", stood ? "stood" : "fell"}};
  return run;
}

}  // namespace

TEST_CASE("campaign: a grid of runs, the same bytes with one process or several, and what a run by itself gives") {
  const RobotDirectory directory;
  const std::string spec = directory.write("spec.yaml", makeGrid()), out = directory.path() + "/out";
  const CommandResult result = runCampaign(spec, out);
  CAPTURE(result.err);
  REQUIRE(result.status == 0);
  CHECK(countProgress(result) == 8);
  CHECK(countLines(out + "/runs.jsonl") == 9);
  const json summary = json::parse(readFile(out + "/summary.json"));
  CHECK(summary["runs"] == 8);
  CHECK(summary["outcomes"]["stood"].get<int>() + summary["outcomes"]["fell"].get<int>() == 8);
  CHECK(summary["axes"]["friction"]["0.7"]["stood"] > 0);
  CHECK(summary["axes"]["friction"]["0.7"]["runs"] == 4);
  CHECK(summary["axes"]["push impulse"]["60"]["stood"] == 0);
  CHECK_THAT(readFile(out + "/campaign.md"), Contains("| friction | stood | of |"));

  // A run by itself: phase 1 of the plan, the first step, lasts from 0.3 to 0.66 s.
  const std::string alone = directory.path() + "/alone";
  const CommandResult simulated =
      runCommand({BIELLE_COMMAND, "simulate", out + "/motions/walk/motion", "-o", alone, "--summary-only", "--control",
                  "gains", "--friction", "0.7", "--duration", "0.9", "--push", "t=0.48,direction=90,impulse=1"});
  REQUIRE(simulated.status < 2);
  const json one = json::parse(readFile(alone + "/summary.json"));
  std::istringstream log(readFile(out + "/runs.jsonl"));
  int found = 0;
  for (std::string line; std::getline(log, line);) {
    const json entry = json::parse(line);
    if (entry.value("run", "") !=
        "walk --control gains --friction 0.7 --duration 0.9 --push t=0.48,direction=90,impulse=1")
      continue;
    ++found;
    // It shared its steps with others, which rounds otherwise.
    for (const auto& [name, value] : entry["result"].items())
      if (value.is_number())
        CHECK(value.get<double>() == Approx(one[name].get<double>()).epsilon(1e-6).margin(1e-9));
      else
        CHECK(value == one[name]);
  }
  CHECK(found == 1);

  const std::string single = directory.path() + "/single";
  fs::create_directories(single);
  fs::copy(out + "/motions", single + "/motions", fs::copy_options::recursive);
  REQUIRE(runCampaign(spec, single, "1").status == 0);
  CHECK(readResults(single) == readResults(out));
  CHECK(countProgress(runCampaign(spec, out)) == 0);  // nothing is left to do
}

TEST_CASE("campaign: after an interruption only what is missing is done", "[long]") {
  const RobotDirectory directory;
  // A squat of 40 stages, whose gains are found at once; twelve runs in two tasks, six of which fall early.
  const std::string head = "motions: [{name: squat, solve: squat, robot: " BIELLE_SOURCE_DIR
                           "/robots/bipetto, set: {depth: 0.9, duration: 0.6, settle: 0.1, time_step: 0.02}}]\n";
  const std::string spec =
      directory.write("spec.yaml", head +
                                       "options: {control: gains, friction: [0.7, 0.1], duration: 8}\npush: "
                                       "{time: 0.3, direction: [0, 90, 180], impulse: [1, 60]}\n");
  const std::string out = directory.path() + "/out", log = out + "/runs.jsonl";
  {
    Command command({BIELLE_COMMAND, "campaign", spec, "-o", out, "--jobs", "2"});
    while (countDone(out) < 3) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    command.sendSignal(SIGINT);
    const CommandResult result = command.wait();
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains("interrupted"));
    CHECK_FALSE(fs::exists(out + "/runs.csv"));
    CHECK_FALSE(fs::exists(out + "/running"));
  }
  const int done = countLines(log) - 1;
  REQUIRE(done >= 3);
  REQUIRE(done < 12);
  std::ofstream(log, std::ios::app) << "{\"run\": \"squat --con";  // cut off by a crash
  const CommandResult rest = runCampaign(spec, out);
  REQUIRE(rest.status == 0);
  CHECK(countProgress(rest) == 12 - done);
  CHECK(countLines(log) == 13);
  // One of these runs: it is in the log, unless its motion changes.
  const std::string other = directory.write(
      "other.yaml",
      head + "options: {control: gains, friction: 0.7, duration: 8}\npush: {time: 0.3, direction: 0, impulse: 1}\n");
  CHECK(countProgress(runCampaign(other, out)) == 0);
  std::ofstream(out + "/motions/squat/motion/summary.json", std::ios::app) << "\n";
  CHECK(countProgress(runCampaign(other, out)) == 1);

  // A line that was changed by hand is named, whatever is wrong with it.
  const std::string whole = readFile(log);
  for (const auto& [from, to, problem] : std::vector<std::array<std::string, 3>>{
           {"\"outcome\":\"stood\"", "\"outcome\":5", "outcome is not text"},
           {"\"outcome\":\"stood\"", "\"outcome\":\"flew\"", "no outcome 'flew'"},
           {"\"energy_balance\":", "\"energy_balance\":\"?\",\"old\":", "energy_balance is not a number"},
           {"\"result\":", "\"results\":", "it has no entry 'result'"},
           {"\"run\":\"", "\"run\":3,\"old\":\"", "type must be string"},
           {"\"run\":\"", "\"run\":", "it is not JSON: parse error at line 1"}}) {
    std::string text = whole;
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    text.replace(at, from.size(), to);
    std::ofstream(log) << text;
    const CommandResult refused = runCampaign(spec, out);
    CAPTURE(to, refused.err);
    CHECK(refused.status == 2);
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    CHECK_THAT(refused.err, Contains("runs.jsonl: line " + std::to_string(line) + ": it was changed or damaged: ") &&
                                Contains(problem) && Contains("remove the line") && !Contains("json.exception"));
  }
}

TEST_CASE("campaign: dry runs stop at once when the user asks for it, and equal ones are done once", "[long]") {
  const RobotDirectory directory;
  const std::string out = directory.path() + "/out", squat = "{name: NAME, solve: squat, robot: bipetto}";
  std::string seeds = "1";
  std::string frictions = "0.1";
  for (int seed = 2; seed <= 3000; ++seed) {
    seeds += ", " + std::to_string(seed);
    frictions += ", 0." + std::to_string(seed) + "1";
  }
  const std::string spec = directory.write("spec.yaml", "motions: [" + squat + "]\noptions: {seed: [" + seeds + "]}\n");
  {
    Command command({BIELLE_COMMAND, "campaign", spec, "-o", out});
    while (!fs::exists(out + "/check.log")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const auto start = std::chrono::steady_clock::now();
    command.sendSignal(SIGINT);
    const CommandResult result = command.wait();
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(2));
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains("interrupted"));
    CHECK_FALSE(fs::exists(out + "/motions"));
    CHECK_FALSE(fs::exists(out + "/check.log"));
  }
  // What there would be too much of is refused before it is tried.
  const std::string large = directory.write(
      "large.yaml", "motions: [" + squat + "]\noptions: {seed: [" + seeds + "], friction: [" + frictions + "]}\n");
  const CommandResult refused = runCampaign(large, directory.path() + "/large");
  CHECK(refused.status == 2);
  CHECK_THAT(refused.err, Contains("more than a million combinations"));
  CHECK_FALSE(fs::exists(directory.path() + "/large"));

  // Motions and phases are not part of a dry run: of these 12 combinations two differ.
  const std::string calls = directory.path() + "/calls";
  const std::string program = directory.write("simulate", "#!/bin/sh\necho >> " + calls + "\n");
  fs::permissions(program, fs::perms::owner_all);
  const tasks::CampaignSpec few = tasks::readCampaignSpec(directory.write(
      "few.yaml", "motions: [" + replaceOnce(squat, "NAME", "a") + ", " + replaceOnce(squat, "NAME", "b") +
                      "]\noptions: {seed: [1, 2]}\npush: {phase: [0.5, 1.5, 2.5], impulse: 1}\n"));
  std::set<std::string> warnings;
  CHECK(tasks::checkCommands(few, "/bin/true", program, directory.path() + "/log", warnings));
  CHECK(countLines(calls) == 2);
}

TEST_CASE("campaign: the largest impulse that is survived, by bisection", "[long]") {
  const RobotDirectory directory;
  const std::string spec =
      directory.write("spec.yaml", std::string("motions: [") + kMotion +
                                       "]\noptions: {control: gains, duration: 1.2}\npush: {time: 0.4, direction: 90, "
                                       "largest_impulse: {up_to: 32, step: 1}}\n");
  const std::string out = makeOutput(directory);
  const CommandResult result = runCampaign(spec, out);
  CAPTURE(result.err);
  REQUIRE(result.status == 0);
  CHECK(countProgress(result) <= 6);
  const json found = json::parse(readFile(out + "/summary.json"))["largest_impulses"][0];
  CHECK(found["bounded"] == true);
  const int survived = found["survived_Ns"];
  REQUIRE(survived >= 1);
  REQUIRE(survived < 32);
  for (const int impulse : {survived, survived + 1})
    CHECK(runCommand({BIELLE_COMMAND, "simulate", out + "/motions/walk/motion", "-o", directory.path() + "/one",
                      "--summary-only", "--control", "gains", "--duration", "1.2", "--push",
                      "t=0.4,direction=90,impulse=" + std::to_string(impulse)})
              .status == (impulse > survived));
}

TEST_CASE("campaign: a specification that is wrong is refused with file, line, key and remedy, before anything runs") {
  const RobotDirectory directory;
  const std::string out = directory.path() + "/out", head = std::string("motions: [") + kMotion + "]\n";
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"motions: [nowhere]\n", {"motions", "(line 1)", "not a directory of a solved motion"}},
      {head + "frictions: [1]\n", {"key 'frictions' (line 2)", "known keys are"}},
      {head + "options:\n  world: bielle\n  frictoin: [0.5]\n", {"key 'frictoin' (line 4)", "--help"}},
      {head + "options:\n  friction: [0.5, -1]\n", {"key 'friction' (line 3)", "friction"}},
      {head + "options: {world: [bielle, moon]}\n", {"key 'world' (line 2)", "moon"}},
      {head + "options: {friction: [0.5, 0.5]}\n", {"friction", "given twice"}},
      {head + "options: {help: true}\n", {"key 'help' (line 2)", "would not execute anything"}},
      {head + "options: {dry-run: true}\n", {"key 'dry-run' (line 2)", "would not execute anything"}},
      {head + "options: {robot: no_such_robot}\n", {"key 'robot' (line 2)", "no_such_robot"}},
      {head + "options: {robot: rsu_biped}\n", {"key 'robot' (line 2)", "other joints, motors or contacts"}},
      {head + "options: {live: true}\n", {"key 'live' (line 2)", "summary-only"}},
      {head + "options: {push: t=1}\n", {"key 'push' (line 2)", "next to `options`"}},
      {head + "options: {play: nothing=0.1}\n", {"key 'play' (line 2)", "no such joint or closure"}},
      {head + "options: {payload: 1, payload-at: 'nolink,0,0,0'}\n", {"key 'payload-at' (line 2)", "'nolink'"}},
      {head + "options: {state: some.json}\n", {"key 'state' (line 2)", "a motion has its own start"}},
      {head + "options: {speed: 0.3}\n", {"key 'speed' (line 2)", "a solved motion has its own"}},
      {head + "options: {real-time: 3}\n", {"key 'real-time' (line 2)", "not expected"}},
      {head + "push: {time: 1, phase: 1, impulse: 1}\n", {"key 'push' (line 2)", "give one of them"}},
      {head + "push: {time: soon, impulse: 1}\n", {"key 'time' (line 2)", "not a number"}},
      {head + "push: {time: -1, impulse: 1}\n", {"key 'time' (line 2)", "its time is not within"}},
      {head + "push: {time: 1, direction: 1e6, impulse: 1}\n", {"key 'direction' (line 2)", "degrees"}},
      {head + "push: {time: 1, largest_impulse: {up_to: 1, step: 2}}\n", {"(line 2)", "up_to"}},
      {"motions: [{name: w, solve: wakl, robot: bipetto}]\n", {"wakl"}},
      {"motions: [{name: w, solve: walk, robot: bipetto, set: {sped: 1}}]\n", {"sped"}},
      {"motions: [{name: w, solve: walk, robot: bipetto, options: {set: 1}}]\n", {"key 'set' (line 1)", "next to"}},
      {"motions: [{name: w, solve: walk, robot: bipetto, options: {max-iteratoins: 1}}]\n",
       {"key 'max-iteratoins' (line 1)", "`bielle solve walk` rejects it", "--help"}},
      {"motions: [{name: w, solve: walk, robot: bipetto, options: {help: true}}]\n",
       {"key 'help' (line 1)", "remove"}}};
  for (const auto& [text, words] : cases) {
    const CommandResult result = runCampaign(directory.write("spec.yaml", text), out);
    CAPTURE(text, result.err);
    CHECK(result.status == 2);
    for (const std::string& word : words) CHECK_THAT(result.err, Contains(word));
    CHECK_THAT(result.err, !Contains("see --help;"));  // a remedy for another remedy
    CHECK_FALSE(fs::exists(out + "/runs.jsonl"));
    CHECK_FALSE(fs::exists(out + "/motions"));
  }
}

TEST_CASE("campaign: pushes that are not over when their motions end are told before these are solved") {
  const RobotDirectory directory;
  const std::string out = directory.path() + "/out",
                    squat = "solve: squat, robot: " BIELLE_SOURCE_DIR "/robots/bipetto",
                    head = "motions:\n  - {name: short, " + squat + ", set: {duration: 0.6}}\n",
                    longer = head + "  - {name: long, " + squat + ", set: {duration: 3}}\n";
  const fs::path programs = fs::path(BIELLE_COMMAND).parent_path();
  std::set<std::string> warnings;
  const auto check =
      [&](const std::string& text) {  // a squat stands for 0.3 s before and after, and a simulation holds for 1 s
        const tasks::CampaignSpec spec = tasks::readCampaignSpec(directory.write("spec.yaml", text));
        warnings.clear();
        return tasks::checkCommands(spec, (programs / "bielle-complete").string(),
                                    (programs / "bielle-simulate").string(), directory.path() + "/log", warnings);
      };
  const auto refuses = [&](const std::string& text, const std::string& message) {
    CAPTURE(text);
    CHECK_THROWS_WITH(check(text), Contains(message) && Contains("spec.yaml"));
  };
  CHECK(check(head + "push: {time: [0.3, 2.1], impulse: 1}\n"));
  CHECK(warnings.empty());
  refuses(head + "push: {time: [0.3, 2.11], impulse: 1}\n",
          "key 'time' (line 3): a push at 2.11 s is over at 2.21 s, but");
  refuses(head + "push: {time: [0.3, 2.11], impulse: 1}\n", "give an earlier time, or `options: {hold: 3}`");
  CHECK(check(head + "push: {time: [0.3, 2.11], impulse: 1}\noptions: {hold: 3}\n"));
  CHECK(check(head + "push: {time: [0.3, 2.11], duration: 0.05, impulse: 1}\n"));
  refuses(head + "push: {time: 1.5, impulse: 1}\noptions: {duration: 1.2}\n", "`options: {duration: 3}`");
  CHECK(check(head + "push: {time: 1.5, impulse: 1}\noptions: {duration: 3}\n"));
  // One motion is long enough.
  CHECK(check(longer + "push: {time: 2.11, impulse: 1}\n"));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(*warnings.begin(), Contains("motion short: a push at 2.11 s") && Contains("these runs are refused"));
  refuses(longer + "push: {time: 5, impulse: 1}\n", "the simulations end at 4.6 s");
  refuses(head + "push: {phase: 99, impulse: 1}\n", "key 'phase' (line 3): motion short has no phase 99");
  // Cycles go on.
  CHECK(check("motions: [{name: w, solve: walk, robot: " BIELLE_SOURCE_DIR
              "/robots/bipetto, options: {periodic: true}}]\npush: {time: 90, impulse: 1}\n"));
  // That is what the program says of a motion that is solved.
  const CommandResult late = runCampaign(directory.write("late.yaml", head + "push: {time: 2.11, impulse: 1}\n"), out);
  CHECK(late.status == 2);
  CHECK_FALSE(fs::exists(out + "/motions"));
  const std::string solved = directory.path() + "/solved";
  REQUIRE(runCommand({BIELLE_COMMAND, "solve", "squat", "--robot", BIELLE_SOURCE_DIR "/robots/bipetto", "--set",
                      "duration=0.6", "--quiet", "--no-report", "--no-check", "-o", solved})
              .status == 0);
  const auto push = [&](const std::string& time) {
    return runCommand({BIELLE_COMMAND, "simulate", solved, "-o", directory.path() + "/one", "--summary-only",
                       "--control", "gains", "--push", "impulse=1,t=" + time})
        .status;
  };
  CHECK(push("2.1") == 0);
  CHECK(push("2.11") == 2);
  refuses("motions: [solved]\npush: {time: 2.11, impulse: 1}\n", "a push at 2.11 s is over at 2.21 s");
}

TEST_CASE("campaign: options without effect on some of its runs are told once, before anything runs") {
  const RobotDirectory directory;
  const std::string path =
      directory.write("spec.yaml", std::string("motions: [") + kMotion +
                                       "]\noptions: {control: [gains, mpc], nodes: 50, seed: [1, 2]}\n");
  std::set<std::string> warnings;
  const fs::path programs = fs::path(BIELLE_COMMAND).parent_path();
  const std::string bielle = (programs / "bielle-complete").string(),
                    simulate = (programs / "bielle-simulate").string();
  REQUIRE(tasks::checkCommands(tasks::readCampaignSpec(path), bielle, simulate, directory.path() + "/log", warnings));
  CHECK(warnings == std::set<std::string>{"warning: --nodes has no effect: control is not predictive",
                                          "warning: --seed has no effect: nothing is random"});
}

TEST_CASE("campaign: the specifications of the examples are read") {
  const std::vector<std::pair<std::string, size_t>> examples{{"pushes", 32},      {"pushes_predictive", 80},
                                                             {"pushes_felt", 80}, {"solve_times", 1600},
                                                             {"unknown", 160},    {"worlds", 198}};
  for (const auto& [name, expected] : examples) {
    const tasks::CampaignSpec spec = tasks::readCampaignSpec(BIELLE_SOURCE_DIR "/examples/campaign/" + name + ".yaml");
    CHECK(spec.search.has_value() == (name == "pushes"));
    size_t combinations = 1;
    for (const tasks::CampaignAxis& axis : spec.axes) combinations *= axis.values.size();
    CHECK(combinations == expected);
  }
}

TEST_CASE("campaign: motions are solved with the options that they are given") {
  const RobotDirectory directory;
  const std::string spec = directory.write(
      "spec.yaml",
      std::string("motions:\n  - {name: w, solve: walk, robot: bipetto, set: {steps: 2}, options: {no-limits: "
                  "true, no-check: false, dead-point-margin: 0.25}}\n"));
  const std::vector<tasks::CampaignMotion> motions = tasks::readCampaignSpec(spec).motions;
  REQUIRE(motions.size() == 1);
  CHECK(motions[0].solve == std::vector<std::string>{"solve", "walk", "--robot", "bipetto", "--set", "steps=2",
                                                     "--no-limits", "--dead-point-margin", "0.25"});

  // That such a motion misses its goal is told.
  const std::string shallow =
      directory.write("shallow.yaml",
                      "motions:\n  - {name: low, solve: squat, robot: bipetto, set: {depth: 0.6, duration: 0.6, "
                      "time_step: 0.03, com_weight: 1e-3}}\noptions: {duration: 0.1}\n");
  const CommandResult result = runCampaign(shallow, directory.path() + "/out");
  CHECK(result.status == 0);
  CHECK_THAT(result.err, Contains("warning: motion low: depth: requested 0.6, achieved"));
}

TEST_CASE("campaign: an impulse counts as survived if all smaller ones were") {
  tasks::CampaignResults results;
  results.columns = {"motion", "push direction", "push impulse"};
  for (const auto& [direction, impulse, stood] :
       std::vector<std::tuple<const char*, const char*, bool>>{{"0", "10", true},
                                                               {"0", "2", true},
                                                               {"90", "1", true},
                                                               {"90", "2", false},
                                                               {"90", "3", true},
                                                               {"180", "1", false}})
    results.runs.push_back(makeRun({"walk", direction, impulse}, stood));
  const std::vector<tasks::SurvivedImpulse> found = findSurvivedImpulses(results);
  REQUIRE(found.size() == 3);
  CHECK(found[0].impulse == 10);
  CHECK_FALSE(found[0].bounded);
  CHECK(found[1].impulse == 1);
  CHECK(found[1].bounded);
  CHECK(found[2].impulse == 0);
  CHECK(found[2].bounded);
}

TEST_CASE(
    "campaign: where instants of a push and a condition vary, the map shows the condition's means over the instants") {
  const RobotDirectory directory;
  tasks::CampaignResults results;
  results.columns = {"delay", "push time", "push direction", "push impulse"};
  const auto draw = [&](const std::vector<std::string>& delays) {
    results.runs.clear();
    for (const std::string& delay : delays)
      for (const std::string time : {"1", "2"})
        for (const std::string direction : {"0", "120", "240"})
          for (const std::string impulse : {"4", "8"})
            results.runs.push_back(makeRun({delay, time, direction, impulse}, time == "2" || impulse == "4"));
    std::vector<std::string> notes;
    writeCampaign(directory.path(), results, notes);
    CHECK(notes.empty());
    return readFile(directory.path() + "/map.svg");
  };
  const std::string both = draw({"5", "10"}), alone = draw({"5"});
  CHECK_THAT(both,
             Contains("by direction and delay, mean of all instants") && Contains(">10<") && !Contains(">10, 1<"));
  CHECK_THAT(alone, !Contains("mean of all instants") && Contains(">2<"));
  // The table has every instant.
  draw({"5", "10"});
  CHECK_THAT(readFile(directory.path() + "/campaign.md"),
             Contains("| 10 | 1 | 4 | 4 | 4 |") && Contains("| 10 | 2 | ≥ 8 |"));
}
