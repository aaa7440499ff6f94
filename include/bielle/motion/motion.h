#pragma once
/// \file A motion: from a few numbers a person understands to a shooting problem with its initial guess.
#include <memory>
#include <string>
#include <vector>

#include "bielle/motion/limits.h"
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

/// The options' present values.
std::vector<std::pair<std::string, double>> listValues(const std::vector<OptionEntry>& options);

/// \throws ModelError naming the option, unless ok
void requireOption(bool ok, const std::string& option, const std::string& problem, const std::string& remedy);

/// \throws ModelError when a motion of so many seconds has more stages than there may be memory for (100000)
void requireStages(double seconds, double time_step);

/// A motion before it becomes a problem: what a sequence joins. It starts and ends standing.
struct MotionPlan {
  std::string name;
  ContactSchedule schedule;
  Ground ground;
  std::vector<StageSpec> stages;                          ///< N running ones and the terminal one
  ShootingTrajectory guess;                               ///< quasi-static
  VectorXd q_start, q_end;                                ///< standing postures, nq
  std::vector<std::pair<std::string, double>> requested;  ///< what was asked, by option name
};

/// A problem ready to be solved, with what reports need to know about it.
struct Motion {
  std::string name;
  ContactSchedule schedule;
  Ground ground;
  std::unique_ptr<RobotProblem> problem;
  ShootingTrajectory guess;                               ///< quasi-static
  std::vector<std::pair<std::string, double>> requested;  ///< what was asked, by option name
};

/// The last step of making a motion: its stages, with their limits, to a problem that starts at rest.
/// \throws ModelError when there is no motor that a limit names
Motion makeMotion(const Model& model, MotionPlan plan, const ProblemOptions& options);

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

/// The posture q carried over the ground by X, a displacement and a turn about the vertical. A robot without a free-flyer
/// stays where it is.
VectorXd carryPosture(const Model& model, ConstVectorRef q, const SE3& X);

/// Stabilisation of contacts, 1/s^2 and 1/s, limited to 1/(4 h^2) and 1/h with h the time step: one Euler step turns a
/// contact velocity e into (1 - kd h) e, beyond 1/h it would swing back.
struct ContactGains {
  double kp = 0, kd = 0;
};
ContactGains limitContactGains(const ContactGains& gains, double time_step);

/// Contacts of the robot held at their places in q.
std::vector<ContactTarget> makeContactTargets(const Model& model, ConstVectorRef q, const std::vector<int>& contacts,
                                              double kp, double kd);

/// Weights of the state regularization, as the paper's example code gives them (ocp-figures: importance vectors,
/// squared): joints of the equivalent serial chain as listed, linkage joints zero, base position free.
VectorXd makeStateWeights(const Model& model);

/// Motor velocities weigh at least `weight` (weights: 2 nv): motors of linkages would be free to shake.
void raiseMotorWeights(const Model& model, double weight, VectorXd& weights);

/// What feet on the ground should do, for all motions.
struct GroundCosts {
  double force_weight = 10;    ///< of the force reference, over (m g)^2
  double pressure_weight = 1;  ///< of the centre of pressure, over the half size of the sole squared
  /// Of leaving the friction pyramid, over the square of the foot's load (of m g / 10 at least), 1. By newtons alone, a
  /// weight that holds a foot that bears little is so stiff for one that bears the robot that the solver creeps.
  double friction_weight = 100;
  double friction = 0.7;  ///< coefficient, 1
};
/// Adds the costs of every contact in force at the stage. \param loads  vertical force of each, in their order, N
void addGroundCosts(const Model& model, const GroundCosts& costs, const VectorXd& loads, StageSpec& stage);

}  // namespace bielle
