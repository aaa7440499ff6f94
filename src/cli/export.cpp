// bielle export: a trajectory in the format of another program.
#include <filesystem>
#include <iostream>
#include <memory>

#include "bielle/results/result.h"
#include "cli/commands.h"
#include "formats/text_file.h"
#include "report/run.h"
#include "results/motion_mcap.h"
#include "results/opensim.h"
#include "results/output_place.h"
#include "results/result_files.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

struct ExportArguments {
  std::string directory, format = "sto", output;
};

std::string formatTrajectory(const ExportArguments& arguments) {
  if (arguments.format == "mot") return formatMot(readResultRecord(arguments.directory));
  if (arguments.format == "sto") return formatSto(readResultRecord(arguments.directory));
  const ReportRun run = readRun(arguments.directory);
  return formatMotionMcap(run.robot, run.record, run.plan, run.summary);
}

int exportTrajectory(const ExportArguments& arguments) {
  const fs::path place = arguments.directory;
  const fs::path path =
      arguments.output.empty() ? place / ("trajectory." + arguments.format) : fs::path(arguments.output);
  requireApart(path.string(), listResultFiles(place.string()));
  writeTextFile(path.string(), formatTrajectory(arguments));
  std::cout << path.string() << "\n";
  return kOk;
}

}  // namespace

void addExport(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("export", "Write a trajectory in another program's format");
  const auto arguments = std::make_shared<ExportArguments>();
  command.add_option("DIR", arguments->directory, "result of `bielle solve` or `bielle simulate`")->required();
  command
      .add_option("--format", arguments->format,
                  "mcap: frames, shapes, joints, forces and events (Foxglove, Lichtblick, PlotJuggler, Rerun); "
                  "mot: coordinates over time (OpenSim); sto: everything over time (OpenSim)")
      ->check(CLI::IsMember({"mcap", "mot", "sto"}))
      ->capture_default_str();
  command.add_option("-o,--output", arguments->output, "the file; default: trajectory.FORMAT in the directory");
  command.footer(
      "SI units, radians. Without export: trajectory.csv has one named column per quantity and a column 'time', as\n"
      "PlotJuggler and spreadsheets read it; trajectory.npz holds arrays q and v with Pinocchio's frames and orders "
      "within\n"
      "a joint, and q_names and v_names to sort the joints by.\n"
      "Examples:\n"
      "  bielle export squat --format mot\n"
      "  bielle export squat --format mcap\n"
      "  bielle export squat --format sto -o squat.sto");
  command.callback([&action, arguments] { action = [=] { return exportTrajectory(*arguments); }; });
}

}  // namespace bielle::cli
