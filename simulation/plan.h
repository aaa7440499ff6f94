#pragma once
/// \file A motion ready to be carried out: read from its files, or solved on the spot.
#include <string>

#include "bielle/control/predictive_controller.h"
#include "bielle/io/result.h"
#include "bielle/model/reader.h"

namespace bielle::simulation {

enum class PlanControl {
  Open,       ///< the torques of the files
  Gains,      ///< and the gains of the solver's last sweep
  Predictive  ///< predictive control along the motion
};

/// The policy refers to the robot's model: a plan stays where it was made.
struct Plan {
  LoadedRobot robot;
  MotionSummary summary;
  Ground ground;  ///< that the motion was planned for
  ContactSchedule schedule;
  std::unique_ptr<Policy> policy;
  std::unique_ptr<PredictiveController> predictive;  ///< or null
  int iterations = 0;  ///< that the solver took for the gains; 0: the motion in the files was its solution

  Controller& getController() { return predictive ? static_cast<Controller&>(*predictive) : *policy; }
};

/// Makes the motion again from its request. For gains it is solved again, from the solution in the files: they do not
/// hold the gains, nor the multipliers of the constraints.
/// \throws ModelError when the files cannot be read, the motion is not one of the closed robot, does not converge, or has the
/// least peak torque or the full formulation, and gains or predictive control are wanted that need others
std::unique_ptr<Plan> readPlan(const std::string& directory, PlanControl control,
                               const PredictiveOptions& predictive = {});

/// A motion by its name (`bielle solve`), solved when it is carried out.
struct PlanRequest {
  std::string motion, robot;                             ///< the latter a name or a directory
  std::vector<std::pair<std::string, double>> settings;  ///< options by name
  double duration = 0;  ///< s; motions of steps take as many as there is time for; 0: their default
};
/// \throws ModelError when robot, motion or an option do not exist, or it does not converge
std::unique_ptr<Plan> makePlan(const PlanRequest& request, PlanControl control,
                               const PredictiveOptions& predictive = {});

}  // namespace bielle::simulation
