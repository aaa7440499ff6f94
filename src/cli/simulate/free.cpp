#include "cli/simulate/free.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/report/report.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/robot_loader.h"
#include "cli/simulate/output.h"
#include "cli/simulate/watch.h"
#include "formats/text_file.h"
#include "formats/yaml_entry.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/interrupt.h"
#include "results/output_place.h"
#include "results/result_files.h"
#include "results/setting.h"
#include "worlds/free_motion.h"
#include "worlds/make_world.h"
#include "worlds/motion_recorder.h"

namespace fs = std::filesystem;

namespace bielle::worlds {
namespace {

constexpr double kOwnTolerance = 1e-9, kSimbodyTolerance = 1e-6;
constexpr double kDuration = 2, kRecordPeriod = 0.01;  // s
constexpr const char* kSpringExample = "stiffness=50,damping=1";
const YamlKeys kTorquesKeys("torques", "", {"torques"});
const YamlKeys kTorqueKeys("torques", "torques[]", {"time", "MOTOR"});

// Entries {time: 0.5, MOTOR: 3, ..}; motors that an entry does not name keep their torque.
std::vector<TimedTorques> readTorques(const Model& model, const std::string& path, const VectorXd& u) {
  std::vector<TimedTorques> torques{{0, u}};
  if (path.empty()) return torques;
  const auto read = [&](const YamlEntry& document) {
    const YamlEntry list = require(document.getFields(kTorquesKeys), "torques", document);
    for (const YamlEntry& entry : list.getList()) {
      TimedTorques next = torques.back();
      bool has_time = false;
      for (const auto& [name, value] : entry.getMap()) {
        if (name == "time") {
          next.time = value.getNumber();
          has_time = true;
          continue;
        }
        const int motor = model.findMotor(name);
        if (motor < 0)
          value.fail("the robot has no such motor", "its motors are: " + listItems(getNames(model.motors())));
        next.u[motor] = value.getNumber();
      }
      if (!has_time)
        entry.fail("it has no time", "e.g. {time: 0.5, " + (model.nu() > 0 ? model.motors()[0].name : "MOTOR") +
                                         ": 3}, in s and N m or N");
      if (next.time < 0) entry.fail("its time is negative", "give seconds from the start");
      if (next.time < torques.back().time || (torques.size() > 1 && next.time == torques.back().time))
        entry.fail("its time is not later than that of the previous entry", "list torques in order of time");
      torques.push_back(next);
    }
  };
  readYamlDocument(path, readTextFile(path, "give a YAML file with a list of torques"), read);
  return torques;
}

int findPushedBody(const Model& model, const std::string& name) {
  if (name.empty()) return 1;
  const int frame = model.findFrame(name);
  const int body = frame < 0 ? 0 : model.frames()[frame].body;
  if (body > 0) return body;
  throw InputError("", "--push-body " + name, frame < 0 ? "the robot has no such link" : "it is fixed to the ground",
                   "name a link that moves");
}

// E.g. stiffness=50,damping=1,motor=crank,angle=0.3; without a motor, all of them; without an angle, where it starts.
void addSprings(const Model& model, const std::string& text, const VectorXd& q, std::vector<MotorSpring>& springs) {
  MotorSpring spring;
  std::string name;
  double angle = std::nan("");
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const auto [key, value] = splitSetting("--spring", part, kSpringExample);
    if (key == "motor")
      name = value;
    else if (key == "stiffness")
      spring.stiffness = parseSetting("--spring", part, kSpringExample).second;
    else if (key == "damping")
      spring.damping = parseSetting("--spring", part, kSpringExample).second;
    else if (key == "angle")
      angle = parseSetting("--spring", part, kSpringExample).second;
    else
      throw InputError("", "--spring '" + text + "'", "there is no '" + key + "'",
                       std::string("e.g. ") + kSpringExample);
  }
  if (!(spring.stiffness >= 0 && spring.damping >= 0 && std::isfinite(spring.stiffness + spring.damping)))
    throw InputError("", "--spring '" + text + "'", "stiffness or damping is negative or not finite",
                     std::string("e.g. ") + kSpringExample);
  bool is_found = false;
  for (int m = 0; m < model.nu(); ++m) {
    if (!name.empty() && model.motors()[m].name != name) continue;
    is_found = true;
    spring.motor = m;
    spring.rest = std::isnan(angle) ? q[model.joints()[model.motors()[m].joint].idx_q] : angle;
    springs.push_back(spring);
  }
  constexpr double kTurn = 6.2832;  // rad
  if (std::abs(angle) > kTurn)
    tell({"--spring '" + text + "': its angle is more than a turn; give radians if degrees were meant"});
  if (!is_found)
    throw InputError("", "--spring '" + text + "'",
                     name.empty() ? "the robot has no motors" : "the robot has no motor '" + name + "'",
                     "its motors are: " + listItems(getNames(model.motors())));
}

// What only a plan can use.
void refuseOptionsOfPlans(const SimulateArguments& arguments) {
  const auto flag =
      findGiven(arguments, {"control",    "command",    "model",      "maps",          "speed",     "set",
                            "real_time",  "sensors",    "noise",      "look_ahead",    "delay",     "jitter",
                            "live",       "lead",       "solve_time", "mass_error",    "rod_error", "nodes",
                            "fine_nodes", "iterations", "hold",       "control_period"});
  if (flag)
    throw InputError("", *flag, "'" + arguments.directory + "' is a robot without a plan, which moves freely",
                     "leave it out, or give the directory of a solved motion");
}

std::string makeEnergyText(const MotionRecord& record, const std::vector<Books>& books) {
  std::string text =
      "time,kinetic,potential,elastic,motor_work,push_work,contact_loss,stop_loss,other_loss,imbalance\n";
  for (size_t i = 0; i < books.size(); ++i) {
    const Books& b = books[i];
    const double values[] = {record.time[static_cast<Eigen::Index>(i)],
                             b.kinetic,
                             b.potential,
                             b.elastic,
                             b.motor_work,
                             b.push_work,
                             b.contact_loss,
                             b.stop_loss,
                             b.other_loss,
                             calcImbalance(books.front(), b)};
    for (size_t c = 0; c < std::size(values); ++c) text += (c ? "," : "") + formatExact(values[c]);
    text += "\n";
  }
  return text;
}

// What has no effect on a free motion of this robot.
std::vector<std::string> listIdleInFree(const SimulateArguments& arguments, const Model& model,
                                        const FreeMotionOptions& o) {
  std::vector<std::string> idle = listIdlePushes(o.pushes, o.duration);
  if (model.contacts().empty())
    if (const auto flag = findGiven(arguments, {"terrain", "friction"}))
      idle.push_back(*flag + " has no effect: the robot has no feet");
  for (size_t i = 1; i < o.torques.size(); ++i)
    if (o.torques[i].time >= o.duration)
      idle.push_back("--torques: from " + formatNumber(o.torques[i].time) +
                     " s on they have no effect: the motion ends at " + formatNumber(o.duration) + " s");
  return idle;
}

struct FreeRun {
  std::string world, directory;
  std::vector<std::string> warnings;
  FreeMotion motion;
};

std::vector<std::string> writeRun(const SimulateArguments& arguments, const LoadedRobot& robot, const Model& model,
                                  const Ground& ground, const FreeRun& run, const std::vector<std::string>& command) {
  const Execution& e = run.motion.execution;
  MotionResult result;
  result.run = makeRunInfo(arguments.directory, robot, command);
  result.motion = "free motion";
  result.schedule.phases.push_back(
      {"free", static_cast<int>(e.record.u.rows()), arguments.execution.record_period, {}});
  result.ground = ground;
  result.record = e.record;
  setFigures(model, result);
  result.gap_position = e.largest_gap;
  Json summary = makeHappenedSummary(result);
  summary["world"] = run.world;
  summary["integration"] = listIntegration(e.integration);
  summary["warnings"] = run.warnings;
  summary["pushes"] = listPushes(arguments.execution.pushes);
  for (const Play& play : makeWear(arguments, robot).plays) summary["play"][play.name] = play.size;
  const int pushed = findPushedBody(model, arguments.push_body);
  const Vector3d& com = model.bodies()[pushed].inertia.com;
  summary["pushed_body"] = {{"index", pushed}, {"com", std::vector<double>(com.data(), com.data() + 3)}};
  summary["outcome"] = getName(e.outcome);
  summary["outcome_message"] = e.message;
  summary["duration"] = e.duration;
  summary["largest_gap"] = e.largest_gap;
  summary["energy_balance"] = e.energy_balance;
  summary["books"] = listBooks(e);
  summary["real_time_factor"] = e.realTimeFactor();
  summary["seconds"] = {{"whole", e.whole_seconds}, {"world", e.world_seconds}};
  if (arguments.summary_only) {
    writeSummary(run.directory, summary);
    return {(fs::path(run.directory) / "summary.json").string()};
  }
  std::vector<std::string> paths = writeResult(run.directory, e.record, result.run.mechanism, summary);
  paths.push_back((fs::path(run.directory) / "energy.csv").string());
  writeTextFile(paths.back(), makeEnergyText(e.record, run.motion.books));
  return paths;
}

void printRun(const FreeRun& run) {
  const Execution& e = run.motion.execution;
  char text[600];
  std::snprintf(text, sizeof text,
                "  duration            %.6g s\n"
                "  closures            gap %.1e m at most\n"
                "  energy              %.6g J at the start, %.6g J at the end; motors %.3g J, losses %.3g J\n"
                "  energy balance      %.1e J\n"
                "  computing time      %.3f s, %.3g times real time\n",
                e.duration, e.largest_gap, e.start.energy(), e.end.energy(), e.end.motor_work,
                e.end.contact_loss + e.end.stop_loss + e.end.other_loss, e.imbalance, e.world_seconds,
                e.world_seconds > 0 ? e.duration / e.world_seconds : 0);
  std::cout << "free motion in world " << run.world << ": it " << getName(e.outcome);
  if (!e.message.empty()) std::cout << " (" << e.message << ")";
  std::cout << "\n" << text;
}

// Where the worlds have gone apart: the largest difference of a coordinate from the first world.
void printDifferences(const Model& model, const std::vector<FreeRun>& runs) {
  const MotionRecord& first = runs.front().motion.execution.record;
  for (size_t i = 1; i < runs.size(); ++i) {
    const MotionRecord& other = runs[i].motion.execution.record;
    const Eigen::Index rows = std::min(first.q.rows(), other.q.rows());
    double largest = 0, at = 0;
    int dof = 0;
    for (Eigen::Index k = 0; k < rows; ++k) {
      const VectorXd d = model.difference(first.q.row(k).transpose(), other.q.row(k).transpose());
      Eigen::Index where = 0;
      if (d.size() && d.cwiseAbs().maxCoeff(&where) > largest)
        largest = std::abs(d[where]), at = first.time[k], dof = static_cast<int>(where);
    }
    std::cout << "  " << runs[i].world << " differs from " << runs.front().world << " by at most "
              << formatNumber(largest, "%.2e") << " (" << makeVelocityNames(model)[dof] << " at " << formatNumber(at)
              << " s)\n";
  }
}

// Where the motions of the robot start: under the soles of its reference. The neutral posture is put on the plane at 0, which is also
// that of a robot without a reference.
Ground makeStandingGround(const Model& model, const std::string& posture) {
  constexpr double kRounding = 1e-9;  // m
  if (posture == "neutral" || model.references().empty() || model.contacts().empty()) return {};
  Ground ground = makeGroundUnder(model, makeContactTargets(makeStandingRobot(model), 0, 0));
  if (std::abs(ground.height) < kRounding) ground.height = 0;
  return ground;
}

}  // namespace

bool isFree(const SimulateArguments& arguments) {
  return arguments.robot.empty() && !fs::exists(fs::path(arguments.directory) / "summary.json");
}

bool simulateFreely(const SimulateArguments& given, const std::vector<std::string>& command) {
  SimulateArguments arguments = given;
  ExecutionOptions& execution = arguments.execution;
  if (execution.duration == 0) execution.duration = kDuration;
  if (!arguments.has_record_period)
    execution.record_period =
        std::min(std::max(kRecordPeriod, arguments.time_step), std::max(execution.duration / 100, arguments.time_step));
  requireShortSteps(arguments, "--record-period", execution.record_period);
  LoadedRobot robot = [&] {
    try {
      return loadRobot(arguments.directory);
    } catch (const InputError& error) {
      if (fs::exists(arguments.directory)) throw;
      throw InputError("", "'" + arguments.directory + "'",
                       "it is neither the directory of a solved motion nor a robot",
                       "give one of them, or --robot with the name of a motion");
    }
  }();
  refuseOptionsOfPlans(given);
  for (const std::string& warning : robot.warnings) std::cerr << "bielle: warning: " << warning << "\n";
  robot.model = addPayload(robot.model, makePayload(arguments));
  const FreeStart start = makeFreeStart(robot.model, arguments, robot.path());
  std::vector<MotorSpring> springs;
  for (const std::string& spring : arguments.springs) addSprings(robot.model, spring, start.q, springs);
  const Model model = addMotorSprings(robot.model, springs);
  const std::vector<ContactTarget> soles = makeContactTargets(makeStandingRobot(model, start.q), 0, 0);
  const Ground standing = makeStandingGround(model, arguments.posture);
  StandingPlace place = findPlace(model, soles);
  place.X_WP.p.z() = standing.height;  // it may start in the air
  const Ground ground = makeGround(arguments, standing, place).ground;
  const int pushed_body = findPushedBody(model, arguments.push_body);
  FreeMotionOptions options;
  options.duration = execution.duration;
  options.record_period = execution.record_period;
  options.torques = readTorques(model, arguments.torques, start.u);
  options.pushes = execution.pushes;

  std::vector<std::string> idle = listIdleOptions(arguments);
  for (const std::string& each : listIdleInFree(arguments, model, options)) idle.push_back(each);
  const bool is_on_other_ground = arguments.terrain != "planned" && arguments.state.empty();
  for (const ContactTarget& sole : soles)
    if (is_on_other_ground || sole.X_WT.p.z() < ground.calcHeight(sole.X_WT.p.x(), sole.X_WT.p.y()))
      for (const std::string& each : describeSoles(model, ground, {sole})) idle.push_back(each);
  tell(idle);

  const std::vector<std::string> names = splitWorlds(arguments.world);
  std::vector<FreeRun> runs;
  std::vector<std::string> paths;
  bool has_ended = true;
  makeOutputDirectory(arguments.output);
  for (const std::string& name : names) {
    WorldOptions world_options{ground, arguments.time_step, &isInterrupted()};
    if (controlsError(name))
      world_options.tolerance = arguments.accuracy > 0 ? arguments.accuracy
                                : name == "simbody"    ? kSimbodyTolerance
                                                       : kOwnTolerance;
    world_options.pushed_body = pushed_body;
    world_options.wear = makeWear(arguments, robot);
    const std::unique_ptr<World> world = makeWorld(name, model, world_options);
    FreeRun run{name, names.size() > 1 ? (fs::path(arguments.output) / name).string() : arguments.output, idle, {}};
    for (const std::string& warning : world->warnings()) {
      run.warnings.push_back("world " + name + ": " + warning);
      tell({run.warnings.back()});
    }
    Watch watch{Watch::Show()};
    run.motion =
        moveFreely(*world, start.q, start.v, options, [&](double time, double duration, const ExecutionSoFar& so_far) {
          if (!arguments.summary_only) watch.update(time, duration, so_far);
        });
    noteOpenLoops(name, run.motion.execution, run.warnings);
    has_ended = has_ended && run.motion.execution.outcome == Outcome::Ended;
    printRun(run);
    makeOutputDirectory(run.directory);
    for (const std::string& path : writeRun(arguments, robot, model, ground, run, command)) paths.push_back(path);
    runs.push_back(std::move(run));
  }
  if (runs.size() > 1) printDifferences(model, runs);
  if (!arguments.no_report && !arguments.summary_only) {
    std::vector<std::string> directories;
    for (const FreeRun& run : runs) directories.push_back(run.directory);
    paths.push_back((fs::path(arguments.output) / "report.html").string());
    writeReport(paths.back(), directories);
  }
  for (const std::string& path : paths) std::cout << "  " << path << "\n";
  return has_ended;
}

}  // namespace bielle::worlds
