#pragma once
/// \file A solved motion read from its files, ready to be carried out.
#include <string>

#include "bielle/control/policy.h"
#include "bielle/io/result.h"
#include "bielle/model/reader.h"

namespace bielle::simulation {

enum class PlanControl {
  Open,  ///< the torques of the files
  Gains  ///< and the gains of the solver's last sweep
};

/// The policy refers to the robot's model: a plan stays where it was made.
struct Plan {
  LoadedRobot robot;
  MotionSummary summary;
  Ground ground;  ///< that the motion was planned for
  ContactSchedule schedule;
  std::unique_ptr<Policy> policy;
  int iterations = 0;  ///< that the solver took for the gains; 0: the motion in the files was its solution
};

/// Makes the motion again from its request. For gains it is solved again, from the solution in the files: they do not
/// hold the gains, nor the multipliers of the constraints.
/// \throws ModelError when the files cannot be read, the motion is not one of the closed robot, does not converge, or has the
/// least peak torque and gains are wanted
std::unique_ptr<Plan> readPlan(const std::string& directory, PlanControl control);

}  // namespace bielle::simulation
