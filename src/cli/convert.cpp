// bielle convert: a robot in another format.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>

#include "bielle/dynamics/assembly.h"
#include "bielle/firmware/firmware.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "cli/commands.h"
#include "cli/serial_files.h"
#include "formats/aside_file.h"
#include "formats/companion.h"
#include "formats/drake.h"
#include "formats/mjcf.h"
#include "formats/process.h"
#include "formats/robot_files.h"
#include "formats/sdf.h"
#include "formats/text_file.h"
#include "formats/usd.h"
#include "model/number_text.h"
#include "model/payload.h"
#include "results/option_flags.h"
#include "results/output_place.h"
#include "results/setting.h"
#include "results/workshop_sheet.h"
#include "results/workshop_solids.h"

namespace bielle::cli {
namespace {

struct ConvertArguments {
  RobotArgument robot;
  std::string format = "bielle", joints, output;
  double payload = 0, hole = 8;
  std::vector<double> payload_at;
  std::vector<std::string> plays;
  bool is_single = false, is_serial = false;
  int postures = FirmwareOptions().postures;
  std::vector<std::string> ranges;  // joint, low, high, ..
};

void describe(OptionFields& f, ConvertArguments& a) {
  f.number("hole", a.hole, "mm", {0.1, 1000}, "diameter of the holes of --to dxf");
  f.choice("precision", a.is_single, {"double", "float"}, "with --to c, cpp or ros2_control: of all numbers");
  f.integer("postures", a.postures, {100, 10000000},
            "with maps of linkages: at how many of each linkage errors are measured");
  f.number("payload", a.payload, "kg", {0, 1e6}, "mass fixed to the trunk");
  f.texts("play", a.plays,
          "NAME=SIZE, e.g. closure_ankle*=0.0003: play of a joint or of the rod that a closure ties, a free coordinate "
          "between two stops [rad, m]; * stands for any text; may be repeated, or several with commas");
  f.flag("serial", a.is_serial,
         "with --to mjcf or urdf: the chain of the serial joints, with motors on them, for trainers; beside it, in "
         "NAME.linkages.json, inertia, limits and friction of its linkages over their postures");
}

void warn(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) std::cerr << "bielle: warning: " << warning << "\n";
}

// By a program of its own, which reads JSON and says what it cannot do. Returns its exit status.
int writeBy(const std::string& name, const std::string& json, const std::string& path) {
  const std::string program = requireCompanion(name);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), &std::fclose);
  if (!file || std::fputs(json.c_str(), file.get()) < 0 || std::fflush(file.get()) != 0)
    throw InputError(path, name, "what it reads cannot be written to a temporary file", "make room in /tmp");
  std::rewind(file.get());
  ProcessOptions options;
  options.in = fileno(file.get());
  AsideFile written(path);
  if (written.aside() != path) written.write("");  // which says what is wrong with the place
  const int status = waitForProcess(startProcess({program, written.aside()}, options));
  if (status != kOk && status != kBadInput)
    throw InputError(path, name, "it could not write the file", "see its message above");
  if (status == kOk) written.commit();
  return status;
}

const std::map<std::string, FirmwareLanguage> kFirmware = {{"c", FirmwareLanguage::C},
                                                           {"cpp", FirmwareLanguage::Cpp},
                                                           {"numpy", FirmwareLanguage::NumPy},
                                                           {"torch", FirmwareLanguage::Torch},
                                                           {"ros2_control", FirmwareLanguage::Ros2Control}};
bool isFirmware(const std::string& format) { return kFirmware.count(format) > 0; }

void writeFirmware(const LoadedRobot& robot, const ConvertArguments& arguments) {
  FirmwareOptions options;
  options.language = kFirmware.at(arguments.format);
  options.is_single = arguments.is_single;
  options.postures = arguments.postures;
  for (size_t i = 0; i + 2 < arguments.ranges.size(); i += 3) {
    const std::string& joint = arguments.ranges[i];
    const std::optional<double> low = parseNumber(arguments.ranges[i + 1]), high = parseNumber(arguments.ranges[i + 2]);
    if (!low || !high || !(*low < *high))
      throw InputError("", "--range " + joint,
                       "'" + arguments.ranges[i + 1] + " " + arguments.ranges[i + 2] + "' is no range",
                       "give two numbers, the lower one first, as --range " + joint + " -0.3 0.5");
    options.ranges[joint] = {*low, *high};
  }
  const FirmwareText text = formatFirmware(robot.model, findClosedConfiguration(robot.model).q, options);
  warn(text.warnings);
  writeTextDirectory(arguments.output, text.files);
}

// With --play, all play becomes coordinates. What is left in wear, files of Bielle alone keep.
std::vector<Play> takePlays(const ConvertArguments& arguments, Wear& wear) {
  std::vector<Play> plays = parsePlays(arguments.plays);
  if (!plays.empty()) {
    plays.insert(plays.begin(), wear.plays.begin(), wear.plays.end());
    wear.plays.clear();
  }
  if (arguments.format == "bielle") return plays;
  for (const Play& play : wear.plays)
    warn({"its play of '" + play.name + "' is left out: add --play " + play.name + "=" + formatNumber(play.size)});
  for (const RodFriction& friction : wear.frictions)
    warn({"friction of closure '" + friction.closure + "' is left out: it depends on the closure's force"});
  return plays;
}

int convert(const ConvertArguments& arguments) {
  const ConvertArguments usual;
  const bool has_postures = arguments.postures != usual.postures;
  if (!isFirmware(arguments.format) && (!arguments.ranges.empty() || arguments.is_single || has_postures))
    throw InputError("",
                     !arguments.ranges.empty() ? "--range"
                     : has_postures            ? "--postures"
                                               : "--precision",
                     "it says how maps of linkages are computed", "add --to c, or leave it out");
  if (arguments.hole != usual.hole && arguments.format != "dxf")
    throw InputError("", "--hole", "only plates for a workshop have holes", "add --to dxf, or leave it out");
  if (!arguments.joints.empty() && arguments.format != "mjcf")
    throw InputError("", "--joints", "it says how a file of MuJoCo is written", "add --to mjcf, or leave it out");
  if (arguments.is_serial && arguments.format != "mjcf" && arguments.format != "urdf")
    throw InputError("", "--serial", "only files of MuJoCo and URDFs are written of the serial chain",
                     "add --to mjcf or --to urdf, or leave it out");
  LoadedRobot robot = arguments.robot.load();
  requireApart(arguments.output, listFiles(robot));
  const std::vector<Play> plays = takePlays(arguments, robot.wear);
  Payload payload;
  payload.mass = arguments.payload;
  if (!arguments.payload_at.empty()) payload.at = Eigen::Map<const Vector3d>(arguments.payload_at.data());
  robot.model = addPlay(addPayload(robot.model, payload), plays);
  std::optional<SerialFiles> serial;
  const std::filesystem::path tables = std::filesystem::path(arguments.output).replace_extension(".linkages.json");
  if (arguments.is_serial) {
    requireApart(tables.string(), listFiles(robot));
    serial = makeSerialFiles(robot.model, std::filesystem::path(arguments.output).filename().string());
    warn(serial->warnings);
    robot.model = serial->model;
  }
  if (arguments.format == "bielle") {
    writeRobot(robot.model, arguments.output,
               "Written by `bielle convert` from " + std::filesystem::path(robot.file).filename().string() + ".",
               robot.wear);
  } else if (isFirmware(arguments.format)) {
    writeFirmware(robot, arguments);
  } else if (arguments.format == "urdf") {
    const UrdfText text = formatUrdf(robot.model);
    warn(text.warnings);
    writeTextFile(arguments.output, text.urdf);
  } else if (arguments.format == "drake") {
    const UrdfText text = formatDrake(robot.model);
    warn(text.warnings);
    writeTextFile(arguments.output, text.urdf);
  } else if (arguments.format == "dxf") {
    const int status = writeBy("bielle-dxf", formatLinks(robot.model, 1e-3 * arguments.hole), arguments.output);
    if (status != kOk) return status;
  } else if (arguments.format == "sheet") {
    const std::filesystem::path table = std::filesystem::path(arguments.output).replace_extension(".csv");
    if (table == arguments.output)
      throw InputError("", "--output " + arguments.output, "the table would have the same name",
                       "give one that ends in .svg");
    requireApart(table.string(), listFiles(robot));
    writeTextFile(arguments.output, formatSheet(robot.model));
    writeTextFile(table.string(), formatSheetTable(robot.model));
    std::cout << table.string() << "\n";
  } else if (arguments.format == "step") {
    const WorkshopSolids solids = formatSolids(robot.model, findClosedConfiguration(robot.model).q);
    warn(solids.warnings);
    const int status = writeBy("bielle-step", solids.json, arguments.output);
    if (status != kOk) return status;
  } else if (arguments.format == "sdf") {
    const SdfText text = formatSdf(robot.model, findClosedConfiguration(robot.model).q);
    warn(text.warnings);
    writeTextFile(arguments.output, text.xml);
  } else if (arguments.format == "usd") {
    const UsdText text = formatUsd(robot.model, findClosedConfiguration(robot.model).q);
    warn(text.warnings);
    writeTextFile(arguments.output, text.usda);
  } else {
    MjcfOptions options;
    if (arguments.joints == "hinges") options.rotations = MjcfRotations::Hinges;
    const MjcfText text = formatMjcf(robot.model, serial ? serial->q : findClosedConfiguration(robot.model).q, options);
    warn(text.warnings);
    writeTextFile(arguments.output, text.xml);
  }
  std::cout << arguments.output << "\n";
  if (serial) {
    writeTextFile(tables.string(), serial->tables);
    std::cout << tables.string() << "\n";
  }
  return kOk;
}

}  // namespace

void addConvert(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<ConvertArguments>();
  addRobot(command, arguments->robot);
  command
      .add_option(
          "--to", arguments->format,
          "bielle: a directory with URDF and YAML, without losses; c, cpp: a directory with the maps of its linkages "
          "between joints and motors, for firmware; drake: a URDF with loops and motors for "
          "Drake; dxf: plates of the plane links, for a workshop; mjcf: a MuJoCo file; sdf: a Gazebo file with "
          "loops; numpy, torch: those maps as modules for Python; ros2_control: them in C++, and transmissions around "
          "them; "
          "sheet: an SVG drawing with distances, and a CSV file of "
          "lengths, masses and motors; step: "
          "solids for CAD "
          "(AP214), an assembly of links; urdf: a URDF alone; usd: a USD file with loops for Isaac and Newton")
      ->check(CLI::IsMember({"bielle", "c", "cpp", "drake", "dxf", "mjcf", "numpy", "ros2_control", "sdf", "sheet",
                             "step", "torch", "urdf", "usd"}))
      ->capture_default_str();
  command
      .add_option(
          "--joints", arguments->joints,
          "with --to mjcf: rotations about three axes as balls (default), or as three hinges each, for trainers "
          "without balls")
      ->check(CLI::IsMember({"balls", "hinges"}));
  addFlags(*arguments, command);
  command
      .add_option("--range", arguments->ranges,
                  "with maps of linkages: JOINT LOW HIGH [rad, m], instead of the limits of the robot's file, or "
                  "where it has none the range around its posture that stays 0.1 rad away from dead points; again for "
                  "other joints")
      ->expected(3)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  addRobotFlags(command, arguments->robot);
  command
      .add_option("--payload-at", arguments->payload_at,
                  "x y z [m] in the frame of the trunk; default: the trunk's centre of mass")
      ->expected(3)
      ->needs("--payload");
  command
      .add_option("-o,--output", arguments->output,
                  "the file; for bielle the directory, whose last part names its files; for maps of linkages a "
                  "directory of its own")
      ->required();
  command.footer(
      "Lost elements are listed as warnings; a conversion that would change the mechanism is refused.\n"
      "MuJoCo closes loops by soft constraints. Those of its file open with the square of the step, up to 1e-8 m where "
      "a\n"
      "robot squats at the file's 0.25 ms and 2e-6 m at 5 ms; 6e-6 and 2e-3 m where a linkage falls freely.\n"
      "In SDF, coordinates are measured from the posture in the file; couplers are left out.\n"
      "For Drake, loops are ball constraints: one for a ball, two for a hinge, three for a weld.\n"
      "A DXF (R12, mm) has a layer for each link whose hinges are parallel: outline and holes; names and distances are "
      "on "
      "NOTES.\n"
      "A STEP file (mm) has the boxes, cylinders and spheres of the drawing, each link at its place in the closed "
      "posture.\n"
      "In USD, loops are joints with excludeFromArticulation, and motors drives without a servo; programs that read it "
      "keep the\n"
      "digits of float.\n"
      "A URDF alone is a tree: loops are left out, linear couplers of two joints become <mimic>.\n"
      "With --serial, linkages are frozen in the robot's posture.\n"
      "Maps of linkages come with a README.md and tests; they are exact to rounding, and say how exact they were "
      "found.\n"
      "Examples:\n"
      "  bielle convert bipetto --to c --precision float -o maps\n"
      "  bielle convert bipetto --to mjcf -o bipetto.xml\n"
      "  bielle convert bipetto --to mjcf --joints hinges -o trained.xml\n"
      "  bielle convert bipetto --to mjcf --serial -o chain.xml\n"
      "  bielle convert bipetto --to usd -o bipetto.usda\n"
      "  bielle convert leg_biped --to dxf -o plates.dxf\n"
      "  bielle convert leg_biped --to sheet -o leg.svg\n"
      "  bielle convert leg_biped --to step -o leg.step\n"
      "  bielle convert bipetto.xml -o my_bipetto\n"
      "  bielle convert bipetto --payload 5 --payload-at 0 0 0.3 -o loaded\n"
      "  bielle convert belt_biped --to urdf -o belt.urdf");
  command.callback([&action, arguments] { action = [=] { return convert(*arguments); }; });
}

}  // namespace bielle::cli
