// bielle-check: checks a motion from its files with Simbody. Where it misses a reader of robots, it becomes bielle-check-complete.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "bielle/model/error.h"
#include "check.h"
#include "formats/companion.h"
#include "formats/text_file.h"
#include "model/missing_part.h"
#include "results/failure_message.h"
#include "results/standard_output.h"

using namespace bielle;
using namespace bielle::validation;

namespace {

constexpr int kPasses = 0, kFails = 1, kBadInput = 2;

}  // namespace

int main(int argc, char** argv) {
  ignoreClosedPipes();
  CLI::App app{
      "Checks a result of `bielle solve` from its files alone: forces and energies with Simbody's dynamics, steps, "
      "loops, feet, friction, limits. Of a motion carried out or recorded, what is recorded is judged, and the rest "
      "informs. Exit status: 0 passed, 1 a check failed, 2 bad input."};
  app.failure_message(bielle::cli::describeFailure);
  app.name("bielle check");
  std::string directory;
  bool json = false, brief = false;
  app.add_option("DIR", directory, "directory with trajectory.npz and summary.json; check.json is written there")
      ->required();
  app.add_flag("--json", json, "print JSON instead of the table");
  app.add_flag("--brief", brief, "print one line and the rows that fail")->excludes("--json");
  app.footer("Example:\n  bielle solve squat --robot bipetto --depth 0.7 -o squat && bielle check squat");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kPasses : kBadInput;
  }
  try {
    const CheckedMotion motion = readMotion(directory);
    for (const std::string& warning : motion.warnings) std::cerr << "bielle: warning: " << warning << std::endl;
    const CheckReport report = checkMotion(motion);
    writeTextFile((std::filesystem::path(directory) / "check.json").string(), formatReport(report));
    if (json)
      std::cout << formatReport(report);
    else
      printReport(std::cout, report, brief ? CheckPrint::Failures : CheckPrint::All);
    finishStandardOutput();
    return report.passed() ? kPasses : kFails;
  } catch (const MissingPart&) {
    const std::string program = "bielle-check-complete", path = obtainCompanion(program);
    if (!path.empty()) execvp(path.c_str(), argv);
    std::cerr << "bielle: error: " << describeMissingCompanion(program) << std::endl;
  } catch (const InputError& error) {
    std::cerr << "bielle: error: " << error.what() << std::endl;
  } catch (const std::exception& error) {  // of Simbody, for a robot it does not support
    std::cerr << "bielle: error: " << directory << ": Simbody: " << error.what() << std::endl;
  }
  return kBadInput;
}
