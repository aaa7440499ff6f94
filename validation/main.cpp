// bielle-validate: robots against Simbody and MuJoCo.
#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bielle/model/error.h"
#include "results/failure_message.h"
#include "results/number_option.h"
#include "results/standard_output.h"
#include "validate.h"
#ifdef BIELLE_WITH_MUJOCO
#include "bielle/robots/robot_loader.h"
#include "validate_mujoco.h"
#endif

using namespace bielle;
using namespace bielle::validation;

namespace {

constexpr int kAgrees = 0, kDisagrees = 1, kBadInput = 2;

nlohmann::json toJson(const ValidationReport& report) {
  nlohmann::json rows = nlohmann::json::array();
  for (const ValidationRow& row : report.rows)
    rows.push_back({{"quantity", row.quantity},
                    {"difference", row.difference},
                    {"tolerance", row.tolerance},
                    {"samples", row.samples},
                    {"passed", row.passed()}});
  return {{"robot", report.robot},
          {"engine", report.engine},
          {"passed", report.passed()},
          {"states", report.states},
          {"redundant_states", report.redundant_states},
          {"failure", report.failure},
          {"rows", rows}};
}

ValidationReport validate([[maybe_unused]] const std::string& engine, const Model& model,
                          const ValidationOptions& options) {
#ifdef BIELLE_WITH_MUJOCO
  if (engine == "mujoco") return validateByMujoco(model, options);
#endif
  return validateRobot(model, options);
}

}  // namespace

int main(int argc, char** argv) {
  ignoreClosedPipes();
  CLI::App app{
      "Compares the dynamics of robots with Simbody's or MuJoCo's at random closed states. Exit status: 0 all agree, 1 "
      "a row failed, 2 bad input."};
  app.failure_message(bielle::cli::describeFailure);
  app.name("bielle validate");
  std::vector<std::string> robots;
  ValidationOptions options;
  std::string base, engine = "simbody";
  bool json = false;
  app.add_option("ROBOT", robots, "names, directories or .urdf files; default: all robots known by name");
  app.add_option("--samples", options.samples, "number of random states per robot")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "seed of the random states")->capture_default_str();
  app.add_option("--tolerance", options.tolerance, "relative difference allowed")
      ->check(isPositive())
      ->capture_default_str();
  app.add_option("--derivatives", options.derivative_samples, "number of states whose derivatives are compared")
      ->check(isNotNegative())
      ->capture_default_str();
  app.add_option("--motion", options.motion_duration,
                 "duration of a free motion integrated by both programs [s]; 0: none")
      ->check(isWithin(0, 60))
      ->capture_default_str();
  app.add_option("--motion-step", options.motion_step,
                 "time step of Bielle's integrator for it [s]; fast mechanisms need less")
      ->check(isWithin(1e-6, 0.1))
      ->capture_default_str();
  app.add_option("--base", base, "base to use instead of the robot's own")->check(CLI::IsMember({"free", "fixed"}));
  std::vector<std::string> engines = {"simbody"};
#ifdef BIELLE_WITH_MUJOCO
  engines.push_back("mujoco");
#endif
  app.add_option("--engine", engine,
                 "simbody: every quantity; mujoco: mass matrix, bias and accelerations (its closures are soft)")
      ->check(CLI::IsMember(engines))
      ->capture_default_str();
  app.add_flag("--json", json, "print JSON instead of tables");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kAgrees : kBadInput;
  }
  if (robots.empty()) robots = listRobots();
  if (robots.empty()) {
    std::cerr << "bielle-validate: no robot is known by name; give a directory or a .urdf file\n";
    return kBadInput;
  }
  LoadOptions load;
  if (!base.empty()) load.base = base == "free" ? BaseKind::Free : BaseKind::Fixed;
  bool passed = true;
  nlohmann::json reports = nlohmann::json::array();
  try {
    for (const std::string& robot : robots) {
      const ValidationReport report = validate(engine, loadRobot(robot, load).model, options);
      passed = passed && report.passed();
      if (json)
        reports.push_back(toJson(report));
      else
        printReport(std::cout, report);
    }
    if (json) std::cout << nlohmann::json{{"passed", passed}, {"robots", reports}}.dump(2) << "\n";
    finishStandardOutput();
  } catch (const InputError& error) {
    std::cerr << "bielle-validate: " << error.what() << "\n";
    return kBadInput;
  }
  return passed ? kAgrees : kDisagrees;
}
