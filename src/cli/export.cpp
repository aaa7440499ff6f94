// bielle export: a trajectory or a robot in the format of another program.
#include <filesystem>
#include <iostream>
#include <memory>

#include "bielle/dynamics/assembly.h"
#include "cli/commands.h"
#include "io/mjcf.h"
#include "io/opensim.h"
#include "io/output_place.h"
#include "io/result_files.h"
#include "io/text_file.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

struct ExportArguments {
  RobotArgument robot;  // or the directory of a result
  std::string format = "sto", output;
};

int exportRobot(const ExportArguments& arguments) {
  const LoadedRobot robot = arguments.robot.load();
  const std::string path = arguments.output.empty() ? fs::path(robot.file).stem().string() + ".xml" : arguments.output;
  requireApart(path, listFiles(robot));
  const MjcfText text = formatMjcf(robot.model, findClosedConfiguration(robot.model).q);
  for (const std::string& warning : text.warnings) std::cerr << "bielle: warning: " << warning << "\n";
  writeTextFile(path, text.xml);
  std::cout << path << "\n";
  return kOk;
}

int exportTrajectory(const ExportArguments& arguments) {
  const fs::path place = arguments.robot.name;
  const MotionRecord record = readRecord((place / "trajectory.npz").string());
  const fs::path path =
      arguments.output.empty() ? place / ("trajectory." + arguments.format) : fs::path(arguments.output);
  requireApart(path.string(), listResultFiles(place.string()));
  writeTextFile(path.string(), arguments.format == "mot" ? formatMot(record) : formatSto(record));
  std::cout << path.string() << "\n";
  return kOk;
}

}  // namespace

void addExport(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("export", "Write a trajectory or a robot in another program's format");
  const auto arguments = std::make_shared<ExportArguments>();
  command.add_option("source", arguments->robot.name, "result directory of `bielle solve`; mjcf: a robot")->required();
  command
      .add_option("--format", arguments->format,
                  "mot: coordinates over time (OpenSim); sto: everything over time (OpenSim); mjcf: the robot (MuJoCo)")
      ->check(CLI::IsMember({"mot", "sto", "mjcf"}))
      ->capture_default_str();
  addFixedBase(command, arguments->robot);
  command.add_option("-o,--output", arguments->output,
                     "the file; default: trajectory.FORMAT in the directory; mjcf: ROBOT.xml here");
  command.footer(
      "SI units, radians. Without export: trajectory.csv has one named column per quantity and a column 'time', as\n"
      "PlotJuggler and spreadsheets read it; trajectory.npz holds arrays q and v with Pinocchio's frames and orders "
      "within\n"
      "a joint, and q_names and v_names to sort the joints by.\n"
      "mjcf: loops are closed by MuJoCo's soft constraints, which are so stiff that they need steps of 0.25 ms.\n"
      "Examples:\n"
      "  bielle export squat --format mot\n"
      "  bielle export squat --format sto -o squat.sto\n"
      "  bielle export bipetto --format mjcf -o bipetto.xml");
  command.callback([&action, arguments] {
    action = [=] { return arguments->format == "mjcf" ? exportRobot(*arguments) : exportTrajectory(*arguments); };
  });
}

}  // namespace bielle::cli
