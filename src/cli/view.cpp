// bielle view ROBOT: the robot as a page, with a slider for each motor.
#include "bielle/report/view.h"

#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/commands.h"
#include "results/output_place.h"

namespace bielle::cli {
namespace {

struct ViewArguments {
  RobotArgument robot;
  std::string output;
};

int view(const ViewArguments& arguments) {
  const LoadedRobot robot = arguments.robot.load();
  const std::string path =
      arguments.output.empty() ? std::filesystem::path(robot.file).stem().string() + ".html" : arguments.output;
  requireApart(path, listFiles(robot));
  writeView(path, robot);
  std::cout << path << "\n";
  return kOk;
}

}  // namespace

void addView(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("view", "Show a robot as a page, with a slider for each motor");
  const auto arguments = std::make_shared<ViewArguments>();
  command.add_option("robot", arguments->robot.name, "name, directory, .urdf, .sdf, .yaml or MuJoCo .xml file")
      ->required();
  addFixedBase(command, arguments->robot);
  command.add_option("-o,--output", arguments->output, "the page; default: NAME.html here");
  command.footer(
      "The loops close as the sliders move, from precomputed samples; the page reports where they cannot close.\n"
      "Examples:\n"
      "  bielle view bipetto\n"
      "  bielle view robots/fourbar -o fourbar.html");
  command.callback([&action, arguments] { action = [=] { return view(*arguments); }; });
}

}  // namespace bielle::cli
