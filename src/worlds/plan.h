#pragma once
/// \file A motion ready to be carried out: read from its files, or solved on the spot; and the controller that carries it out.
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "bielle/control/predictive_controller.h"
#include "bielle/formats/reader.h"
#include "bielle/results/result.h"
#include "worlds/serial_belief.h"

namespace bielle::worlds {

enum class PlanControl {
  Predictive,  ///< predictive control along the plan
  Gains,       ///< the torques of the plan, and the gains of the solver's last sweep
  Open         ///< the torques of the plan
};

struct ControlOptions {
  PlanControl control = PlanControl::Predictive;
  PredictiveOptions predictive;  ///< its look_ahead is that of gains, too (Policy::setLookAhead)
  double duration = 0;           ///< for which a motion that repeats is to last, s; 0: ten cycles
  /// Of controllers that believe in a serial chain: whether maps as firmware has them are between them and the motors.
  bool generated_maps = false;
};

/// A run goes on for up to so long until it is decided whether the robot stands, s.
inline constexpr double kMostExtension = 5;

/// What is to be carried out, and what it was planned for.
struct Plan {
  Policy policy;  ///< of the model that is believed in; with gains, if they are wanted
  ContactSchedule schedule{};
  Ground ground{};
  std::vector<Goal> goals{};
  LoadedRobot robot{};
  MotionSummary summary{};
  Belief belief = Belief::Closed;
  std::optional<SerialModel> serial{};   ///< none for Belief::Closed
  std::optional<GeneratedMaps> maps{};   ///< likewise, where they are generated
  SerialReference lifted{};              ///< the plan of the serial model as one of the robot; empty for Belief::Closed
  std::optional<Solution> solution{};    ///< of the policy; none for a walk by command
  std::optional<CommandedWalk> walk{};   ///< by command: of the robot cut at its balls, before its first stage
  std::vector<TimedCommand> commands{};  ///< of that walk
  /// Of a motion that repeats: when it ends unless told otherwise, s. The policy has as many cycles as it takes to see whether the
  /// robot stands.
  std::optional<double> end{};
  int cycles = 1;
  int iterations = 0;  ///< that the solver took for the gains; 0: the motion in the files was its solution

  /// Of the model that is believed in.
  const Model& model() const { return serial ? serial->model : robot.model; }
  /// When a node of the plan comes, s.
  double getTime(int node) const {
    const size_t k = static_cast<size_t>(node);
    return k < policy.stages().size() ? policy.stages()[k].start : policy.duration();
  }
  /// The plan in states of the closed robot.
  const Policy& reference() const { return lifted.policy ? *lifted.policy : policy; }
};

/// Ctrl-C (results/interrupt.h) came before the motion began.
struct InterruptedPlan : std::runtime_error {
  InterruptedPlan() : std::runtime_error("interrupted before the motion began; nothing is written") {}
};
/// \throws InterruptedPlan if it did
void requireNoInterrupt();

/// Makes the motion again from its request. For gains it is solved again, from the solution in the files, which do not
/// hold them; for predictive control only if that has not converged.
/// \param belief  what the controller takes the robot for; empty: the model of the motion, which is solved anew for another
/// \throws InterruptedPlan, as makePlan() does; InputError when the files cannot be read, the motion does not converge, or has the least peak torque or the full formulation, and gains or predictive control are wanted that need others
Plan readPlan(const std::string& directory, const ControlOptions& control, std::optional<Belief> belief = {});

/// A motion by its name (`bielle solve`), solved when it is carried out.
struct PlanRequest {
  std::string motion, robot;  ///< the latter a name or a directory
  OptionValues settings;      ///< options by name
  double duration = 0;        ///< s; motions of steps take as many as there is time for; 0: their default
  Belief belief = Belief::Closed;
};
/// \throws InputError when robot, motion or an option do not exist, or it does not converge
Plan makePlan(const PlanRequest& request, const ControlOptions& control);

/// A walk that follows a file of commands, made while it is carried out: there is only predictive control. Its policy is the
/// standing posture, moved along the path that the commands foresee, with the ground and the contacts of that path.
/// \param request  of the motion 'walk'; its settings are those of locomotion.h   \param file  of commands (motion/commanded_walk.h)
/// \throws InputError when the file cannot be read, a command is impossible, the motion is no walk or an option does not exist
Plan makeCommandedPlan(const PlanRequest& request, const std::string& file);

/// Sets what predictive control wants of steps, where a motion has the option: feet stand where they landed, and may land
/// elsewhere than planned, on steps of the ground a little; wrenches keep away from the edges of their cones, since feedback and
/// errors of the model add to what is planned.
void freeFeet(const Model& model, const StandingRobot& standing, const Ground& ground, OptionSet& options);

/// A controller that owns all that it works with.
struct PlanController {
  std::unique_ptr<Controller> law;                   ///< of the closed robot
  const PredictiveController* prediction = nullptr;  ///< the part of it that predicts, or null
  const GeneratedMaps* maps = nullptr;               ///< generated ones in it, or null
  std::vector<Goal> goals{};                         ///< those of the plan; of footholds, within the room that it has
};
/// \param options  for which the plan was made
/// \throws InputError as PredictiveController does
PlanController makeController(const Plan& plan, const ControlOptions& options);

}  // namespace bielle::worlds
