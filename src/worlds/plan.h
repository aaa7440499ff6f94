#pragma once
/// \file A motion ready to be carried out: read from its files, or solved on the spot.
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
  Open,       ///< the torques of the files
  Gains,      ///< and the gains of the solver's last sweep
  Predictive  ///< predictive control along the motion
};

/// The policies refer to the models: a plan stays where it was made.
struct Plan {
  LoadedRobot robot;
  MotionSummary summary;
  Ground ground;  ///< that the motion was planned for
  ContactSchedule schedule;
  std::vector<Goal> goals;             ///< of the plan
  std::vector<TimedCommand> commands;  ///< of a walk by command
  Belief belief = Belief::Closed;
  std::unique_ptr<SerialModel> serial;               ///< null for Belief::Closed
  std::unique_ptr<Policy> policy;                    ///< of the model that is believed in
  std::unique_ptr<PredictiveController> predictive;  ///< of the same, cut at its balls (dynamics/ball_cuts.h), or null
  SerialReference reference;                         ///< empty for Belief::Closed
  std::unique_ptr<Controller> adapter;               ///< of a controller whose model is not the robot's, or null
  int iterations = 0;  ///< that the solver took for the gains; 0: the motion in the files was its solution

  /// Of the model that is believed in.
  const Model& model() const { return serial ? serial->model : robot.model; }
  /// When a node of the plan comes, s.
  double getTime(int node) const {
    const size_t k = static_cast<size_t>(node);
    return k < policy->stages().size() ? policy->stages()[k].start : policy->duration();
  }
  /// The plan in states of the closed robot.
  const Policy& getReference() const { return reference.policy ? *reference.policy : *policy; }
  Controller& getController() {
    if (adapter) return *adapter;
    return predictive ? static_cast<Controller&>(*predictive) : *policy;
  }
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
std::unique_ptr<Plan> readPlan(const std::string& directory, PlanControl control,
                               const PredictiveOptions& predictive = {}, std::optional<Belief> belief = {});

/// A motion by its name (`bielle solve`), solved when it is carried out.
struct PlanRequest {
  std::string motion, robot;  ///< the latter a name or a directory
  OptionValues settings;      ///< options by name
  double duration = 0;        ///< s; motions of steps take as many as there is time for; 0: their default
  Belief belief = Belief::Closed;
};
/// \throws InputError when robot, motion or an option do not exist, or it does not converge
std::unique_ptr<Plan> makePlan(const PlanRequest& request, PlanControl control,
                               const PredictiveOptions& predictive = {});

/// Makes the plan's predictive controller, whose model this is, one of the plan's model.
void adaptPredictive(const Model& cut, Plan& plan);

/// Sets what predictive control wants of steps: feet stand where they landed and may land elsewhere than planned, and wrenches
/// keep away from the edges of their cones.
void freeFeet(LocomotionOptions& options);

}  // namespace bielle::worlds
