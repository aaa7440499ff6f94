// bielle export: a trajectory in the format of another program.
#include "cli/export.h"

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "results/number_option.h"
#include "results/output_place.h"
#include "results/result_files.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr double kRate = 50;  // frames per second, unless they are given

struct ExportArguments {
  std::string directory, format = "sto", output;
  std::optional<double> rate;
  std::optional<int> isaac_lab;
};

fs::path makePath(const ExportArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  const std::string& format = arguments.format;
  return fs::path(arguments.directory) / (isReference(format)   ? format + ".npz"
                                          : format == "problem" ? format + ".json"
                                                                : "trajectory." + format);
}

// Tables of numbers can do without the robot.
void tellOfRobot(const ExportArguments& arguments) {
  try {
    printWarnings(loadRobotOf(arguments.directory).warnings);
  } catch (const InputError&) {
    if (arguments.format != "mot" && arguments.format != "sto") throw;
  }
}

int exportTrajectory(const ExportArguments& arguments) {
  const fs::path path = makePath(arguments);
  requireApart(path.string(), listResultFiles(arguments.directory));
  const bool is_of_isaac = isOfIsaacLab(arguments.format);
  if (arguments.isaac_lab && !is_of_isaac)
    throw InputError("", "--isaac-lab", "'" + arguments.format + "' is the same for each version of it",
                     "leave it out, or give --format amp or beyondmimic");
  if (arguments.rate && !isReference(arguments.format))
    throw InputError("", "--fps", "'" + arguments.format + "' has the steps of the motion",
                     "leave it out, or give --format mjlab, amp or beyondmimic");
  ExportRequest request{arguments.directory,
                        arguments.format,
                        path.string(),
                        "",
                        arguments.rate.value_or(kRate),
                        arguments.isaac_lab.value_or(kIsaacLab)};
  if (hasRobot(arguments.format)) {
    request.robot = fs::path(path).replace_extension(".xml").string();
    if (request.robot == path.string())
      throw InputError("", "--output " + request.path, "the robot would have the same name",
                       arguments.format == "problem" ? "give one that ends in .json" : "give one that ends in .npz");
  }
  tellOfRobot(arguments);
  if (is_of_isaac && !arguments.isaac_lab) printWarnings({describeIsaacLab("--isaac-lab")});
  printWarnings(writeExport(request));
  std::cout << path.string() << "\n";
  if (arguments.format == "problem")
    for (const char* extension : {".npz", ".urdf"})
      std::cout << fs::path(path).replace_extension(extension).string() << "\n";
  if (!request.robot.empty()) std::cout << request.robot << "\n";
  return kOk;
}

}  // namespace

void addExport(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<ExportArguments>();
  command.add_option("DIR", arguments->directory, "result of `bielle solve` or `bielle simulate`")->required();
  command
      .add_option(
          "--format", arguments->format,
          "amp, beyondmimic, mjlab: a reference for learning, with the robot (Isaac Lab's AMP; BeyondMimic; mjlab); "
          "mcap: frames, shapes, joints, forces and events (Foxglove, Lichtblick, PlotJuggler, Rerun); "
          "mot: coordinates over time (OpenSim); "
          "problem: the optimal control problem with its optimum, for other solvers (JSON, npz, URDF, MJCF); "
          "sto: everything over time (OpenSim)")
      ->check(CLI::IsMember({"amp", "beyondmimic", "mcap", "mjlab", "mot", "problem", "sto"}))
      ->capture_default_str();
  command.add_option("--fps", arguments->rate, "frames per second of a reference for learning; default: 50")
      ->check(isWithin(1e-3, 1e4));
  command
      .add_option("--isaac-lab", arguments->isaac_lab,
                  "version that will read amp or beyondmimic; default: 2, with a warning\n"
                  "2: quaternions w, x, y, z; 3: x, y, z, w; in both, velocities are of centres of mass")
      ->check(CLI::IsMember({2, 3}));
  command.add_option(
      "-o,--output", arguments->output,
      "the file; default: trajectory.FORMAT in the directory, FORMAT.npz of a reference with the robot as "
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
      "  bielle export squat --format amp --isaac-lab 3\n"
      "  bielle export squat --format problem\n"
      "  bielle export squat --format sto -o squat.sto");
  command.callback([&action, arguments] { action = [=] { return exportTrajectory(*arguments); }; });
}

}  // namespace bielle::cli
