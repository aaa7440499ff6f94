// The command `bielle`.
#include <algorithm>
#include <exception>
#include <iostream>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "results/number_option.h"
#include "results/standard_output.h"

namespace {

int fail(std::string message, int status) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << "bielle: error: " << message << std::endl;
  return status;
}

std::string describeVersion() {
  const bielle::BuildInfo build = bielle::getBuildInfo();
  return "bielle " + build.bielle + " (Eigen " + build.eigen + ", " + build.compiler + ")";
}

// Explains an error of the command line; for a missing or unknown command, motion or robot it lists the known ones.
std::string describe(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
  const CLI::App* last = &app;
  while (!last->get_subcommands().empty()) last = last->get_subcommands().back();
  std::string known;
  for (const CLI::App* command : last->get_subcommands([](const CLI::App*) { return true; }))
    known += (known.empty() ? "" : ", ") + command->get_name();
  if (known.empty()) return std::string(error.what()) + "; see --help";
  const std::vector<std::string> unknown = app.remaining(true);
  const char* const* named = std::find_first_of(argv + 1, argv + argc, unknown.begin(), unknown.end());
  const bool is_name = named != argv + argc && **named != '-';
  return (is_name ? "there is no '" + std::string(*named) + "'" : error.what()) + "; choose one of: " + known;
}

int run(int argc, char** argv) {
  using namespace bielle::cli;
  setCommandLine(argc, argv);
  const std::string first = argc > 1 ? argv[1] : "";
  if (first == "validate" || first == "check" || first == "simulate")
    return becomeCompanion("bielle-" + first, argv + 1);

  CLI::App app{"Legged robots driven through linkages: dynamics, and motions by optimal control."};
  app.name("bielle");
  app.set_version_flag("--version", describeVersion());
  app.footer(
      "Examples:\n"
      "  bielle robots\n"
      "  bielle info bipetto\n"
      "  bielle solve squat --robot bipetto --depth 0.7 -o squat\n"
      "Each command has its own --help. Exit status: 0 done, 1 not converged or a failed check, 2 bad input.");
  Action action;
  addSolve(app, action);
  addReport(app, action);
  addView(app, action);
  addExport(app, action);
  addConvert(app, action);
  addAdopt(app, action);
  addInfo(app, action);
  addEval(app, action);
  addRobots(app, action);
  addGenerate(app, action);
  addDesign(app, action);
  addCompare(app, action);
  addRatio(app, action);
  addModes(app, action);
  addSynthesize(app, action);
  addLift(app, action);
  addCampaign(app, action);
  addDataset(app, action);
  addBench(app, action);
  addCompanions(app);
  bielle::requireFiniteNumbers(app);
  app.callback([&action] {
    if (!action) throw CLI::RequiredError("A command");
  });
  try {
    app.parse(argc, argv);
    return action();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return fail(describe(app, error, argc, argv), kBadInput);
  } catch (const bielle::InputError& error) {
    return fail(error.what(), kBadInput);
  } catch (const std::exception& error) {
    return fail(error.what(), kFailed);
  }
}

}  // namespace

int main(int argc, char** argv) {
  bielle::ignoreClosedPipes();
  const int status = run(argc, argv);
  try {
    bielle::finishStandardOutput();
  } catch (const bielle::InputError& error) {
    if (status == bielle::cli::kOk) return fail(error.what(), bielle::cli::kBadInput);
  }
  return status;
}
