#pragma once
/// \file Carrying a plan out: a controller and a world, instant by instant, and what came of it.
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "bielle/motion/record.h"
#include "bielle/worlds/world.h"
#include "worlds/fall_detector.h"
#include "worlds/perception.h"
#include "worlds/plan.h"
#include "worlds/torque_delay.h"

namespace bielle::worlds {

/// A constant force on the trunk for a while.
struct Push {
  double time = 0;        ///< when it begins, s
  double impulse = 0;     ///< N s
  double direction = 0;   ///< about the vertical, from the x axis of the world; 90: to the left, degrees
  double duration = 0.1;  ///< s
};

struct ExecutionOptions {
  /// s; 0: that of the plan and `hold`. Goes on for up to 5 s until it is decided whether the robot stands (worlds/balance.h).
  double duration = 0;
  double hold = 1;               ///< s
  double control_period = 1e-3;  ///< s
  double record_period = 5e-3;   ///< s
  /// Each instant of control awaits its time on the clock: for controllers that work beside the world.
  bool real_time = false;
  DelayOptions delay;
  std::vector<Push> pushes;
  FallCriterion fall;
  /// Ends the motion where it is, as WorldOptions::interrupt does within a period of control.
  const std::atomic<bool>* interrupt = nullptr;
};

enum class Outcome { Running, Stood, Ended, Fell, BrokeOff, Stopped, Undecided };
const char* getName(Outcome outcome);

/// The largest of what happened to a foot, and when.
struct FootExtreme {
  double value = 0, time = 0;  ///< rad or m; s
  int contact = -1;            ///< of the model, -1 as long as there was none

  void note(double other, double at, int foot) {
    if (other > value) *this = {other, at, foot};
  }
};

struct Execution {
  Outcome outcome = Outcome::BrokeOff;
  /// What made it count as fallen, why the world broke off, what is not decided, or what is odd about how a foot stood
  /// (describeFeet()).
  std::string message;
  double duration = 0;                 ///< until the end, the fall or the break, s
  double extension = 0;                ///< of that beyond what was asked for, until it was decided whether it stands, s
  double distance = 0;                 ///< of the centre of mass over the ground, from the start to the end, m
  double largest_gap = 0;              ///< of closures, m
  double largest_slip = 0;             ///< of a sole since its touchdown, m
  FootExtreme largest_tilt;            ///< of a foot that carries a quarter of the weight, from the ground, rad
  FootExtreme largest_depth;           ///< of such a foot in the ground, m
  double largest_deviation = 0;        ///< of the trunk from its planned place, m
  double largest_joint_deviation = 0;  ///< of a revolute joint from its planned angle, rad
  double imbalance = 0;                ///< Books' Eq. (1), left less right side, J
  /// The imbalance over the energy that motors, pushes and losses moved, row by row of the record.
  double energy_balance = 0;
  double saturated_share = 0;  ///< of motors and time: torques that were cut at their limits
  /// Time on the clock, s: all in all, of which in the world, and in the controller with its sensors.
  double whole_seconds = 0, world_seconds = 0, control_seconds = 0;
  std::vector<double> update_seconds;  ///< of each call of Controller::update()
  double largest_lag = 0;              ///< with `real_time`: of an instant of control behind the clock, s
  EstimationErrors estimation;
  Books start, end;
  Integration integration;
  MotionRecord record;  ///< of what happened; forces of closures are not known (NaN), accelerations are means

  double meanSpeed() const { return duration > 0 ? distance / duration : 0; }  ///< m/s
  /// Simulated time over time on the clock.
  double realTimeFactor() const { return whole_seconds > 0 ? duration / whole_seconds : 0; }
};

/// What has happened up to now, with the rows of its record from an instant [s] on.
using ExecutionSoFar = std::function<Execution(double since)>;
/// Looks on: is called after every row of the record, at `time` of `duration`, s.
using ExecutionObserver = std::function<void(double time, double duration, const ExecutionSoFar& so_far)>;

/// Names the foot that carried the robot although it was turned from the ground or sank into it by more than the ground's
/// softness and a landing explain, 0.2 rad or 5 mm; empty if none did.
std::string describeFeet(const Model& model, const Execution& execution);

/// The force of all pushes at an instant [s], N (world).
Vector3d calcPush(const std::vector<Push>& pushes, double time);

/// When a run ends unless it is not decided yet, s.
double getEnd(const Plan& plan, const ExecutionOptions& options);

/// From the state in which the plan starts.
/// \param controller  for the robot of the plan, from which that of the world may differ in its dimensions (robot_errors.h)
/// \param sensors  what the controller is told
Execution carryOut(const Plan& plan, Controller& controller, World& world, const PerceptionOptions& sensors = {},
                   const ExecutionOptions& options = {}, const ExecutionObserver& observer = {});

}  // namespace bielle::worlds
