// bielle generate: a robot from named numbers.
#include "bielle/robots/generate.h"

#include <filesystem>
#include <iostream>
#include <sstream>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "results/setting.h"

namespace bielle::cli {
namespace {

struct GenerateArguments {
  std::string robot;
  std::vector<std::string> settings;  // name=value
  std::string directory;
};

std::string formatParameters(const Generator& generator) {
  std::vector<Row> rows;
  for (const Option& p : generator.parameters)
    rows.push_back(
        {p.name, formatOption(p.value), p.unit.empty() ? "" : "[" + p.unit + "]", p.describeValues(), p.help});
  std::ostringstream text;
  printTable(text, rows);
  return text.str();
}

// A setting that the robot has.
std::string makeExample(const std::string& robot) {
  for (const Option& p : findGenerator(robot).parameters) return p.name + "=" + formatOption(p.value);
  return "NAME=VALUE";
}

int generate(const GenerateArguments& arguments) {
  OptionValues values;
  std::string changes;
  for (const std::string& setting : arguments.settings) {
    const auto [name, value] =
        splitSetting("--set", setting, setting.find('=') == std::string::npos ? makeExample(arguments.robot) : "");
    values.emplace_back(name, parseOption(value));
    changes += (changes.empty() ? " with " : ", ") + setting;
  }
  const Model model = generateRobot(arguments.robot, values);
  writeRobot(model, arguments.directory, "Written by `bielle generate " + arguments.robot + "`" + changes + ".");
  std::cout << model.name() << ": " << formatNumber(model.mass()) << " kg, nv " << model.nv() << ", " << model.nu()
            << " motors, " << model.closures().size() << " closures\n  " << arguments.directory << "\n";
  return kOk;
}

std::string formatRobots() {
  std::vector<Row> rows;
  for (const Generator& generator : listGenerators()) rows.push_back({generator.name, generator.help});
  std::ostringstream text;
  printTable(text, rows);
  return text.str();
}

std::string formatHelp(const GenerateArguments& arguments) {
  if (!arguments.robot.empty()) {
    try {
      return "Parameters of --set, with default, unit and bounds:\n" + formatParameters(findGenerator(arguments.robot));
    } catch (const InputError& error) {
      return error.what();
    }
  }
  return "Robots:\n" + formatRobots() +
         "Examples:\n"
         "  bielle generate cleobot --set upper_length=0.25 -o longer\n"
         "  bielle generate leg_biped --set knee=belt --set knee_ratio=3 -o belted\n"
         "  bielle info longer\n"
         "`bielle generate ROBOT --help` lists the parameters of a robot. The URDF and YAML files written are for "
         "editing,\n"
         "and for other programs. A short file longer/longer.yaml is the same robot for Bielle:\n"
         "  generator: cleobot\n"
         "  set: {upper_length: 0.25}\n"
         "Robots of your own, composed of parts of your own: docs/parts.md";
}

}  // namespace

void addGenerate(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<GenerateArguments>();
  command.add_option("ROBOT", arguments->robot, "one of those below, or a file that composes a robot of parts")
      ->required();
  command.add_option("--set", arguments->settings, "NAME=VALUE, may be repeated; the value of a part may be its file")
      ->type_name("NAME=VALUE");
  command
      .add_option("-o,--output", arguments->directory,
                  "directory of the robot; its last part names the files, and every command accepts it as a robot")
      ->required();
  command.footer([arguments] { return formatHelp(*arguments); });
  command.callback([&action, arguments] { action = [arguments] { return generate(*arguments); }; });
}

}  // namespace bielle::cli
