// bielle export: a trajectory in the format of another program.
#include <filesystem>
#include <iostream>
#include <memory>

#include "bielle/dynamics/assembly.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "formats/mjcf.h"
#include "formats/text_file.h"
#include "report/run.h"
#include "results/motion_mcap.h"
#include "results/number_option.h"
#include "results/opensim.h"
#include "results/output_place.h"
#include "results/reference_motion.h"
#include "results/result_files.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

struct ExportArguments {
  std::string directory, format = "sto", output;
  double rate = 50;
};

bool isReference(const std::string& format) { return format == "amp" || format == "mjlab"; }

fs::path makePath(const ExportArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  return fs::path(arguments.directory) /
         (isReference(arguments.format) ? arguments.format + ".npz" : "trajectory." + arguments.format);
}

// The robot is written beside it, as MuJoCo has it in the frames.
void exportReference(const ExportArguments& arguments, const fs::path& path) {
  const ReportRun run = readRun(arguments.directory);
  const fs::path robot = fs::path(path).replace_extension(".xml");
  requireApart(robot.string(), {path.string(), run.robot.file});
  const VectorXd q_ref = findClosedConfiguration(run.robot.model).q;
  MjcfOptions options;
  options.rotations = MjcfRotations::Hinges;
  const MjcfText text = formatMjcf(run.robot.model, q_ref, options);
  const ReferenceMotion motion = makeReferenceMotion(run.robot.model, q_ref, run.record, arguments.rate);
  for (const std::string& warning : motion.warnings) std::cerr << "bielle: warning: " << warning << "\n";
  writeTextFile(path.string(), formatReferenceMotion(
                                   motion, arguments.format == "amp" ? ReferenceFormat::Amp : ReferenceFormat::Mjlab));
  writeTextFile(robot.string(), text.xml);
  std::cout << path.string() << "\n" << robot.string() << "\n";
}

std::string formatTrajectory(const ExportArguments& arguments) {
  if (arguments.format == "mot") return formatMot(readResultRecord(arguments.directory));
  if (arguments.format == "sto") return formatSto(readResultRecord(arguments.directory));
  const ReportRun run = readRun(arguments.directory);
  return formatMotionMcap(run.robot, run.record, run.plan, run.summary);
}

int exportTrajectory(const ExportArguments& arguments) {
  const fs::path path = makePath(arguments);
  requireApart(path.string(), listResultFiles(arguments.directory));
  if (isReference(arguments.format)) {
    exportReference(arguments, path);
    return kOk;
  }
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
                  "amp, mjlab: a reference for learning, with the robot (Isaac Lab's AMP; mjlab, BeyondMimic); "
                  "mcap: frames, shapes, joints, forces and events (Foxglove, Lichtblick, PlotJuggler, Rerun); "
                  "mot: coordinates over time (OpenSim); sto: everything over time (OpenSim)")
      ->check(CLI::IsMember({"amp", "mcap", "mjlab", "mot", "sto"}))
      ->capture_default_str();
  command.add_option("--fps", arguments->rate, "frames per second of a reference for learning")
      ->check(isWithin(1e-3, 1e4))
      ->capture_default_str();
  command.add_option(
      "-o,--output", arguments->output,
      "the file; default: trajectory.FORMAT in the directory, amp.npz or mjlab.npz with the robot as .xml");
  command.footer(
      "SI units, radians. Without export: trajectory.csv has one named column per quantity and a column 'time', as\n"
      "PlotJuggler and spreadsheets read it; trajectory.npz holds arrays q and v with Pinocchio's frames and orders "
      "within\n"
      "a joint, and q_names and v_names to sort the joints by.\n"
      "Examples:\n"
      "  bielle export squat --format mot\n"
      "  bielle export squat --format mcap\n"
      "  bielle export squat --format mjlab --fps 50\n"
      "  bielle export squat --format sto -o squat.sto");
  command.callback([&action, arguments] { action = [=] { return exportTrajectory(*arguments); }; });
}

}  // namespace bielle::cli
