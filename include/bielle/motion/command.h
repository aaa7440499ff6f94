#pragma once
/// \file Commands of a walk: a velocity over time.
///
/// A file of commands is YAML. Each velocity holds from its time on, until the next one; before the first the robot stands.
///
///     commands:
///       - {time: 0.5, forward: 0.4}
///       - {time: 4, forward: 0.3, turning: 0.4}
///       - {time: 8}
///
/// time is in s; forward and sideways (to the left) are in m/s, turning (to the left) in rad/s; all three are 0 unless given.
#include <string>
#include <vector>

#include "bielle/motion/locomotion.h"

namespace bielle {

/// Velocity of the middle of the feet, in its own axes.
struct VelocityCommand {
  double forward = 0, sideways = 0;  ///< m/s; the latter to the left
  double turning = 0;                ///< rad/s, to the left

  bool isRest() const { return forward == 0 && sideways == 0 && turning == 0; }
};

/// A velocity that holds from a time on.
struct TimedCommand {
  double time = 0;  ///< s
  VelocityCommand velocity;
};

/// \throws InputError naming file, entry and line
std::vector<TimedCommand> readCommands(const std::string& path);

/// The velocity that holds at a time; rest before the first. \param commands  in the order of time
VelocityCommand findCommand(const std::vector<TimedCommand>& commands, double time);

/// The mean over [0, duration] of the speed over the ground, m/s.
double calcMeanSpeed(const std::vector<TimedCommand>& commands, double duration);

/// Checks that legs reach the footholds of steps at this velocity, that none turns by more than half a turn, and that soles do
/// not collide.
/// \param element  names the command in messages   \throws InputError unless they do
void checkCommand(const Model& model, const StandingRobot& standing, const LocomotionOptions& options,
                  const VelocityCommand& command, const std::string& element);

}  // namespace bielle
