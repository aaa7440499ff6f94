// bielle generate: a robot from named numbers.
#include <filesystem>
#include <iostream>
#include <sstream>

#include "bielle/io/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/robots/generators.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "io/setting.h"

namespace bielle::cli {
namespace {

struct GenerateArguments {
  std::vector<std::string> settings;  // name=value
  std::string directory;
};

std::string formatRange(const Parameter& p) {
  if (p.choices.empty()) return formatNumber(p.lower) + " .. " + formatNumber(p.upper);
  std::string text;
  for (const std::string& choice : p.choices) text += (text.empty() ? "" : ", ") + choice;
  return text;
}

// name=number, or the name of a choice.
std::pair<std::string, double> readSetting(const std::vector<Parameter>& parameters, const std::string& setting) {
  const size_t equals = setting.find('=');
  for (const Parameter& p : parameters)
    if (!p.choices.empty() && setting.substr(0, equals) == p.name && equals != std::string::npos)
      return {p.name, findChoice(p, setting.substr(equals + 1))};
  return parseSetting("--set", setting, parameters.front().name + "=0.1");
}

std::string formatParameters(const Generator& generator) {
  std::vector<Row> rows;
  for (const Parameter& p : generator.makeRequest().parameters)
    rows.push_back({p.name, p.choices.empty() ? formatNumber(*p.value) : p.choices[static_cast<size_t>(*p.value)],
                    p.choices.empty() ? "[" + p.unit + "]" : "", formatRange(p), p.help});
  std::ostringstream text;
  printTable(text, rows);
  return text.str();
}

int generate(const Generator& generator, const GenerateArguments& arguments) {
  const GeneratorRequest request = generator.makeRequest();
  std::string changes;
  for (const std::string& setting : arguments.settings) {
    const auto [name, value] = readSetting(request.parameters, setting);
    setParameter(request.parameters, name, value);
    changes += (changes.empty() ? " with " : ", ") + setting;
  }
  const Model model = request.make();
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
      "`bielle generate ROBOT --help` lists the parameters.");
}

}  // namespace bielle::cli
