// bielle export: a trajectory in the format of another program.
#include "cli/export.h"

#include <filesystem>
#include <iostream>
#include <memory>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "formats/drake.h"
#include "formats/mjcf.h"
#include "formats/text_file.h"
#include "report/run.h"
#include "results/motion_mcap.h"
#include "results/number_option.h"
#include "results/opensim.h"
#include "results/output_place.h"
#include "results/problem_file.h"
#include "results/reference_motion.h"
#include "results/result_files.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

struct ExportArguments {
  std::string directory, format = "sto", output;
  double rate = 50;
};

fs::path makePath(const ExportArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  const std::string& format = arguments.format;
  return fs::path(arguments.directory) / (isReference(format)   ? format + ".npz"
                                          : format == "problem" ? format + ".json"
                                                                : "trajectory." + format);
}

int exportTrajectory(const ExportArguments& arguments) {
  const fs::path path = makePath(arguments);
  requireApart(path.string(), listResultFiles(arguments.directory));
  ExportRequest request{arguments.directory, arguments.format, path.string(), "", arguments.rate};
  if (hasRobot(arguments.format)) {
    request.robot = fs::path(path).replace_extension(".xml").string();
    if (request.robot == path.string())
      throw InputError("", "--output " + request.path, "the robot would have the same name",
                       arguments.format == "problem" ? "give one that ends in .json" : "give one that ends in .npz");
  }
  for (const std::string& warning : writeExport(request)) std::cerr << "bielle: warning: " << warning << "\n";
  std::cout << path.string() << "\n";
  if (arguments.format == "problem")
    for (const char* extension : {".npz", ".urdf"})
      std::cout << fs::path(path).replace_extension(extension).string() << "\n";
  if (!request.robot.empty()) std::cout << request.robot << "\n";
  return kOk;
}

}  // namespace

bool isReference(const std::string& format) { return format == "amp" || format == "mjlab"; }

bool hasRobot(const std::string& format) { return isReference(format) || format == "problem"; }

namespace {

// The problem, its optimum, and the robot for Drake and MuJoCo. Returns what these lose.
std::vector<std::string> writeProblem(const ExportRequest& request, const ReportRun& run) {
  const Model& model = run.robot.model;
  const fs::path path = request.path, mjcf = request.robot;
  const fs::path urdf = fs::path(mjcf).replace_extension(".urdf"), npz = fs::path(path).replace_extension(".npz");
  requireApart(urdf.string(), {run.robot.file});
  const ProblemText text = formatProblem(model, readSummary(request.directory), run.record,
                                         {{"urdf", urdf.filename().string()}, {"mjcf", mjcf.filename().string()}});
  const UrdfText robot = formatDrake(model);
  writeTextFile(urdf.string(), robot.urdf);
  writeTextFile(mjcf.string(), formatMjcf(model, findClosedConfiguration(model).q, {}).xml);
  writeTextFile(npz.string(), text.npz);
  writeTextFile(path.string(), text.json);
  return robot.warnings;
}

}  // namespace

std::vector<std::string> writeExport(const ExportRequest& request) {
  if (request.format == "mot" || request.format == "sto") {
    const MotionRecord record = readResultRecord(request.directory);
    writeTextFile(request.path, request.format == "mot" ? formatMot(record) : formatSto(record));
    return {};
  }
  const ReportRun run = readRun(request.directory);
  if (request.format == "mcap") {
    const MotionMcap text = formatMotionMcap(run.robot, run.record, run.plan, run.summary);
    writeTextFile(request.path, text.mcap);
    return text.warnings;
  }
  requireApart(request.robot, {run.robot.file});
  if (request.format == "problem") return writeProblem(request, run);
  const VectorXd q_ref = findClosedConfiguration(run.robot.model).q;
  MjcfOptions options;
  options.rotations = MjcfRotations::Hinges;
  const ReferenceMotion motion = makeReferenceMotion(run.robot.model, q_ref, run.record, request.rate);
  writeTextFile(request.path,
                formatReferenceMotion(motion, request.format == "amp" ? ReferenceFormat::Amp : ReferenceFormat::Mjlab));
  writeTextFile(request.robot, formatMjcf(run.robot.model, q_ref, options).xml);
  return motion.warnings;
}

void addExport(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("export", "Write a trajectory in another program's format");
  const auto arguments = std::make_shared<ExportArguments>();
  command.add_option("DIR", arguments->directory, "result of `bielle solve` or `bielle simulate`")->required();
  command
      .add_option("--format", arguments->format,
                  "amp, mjlab: a reference for learning, with the robot (Isaac Lab's AMP; mjlab); "
                  "mcap: frames, shapes, joints, forces and events (Foxglove, Lichtblick, PlotJuggler, Rerun); "
                  "mot: coordinates over time (OpenSim); "
                  "problem: the optimal control problem with its optimum, for other solvers (JSON, npz, URDF, MJCF); "
                  "sto: everything over time (OpenSim)")
      ->check(CLI::IsMember({"amp", "mcap", "mjlab", "mot", "problem", "sto"}))
      ->capture_default_str();
  command.add_option("--fps", arguments->rate, "frames per second of a reference for learning")
      ->check(isWithin(1e-3, 1e4))
      ->capture_default_str();
  command.add_option("-o,--output", arguments->output,
                     "the file; default: trajectory.FORMAT in the directory, amp.npz or mjlab.npz with the robot as "
                     ".xml, problem.json with\n"
                     "problem.npz and the robot as .urdf and .xml");
  command.footer(
      "SI units, radians. Without export: trajectory.csv has one named column per quantity and a column 'time', as\n"
      "PlotJuggler and spreadsheets read it; trajectory.npz holds arrays q and v with Pinocchio's frames and orders "
      "within\n"
      "a joint, and q_names and v_names to sort the joints by.\n"
      "Examples:\n"
      "  bielle export squat --format mot\n"
      "  bielle export squat --format mcap\n"
      "  bielle export squat --format mjlab --fps 50\n"
      "  bielle export squat --format problem\n"
      "  bielle export squat --format sto -o squat.sto");
  command.callback([&action, arguments] { action = [=] { return exportTrajectory(*arguments); }; });
}

}  // namespace bielle::cli
