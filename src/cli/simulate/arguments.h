#pragma once
// The options of bielle-simulate.
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bielle/model/options.h"
#include "bielle/model/wear.h"
#include "model/payload.h"
#include "worlds/execution.h"
#include "worlds/robot_errors.h"
#include "worlds/standing_place.h"

namespace bielle::worlds {

enum class Sensing { Ideal, Real };
// As on the command line.
std::string getName(PlanControl control);
std::string getName(Sensing sensors);

struct SimulateArguments {
  std::string directory, output;
  // Of the plan.
  std::string robot;     // of a motion that is to be solved; empty: `directory` holds one, or is a robot
  std::string commands;  // file; empty: none
  std::optional<double> speed;
  std::vector<std::string> settings;  // name=value
  // Of the world.
  std::string world = "bielle", terrain = "planned";
  double friction = 0;  // 0: that of the plan
  double accuracy = 0;  // 0: that of the world
  double time_step = 0;
  std::string world_robot;         // file or directory; empty: the robot of the plan
  double payload = 0;              // kg
  std::string payload_at;          // LINK,x,y,z or x,y,z
  std::vector<std::string> plays;  // name=size
  RobotErrors errors;
  std::vector<std::string> pushes;
  unsigned seed = 1;
  // Of the controller.
  std::optional<PlanControl> wanted_control;  // none: chosen for the motion, predictive where that can carry it out
  std::optional<Belief> belief;               // none: in the model of the motion
  ControlOptions control;
  std::optional<double> lead;  // ms
  double solve_time = 0;       // ms
  // Of what it is told.
  Sensing sensors = Sensing::Ideal;
  PerceptionOptions perception;
  double noise = 1;
  std::optional<double> look_ahead;  // ms
  double delay = 0, jitter = 0;      // ms
  // Of a free motion.
  std::string posture, state, torques;  // name of a reference; files
  std::string push_body;                // link; empty: the first body
  std::vector<std::string> springs;

  ExecutionOptions execution;
  std::string runs;  // file; empty: one run
  bool has_record_period = false;
  bool live = false, no_report = false, summary_only = false, dry_run = false;
};
// All but the places of files.
void describe(OptionFields& fields, SimulateArguments& arguments);

void addOptions(CLI::App& app, SimulateArguments& arguments);
/// What `app` has parsed, to which addOptions() was applied, says beside the options.
void noteGiven(const CLI::App& app, SimulateArguments& arguments);

/// The flag of the first of these options that is not as usual.
std::optional<std::string> findGiven(const SimulateArguments& arguments, const std::vector<std::string>& names);

/// The worlds by their names, which commas separate.
std::vector<std::string> splitWorlds(const std::string& text);

/// Options that others, or the kind of control, make useless, a sentence each; what depends on motion and robot is up to others.
std::vector<std::string> listIdleOptions(const SimulateArguments& arguments);
/// Pushes that come after the end of a motion, or in part.
std::vector<std::string> listIdlePushes(const std::vector<Push>& pushes, double duration);
/// There is nothing to convert for a controller that has the closed model. \throws InputError
[[noreturn]] void refuseMaps();
/// Steps cannot be longer than a period at whose ends they end. \throws InputError
void requireShortSteps(const SimulateArguments& arguments, const std::string& flag, double period);

/// Sets what follows from pushes, delays and sensors, and checks what can be checked without the motion. \throws InputError
void parseOptions(SimulateArguments& arguments);

/// What the robot of the world carries, and a plan does not know. \throws InputError
Payload makePayload(const SimulateArguments& arguments);
/// That of the robot of the world, and of the options, which take precedence. \throws InputError
Wear makeWear(const SimulateArguments& arguments, const LoadedRobot& robot);

/// The ground of the world: "planned", "flat", "ramp=0.05", "tiles=0.01" or "uneven=0.01".
struct WorldGround {
  Ground ground;
  double start = 0;  ///< where ramps and tiles begin, ahead of where the robot stands, m; 0: it has none
};
/// \param place  where the robot stands: ramps and tiles lie ahead of it, before its toes   \throws InputError
WorldGround makeGround(const SimulateArguments& arguments, const Ground& planned, const StandingPlace& place = {});

}  // namespace bielle::worlds
