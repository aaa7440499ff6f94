#include "cli/simulate/arguments.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/number_option.h"
#include "results/setting.h"
#include "solve/fddp_checks.h"
#include "worlds/make_world.h"
#include "worlds/terrain.h"

namespace bielle::worlds {
namespace {

constexpr const char* kPushExample = "t=3,impulse=6,direction=90,duration=0.1";

[[noreturn]] void refusePush(const std::string& text, const std::string& problem) {
  throw InputError("", "--push '" + text + "'", problem, std::string("e.g. --push ") + kPushExample);
}

// E.g. kPushExample. \param shortest  that acts at an instant of control, s
Push parsePush(const std::string& text, double shortest) {
  constexpr double kLongest = 1e4, kLargest = 1e4;  // s, N s
  Push push;
  const std::map<std::string, double*> places{
      {"t", &push.time}, {"impulse", &push.impulse}, {"direction", &push.direction}, {"duration", &push.duration}};
  std::set<std::string> given;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const auto [name, value] = parseSetting("--push", part, kPushExample);
    const auto place = places.find(name);
    if (place == places.end()) refusePush(text, "there is no '" + name + "'");
    if (!given.insert(name).second) refusePush(text, "'" + name + "' is given twice");
    *place->second = value;
  }
  if (!given.count("impulse")) refusePush(text, "it has no impulse");
  if (!(push.time >= 0 && push.time <= kLongest)) refusePush(text, "its time is not within 0 .. 10000 s");
  if (!(std::abs(push.impulse) <= kLargest)) refusePush(text, "its impulse is not within 10000 N s");
  if (!(std::abs(push.direction) <= 360)) refusePush(text, "its direction is not within 360 degrees");
  if (!(push.duration >= shortest && push.duration <= kLongest))
    refusePush(text, "its duration is not within a period of control, " + formatNumber(shortest) + " s, and 10000 s");
  return push;
}

// One world or, for free motions, several with commas.
CLI::Validator isListOfWorlds() {
  std::string choices;
  for (const std::string& world : listWorlds()) choices += (choices.empty() ? "" : ",") + world;
  return CLI::Validator(
      [](std::string& text) {
        const std::vector<std::string> known = listWorlds();
        std::istringstream parts(text);
        for (std::string part; std::getline(parts, part, ',');)
          if (std::find(known.begin(), known.end(), part) == known.end())
            return "there is no world '" + part + "', only " + listItems(known);
        return std::string();
      },
      "{" + choices + "}");
}

}  // namespace

Ground makeGround(const SimulateArguments& arguments, const Ground& planned) {
  Ground ground;
  if (arguments.terrain == "planned") {
    ground = planned;
  } else if (arguments.terrain != "flat") {
    const auto [name, value] = parseSetting("--terrain", arguments.terrain, "tiles=0.01");
    if (!std::isfinite(value)) throw InputError("", "terrain '" + name + "'", "it is not finite", "e.g. tiles=0.01");
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
      throw InputError("", "terrain '" + name + "'", "there is no such terrain",
                       "choose one of: planned, flat, ramp=SLOPE, tiles=HEIGHT, uneven=HEIGHT");
    }
  }
  ground.friction = arguments.friction > 0 ? arguments.friction : planned.friction;
  return ground;
}

void parseOptions(SimulateArguments& arguments) {
  for (const std::string& push : arguments.pushes)
    arguments.execution.pushes.push_back(parsePush(push, arguments.execution.control_period));
  const bool is_predictive = arguments.control.empty() || arguments.control == "mpc";
  if (!arguments.commands.empty()) {
    if (arguments.robot.empty() || !is_predictive)
      throw InputError("", "--command", "only predictive control can follow commands, with a walk that it plans itself",
                       "give the motion walk, --robot and --control mpc");
    if (arguments.speed) throw InputError("", "--speed", "the commands already set the speed", "leave it out");
    if (!arguments.model.empty() && arguments.model != "closed")
      throw InputError("", "--model " + arguments.model, "commanded walks need the closed model", "leave it out");
    readCommands(arguments.commands);
  }
  if (arguments.execution.real_time && arguments.live)
    throw InputError("", "--live", "writing files would delay the world in real time", "leave out --real-time");
  if (arguments.execution.real_time && !is_predictive)
    throw InputError("", "--real-time", "only predictive control solves while the motion runs", "give --control mpc");
  if (arguments.solve_time > 0 && !is_predictive)
    throw InputError("", "--solve-time", "only predictive control solves while the motion runs", "give --control mpc");
  arguments.predictive.own_thread = arguments.execution.real_time;
  arguments.predictive.solve_time = 1e-3 * arguments.solve_time;
  if (arguments.jitter > arguments.delay)
    throw InputError("", "--jitter", "it is longer than the delay", "give at most --delay");
  arguments.execution.delay = {1e-3 * arguments.delay, 1e-3 * arguments.jitter, arguments.seed};
  makeGround(arguments, {});
}

void addOptions(CLI::App& app, SimulateArguments& a) {
  app.add_option("DIR", a.directory,
                 "result of `bielle solve` for the closed robot; with --robot the name of a motion, which is solved "
                 "first; or a "
                 "robot or mechanism, which moves freely from a state, without a plan")
      ->required();
  app.add_option("--robot", a.robot, "name or directory of the robot for which the motion is solved");
  app.add_option("--speed", a.speed, "speed of the motion that is solved first [m/s]");
  app.add_option("--command", a.commands,
                 "YAML file with velocity commands for a walk with --control mpc, which plans its steps as it goes. "
                 "Entries: {time: 4, forward: 0.3, sideways: 0, turning: 0.4} [s, m/s, m/s to the left, rad/s to the "
                 "left], each valid until the next");
  app.add_option("--set", a.settings,
                 "name=value: another option of the motion that is solved first, as in `bielle solve`; may be repeated")
      ->allow_extra_args(false);
  app.add_option("-o,--output", a.output,
                 "directory for trajectory.csv, trajectory.npz and summary.json of the executed motion, plan.npz (the "
                 "plan at the same times) and report.html")
      ->required();
  app.add_option("--world", a.world,
                 "bielle: Bielle's dynamics and contact law, fixed steps; simbody: Simbody's dynamics, the same "
                 "contact law, error-controlled steps, 30 times slower; mujoco: MuJoCo, soft closures and contacts (if "
                 "Bielle was built with it). Free motions take several, e.g. bielle,simbody, and compare them")
      ->check(isListOfWorlds())
      ->capture_default_str();
  app.add_option("--posture", a.posture,
                 "free motion: a reference posture of the robot, or neutral: the closed configuration next to zero "
                 "(default: its first reference)");
  app.add_option("--state", a.state,
                 "free motion: JSON file with positions and velocities of joints and constant torques by name, as for "
                 "`bielle eval`; joints that it does not give follow by the loops");
  app.add_option("--torques", a.torques,
                 "free motion: YAML file, torques: [{time: 0, MOTOR: 3}, {time: 0.5, MOTOR: 0}] [s, N m or N], each "
                 "valid until the next");
  app.add_option("--push-body", a.push_body,
                 "free motion: the link that is pushed, at the centre of mass of its body; default: the first body");
  app.add_option("--spring", a.springs,
                 "free motion: a spring on a motor, e.g. stiffness=50,damping=1,motor=crank,angle=0.3 [N m/rad, N m "
                 "s/rad, rad]; without motor: on each; without angle: where it starts; may be repeated")
      ->allow_extra_args(false);
  app.add_option(
         "--accuracy", a.accuracy,
         "error per step of worlds that control it, bielle and simbody [rad, m, relative in velocities]; 0: the "
         "world's default; with a motion, bielle takes such steps only if it is given")
      ->check(isWithin(0, 1))
      ->capture_default_str();
  app.add_option("--control", a.control,
                 "mpc: predictive control, which solves the next second again at every stage from the measured state; "
                 "gains: the planned torques and linear feedback with the solver's gains, for which the motion is "
                 "solved again; open: the planned torques (default: mpc; gains for motions solved with --formulation "
                 "full, which mpc cannot carry out)")
      ->check(CLI::IsMember({"mpc", "gains", "open"}));
  app.add_option("--model", a.model,
                 "the controller's model of the robot. closed: with its linkages; serial: a serial chain with motors "
                 "on its joints, converted by the linkages' ratios in the current posture; ratio: the same, with the "
                 "constant ratios of the standing posture (default: the motion's model)")
      ->check(CLI::IsMember({"closed", "serial", "ratio"}));
  app.add_option("--nodes", a.predictive.nodes, "number of nodes in the window of predictive control")
      ->check(CLI::Range(10, 1000))
      ->capture_default_str();
  app.add_option("--fine-nodes", a.predictive.fine_nodes,
                 "number of nodes at its beginning that are one stage long; later ones are up to two, then four")
      ->check(CLI::Range(10, 1000))
      ->capture_default_str();
  app.add_option("--iterations", a.predictive.iterations, "solver iterations of predictive control at every stage")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--threads", a.predictive.threads,
                 "number of threads of predictive control; 0: all; results do not depend on it")
      ->check(CLI::Range(0, kMostThreads))
      ->capture_default_str();
  app.add_flag("--real-time", a.execution.real_time,
               "run the world in real time while predictive control solves in a separate thread. Late policies take "
               "effect on arrival; results depend on the machine");
  app.add_option(
         "--solve-time", a.solve_time,
         "time that each solve of predictive control is given [ms]: within a stage another one begins while "
         "there is that much left. Except with --real-time, policies come into force only when it has passed, as "
         "if the machine were that fast or slow. 0: one solve for each stage")
      ->check(isWithin(0, 1000))
      ->capture_default_str();
  app.add_option("--terrain", a.terrain,
                 "planned: the plan's ground; flat; ramp=SLOPE: height over length [1], from x = 0.3 m on; "
                 "tiles=HEIGHT: 0.25 m long, random heights from 0 to HEIGHT [m], from x = 0.2 m on; uneven=HEIGHT: "
                 "likewise, from -HEIGHT to HEIGHT")
      ->capture_default_str();
  app.add_option("--friction", a.friction, "coefficient of friction of the ground [1]; 0: the plan's")
      ->check(isWithin(0, 100))
      ->capture_default_str();
  app.add_option("--seed", a.seed, "seed of the tiles' heights, the jitter, the noise and the robot's errors")
      ->capture_default_str();
  app.add_option("--push", a.pushes,
                 "a constant force on the trunk, e.g. t=3,impulse=6,direction=90,duration=0.1: start [s], impulse [N "
                 "s], direction [degrees; 0: along x, 90: along y] and duration [s]; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--duration", a.execution.duration, "duration of the simulation [s]; 0: that of the plan plus --hold")
      ->check(isWithin(0, 1e4))
      ->capture_default_str();
  app.add_option("--hold", a.execution.hold, "time that the robot stands in its last posture after the plan [s]")
      ->check(isWithin(0, 1e4))
      ->capture_default_str();
  app.add_option("--time-step", a.time_step, "time step of worlds with fixed steps [s]; 0: the world's default")
      ->check(isWithin(0, 0.1))
      ->capture_default_str();
  app.add_option("--control-period", a.execution.control_period, "period of torque updates [s]")
      ->check(isWithin(1e-5, 1))
      ->capture_default_str();
  app.add_option("--sensors", a.sensors,
                 "ideal: the controller receives the true state; real: an estimate from motor encoders and an inertial "
                 "measurement unit in the trunk")
      ->check(CLI::IsMember({"ideal", "real"}))
      ->capture_default_str();
  app.add_option("--noise", a.noise, "noise of real sensors, relative to their data sheets [1]; 0: exact")
      ->check(isWithin(0, 1000))
      ->capture_default_str();
  app.add_option("--look-ahead", a.look_ahead,
                 "reuse the gains from this long before each contact change, since later gains need a more precise "
                 "state than an estimated one [ms] (default: 36 with real sensors, else 0)")
      ->check(isWithin(0, 1000));
  app.add_option("--mass-error", a.errors.mass,
                 "largest relative error of masses [1]: the simulated robot's masses and inertias are the "
                 "controller's, times a random factor within 1 plus or minus this")
      ->check(isWithin(0, 0.99))
      ->capture_default_str();
  app.add_option("--rod-error", a.errors.rod,
                 "largest error of rods [m]: in the simulated robot one frame of each closure is moved at random by up "
                 "to this along each axis")
      ->check(isWithin(0, 0.1))
      ->capture_default_str();
  app.add_option("--delay", a.delay, "delay between a measurement and the torques computed from it [ms]")
      ->check(isWithin(0, 1000))
      ->capture_default_str();
  app.add_option("--jitter", a.jitter, "largest random deviation of each delay from --delay [ms]; at most --delay")
      ->check(isWithin(0, 1000))
      ->capture_default_str();
  app.add_option("--record-period", a.execution.record_period, "period of the recorded rows [s]")
      ->check(isWithin(1e-5, 1e4))
      ->capture_default_str();
  CLI::Option* live = app.add_flag(
      "--live", a.live,
      "write the files every two seconds during execution, with the last 10 s; an open report.html follows the motion");
  app.add_flag("--no-report", a.no_report, "do not write report.html")->excludes(live);
  app.add_flag("--summary-only", a.summary_only, "write only summary.json")->excludes(live);
  app.add_flag("--dry-run", a.dry_run, "check the options only: read no motion, execute nothing, write nothing");
  requireFiniteNumbers(app);
}

}  // namespace bielle::worlds
