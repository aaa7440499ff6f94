// bielle-simulate: carries a solved motion out in a world.
#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "bielle/model/error.h"
#include "bielle/report/report.h"
#include "io/standard_output.h"
#include "io/text_file.h"
#include "model/text_file.h"
#include "simulation/execution.h"
#include "simulation/make_world.h"
#include "simulation/plan.h"
#include "simulation/planned_record.h"
#include "simulation/robot_errors.h"
#include "simulation/terrain.h"

using namespace bielle;
using namespace bielle::simulation;

namespace {

constexpr double kRealLookAhead = 36;  // ms
constexpr int kStood = 0, kFell = 1, kBadInput = 2;

struct Arguments {
  std::string directory, output, world = "bielle", control = "gains", terrain = "planned";
  std::string robot;  // of a motion that is to be solved; empty: `directory` holds one
  std::optional<double> speed;
  std::vector<std::string> settings;  // name=value
  std::vector<std::string> pushes;
  double friction = 0;  // 0: that of the plan
  double time_step = 0;
  std::string sensors = "ideal";
  double noise = 1;
  std::optional<double> look_ahead;  // ms
  double delay = 0, jitter = 0;      // ms
  RobotErrors errors;
  unsigned seed = 1;
  bool no_report = false, summary_only = false, dry_run = false;
  ExecutionOptions execution;
  PredictiveOptions predictive;
};

std::pair<std::string, double> parseNumber(const std::string& flag, const std::string& text, const char* example) {
  const size_t equals = text.find('=');
  double value = 0;
  const char* end = text.data() + text.size();
  const char* begin = equals == std::string::npos ? end : text.data() + equals + 1;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value))
    throw ModelError("", flag + " '" + text + "'", "it is not of the form name=number", std::string("e.g. ") + example);
  return {text.substr(0, equals), value};
}

// "t=3,impulse=6,direction=90,duration=0.1"
Push parsePush(const std::string& text) {
  constexpr const char* kExample = "--push t=3,impulse=6,direction=90,duration=0.1";
  Push push;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const auto [name, value] = parseNumber("--push", part, kExample);
    if (name == "t")
      push.time = value;
    else if (name == "impulse")
      push.impulse = value;
    else if (name == "direction")
      push.direction = value;
    else if (name == "duration")
      push.duration = value;
    else
      throw ModelError("", "--push '" + part + "'", "there is no '" + name + "'", std::string("e.g. ") + kExample);
  }
  if (!(push.duration > 0 && push.time >= 0))
    throw ModelError("", "--push '" + text + "'", "its time or its duration is not positive",
                     std::string("e.g. ") + kExample);
  return push;
}

// "planned", "flat", "ramp=0.05" or "tiles=0.01"
Ground makeGround(const Arguments& arguments, const Ground& planned) {
  Ground ground;
  if (arguments.terrain == "planned") {
    ground = planned;
  } else if (arguments.terrain != "flat") {
    const auto [name, value] = parseNumber("--terrain", arguments.terrain, "--terrain tiles=0.01");
    if (name == "ramp") {
      RampOptions ramp;
      ramp.slope = value;
      ground = makeRamp(ramp);
    } else if (name == "tiles") {
      TileOptions tiles;
      tiles.height = value;
      tiles.seed = arguments.seed;
      ground = makeTiles(tiles);
    } else {
      throw ModelError("", "terrain '" + name + "'", "there is no such terrain",
                       "choose one of: planned, flat, ramp=SLOPE, tiles=HEIGHT");
    }
  }
  ground.friction = arguments.friction > 0 ? arguments.friction : planned.friction;
  return ground;
}

// A motion that happened, in the form of a solved one.
MotionResult makeResult(const Arguments& arguments, const Plan& plan, const Ground& ground, const Execution& execution,
                        const std::vector<std::string>& command) {
  MotionResult result;
  result.run = {plan.summary.robot, plan.robot.file, command};
  result.motion = plan.summary.motion;
  result.formulation = plan.summary.formulation;
  result.requested = plan.summary.requested;
  const int stages = static_cast<int>(execution.record.u.rows());
  result.schedule.phases.push_back({"simulated", stages, arguments.execution.record_period, {}});
  result.ground = ground;
  result.solver.termination =
      execution.outcome == Outcome::Stood ? FddpTermination::Converged : FddpTermination::Failed;
  result.solver.message = std::string("carried out: it ") + getName(execution.outcome);
  result.record = execution.record;
  result.objective = plan.summary.objective;
  setFigures(plan.robot.model, result);
  result.gap_position = execution.largest_gap;  // also between the rows of the record
  result.slip_position = execution.largest_slip;
  return result;
}

nlohmann::ordered_json listBooks(const Execution& e) {
  return {{"energy_start_J", e.start.getEnergy()}, {"energy_end_J", e.end.getEnergy()},
          {"motor_work_J", e.end.motor_work},      {"push_work_J", e.end.push_work},
          {"contact_loss_J", e.end.contact_loss},  {"stop_loss_J", e.end.stop_loss},
          {"other_loss_J", e.end.other_loss},      {"imbalance_J", e.imbalance}};
}

// The drift of a robot that went nowhere is no share of its way.
nlohmann::ordered_json listEstimation(const EstimationErrors& e) {
  constexpr double kShortestWay = 0.1;  // m
  const nlohmann::ordered_json share = e.way > kShortestWay ? nlohmann::ordered_json(e.drift / e.way) : nullptr;
  return {{"position_error", {{"rms", e.position_rms}, {"max", e.position_max}}},
          {"velocity_error", {{"rms", e.velocity_rms}, {"max", e.velocity_max}}},
          {"tilt_error", {{"rms", e.tilt_rms}, {"max", e.tilt_max}}},
          {"drift", e.drift},
          {"drift_share", share},
          {"contact_errors", e.contact_errors}};
}

nlohmann::ordered_json listSolves(const PredictiveCounts& counts) {
  return {{"count", counts.solves},
          {"missed", counts.missed},
          {"failed", counts.failed},
          {"median_ms", 1e3 * counts.calcQuantile(0.5)},
          {"p99_ms", 1e3 * counts.calcQuantile(0.99)},
          {"worst_ms", 1e3 * counts.calcQuantile(1)}};
}

nlohmann::ordered_json listPushes(const std::vector<Push>& pushes) {
  auto list = nlohmann::ordered_json::array();
  for (const Push& push : pushes)
    list.push_back({{"time_s", push.time},
                    {"impulse_Ns", push.impulse},
                    {"direction_deg", push.direction},
                    {"duration_s", push.duration}});
  return list;
}

// Adds what happened to the summary of the result.
void extendSummary(const std::string& path, const Arguments& arguments, const Plan& plan, const Execution& e) {
  auto summary = nlohmann::ordered_json::parse(readTextFile(path));
  summary["world"] = arguments.world;
  summary["control"] = arguments.control;
  if (plan.predictive) summary["solves"] = listSolves(plan.predictive->getCounts());
  for (const auto& [name, value] : plan.summary.requested)
    if (name == "speed") summary["commanded_speed"] = value;
  summary["terrain"] = arguments.terrain;
  summary["sensors"] = arguments.sensors;
  if (arguments.sensors == "real") {
    summary["noise"] = arguments.noise;
    summary["estimator"] = listEstimation(e.estimation);
  }
  summary["robot_errors"] = {{"mass", arguments.errors.mass}, {"rod_m", arguments.errors.rod}};
  summary["delay"] = {{"mean_ms", arguments.delay}, {"jitter_ms", arguments.jitter}};
  summary["seed"] = arguments.seed;
  summary["pushes"] = listPushes(arguments.execution.pushes);
  summary["gain_iterations"] = plan.iterations;
  summary["outcome"] = getName(e.outcome);
  summary["outcome_message"] = e.message;
  summary["fell"] = e.outcome == Outcome::Fell;
  summary["fall_time"] = e.outcome == Outcome::Fell ? nlohmann::ordered_json(e.duration) : nullptr;
  summary["duration"] = e.duration;
  summary["distance"] = e.distance;
  summary["mean_speed"] = e.getMeanSpeed();
  summary["largest_deviation"] = e.largest_deviation;
  summary["largest_gap"] = e.largest_gap;
  summary["largest_slip"] = e.largest_slip;
  summary["energy_balance"] = e.energy_balance;
  summary["books"] = listBooks(e);
  summary["saturated_share"] = e.saturated_share;
  summary["real_time_factor"] = e.real_time_factor;
  writeTextFile(path, summary.dump(2) + "\n");
}

void print(const Arguments& arguments, const Plan& plan, const Execution& e) {
  std::cout << plan.summary.motion << " of " << plan.summary.robot << " in world " << arguments.world << ", control "
            << arguments.control << ": it " << getName(e.outcome);
  if (!e.message.empty()) std::cout << " (" << e.message << ")";
  char text[600];
  std::snprintf(
      text, sizeof text,
      "\n  duration            %.3f s\n  distance            %.3f m, %.3f m/s\n"
      "  trunk off its plan  %.4f m at most\n  closures            open by %.1e m at most\n"
      "  soles               slip by %.1e m at most\n  energy balance      %.1e J, %.1e of what was exchanged\n"
      "  torques             %.2f %% cut at their limits\n  speed               %.2g times real time\n",
      e.duration, e.distance, e.getMeanSpeed(), e.largest_deviation, e.largest_gap, e.largest_slip, e.imbalance,
      e.energy_balance, 100 * e.saturated_share, e.real_time_factor);
  std::cout << text;
  if (plan.predictive) {
    const PredictiveCounts& c = plan.predictive->getCounts();
    std::snprintf(text, sizeof text,
                  "  solves              %d, %d failed; median %.1f ms, 99 %% %.1f ms, worst %.1f ms\n"
                  "                      %d took longer than they would have in real time\n",
                  c.solves, c.failed, 1e3 * c.calcQuantile(0.5), 1e3 * c.calcQuantile(0.99), 1e3 * c.calcQuantile(1),
                  c.missed);
    std::cout << text;
  }
  if (arguments.sensors != "real") return;
  const EstimationErrors& s = e.estimation;
  std::snprintf(text, sizeof text,
                "  estimated trunk     off by %.4f m and %.4f m/s rms, tilt by %.4f rad\n"
                "  drift               %.4f m of %.3f m\n  contacts            wrong for %.2f %% of the time\n",
                s.position_rms, s.velocity_rms, s.tilt_rms, s.drift, s.way, 100 * s.contact_errors);
  std::cout << text;
}

// The files of a motion that happened; returns their paths.
std::vector<std::string> write(const Arguments& arguments, const Plan& plan, const Execution& execution,
                               const MotionResult& result) {
  const std::filesystem::path output = arguments.output;
  const std::string summary = (output / "summary.json").string();
  if (arguments.summary_only) {
    writeSummary(arguments.output, result);
    extendSummary(summary, arguments, plan, execution);
    return {summary};
  }
  std::vector<std::string> paths = writeResult(arguments.output, result);
  extendSummary(summary, arguments, plan, execution);
  paths.push_back((output / "plan.npz").string());
  writeNpz(paths.back(), makePlannedRecord(plan.robot.model, *plan.policy, execution.record));
  if (!arguments.no_report) {
    paths.push_back((output / "report.html").string());
    writeReport(paths.back(), {arguments.output});
  }
  return paths;
}

// What can be checked of the options without the motion.
void parseOptions(Arguments& arguments) {
  for (const std::string& push : arguments.pushes) arguments.execution.pushes.push_back(parsePush(push));
  if (arguments.jitter > arguments.delay)
    throw ModelError("", "--jitter", "it is longer than the delay", "give at most --delay");
  arguments.execution.delay = {1e-3 * arguments.delay, 1e-3 * arguments.jitter, arguments.seed};
  makeGround(arguments, {});
}

// The motion solved before or, where a robot is given, the motion of that name.
std::unique_ptr<Plan> obtainPlan(const Arguments& arguments) {
  const std::map<std::string, PlanControl> controls{
      {"open", PlanControl::Open}, {"gains", PlanControl::Gains}, {"mpc", PlanControl::Predictive}};
  const PlanControl control = controls.at(arguments.control);
  if (arguments.robot.empty()) {
    if (arguments.speed || !arguments.settings.empty())
      throw ModelError("", arguments.speed ? "--speed" : "--set", "a motion solved before has its own",
                       "give --robot and the name of a motion");
    return readPlan(arguments.directory, control, arguments.predictive);
  }
  PlanRequest request{arguments.directory, arguments.robot, {}, arguments.execution.duration};
  if (arguments.speed) request.settings.emplace_back("speed", *arguments.speed);
  for (const std::string& setting : arguments.settings)
    request.settings.push_back(parseNumber("--set", setting, "--set steps=8"));
  return makePlan(request, control, arguments.predictive);
}

int simulate(Arguments arguments, const std::vector<std::string>& command) {
  parseOptions(arguments);
  if (arguments.dry_run) return kStood;
  const auto plan = obtainPlan(arguments);
  const Model& model = plan->robot.model;
  const double look_ahead = arguments.look_ahead.value_or(arguments.sensors == "real" ? kRealLookAhead : 0);
  plan->policy->setLookAhead(1e-3 * look_ahead);
  if (arguments.sensors == "real") {
    arguments.execution.perception.sensors = SensorOptions{makeRealParts(), arguments.noise, arguments.seed, {}};
    arguments.execution.perception.planned = plan->schedule;
  }
  const Ground ground = makeGround(arguments, plan->ground);
  arguments.execution.ground = ground;
  arguments.execution.planned_ground = plan->ground;
  arguments.errors.seed = arguments.seed;
  const Model machine = makeMachine(model, arguments.errors);
  const Model& robot = arguments.errors.isZero() ? model : machine;
  const auto world = makeWorld(arguments.world, robot, {ground, arguments.time_step});
  makeOutputDirectory(arguments.output);
  const Execution execution = execute(robot, *plan->policy, plan->getController(), *world, arguments.execution);
  print(arguments, *plan, execution);
  const MotionResult result = makeResult(arguments, *plan, ground, execution, command);
  for (const std::string& path : write(arguments, *plan, execution, result)) std::cout << "  " << path << "\n";
  return execution.outcome == Outcome::Stood ? kStood : kFell;
}

void addOptions(CLI::App& app, Arguments& a) {
  const auto positive = CLI::PositiveNumber;
  app.add_option(
         "DIR", a.directory,
         "result of `bielle solve`: a motion of the closed robot; with --robot the name of a motion, which is solved "
         "first")
      ->required();
  app.add_option("--robot", a.robot, "name or directory of the robot that is to make the motion of this name");
  app.add_option("--speed", a.speed, "of that motion [m/s]");
  app.add_option("--set", a.settings,
                 "name=value: another option of that motion, as in `bielle solve`; may be repeated")
      ->allow_extra_args(false);
  app.add_option(
         "-o,--output", a.output,
         "directory for trajectory.csv, trajectory.npz and summary.json of the motion that happened, plan.npz (the "
         "plan at the same times) and report.html")
      ->required();
  app.add_option(
         "--world", a.world,
         "bielle: its own dynamics and contact law, fixed steps; simbody: Simbody's dynamics, the same contact law, "
         "steps of controlled error, 30 times slower; mujoco: MuJoCo, closures and contacts soft constraints "
         "(where Bielle was built with it)")
      ->check(CLI::IsMember(listWorlds()))
      ->capture_default_str();
  app.add_option(
         "--control", a.control,
         "open: the torques of the plan; gains: and the gains of the solver's last sweep times the deviation from "
         "the plan, for which the motion is solved again; mpc: predictive control, which solves the next second anew "
         "at "
         "every stage, from the state that is measured")
      ->check(CLI::IsMember({"open", "gains", "mpc"}))
      ->capture_default_str();
  app.add_option("--nodes", a.predictive.nodes, "stages that predictive control looks ahead")
      ->check(CLI::Range(10, 1000))
      ->capture_default_str();
  app.add_option("--iterations", a.predictive.iterations, "of predictive control, at every stage")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--threads", a.predictive.threads, "of predictive control; 0: all. Results do not depend on it")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--terrain", a.terrain,
                 "planned: the ground of the plan; flat; ramp=SLOPE: height over length [1], from x = 0.3 m on; "
                 "tiles=HEIGHT: of 0.25 m, heights at random up to that [m], from x = 0.2 m on")
      ->capture_default_str();
  app.add_option("--friction", a.friction, "coefficient of the ground [1]; 0: that of the plan")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--seed", a.seed, "of the heights of tiles, of the jitter, of the noise and of errors of the robot")
      ->capture_default_str();
  app.add_option("--push", a.pushes,
                 "t=3,impulse=6,direction=90,duration=0.1: a constant force on the trunk from t [s] on, of an impulse "
                 "[N s], in a direction [degrees, 0: along x, 90: along y] and for a duration [s]; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--duration", a.execution.duration, "of the simulation [s]; 0: that of the plan and --hold")
      ->check(CLI::Range(0.0, 1e4))
      ->capture_default_str();
  app.add_option("--hold", a.execution.hold, "how long the robot stands in its last posture after the plan [s]")
      ->check(CLI::Range(0.0, 1e4))
      ->capture_default_str();
  app.add_option("--time-step", a.time_step, "of worlds with fixed steps [s]; 0: the world's own")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
  app.add_option("--control-period", a.execution.control_period, "between updates of the torques [s]")
      ->check(positive)
      ->capture_default_str();
  app.add_option(
         "--sensors", a.sensors,
         "ideal: the controller is told the true state; real: what an estimator makes of encoders of the motors and an "
         "inertial measurement unit in the trunk")
      ->check(CLI::IsMember({"ideal", "real"}))
      ->capture_default_str();
  app.add_option("--noise", a.noise, "of real sensors, over that of their data sheets [1]; 0: exact")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_option(
         "--look-ahead", a.look_ahead,
         "how far before the end of a phase of contacts its last gains are taken [ms]: those after them ask for "
         "more than an estimated state can give (default: 36 with real sensors, else 0)")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option(
         "--mass-error", a.errors.mass,
         "of the robot in the world [1]: masses and inertias of its bodies are those that the controller believes "
         "in, times 1 plus or minus this, at random")
      ->check(CLI::Range(0.0, 0.99))
      ->capture_default_str();
  app.add_option("--rod-error", a.errors.rod,
                 "of the robot in the world [m]: one frame of each closure is moved by up to this along each axis, at "
                 "random")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
  app.add_option("--delay", a.delay, "from a measurement until the torques computed from it act [ms]")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_option("--jitter", a.jitter,
                 "each delay differs from --delay by at most this, at random [ms]; not above --delay")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_option("--record-period", a.execution.record_period, "between rows of the trajectory [s]")
      ->check(positive)
      ->capture_default_str();
  app.add_flag("--no-report", a.no_report, "writes no report.html");
  app.add_flag("--summary-only", a.summary_only, "writes summary.json alone");
  app.add_flag("--dry-run", a.dry_run, "checks the options; reads no motion, carries nothing out, writes nothing");
}

}  // namespace

int main(int argc, char** argv) {
  ignoreClosedPipes();
  CLI::App app{
      "Carries a motion out in physics with contact, one that `bielle solve` wrote or one that is solved first: a "
      "controller reads the state of the robot and commands its motors, feet stand or slip as the ground lets them."};
  app.name("bielle simulate");
  Arguments arguments;
  addOptions(app, arguments);
  app.footer(
      "A robot falls when its trunk leans by more than 0.8 rad from its planned attitude or is less than 0.6 times\n"
      "as high over the ground as planned, or a joint is more than 1.5 rad away from its planned angle. Exit status:\n"
      "0 it stood to the end, 1 it fell or the world broke off (files are written all the same), 2 bad input.\n"
      "Examples:\n"
      "  bielle solve walk --robot bipetto --speed 0.4 -o walk\n"
      "  bielle simulate walk -o carried-out\n"
      "  bielle simulate walk -o pushed --control mpc --push t=1.5,impulse=7,direction=90\n"
      "  bielle simulate walk --robot cleobot --speed 0.3 --duration 10 --control mpc -o long");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kStood : kBadInput;
  }
  try {
    const int status = simulate(arguments, {argv, argv + argc});
    finishStandardOutput();
    return status;
  } catch (const std::exception& error) {
    std::cerr << "bielle: error: " << error.what() << std::endl;
  }
  return kBadInput;
}
