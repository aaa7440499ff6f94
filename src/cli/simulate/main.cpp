// bielle-simulate: carries a motion out in a world.
#include <iostream>
#include <map>
#include <memory>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/simulate/free.h"
#include "cli/simulate/output.h"
#include "cli/simulate/watch.h"
#include "model/number_text.h"
#include "results/interrupt.h"
#include "results/output_place.h"
#include "results/setting.h"
#include "results/standard_output.h"
#include "worlds/commanded_plan.h"
#include "worlds/make_world.h"

using namespace bielle;
using namespace bielle::worlds;

namespace {

constexpr double kRealLookAhead = 36;  // ms
constexpr int kStood = 0, kFell = 1, kBadInput = 2;

// Predictive control needs states with closed loops, which other formulations do not have.
void chooseControl(SimulateArguments& arguments) {
  if (!arguments.control.empty()) return;
  arguments.control = "mpc";
  if (!arguments.robot.empty() || arguments.execution.real_time ||
      readSummary(arguments.directory).formulation == Formulation::Reduced)
    return;
  arguments.control = "gains";
  arguments.reason = "mpc cannot carry out motions solved with --formulation full";
}

// Options of free motions alone.
void requirePlan(const SimulateArguments& arguments) {
  const std::pair<bool, const char*> options[] = {{!arguments.posture.empty(), "--posture"},
                                                  {!arguments.state.empty(), "--state"},
                                                  {!arguments.torques.empty(), "--torques"},
                                                  {!arguments.push_body.empty(), "--push-body"},
                                                  {!arguments.springs.empty(), "--spring"}};
  for (const auto& [is_given, name] : options)
    if (is_given)
      throw InputError("", name, "a motion has its own start and torques", "leave it out, or give a robot alone");
  if (arguments.world.find(',') != std::string::npos)
    throw InputError("", "--world", "a motion is carried out in one world at a time", "give one");
}

// The motion solved before or, where a robot is given, the motion of that name.
std::unique_ptr<Plan> obtainPlan(const SimulateArguments& arguments) {
  const std::map<std::string, PlanControl> controls{
      {"open", PlanControl::Open}, {"gains", PlanControl::Gains}, {"mpc", PlanControl::Predictive}};
  const PlanControl control = controls.at(arguments.control);
  const std::map<std::string, Belief> beliefs{
      {"closed", Belief::Closed}, {"serial", Belief::Serial}, {"ratio", Belief::Ratio}};
  std::optional<Belief> belief;
  if (!arguments.model.empty()) belief = beliefs.at(arguments.model);
  if (arguments.robot.empty()) {
    if (arguments.speed || !arguments.settings.empty())
      throw InputError("", arguments.speed ? "--speed" : "--set", "a solved motion has its own",
                       "give --robot and the name of a motion");
    return readPlan(arguments.directory, control, arguments.predictive, belief);
  }
  PlanRequest request{
      arguments.directory, arguments.robot, {}, arguments.execution.duration, belief.value_or(Belief::Closed)};
  if (arguments.speed) request.settings.emplace_back("speed", *arguments.speed);
  for (const std::string& setting : arguments.settings) {
    const auto [name, value] = splitSetting("--set", setting, "steps=8");
    request.settings.emplace_back(name, parseOption(value));
  }
  if (!arguments.commands.empty()) return makeCommandedPlan(request, arguments.commands, arguments.predictive);
  return makePlan(request, control, arguments.predictive);
}

// A robot that is not quite the one that its controller knows, if errors are given.
std::optional<Model> makeOtherRobot(const Plan& plan, const SimulateArguments& arguments) {
  RobotErrors errors = arguments.errors;
  errors.seed = arguments.seed;
  if (errors.isZero()) return std::nullopt;
  Model machine = makeMachine(plan.robot.model, errors);
  VectorXd q = plan.robot.model.makeNeutral(), v = VectorXd::Zero(plan.robot.model.nv());
  plan.getReference().getReference(0, q, v);
  try {
    if (!machine.references().empty()) makeStandingPosture(machine);
    assembleMachine(plan.robot.model, machine, q);
  } catch (const InputError& error) {  // which names the robot's file, where nothing is wrong
    if (errors.rod == 0) throw;
    throw InputError("", "--rod-error " + formatNumber(errors.rod),
                     std::string("the loops of such a robot do not close: ") + error.what(), "give a smaller error");
  }
  return machine;
}

int simulate(SimulateArguments arguments, const std::vector<std::string>& command) {
  parseOptions(arguments);
  if (arguments.dry_run) return kStood;
  if (arguments.robot.empty()) requireApart(arguments.output, {arguments.directory});
  watchInterrupts();
  if (isFree(arguments)) return simulateFreely(arguments, command) ? kStood : kFell;
  requirePlan(arguments);
  const double look_ahead = 1e-3 * arguments.look_ahead.value_or(arguments.sensors == "real" ? kRealLookAhead : 0);
  arguments.predictive.look_ahead = look_ahead;
  chooseControl(arguments);
  const auto plan = obtainPlan(arguments);
  const Model& model = plan->robot.model;
  plan->policy->setLookAhead(look_ahead);
  ExecutionOptions& options = arguments.execution;
  if (arguments.sensors == "real") {
    options.perception.sensors = SensorOptions{makeRealParts(), arguments.noise, arguments.seed, {}};
    options.perception.planned = plan->schedule;
  }
  const Ground ground = makeGround(arguments, plan->ground);
  options.ground = ground;
  options.planned_ground = plan->ground;
  options.fall.only_whirling = plan->predictive != nullptr;
  options.interrupt = &isInterrupted();
  const std::optional<Model> machine = makeOtherRobot(*plan, arguments);
  const Model& robot = machine ? *machine : model;
  const auto world =
      makeWorld(arguments.world, robot, {ground, arguments.time_step, options.interrupt, arguments.accuracy});
  makeOutputDirectory(arguments.output);
  const auto writeFiles = [&](const Execution& execution) {
    return write(arguments, *plan, ground, execution, command);
  };
  ExecutionObserver observer;
  if (!arguments.summary_only) {  // a campaign's, which looks at nothing else
    const auto watch = std::make_shared<Watch>(arguments.live ? writeFiles : Watch::Show());
    observer = [watch](double time, double duration, const ExecutionSoFar& so_far) {
      watch->update(time, duration, so_far);
    };
  }
  requireNoInterrupt();
  const Execution execution = execute(robot, plan->getReference(), plan->getController(), *world, options, observer);
  print(arguments, *plan, execution);
  for (const std::string& path : writeFiles(execution)) std::cout << "  " << path << "\n";
  return execution.outcome == Outcome::Stood ? kStood : kFell;
}

}  // namespace

int main(int argc, char** argv) {
  ignoreClosedPipes();
  CLI::App app{
      "Executes a motion in a physics simulation with contact: a result of `bielle solve`, or a motion that is solved "
      "first. A controller reads the robot's state and commands its motors; feet stand or slip as friction allows. "
      "Given a robot alone, lets it move freely, with or without feet, under torques, springs and pushes."};
  app.name("bielle simulate");
  SimulateArguments arguments;
  addOptions(app, arguments);
  app.footer(
      "A robot falls when its trunk leans by more than 0.8 rad from its planned attitude or is less than 0.6 times\n"
      "as high over the ground as planned, or a joint is more than 1.5 rad away from its planned angle. With\n"
      "--control mpc, a joint driven by a linkage counts only if the linkage has passed a dead point or the joint is "
      "half\n"
      "a turn away. Exit status: 0 it stood to the end, 1 it fell, was stopped by Ctrl-C, or the simulation failed "
      "(files\n"
      "are written all the same, unless Ctrl-C comes while the motion is still solved), 2 bad input.\n"
      "Examples:\n"
      "  bielle solve walk --robot bipetto --speed 0.4 -o walk\n"
      "  bielle simulate walk -o carried-out\n"
      "  bielle simulate walk -o fixed --control gains\n"
      "  bielle simulate walk -o pushed --push t=1.5,impulse=7,direction=90\n"
      "  bielle simulate walk --robot cleobot --speed 0.3 --duration 10 -o long\n"
      "  bielle simulate walk --robot bipetto --command tour.yaml --duration 20 -o tour\n"
      "  bielle simulate fourbar --state swing.json --world bielle,simbody,mujoco -o swing");
  try {
    app.parse(argc, argv);
    arguments.has_record_period = app.count("--record-period") > 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kStood : kBadInput;
  }
  try {
    const int status = simulate(arguments, {argv, argv + argc});
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
