// bielle compare, run as a user runs it. Oracles: the results of its cases, read by themselves.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "read_table.h"
#include "robot_directory.h"
#include "run_command.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;

namespace {

const char* const kSpec = R"(robots:
  reference: {robot: bipetto}
  ankles: {generator: rsu_biped, set: {trunk_mass: 5}}
mass: 26
motions:
  - {motion: squat, set: {depth: 0.95, duration: 0.6, settle: 0.06, time_step: 0.03}}
speeds: {motion: squat, option: depth, from: 0.9, to: 0.95, step: 0.05, set: {duration: 0.6, settle: 0.06, time_step: 0.03}}
groups: {hips: [hip], knees and ankles: [knee, ankle]}
drives: {motor_constant: 1.5, regeneration: 1}
)";

// Sums over the stages of one result, with all given back: the power at the terminals itself.
struct Sums {
  double peak_hips = 0, peak = 0, squares = 0, electrical = 0, duration = 0;
};

Sums addUp(const MotionRecord& record) {
  Sums sums;
  for (int k = 0; k < record.u.rows(); ++k) {
    const double h = record.time[k + 1] - record.time[k];
    sums.duration += h;
    for (size_t m = 0; m < record.u_names.size(); ++m) {
      const auto column = std::find(record.v_names.begin(), record.v_names.end(), record.u_names[m]);
      REQUIRE(column != record.v_names.end());
      const double u = record.u(k, m), v = record.v_mid(k, column - record.v_names.begin());
      if (record.u_names[m].find("hip") != std::string::npos) sums.peak_hips = std::max(sums.peak_hips, std::abs(u));
      sums.peak = std::max(sums.peak, std::abs(u));
      sums.squares += h * u * u / static_cast<double>(record.u_names.size());
      sums.electrical += h * (u * v + u * u / 2.25);
    }
  }
  return sums;
}

}  // namespace

TEST_CASE("compare: same mass, same motion, numbers of the cases, and only what is missing is done again") {
  const RobotDirectory directory;
  const std::string spec = directory.write("spec.yaml", kSpec), out = directory.path() + "/out";
  const std::vector<std::string> command = {BIELLE_COMMAND, "compare", spec, "-o", out, "--jobs", "2"};
  const CommandResult first = runCommand(command);
  INFO(first.err);
  REQUIRE(first.status == 0);
  CHECK_THAT(first.out, Contains("[4/4]"));

  for (const char* name : {"reference", "ankles"}) {
    const Model model = loadRobot(out + "/robots/" + name).model;
    CHECK(model.mass() == Approx(26).epsilon(1e-9));
  }
  const std::vector<std::map<std::string, std::string>> rows = readTable(out + "/compare.csv");
  REQUIRE(rows.size() == 6);
  for (auto row : rows) {
    const std::string name = row["robot"] + "-" + row["motion"];
    CAPTURE(name);
    const Sums sums = addUp(readRecord(out + "/cases/" + name + "/motion/trajectory.npz"));
    CHECK(std::stod(row["hips peak_Nm"]) == Approx(sums.peak_hips).epsilon(1e-7));
    CHECK(std::stod(row["all peak_Nm"]) == Approx(sums.peak).epsilon(1e-7));
    CHECK(std::stod(row["all rms_Nm"]) == Approx(std::sqrt(sums.squares / sums.duration)).epsilon(1e-7));
    CHECK(std::stod(row["electrical_energy_J"]) == Approx(sums.electrical).epsilon(1e-7));
    CHECK(row["cost_of_transport"].empty());  // it stays where it is
  }
  const std::string page = readFile(out + "/compare.md");
  CHECK_THAT(page, Contains("| mass [kg] | 26.000 | 26.000 |"));
  CHECK_THAT(page, Contains("largest that passes"));

  // One case lost: the others are kept, and the page is the same.
  fs::remove_all(out + "/cases/ankles-squat-depth-0.9-duration-0.6-settle-0.06-time_step-0.03");
  const CommandResult second = runCommand(command);
  CHECK(second.status == 0);
  const std::string& text = second.out;
  size_t kept = 0;
  for (size_t at = text.find(": kept"); at != std::string::npos; at = text.find(": kept", at + 1)) ++kept;
  CHECK(kept == 3);
  CHECK(readFile(out + "/compare.md") == page);
}

TEST_CASE(
    "compare: energies of the robots' own windings and gears are those of `bielle solve`, and missed goals are told") {
  const RobotDirectory directory;
  const std::string driven = directory.path() + "/driven";
  REQUIRE(runCommand({BIELLE_COMMAND, "convert", "bipetto", "-o", driven}).status == 0);
  directory.write("driven/driven.yaml",
                  replaceOnce(readFile(driven + "/driven.yaml"), "motor_knee_left: {armature: 0.001}",
                              "motor_knee_left: {type: ak80-9, efficiency: 0.8}"));
  const std::string spec = directory.write("spec.yaml", R"(robots: {driven: {robot: ./driven}, plain: {robot: bipetto}}
motions:
  - {motion: squat, set: {depth: 0.95, duration: 0.6, settle: 0.06, time_step: 0.03}}
  - {motion: squat, set: {depth: 0.6, duration: 0.6, settle: 0.06, time_step: 0.03, com_weight: 1e-3}}
)");
  const std::string out = directory.path() + "/out";
  const CommandResult result = runCommand({BIELLE_COMMAND, "compare", spec, "-o", out, "--jobs", "2"});
  INFO(result.err);
  REQUIRE(result.status == 0);
  for (auto row : readTable(out + "/compare.csv")) {
    const std::string name = row["robot"] + "-" + row["motion"];
    CAPTURE(name, row["outcome"]);
    const auto summary = nlohmann::json::parse(readFile(out + "/cases/" + name + "/motion/summary.json"));
    const double energy = summary["electrical_energy"]["total_J"];
    CHECK(std::stod(row["electrical_energy_J"]) == Approx(energy).epsilon(1e-7));
    CHECK(summary["electrical_energy"]["motors_of_assumed_loss"] == (row["robot"] == "driven" ? 11 : 12));
    if (row["motion"].find("depth-0.6") == std::string::npos) continue;
    CHECK_THAT(row["outcome"], Contains("depth: requested 0.6, achieved") && Contains("missed"));
  }
  const std::string page = readFile(out + "/compare.md");
  CHECK_THAT(page, Contains("K_m by its winding, or 2.00 N m/sqrt(W) where that is not known") &&
                       Contains("| motors of unknown winding | 11 | 12 |") && Contains("missed (tolerance"));
}

TEST_CASE("compare: errors are reported with their places and remedies") {
  const RobotDirectory directory;
  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    const std::string spec = directory.write("spec.yaml", replaceOnce(kSpec, from, to));
    const CommandResult result = runCommand({BIELLE_COMMAND, "compare", spec, "-o", directory.path() + "/out"});
    CAPTURE(to, result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains(problem));
  };
  check("robots:", "robot:", "it is unknown");
  check("robot: bipetto", "robot: bipeto", "bipeto");
  check("generator: rsu_biped", "generator: rsu_bipeds", "rsu_bipeds");
  check("trunk_mass: 5", "trunk: 5", "trunk");
  check("mass: 26", "mass: 10", "its mass without the trunk");
  check("mass: 26", "mass: -1", "not positive");
  check("step: 0.05", "step: 0", "steps");
  check("motor_constant: 1.5", "motor_constant: 0", "not positive");
  check("regeneration: 1", "regeneration: 2", "0 .. 1");
  check("reference:", "../reference:", "cannot be the name");
  check("[hip]", "[hipp]",
        "key 'groups': key 'hips' (line 8): no motor has 'hipp' in its name; the motors are hipz_left");
}
