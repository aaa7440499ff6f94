// bielle dataset: many motions of robots, checked, in the formats of other programs, with an index.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "cli/case_run.h"
#include "cli/commands.h"
#include "cli/export.h"
#include "formats/companion.h"
#include "formats/text_file.h"
#include "model/payload.h"
#include "report/page.h"
#include "report/run.h"
#include "results/ground_json.h"
#include "results/motion_strip.h"
#include "tasks/dataset_index.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

using namespace bielle::tasks;

struct DatasetArguments {
  std::string spec, directory;
  TaskArguments tasks;
};

// The robots by the names of their bodies; those with a payload are written.
std::map<std::string, std::string> makeRobots(const DatasetSpec& spec, const std::string& directory) {
  std::map<std::string, std::string> robots;
  for (const DatasetMotion& motion : spec.motions) {
    const auto [it, is_new] = robots.emplace(motion.body, motion.robot);
    if (!is_new || !(motion.payload > 0)) continue;
    it->second = (fs::path(directory) / "robots" / motion.body).string();
    makeOutputDirectory(it->second);
    const LoadedRobot robot = loadRobot(motion.robot);
    writeRobot(addPayload(robot.model, {motion.payload, {}, {}}), it->second, "Written by `bielle dataset`.",
               robot.wear);
  }
  return robots;
}

// The files of a good motion, by format, in the directory of the format; the robot is there once.
void exportMotion(const DatasetSpec& spec, const std::string& directory, DatasetEntry& entry,
                  std::vector<std::string>& notes) {
  for (const std::string& format : spec.formats) {
    const fs::path place = fs::path(directory) / format;
    makeOutputDirectory(place.string());
    const char* extension = isReference(format) ? ".npz" : format == "problem" ? ".json" : ".mcap";
    const std::string name = format + "/" + entry.motion->name + extension;
    ExportRequest request{entry.result, format,    (fs::path(directory) / name).string(),
                          "",           spec.rate, spec.isaac_lab == 0 ? kIsaacLab : spec.isaac_lab};
    if (hasRobot(format)) request.robot = (place / (entry.motion->body + ".xml")).string();
    for (const std::string& warning : writeExport(request)) {
      // What the files of a robot leave out is the same for all of its motions.
      const std::string note = (format == "problem" ? entry.motion->body : entry.motion->name) + ": " + warning;
      if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
    }
    entry.files.emplace_back(format, name);
  }
}

std::string describeShortfall(const DatasetEntry& entry) {
  if (!entry.error.empty()) return entry.error;
  if (!entry.converged) return "the solver did not converge";
  if (!entry.passed) return "the check did not pass";
  if (entry.outcome == "fell") return "it fell in simulation";  // and so missed its goals
  if (entry.outcome == "not decided") return "it is not decided whether it stands";
  return entry.met ? "the simulation failed" : "a goal was missed";
}

// What the page shows of a motion (dataset.js).
Json describeForPage(const DatasetEntry& entry) {
  Json json = describeEntry(entry);
  json["shortfall"] = entry.is_good() ? "" : describeShortfall(entry);
  json["picture"] = "";
  if (!entry.result.empty()) {
    const ReportRun run = readRun(entry.result);
    json["picture"] = drawMotionStrip(run.robot.model, run.record, readGround(run.summary.at("ground")));
  }
  return json;
}

int run(const DatasetArguments& arguments) {
  const DatasetSpec spec = readDatasetSpec(arguments.spec);
  makeOutputDirectory(arguments.directory);
  requireCompanion("bielle-check");  // motions have to be checked
  const bool carries_out = std::any_of(spec.motions.begin(), spec.motions.end(),
                                       [](const DatasetMotion& motion) { return motion.carried_out; });
  const std::string log = arguments.directory + "/dry_run.log";
  const bool is_checked = checkDataset(spec, requireCompanion("bielle-complete"),
                                       carries_out ? requireCompanion("bielle-simulate") : "", log);
  fs::remove(log);
  if (!is_checked) {
    std::cerr << "bielle: error: interrupted; run the same command again to continue" << std::endl;
    return kFailed;
  }
  const std::map<std::string, std::string> robots = makeRobots(spec, arguments.directory);
  CaseRun cases{arguments.directory + "/motions", {}, {}, arguments.tasks};
  for (const DatasetMotion& motion : spec.motions)
    cases.cases.push_back(makeDatasetCase(motion, robots.at(motion.body)));
  for (const auto& [body, robot] : robots) cases.robots.push_back(loadRobot(robot).directory);
  return runAndWrite(cases, [&](const CaseOutcomes& outcomes) {
    std::vector<DatasetEntry> entries;
    Json shown = Json::array();
    std::vector<std::string> notes;
    if (spec.isaac_lab == 0 && std::any_of(spec.formats.begin(), spec.formats.end(), &isOfIsaacLab))
      notes.push_back(describeIsaacLab("isaac_lab:"));
    for (const DatasetMotion& motion : spec.motions) {
      entries.push_back(readDatasetEntry(motion, outcomes.at(motion.name), cases.directory + "/" + motion.name));
      DatasetEntry& entry = entries.back();
      for (const std::string& warning : entry.warnings) notes.push_back(motion.name + ": " + warning);
      if (entry.is_good())
        exportMotion(spec, arguments.directory, entry, notes);
      else
        notes.push_back(motion.name + ": " + describeShortfall(entry));
      shown.push_back(describeForPage(entry));
    }
    const auto good = std::count_if(entries.begin(), entries.end(), [](const DatasetEntry& e) { return e.is_good(); });
    std::cout << good << " of " << entries.size() << " motions are good\n";
    std::vector<std::string> paths = writeDatasetIndex(arguments.directory, spec, entries);
    paths.push_back(arguments.directory + "/index.html");
    writeTextFile(paths.back(), makeDatasetPage({{"title", fs::path(spec.path).stem().string()},
                                                 {"about", describeDataset(spec)},
                                                 {"motions", shown}}));
    printPaths(paths, notes);
  });
}

}  // namespace

void addDataset(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<DatasetArguments>();
  command.add_option("SPEC", arguments->spec, "YAML file: motions, robots, payloads, options, formats")->required();
  command
      .add_option(
          "-o,--output", arguments->directory,
          "directory for index.jsonl, index.html with pictures, README.md, a directory per format, and motions/; "
          "created if necessary")
      ->required();
  addTaskOptions(command, "motions at a time, each in its own process; results do not depend on it", arguments->tasks);
  command.footer(
      "SPEC: every combination of the values of an entry is one motion.\n"
      "  licence: CC-BY-4.0\n"
      "  formats: [mjlab, mcap]             (of `bielle export`: mjlab, amp, beyondmimic, mcap, problem; default: "
      "mjlab)\n"
      "  fps: 50\n"
      "  motions:\n"
      "    - solve: walk\n"
      "      robot: [bipetto, cleobot]      (names, or paths from this file)\n"
      "      payload: [0, 5]                (kg, fixed to the trunk)\n"
      "      set: {speed: [0.3, -0.3], steps: 4}\n"
      "      options: {dead-point-margin: 0.3}      (others of `bielle solve`)\n"
      "      simulate: {push: [\"t=1,impulse=5\"]}    (optional: carry it out, with options of `bielle simulate`)\n"
      "A motion is good if the solver converged, `bielle check` passes, all goals are met and, carried out, it "
      "stands;\n"
      "only good ones are exported, all are in the index. Finished motions are kept: after Ctrl-C, a crash or with "
      "more values in SPEC, the same\n"
      "command does what is missing.\n"
      "Exit status: 0 done, 1 interrupted or a program crashed, 2 bad input.\n"
      "Example:\n"
      "  bielle dataset walks.yaml -o walks");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
