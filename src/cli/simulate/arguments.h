#pragma once
// The options of bielle-simulate.
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "worlds/execution.h"
#include "worlds/plan.h"
#include "worlds/robot_errors.h"

namespace bielle::worlds {

struct SimulateArguments {
  std::string directory, output, world = "bielle", terrain = "planned";
  std::string control;   // empty: chosen for the motion, "mpc" where it can carry it out
  std::string reason;    // of a choice other than "mpc"; empty: there is none
  std::string robot;     // of a motion that is to be solved; empty: `directory` holds one
  std::string commands;  // file; empty: none
  std::optional<double> speed;
  std::string model;                  // that the controller believes in; empty: that of the motion
  std::vector<std::string> settings;  // name=value
  std::vector<std::string> pushes;
  double friction = 0;  // 0: that of the plan
  // Of a free motion.
  std::string posture, state, torques;  // name of a reference; files
  std::string push_body;                // link; empty: the first body
  std::vector<std::string> springs;
  double accuracy = 0;  // 0: that of the world
  bool has_record_period = false;
  double time_step = 0;
  std::string sensors = "ideal";
  double noise = 1;
  std::optional<double> look_ahead;  // ms
  double delay = 0, jitter = 0;      // ms
  double solve_time = 0;             // ms
  RobotErrors errors;
  unsigned seed = 1;
  bool live = false, no_report = false, summary_only = false, dry_run = false;
  ExecutionOptions execution;
  PredictiveOptions predictive;
};

void addOptions(CLI::App& app, SimulateArguments& arguments);

/// Reads pushes and delays, and checks what can be checked without the motion. \throws InputError
void parseOptions(SimulateArguments& arguments);

/// The ground of the world: "planned", "flat", "ramp=0.05", "tiles=0.01" or "uneven=0.01". \throws InputError
Ground makeGround(const SimulateArguments& arguments, const Ground& planned);

}  // namespace bielle::worlds
