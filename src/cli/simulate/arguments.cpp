#include "cli/simulate/arguments.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "control/clock.h"
#include "formats/robot_files.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/option_flags.h"
#include "results/setting.h"
#include "worlds/made_ground.h"
#include "worlds/make_world.h"

namespace bielle::worlds {
namespace {

constexpr const char* kPushExample = "t=3,impulse=6,direction=90,duration=0.1";
constexpr double kRealLookAhead = 36;  // ms
constexpr double kRealTimeLead = 4;    // ms: most solves take less, and what comes late acts on arrival
const std::vector<std::string> kControls = {"mpc", "gains", "open"}, kSensors = {"ideal", "real"};

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

void describePlan(OptionFields& fields, SimulateArguments& a) {
  fields.text("robot", a.robot,
              "name, directory or file of the robot for which the motion is solved; with the directory of a solved "
              "motion, the robot of the world alone, of the same joints and motors, which plan and controller do not "
              "know");
  fields.number("speed", a.speed, "m/s", {}, "speed of the motion that is solved first");
  fields.text("command", a.commands,
              "YAML file with velocity commands for a walk with --control mpc, which plans its steps as it goes. "
              "Entries: {time: 4, forward: 0.3, sideways: 0, turning: 0.4} [s, m/s, m/s to the left, rad/s to the "
              "left], each valid until the next");
  fields.texts("set", a.settings,
               "name=value: another option of the motion that is solved first, as in `bielle solve`; may be repeated");
}

void describeFreeMotion(OptionFields& fields, SimulateArguments& a) {
  fields.text("posture", a.posture,
              "free motion: a reference posture of the robot, or neutral: the closed configuration next to zero "
              "(default: its first reference)");
  fields.text("state", a.state,
              "free motion: JSON file with positions and velocities of joints and constant torques by name, as for "
              "`bielle eval`; joints that it does not give follow by the loops");
  fields.text("torques", a.torques,
              "free motion: YAML file, torques: [{time: 0, MOTOR: 3}, {time: 0.5, MOTOR: 0}] [s, N m or N], each "
              "valid until the next");
  fields.text("push_body", a.push_body,
              "free motion: the link that is pushed, at the centre of mass of its body; default: the first body");
  fields.texts("spring", a.springs,
               "free motion: a spring on a motor, e.g. stiffness=50,damping=1,motor=crank,angle=0.3 [N m/rad, N m "
               "s/rad, rad]; without motor: on each; without angle: where it starts; may be repeated");
}

void describeControl(OptionFields& fields, SimulateArguments& a) {
  fields.choice("control", a.wanted_control, kControls,
                "mpc: predictive control, which solves the next second again at every stage from the measured state; "
                "gains: the planned torques and linear feedback with the solver's gains, for which the motion is "
                "solved again; open: the planned torques (default: mpc; gains for motions solved with --formulation "
                "full, which mpc cannot carry out)");
  fields.choice("model", a.belief, {"closed", "serial", "ratio"},
                "the controller's model of the robot. closed: with its linkages; serial: a serial chain with motors "
                "on its joints, converted by the linkages' ratios in the current posture; ratio: the same, with the "
                "constant ratios of the standing posture (default: the motion's model)");
  fields.choice("maps", a.control.generated_maps, {"library", "generated"},
                "with a serial model: what converts between joints and motors. library: the mechanism; generated: the "
                "code that `bielle convert --to c` writes, compiled by the C compiler ($CC, or cc), as on a robot");
  fields.restrictTo({"nodes", "fine_nodes", "iterations", "threads"});
  describe(fields, a.control.predictive);
  fields.restrictTo({});
  fields.flag("real_time", a.execution.real_time,
              "run the world in real time while predictive control solves in a separate thread. Late policies take "
              "effect on arrival; results depend on the machine");
  fields.number(
      "lead", a.lead, "ms", {0, 1000},
      "how long before a stage predictive control measures the state that it solves for; less where the stage "
      "before is shorter. 0: the whole stage before, the default unless --real-time is given (4)");
  fields.number("solve_time", a.solve_time, "ms", {0, 1000},
                "time that each solve of predictive control is given: within a stage another one begins while "
                "there is that much left. Except with --real-time, policies come into force only when it has passed, "
                "as if the machine were that fast or slow. 0: one solve for each stage");
}

void describeWorld(OptionFields& fields, SimulateArguments& a) {
  fields.text("world", a.world,
              "bielle: Bielle's dynamics and contact law, fixed steps; simbody: Simbody's dynamics, the same "
              "contact law, error-controlled steps, 30 times slower; mujoco: MuJoCo, soft closures and contacts (if "
              "Bielle was built with it). Free motions take several, e.g. bielle,simbody, and compare them");
  fields.number("accuracy", a.accuracy, "rad, m, relative in velocities", {0, 1},
                "error per step of worlds that control it, bielle and simbody; 0: the "
                "world's default; with a motion, bielle takes such steps only if it is given");
  fields.text(
      "terrain", a.terrain,
      "planned: the plan's ground; flat; ramp=SLOPE: height over length [1], from 0.3 m ahead of "
      "where the robot stands; tiles=HEIGHT: 0.25 m long, random heights from 0 to HEIGHT [m], from 0.2 m ahead; "
      "uneven=HEIGHT: likewise, from -HEIGHT to HEIGHT; none begins under its toes");
  fields.number("friction", a.friction, "1", {0, 100}, "coefficient of friction of the ground; 0: the plan's");
  fields.integer("seed", a.seed, "seed of the tiles' heights, the jitter, the noise and the robot's errors");
  fields.texts("push", a.pushes,
               "a constant force on the trunk, e.g. t=3,impulse=6,direction=90,duration=0.1: start [s], impulse [N "
               "s], direction [degrees; 0: along x, 90: along y] and duration [s]; may be repeated");
  fields.number("time_step", a.time_step, "s", {0, 0.1},
                "time step of worlds with fixed steps, at most --control-period; the longest step of others; 0: the "
                "world's default");
  fields.number("payload", a.payload, "kg", {0, 1e6},
                "a point mass on the simulated robot alone, which neither plan nor controller know");
  fields.text("payload_at", a.payload_at,
              "its place, LINK,x,y,z in the frame of a link [m], or x,y,z in that of the trunk (default: the trunk's "
              "centre of mass)");
  fields.texts(
      "play", a.plays,
      "NAME=SIZE, e.g. closure_ankle*=0.0003: play of a joint or of the rod that a closure ties, the way from stop to "
      "stop [rad, m]; * stands for any text. Of the simulated robot alone; may be repeated, or several with commas");
  fields.number("mass_error", a.errors.mass, "1", {0, 0.99},
                "largest relative error of masses: the simulated robot's masses and inertias are the "
                "controller's, times a random factor within 1 plus or minus this");
  fields.number("rod_error", a.errors.rod, "m", {0, 0.1},
                "largest error of rods: in the simulated robot one frame of each closure is moved at random by up "
                "to this along each axis");
}

void describeSensors(OptionFields& fields, SimulateArguments& a) {
  fields.choice("sensors", a.sensors, kSensors,
                "ideal: the controller receives the true state; real: an estimate from motor encoders and an inertial "
                "measurement unit in the trunk");
  fields.number("noise", a.noise, "1", {0, 1000}, "noise of real sensors, relative to their data sheets; 0: exact");
  fields.number("look_ahead", a.look_ahead, "ms", {0, 1000},
                "reuse the gains from this long before each contact change, since later gains need a more precise "
                "state than an estimated one (default: 36 with real sensors, else 0)");
  fields.number("delay", a.delay, "ms", {0, 1000}, "delay between a measurement and the torques computed from it");
  fields.number("jitter", a.jitter, "ms", {0, 1000},
                "largest random deviation of each delay from --delay; at most --delay");
}

void describeExecution(OptionFields& fields, SimulateArguments& a) {
  ExecutionOptions& execution = a.execution;
  fields.number("duration", execution.duration, "s", {0, 1e4},
                "duration of the simulation; 0: that of the plan plus --hold");
  fields.number("hold", execution.hold, "s", {0, 1e4}, "time that the robot stands in its last posture after the plan");
  fields.number("control_period", execution.control_period, "s", {1e-5, 1}, "period of torque updates");
  fields.number("record_period", execution.record_period, "s", {1e-5, 1e4}, "period of the recorded rows");
}

void describeFiles(OptionFields& fields, SimulateArguments& a) {
  fields.flag("live", a.live,
              "write the files every two seconds during execution, with the last 10 s; an open report.html follows the "
              "motion");
  fields.flag("no_report", a.no_report, "do not write report.html");
  fields.flag("summary_only", a.summary_only, "write only summary.json");
  fields.flag("dry_run", a.dry_run, "check the options only: read no motion, execute nothing, write nothing");
}

}  // namespace

WorldGround makeGround(const SimulateArguments& arguments, const Ground& planned, const StandingPlace& place) {
  constexpr double kBeforeToes = 0.05;  // m
  WorldGround made;
  Ground& ground = made.ground;
  const auto beginAhead = [&](double& start) {
    if (place.reach > 0) start = std::max(start, place.reach + kBeforeToes);
    made.start = start;
  };
  if (arguments.terrain == "planned") {
    ground = planned;
  } else if (arguments.terrain == "flat") {
    ground = carryGround({}, place.X_WP);
  } else {
    const auto [name, value] = parseSetting("--terrain", arguments.terrain, "tiles=0.01");
    if (!std::isfinite(value))
      throw InputError("", "--terrain " + arguments.terrain, "it is not finite",
                       "give a number, e.g. --terrain " + name + "=0.01");
    if (name == "ramp") {
      RampOptions ramp;
      ramp.slope = value;
      beginAhead(ramp.start);
      ground = carryGround(makeRamp(ramp), place.X_WP);
    } else if (name == "tiles" || name == "uneven") {
      TileOptions tiles;
      tiles.height = value;
      if (name == "uneven") tiles.lowest = -value;
      tiles.seed = arguments.seed;
      beginAhead(tiles.start);
      ground = carryGround(makeTiles(tiles), place.X_WP);
    } else {
      throw InputError("", "terrain '" + name + "'", "there is no such terrain",
                       "choose one of: planned, flat, ramp=SLOPE, tiles=HEIGHT, uneven=HEIGHT");
    }
  }
  ground.friction = arguments.friction > 0 ? arguments.friction : planned.friction;
  return made;
}

Payload makePayload(const SimulateArguments& arguments) {
  Payload payload{arguments.payload, {}, {}};
  if (arguments.payload_at.empty()) return payload;
  std::vector<std::string> parts;
  std::istringstream text(arguments.payload_at);
  for (std::string part; std::getline(text, part, ',');) parts.push_back(part);
  const auto refuse = [&arguments] {
    throw InputError("", "--payload-at " + arguments.payload_at, "it is not a place",
                     "e.g. --payload-at trunk,0.15,0,0.1");
  };
  if (parts.size() < 3 || parts.size() > 4) refuse();
  if (parts.size() == 4) payload.link = parts[0];
  payload.at.emplace();
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = parseNumber(parts[parts.size() - 3 + static_cast<size_t>(axis)]);
    if (!value || !std::isfinite(*value)) refuse();
    (*payload.at)[axis] = *value;
  }
  return payload;
}

Wear makeWear(const SimulateArguments& arguments, const LoadedRobot& robot) {
  Wear wear = robot.wear;
  for (const Play& play : parsePlays(arguments.plays)) wear.plays.push_back(play);
  return wear;
}

std::string getName(PlanControl control) { return kControls[static_cast<size_t>(control)]; }
std::string getName(Sensing sensors) { return kSensors[static_cast<size_t>(sensors)]; }

void describe(OptionFields& fields, SimulateArguments& arguments) {
  describePlan(fields, arguments);
  describeWorld(fields, arguments);
  describeControl(fields, arguments);
  describeSensors(fields, arguments);
  describeExecution(fields, arguments);
  describeFreeMotion(fields, arguments);
  describeFiles(fields, arguments);
}

std::optional<std::string> findGiven(const SimulateArguments& arguments, const std::vector<std::string>& names) {
  const OptionSet given = listOptions(arguments), usual = listOptions(SimulateArguments());
  for (const std::string& name : names)
    if (given.get(name).value != usual.get(name).value) return makeFlag(name);
  return {};
}

std::vector<std::string> splitWorlds(const std::string& text) {
  std::vector<std::string> worlds;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) worlds.push_back(part);
  return worlds;
}

std::vector<std::string> listIdleOptions(const SimulateArguments& a) {
  std::vector<std::string> idle;
  const auto check = [&](bool is_useful, const std::vector<std::string>& names, const std::string& reason) {
    if (is_useful) return;
    for (const std::string& name : names)
      if (const auto flag = findGiven(a, {name})) idle.push_back(*flag + " has no effect: " + reason);
  };
  const std::vector<std::string> worlds = splitWorlds(a.world);
  check(std::any_of(worlds.begin(), worlds.end(), controlsError), {"accuracy"},
        "the steps of world " + a.world + " are of a fixed length");
  const PlanControl control = a.wanted_control.value_or(a.control.control);
  check(control == PlanControl::Predictive, {"nodes", "fine_nodes", "iterations"}, "control is not predictive");
  const PredictiveOptions& predictive = a.control.predictive;
  check(predictive.fine_nodes <= predictive.nodes, {"fine_nodes"},
        "all " + std::to_string(predictive.nodes) + " --nodes are one stage long");
  check(a.solve_time == 0, {"lead"}, "with --solve-time solves begin with their stages");
  check(control != PlanControl::Open, {"look_ahead"}, "open control has no gains");
  check(a.sensors == Sensing::Real, {"noise"}, "ideal sensors have none");
  check(a.execution.duration == 0, {"hold"}, "--duration ends the motion");
  check(!a.pushes.empty(), {"push_body"}, "there is no --push");
  check(a.payload > 0, {"payload_at"}, "there is no --payload");
  const bool has_tiles = a.terrain.rfind("tiles", 0) == 0 || a.terrain.rfind("uneven", 0) == 0;
  check(has_tiles || a.jitter > 0 || a.sensors == Sensing::Real || !a.errors.isZero(), {"seed"}, "nothing is random");
  return idle;
}

std::vector<std::string> listIdlePushes(const std::vector<Push>& pushes, double duration) {
  std::vector<std::string> idle;
  for (const Push& push : pushes) {
    const double end = push.time + push.duration;
    if (end <= duration + kClockTolerance) continue;
    idle.push_back("--push at " + formatNumber(push.time) + " s " +
                   (push.time < duration ? "is cut off" : "has no effect") + ": the motion ends at " +
                   formatNumber(duration) + " s");
  }
  return idle;
}

void refuseMaps() {
  throw InputError("", "--maps generated",
                   "the controller knows the robot with its linkages, and commands their motors",
                   "give --model serial or --model ratio");
}

void requireShortSteps(const SimulateArguments& arguments, const std::string& flag, double period) {
  if (arguments.time_step > period * (1 + 1e-9))
    throw InputError("", "--time-step " + formatNumber(arguments.time_step),
                     "it is longer than " + flag + ", " + formatNumber(period) + " s, at whose end a step ends",
                     "give at most that, or a longer " + flag);
}

void parseOptions(SimulateArguments& arguments) {
  for (const std::string& push : arguments.pushes)
    arguments.execution.pushes.push_back(parsePush(push, arguments.execution.control_period));
  const bool is_predictive = arguments.wanted_control.value_or(PlanControl::Predictive) == PlanControl::Predictive;
  if (!arguments.commands.empty()) {
    if (arguments.robot.empty() || !is_predictive)
      throw InputError("", "--command", "only predictive control can follow commands, with a walk that it plans itself",
                       "give the motion walk, --robot and --control mpc");
    if (arguments.speed) throw InputError("", "--speed", "the commands already set the speed", "leave it out");
    if (arguments.belief && *arguments.belief != Belief::Closed)
      throw InputError("", std::string("--model ") + getName(*arguments.belief),
                       "commanded walks need the closed model", "leave it out");
    readCommands(arguments.commands);
  }
  if (arguments.control.generated_maps && arguments.belief == Belief::Closed) refuseMaps();
  if (arguments.execution.real_time && arguments.live)
    throw InputError("", "--live", "writing files would delay the world in real time", "leave out --real-time");
  if (!is_predictive)
    if (const auto flag = findGiven(arguments, {"real_time", "lead", "solve_time"}))
      throw InputError("", *flag, "only predictive control solves while the motion runs", "give --control mpc");
  if (arguments.jitter > arguments.delay)
    throw InputError("", "--jitter", "it is longer than the delay", "give at most --delay");
  const bool is_real = arguments.sensors == Sensing::Real;
  PredictiveOptions& predictive = arguments.control.predictive;
  predictive.own_thread = arguments.execution.real_time;
  predictive.lead = 1e-3 * arguments.lead.value_or(arguments.execution.real_time ? kRealTimeLead : 0);
  predictive.solve_time = 1e-3 * arguments.solve_time;
  predictive.look_ahead = 1e-3 * arguments.look_ahead.value_or(is_real ? kRealLookAhead : 0);
  arguments.execution.delay = {1e-3 * arguments.delay, 1e-3 * arguments.jitter, arguments.seed};
  arguments.errors.seed = arguments.seed;
  if (is_real) arguments.perception.sensors = SensorOptions{makeRealParts(), arguments.noise, arguments.seed, {}};
  makeGround(arguments, {});
  makePayload(arguments);
  parsePlays(arguments.plays);
  const std::vector<std::string> worlds = splitWorlds(arguments.world);
  if (std::set<std::string>(worlds.begin(), worlds.end()).size() < worlds.size())
    throw InputError("", "--world " + arguments.world, "a world is given twice", "give it once");
  std::set<std::string> names;
  if (arguments.speed) names.insert("speed");
  requireOnce("--set", arguments.settings, "com_weight=1e5", names);
}

void addOptions(CLI::App& app, SimulateArguments& a) {
  app.add_option("DIR", a.directory,
                 "result of `bielle solve` for the closed robot; with --robot the name of a motion, which is solved "
                 "first; or a "
                 "robot or mechanism, which moves freely from a state, without a plan")
      ->required();
  app.add_option("-o,--output", a.output,
                 "directory for trajectory.csv, trajectory.npz and summary.json of the executed motion, plan.npz (the "
                 "plan at the same times) and report.html")
      ->required();
  app.add_option("--runs", a.runs,
                 "many runs of this motion: a file with a line per run, a JSON list of its further options. Their "
                 "results go to directories 1, 2, .. in the output, what became of each to runs.jsonl there. With "
                 "gains or open control in world bielle, those that differ in push, seed, friction, mass_error, delay, "
                 "noise or terrain alone are stepped many at once")
      ->check(CLI::ExistingFile);
  addFlags(a, app);
  app.add_option("--at", a.payload_at, "short for --payload-at")->excludes(app.get_option("--payload-at"));
  app.get_option("--world")->check(isListOfWorlds());
  for (const char* name : {"--live", "--dry-run", "--real-time"})
    app.get_option("--runs")->excludes(app.get_option(name));
  for (const char* name : {"--no-report", "--summary-only"}) app.get_option(name)->excludes(app.get_option("--live"));
  requireFiniteNumbers(app);
}

void noteGiven(const CLI::App& app, SimulateArguments& arguments) {
  arguments.has_record_period = app.count("--record-period") > 0;
}

}  // namespace bielle::worlds
