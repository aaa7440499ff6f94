#pragma once
/// \file A motion: from a few numbers a person understands to a shooting problem with its initial guess.
#include <memory>
#include <string>
#include <vector>

#include "bielle/ocp/contact_schedule.h"
#include "bielle/ocp/ground.h"
#include "bielle/ocp/robot_problem.h"
#include "bielle/solve/fddp.h"

namespace bielle {

/// One number that can be set by name (`--set name=value`).
struct OptionEntry {
  std::string name;
  double* value = nullptr;
  std::string unit;
  std::string help;
};

/// Sets an option by name.
/// \throws ModelError naming the options there are
void setOption(const std::vector<OptionEntry>& options, const std::string& name, double value);

/// A problem ready to be solved, with what reports need to know about it.
struct Motion {
  std::string name;
  ContactSchedule schedule;
  Ground ground;
  std::unique_ptr<RobotProblem> problem;
  ShootingTrajectory guess;                               ///< quasi-static
  std::vector<std::pair<std::string, double>> requested;  ///< what was asked, by option name
};

/// Motor torques that hold the robot still at q under the closures and contacts, as well as they can: with a = v = 0,
///     b(q, 0) = B u + J^T lambda (1)
/// solved in the least-squares sense for the smallest (u, lambda / weight of the robot).
struct StaticTorques {
  VectorXd u;           ///< nu
  double residual = 0;  ///< largest entry of what (1) leaves, N m or N
};
StaticTorques calcStaticTorques(const Model& model, const ConstraintSet& constraints, ConstVectorRef q);

/// The robot's starting posture: its reference `half_sitting`, or the only reference it has.
/// \throws ModelError when there is none, or it cannot be closed
VectorXd makeStandingPosture(const Model& model);

/// Contacts of the robot held at their places in q.
std::vector<ContactTarget> makeContactTargets(const Model& model, ConstVectorRef q, const std::vector<int>& contacts,
                                              double kp, double kd);

/// Weights of the state regularization, as the paper's example code gives them (ocp-figures: importance vectors,
/// squared): joints of the equivalent serial chain as listed, linkage joints zero, base position free.
VectorXd makeStateWeights(const Model& model);

}  // namespace bielle
