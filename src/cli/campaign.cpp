// bielle campaign: motions carried out again and again, under many conditions.
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/case_run.h"
#include "cli/commands.h"
#include "cli/task_options.h"
#include "formats/companion.h"
#include "results/output_place.h"
#include "tasks/campaign_report.h"

namespace bielle::cli {
namespace {

using namespace bielle::tasks;

struct CampaignArguments {
  std::string spec, directory;
  TaskArguments tasks;
};

int run(const CampaignArguments& arguments) {
  const CampaignSpec spec = readCampaignSpec(arguments.spec);
  for (const CampaignMotion& motion : spec.motions) requireApart(arguments.directory, {motion.directory});
  for (const CampaignMotion& motion : spec.motions)
    if (motion.solve.empty()) printWarnings(loadRobotOf(motion.directory).warnings);
  CampaignOptions options;
  options.bielle = requireCompanion("bielle-complete");
  options.simulate = requireCompanion("bielle-simulate");
  auto engine = makeTaskEngine(arguments.tasks);
  options.engine = engine.get();
  options.progress = [](const std::string& line) { std::cerr << line << std::endl; };
  const CampaignResults results = runCampaign(spec, arguments.directory, options);
  engine.reset();  // signals have their usual effect again
  if (results.interrupted) {
    std::cerr << "bielle: error: interrupted; run the same command again to continue" << std::endl;
    return kFailed;
  }
  std::vector<std::string> notes;
  printPaths(writeCampaign(arguments.directory, results, notes), notes);
  if (!results.complete) std::cerr << "bielle: error: some runs failed; run the same command again to retry them\n";
  const auto isRefused = [](const CampaignRun& run) { return run.result.at("outcome") == kRefused; };
  const bool is_refused = !results.runs.empty() && std::all_of(results.runs.begin(), results.runs.end(), isRefused);
  if (is_refused)
    std::cerr << "bielle: error: all runs were refused, the first one: "
              << results.runs.front().result.at("outcome_message").get<std::string>() << "\n";
  return results.complete && !is_refused ? kOk : kFailed;
}

}  // namespace

void addCampaign(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<CampaignArguments>();
  command.add_option("SPEC", arguments->spec, "YAML file: motions, options of `bielle simulate`, pushes")->required();
  command
      .add_option(
          "-o,--output", arguments->directory,
          "directory for runs.csv, campaign.md, summary.json, map.svg and the log runs.jsonl; created if necessary")
      ->required();
  addTaskOptions(
      command,
      "processes at a time, each with a run or with several that are stepped together; except in real time, results "
      "do not depend on it",
      arguments->tasks);
  command.footer(
      "SPEC: every combination of the values is one run of `bielle simulate`.\n"
      "  motions:\n"
      "    - walk                     (directory of a solved motion, from this file)\n"
      "    - {name: quick, solve: walk, robot: bipetto, set: {speed: 0.6}}     (solved first, once;\n"
      "                               further keys of the map, options: {dead-point-margin: 0.3}: of `bielle solve`)\n"
      "  options:                     (any of `bielle simulate`; true: an option without a value)\n"
      "    world: [bielle, mujoco]\n"
      "    friction: [0.5, 0.7]\n"
      "  push:\n"
      "    time: [1.5, 1.7]           (s; or `phase: [3.5]`: half of phase 3 of the plan, counted from 0)\n"
      "    direction: [0, 90, 180, 270]\n"
      "    duration: 0.1\n"
      "    impulse: [1, 2, 3]         (N s; or `largest_impulse: {up_to: 8, step: 0.25}`: by bisection)\n"
      "Runs that are in the log are not done again: after Ctrl-C, a crash or with more values in SPEC, the same "
      "command\n"
      "does what is missing. A robot that falls is a result.\n"
      "Exit status: 0 done, 1 interrupted or a run failed, 2 bad input.\n"
      "Example:\n"
      "  bielle campaign pushes.yaml -o pushes");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
