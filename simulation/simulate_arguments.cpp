#include "simulation/simulate_arguments.h"

#include <cmath>
#include <sstream>

#include "bielle/model/error.h"
#include "io/setting.h"
#include "simulation/make_world.h"
#include "simulation/terrain.h"

namespace bielle::simulation {
namespace {

// "t=3,impulse=6,direction=90,duration=0.1"
Push parsePush(const std::string& text) {
  constexpr const char* kExample = "t=3,impulse=6,direction=90,duration=0.1";
  Push push;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const auto [name, value] = parseSetting("--push", part, kExample);
    if (name == "t")
      push.time = value;
    else if (name == "impulse")
      push.impulse = value;
    else if (name == "direction")
      push.direction = value;
    else if (name == "duration")
      push.duration = value;
    else
      throw ModelError("", "--push '" + part + "'", "there is no '" + name + "'",
                       std::string("e.g. --push ") + kExample);
  }
  if (!(push.duration > 0 && push.time >= 0 &&
        std::isfinite(push.duration + push.time + push.impulse + push.direction)))
    throw ModelError("", "--push '" + text + "'",
                     "its duration is not positive, its time negative, or a number not finite",
                     std::string("e.g. --push ") + kExample);
  return push;
}

}  // namespace

Ground makeGround(const SimulateArguments& arguments, const Ground& planned) {
  Ground ground;
  if (arguments.terrain == "planned") {
    ground = planned;
  } else if (arguments.terrain != "flat") {
    const auto [name, value] = parseSetting("--terrain", arguments.terrain, "tiles=0.01");
    if (!std::isfinite(value)) throw ModelError("", "terrain '" + name + "'", "it is not finite", "e.g. tiles=0.01");
    if (name == "ramp") {
      RampOptions ramp;
      ramp.slope = value;
      ground = makeRamp(ramp);
    } else if (name == "tiles" || name == "uneven") {
      TileOptions tiles;
      tiles.height = value;
      if (name == "uneven") tiles.lowest = -value;
      tiles.seed = arguments.seed;
      ground = makeTiles(tiles);
    } else {
      throw ModelError("", "terrain '" + name + "'", "there is no such terrain",
                       "choose one of: planned, flat, ramp=SLOPE, tiles=HEIGHT, uneven=HEIGHT");
    }
  }
  ground.friction = arguments.friction > 0 ? arguments.friction : planned.friction;
  return ground;
}

void parseOptions(SimulateArguments& arguments) {
  for (const std::string& push : arguments.pushes) arguments.execution.pushes.push_back(parsePush(push));
  if (!arguments.commands.empty()) {
    if (arguments.robot.empty() || arguments.control != "mpc")
      throw ModelError("", "--command",
                       "commands are followed by predictive control of a walk that is not solved before",
                       "give the motion walk, --robot and --control mpc");
    if (arguments.speed) throw ModelError("", "--speed", "the commands have the speed", "leave it out");
    if (!arguments.model.empty() && arguments.model != "closed")
      throw ModelError("", "--model " + arguments.model, "walks by command are those of the closed model",
                       "leave it out");
    readCommands(arguments.commands);
  }
  if (arguments.execution.real_time && arguments.live)
    throw ModelError("", "--live", "writing files would hold the world up, which is to keep to the clock",
                     "leave out --real-time");
  if (arguments.execution.real_time && arguments.control != "mpc")
    throw ModelError("", "--real-time", "only predictive control solves anything on the way", "give --control mpc");
  arguments.predictive.own_thread = arguments.execution.real_time;
  if (arguments.jitter > arguments.delay)
    throw ModelError("", "--jitter", "it is longer than the delay", "give at most --delay");
  arguments.execution.delay = {1e-3 * arguments.delay, 1e-3 * arguments.jitter, arguments.seed};
  makeGround(arguments, {});
}

void addOptions(CLI::App& app, SimulateArguments& a) {
  const auto positive = CLI::PositiveNumber;
  app.add_option(
         "DIR", a.directory,
         "result of `bielle solve`: a motion of the closed robot; with --robot the name of a motion, which is solved "
         "first")
      ->required();
  app.add_option("--robot", a.robot, "name or directory of the robot that is to make the motion of this name");
  app.add_option("--speed", a.speed, "of that motion [m/s]");
  app.add_option(
      "--command", a.commands,
      "FILE: YAML, a velocity over time that a walk follows with --control mpc; its steps are made on the way. "
      "Entries such as {time: 4, forward: 0.3, sideways: 0, turning: 0.4} [s, m/s, m/s to the left, rad/s to the "
      "left], each until the next one");
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
         "the plan, for which the motion is solved again; mpc: predictive control, which solves "
         "the next second anew at every stage, from the state that is measured")
      ->check(CLI::IsMember({"open", "gains", "mpc"}))
      ->capture_default_str();
  app.add_option(
         "--model", a.model,
         "what the controller takes the robot for. closed: what it is; serial: a serial chain with motors on "
         "its joints, whose torques the linkages pass on as they do in the present posture; ratio: the same, as "
         "if the linkages were gears of the ratio that they have where the robot stands (default: the model of "
         "the motion)")
      ->check(CLI::IsMember({"closed", "serial", "ratio"}));
  app.add_option("--nodes", a.predictive.nodes, "stages that predictive control looks ahead")
      ->check(CLI::Range(10, 1000))
      ->capture_default_str();
  app.add_option("--iterations", a.predictive.iterations, "of predictive control, at every stage")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--threads", a.predictive.threads, "of predictive control; 0: all. Results do not depend on it")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_flag(
      "--real-time", a.execution.real_time,
      "the world keeps to the clock while predictive control solves in a thread of its own: policies that come "
      "late are waited for by no one, and results depend on the machine");
  app.add_option("--terrain", a.terrain,
                 "planned: the ground of the plan; flat; ramp=SLOPE: height over length [1], from x = 0.3 m on; "
                 "tiles=HEIGHT: of 0.25 m, heights at random up to that [m], from x = 0.2 m on; uneven=HEIGHT: "
                 "likewise, from that "
                 "much below the plan on")
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
  app.add_option("--look-ahead", a.look_ahead,
                 "of gains: how far before the end of a phase of contacts its last ones are taken [ms]: those after "
                 "them ask for "
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
  CLI::Option* live = app.add_flag(
      "--live", a.live,
      "writes the files, with the last 10 s, every other second while the motion is carried out; report.html, open in "
      "a browser, shows what happens");
  app.add_flag("--no-report", a.no_report, "writes no report.html")->excludes(live);
  app.add_flag("--summary-only", a.summary_only, "writes summary.json alone")->excludes(live);
  app.add_flag("--dry-run", a.dry_run, "checks the options; reads no motion, carries nothing out, writes nothing");
}

}  // namespace bielle::simulation
