// bielle view ROBOT: the robot as a page, with a slider for each motor.
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "bielle/model/error.h"
#include "bielle/report/report.h"
#include "cli/commands.h"
#include "cli/film.h"
#include "cli/parameter_range.h"
#include "results/output_place.h"
#include "robots/generator_entry.h"

namespace bielle::cli {
namespace {

constexpr int kSamples = 7;  // of a parameter

struct ViewArguments {
  RobotArgument robot;
  std::vector<std::string> parameters;  // NAME or NAME=LOW:HIGH
  std::string output, png;
};

// Robots of a parameter from low to high, that of the robot itself among them.
ViewParameter makeParameter(const std::string& text, const LoadedRobot& robot, const GeneratorEntry& entry) {
  const ParameterRange range = readParameterRange("--parameter", text, entry.parameters);
  ViewParameter out{range.name, range.unit, {}, {}, 0};
  const double width = range.high - range.low;
  for (int i = 0; i < kSamples; ++i) out.values.push_back(range.low + width * i / (kSamples - 1));
  out.start = static_cast<size_t>(std::lround((range.value - range.low) / width * (kSamples - 1)));
  out.values[out.start] = range.value;
  for (const double sample : out.values) {
    OptionSet parameters = entry.parameters;
    parameters.set(range.name, sample);
    out.robots.emplace_back(robot);
    try {
      out.robots.back()->model = entry.generator.make(parameters);
    } catch (const InputError&) {  // impossible with the other parameters
      out.robots.back().reset();
    }
  }
  return out;
}

int view(const ViewArguments& arguments) {
  const LoadedRobot robot = arguments.robot.load();
  const std::string path =
      arguments.output.empty() ? std::filesystem::path(robot.file).stem().string() + ".html" : arguments.output;
  requireApart(path, listFiles(robot));
  if (!arguments.png.empty()) requireApart(arguments.png, listFiles(robot));
  std::vector<ViewParameter> parameters;
  if (!arguments.parameters.empty()) {
    const std::optional<GeneratorEntry> entry = readGeneratorOf(robot.file);
    if (!entry)
      throw InputError(robot.path(), "option --parameter", "the robot is given by its figures and has no parameters",
                       "give a robot of a generator, or one composed of parts");
    for (const std::string& text : arguments.parameters) parameters.push_back(makeParameter(text, robot, *entry));
  }
  writeView(path, robot, parameters);
  std::cout << path << "\n";
  if (!arguments.png.empty()) {
    writeScreenshot(path, arguments.png);
    std::cout << arguments.png << "\n";
  }
  return kOk;
}

}  // namespace

void addView(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<ViewArguments>();
  addRobot(command, arguments->robot);
  addRobotFlags(command, arguments->robot);
  command
      .add_option(
          "--parameter", arguments->parameters,
          "a slider for this parameter of a generated robot, 30 % about its value or over a range; may be repeated")
      ->type_name(kParameterRange);
  command.add_option("-o,--output", arguments->output, "the page; default: NAME.html here");
  command.add_option("--png", arguments->png, "also a picture of the page as it opens; needs chromium");
  command.footer(
      "The loops close as the sliders move, from precomputed samples; the page reports where they cannot close.\n"
      "Examples:\n"
      "  bielle view bipetto\n"
      "  bielle view robots/fourbar -o fourbar.html\n"
      "  bielle view leg_biped --parameter knee_crank --parameter knee_arm=0.03:0.08");
  command.callback([&action, arguments] { action = [=] { return view(*arguments); }; });
}

}  // namespace bielle::cli
