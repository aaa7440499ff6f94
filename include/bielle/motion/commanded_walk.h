#pragma once
/// \file A walk that follows commands, velocities over time, without an end.
///
/// A file of commands is YAML. Each velocity holds from its time on, until the next one; before the first the robot stands.
///
///     commands:
///       - {time: 0.5, forward: 0.4}
///       - {time: 4, forward: 0.3, turning: 0.4}
///       - {time: 8}
///
/// time is in s; forward and sideways (to the left) are in m/s, turning (to the left) in rad/s; all three are 0 unless given.
///
/// Its stages are made one by one. Costs and constraints are those of locomotion.h, on level ground, for steps by footsteps.h Eq. (1) with
///     D_i = T (forward, sideways, turning),    T the duration of a step,                                         (1)
/// of the command at the beginning of step i. At zero command the robot takes a last step that brings its feet
/// together, then stands.
///
/// The stages of one step are made together. The centre of mass follows the pendulum of gait.h, Eq. (1), through this step and
/// the two that would follow it under the same command, to rest. It starts at the end of the previous step. The
/// prediction beyond a step counts with a factor exp(-2 T / tau), about 0.06, with tau the pendulum's time constant.
#include <deque>
#include <functional>
#include <memory>
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

/// The commanded velocity at a time, s. Called once per step and, while the robot stands, every few stages, with
/// increasing times.
using CommandSource = std::function<VelocityCommand(double)>;

class Limits;

class CommandedWalk {
 public:
  struct Stage {
    StageSpec spec;
    VectorXd
        x;  ///< nq + nv: the standing posture, moved along the walk; a closed state, whose velocity leads to the next
    VectorXd u;                             ///< nu, torques that hold the robot at rest on the feet that stand
    int phase = 0;                          ///< stages with the same feet on the ground, counted from 0 on
    std::string phase_name;                 ///< e.g. "double support"
    std::vector<ContactTarget> contacts{};  ///< feet on the ground, with their places
  };

  /// From where the robot stands, at time 0.
  /// \param options  `flight`, `rigid_landing` and `landing_speed` are ignored; a time step of 0 is 12 ms
  /// \throws InputError as planLocomotion() and makeMotion() do
  CommandedWalk(const Model& model, const LocomotionOptions& options, const LimitOptions& limits, CommandSource command,
                const StandingRobot& standing);

  const Model& model() const { return model_; }
  /// The next stage.
  Stage makeNext();
  double timeStep() const { return options_.timing.time_step; }  ///< s
  /// The stages of a step on the spot, which are as large as any stage of the walk; for allocating memory.
  std::vector<StageSpec> makeExamples() const;

 private:
  struct Segment;
  void makeStages();
  Segment planSegment(const Stance& stance);
  std::vector<Footstep> planSteps(const VelocityCommand& command, int count) const;
  Stance makeStanceHere() const;
  void addLimitsTo(std::vector<StageSpec>& stages);
  const VectorXd& findStaticTorques(const std::array<bool, 2>& stands, const std::vector<ContactTarget>& contacts);

  Model model_;
  const LocomotionOptions options_;
  const CommandSource command_;
  const Stance standing_;  // at the start
  const std::shared_ptr<const Limits> limits_;
  std::array<VectorXd, 4> static_torques_;  // by the feet that stand
  enum class State { Standing, Starting, Walking };
  State state_ = State::Standing;
  // After the last stage made.
  std::array<SE3, 2> feet_;
  SE3 middle_;                // P of footsteps.h Eq. (1)
  Vector3d com_;              // centre of mass
  Side swing_ = Side::Right;  // foot of the next step
  std::array<bool, 2> standing_feet_{};
  int made_ = 0, phase_ = 0;
  std::deque<Stage> stages_;  // made, but not requested yet
};

}  // namespace bielle
