// bielle-simulate: carries a motion out in a world.
#include <filesystem>
#include <iostream>
#include <memory>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "cli/simulate/free.h"
#include "cli/simulate/output.h"
#include "cli/simulate/prepare.h"
#include "cli/simulate/together.h"
#include "cli/simulate/watch.h"
#include "formats/yaml_entry.h"
#include "results/failure_message.h"
#include "results/interrupt.h"
#include "results/output_place.h"
#include "results/standard_output.h"
#include "worlds/carried_goals.h"
#include "worlds/make_world.h"

using namespace bielle;
using namespace bielle::worlds;

namespace {

int simulate(SimulateArguments arguments, const std::vector<std::string>& command) {
  parseOptions(arguments);
  // A motion that is not there yet, as in a dry run for one that will be solved, is none of a robot.
  if (!isFree(arguments) || (arguments.dry_run && !std::filesystem::exists(arguments.directory)))
    requireShortSteps(arguments, "--control-period", arguments.execution.control_period);
  if (arguments.dry_run) {
    if (!isFree(arguments)) requirePlan(arguments);
    if (!arguments.robot.empty()) requireParts(arguments, loadRobot(arguments.robot));
    tell(listIdleOptions(arguments));
    return kStood;
  }
  const bool is_of_plan = isOfPlan(arguments);
  if (arguments.robot.empty()) requireApart(arguments.output, {arguments.directory});
  watchInterrupts();
  if (!is_of_plan) return simulateFreely(arguments, command) ? kStood : kFell;
  const std::string reason = adaptToPlan(arguments);
  const Plan plan = obtainPlan(arguments);
  const PlanController controller = makeController(plan, arguments.control);
  Scene scene = makeScene(plan, arguments);
  const LoadedRobot& robot = scene.robot;
  const Ground& ground = scene.ground;
  std::vector<std::string>& warnings = scene.warnings;
  const double tolerance = controlsError(arguments.world) ? arguments.accuracy : 0;
  WorldOptions world_options{ground, arguments.time_step, &isInterrupted(), tolerance};
  world_options.wear = makeWear(arguments, robot);
  const auto world = makeWorld(arguments.world, scene.machine, world_options);
  for (const std::string& each : listIdleInPlan(arguments, plan, *world)) warnings.push_back(each);
  for (const std::string& each : world->warnings()) warnings.push_back("world " + arguments.world + ": " + each);
  tell(warnings);
  ExecutionOptions& options = arguments.execution;
  options.fall.only_whirling = controller.prediction != nullptr;
  makeOutputDirectory(arguments.output);
  const std::vector<GoalOutcome> planned = measurePlannedGoals(plan);
  const CarriedOut carried{arguments, plan, robot, planned, controller, ground, command, warnings};
  const auto writeFiles = [&carried](const Execution& execution) { return write(carried, execution); };
  ExecutionObserver observer;
  if (!arguments.summary_only) {  // a campaign's, which looks at nothing else
    const auto watch = std::make_shared<Watch>(arguments.live ? writeFiles : Watch::Show());
    observer = [watch](double time, double duration, const ExecutionSoFar& so_far) {
      watch->update(time, duration, so_far);
    };
  }
  requireNoInterrupt();
  const Execution execution = carryOut(plan, *controller.law, *world, arguments.perception, options, observer);
  noteOpenLoops(arguments.world, execution, warnings);
  print(carried, reason, execution);
  for (const std::string& path : writeFiles(execution)) std::cout << "  " << path << "\n";
  return getStatus(execution.outcome);
}

}  // namespace

int main(int argc, char** argv) {
  ignoreClosedPipes();
  CLI::App app{
      "Executes a motion in a physics simulation with contact: a result of `bielle solve`, or a motion that is solved "
      "first. A controller reads the robot's state and commands its motors; feet stand or slip as friction allows. "
      "Given a robot alone, lets it move freely, with or without feet, under torques, springs and pushes."};
  app.failure_message(bielle::cli::describeFailure);
  app.name("bielle simulate");
  SimulateArguments arguments;
  addOptions(app, arguments);
  app.footer(
      "A robot falls when its trunk leans by more than 0.8 rad from its planned attitude or its centre of mass\n"
      "is less than 0.6 times as high over the ground as planned, or a joint is more than 1.5 rad away from its\n"
      "planned angle. With --control mpc, a joint driven by a linkage counts only if the linkage has passed a\n"
      "dead point or the joint is half a turn away. It stands if it has been at rest, or its capture point over\n"
      "its soles, for the last three time constants sqrt(height / gravity); else the simulation goes on until\n"
      "that is decided, for up to 5 s. Exit status:\n"
      "0 it stands, 1 it fell, was stopped by Ctrl-C, or the simulation failed, 3 not decided (files are\n"
      "written all the same, unless Ctrl-C comes while the motion is still solved), 2 bad input.\n"
      "Examples:\n"
      "  bielle solve walk --robot bipetto --speed 0.4 -o walk\n"
      "  bielle simulate walk -o carried-out\n"
      "  bielle simulate walk -o fixed --control gains\n"
      "  bielle simulate walk -o pushed --push t=1.5,impulse=7,direction=90\n"
      "  bielle simulate walk --robot cleobot --speed 0.3 --duration 10 -o long\n"
      "  bielle simulate walk --robot bipetto --command tour.yaml --duration 20 -o tour\n"
      "  bielle simulate fourbar --state swing.json --world bielle,simbody,mujoco -o swing");
  if (argc == 2 && argv[1] == std::string("--yaml-keys")) {  // scripts/update_help.sh
    std::cout << describeYamlKeys();
    return kStood;
  }
  try {
    app.parse(argc, argv);
    noteGiven(app, arguments);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kStood : kBadInput;
  }
  try {
    const std::vector<std::string> command{argv, argv + argc};
    const int status =
        arguments.runs.empty() ? simulate(arguments, command) : simulateTogether(arguments.runs, command, simulate);
    finishStandardOutput();
    return status;
  } catch (const InterruptedPlan& error) {
    std::cerr << "bielle: error: " << error.what() << std::endl;
    return kFell;
  } catch (const std::exception& error) {
    std::cerr << "bielle: error: " << error.what() << std::endl;
  }
  return kBadInput;
}
