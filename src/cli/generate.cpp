// bielle generate: a robot from named numbers.
#include <filesystem>
#include <iostream>
#include <sstream>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/robots/generators.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "results/setting.h"

namespace bielle::cli {
namespace {

struct GenerateArguments {
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

int generate(const Generator& generator, const GenerateArguments& arguments) {
  OptionSet parameters = generator.parameters;
  std::string changes;
  for (const std::string& setting : arguments.settings) {
    const auto [name, value] = splitSetting("--set", setting, generator.parameters.begin()->name + "=0.1");
    parameters.set(name, parseOption(value));
    changes += (changes.empty() ? " with " : ", ") + setting;
  }
  const Model model = generator.make(parameters);
  writeRobot(model, arguments.directory, "Written by `bielle generate " + generator.name + "`" + changes + ".");
  std::cout << model.name() << ": " << formatNumber(model.mass()) << " kg, nv " << model.nv() << ", " << model.nu()
            << " motors, " << model.closures().size() << " closures\n  " << arguments.directory << "\n";
  return kOk;
}

}  // namespace

void addGenerate(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("generate", "Generate a robot from named lengths, angles and masses");
  command.callback([&action] {
    if (!action) throw CLI::RequiredError("A robot");
  });
  for (const Generator& generator : getGenerators()) {
    CLI::App& sub = *command.add_subcommand(generator.name, generator.help);
    const auto arguments = std::make_shared<GenerateArguments>();
    sub.add_option("--set", arguments->settings, "NAME=VALUE, may be repeated")->type_name("NAME=VALUE");
    sub.add_option("-o,--output", arguments->directory,
                   "directory of the robot; its last part names the files, and every command accepts it as a robot")
        ->required();
    sub.footer("Parameters of --set, with default, unit and bounds:\n" + formatParameters(generator) +
               "Example:\n  bielle generate " + generator.name + " -o my_" + generator.name);
    sub.callback([&action, &generator, arguments] {
      action = [&generator, arguments] { return generate(generator, *arguments); };
    });
  }
  command.footer(
      "Examples:\n"
      "  bielle generate cleobot --set upper_length=0.25 -o longer\n"
      "  bielle info longer\n"
      "`bielle generate ROBOT --help` lists the parameters. The URDF and YAML files written are for editing, and for\n"
      "other programs. A short file longer/longer.yaml is the same robot for Bielle:\n"
      "  generator: cleobot\n"
      "  set: {upper_length: 0.25}");
}

}  // namespace bielle::cli
