#pragma once
/// \file A motion: from a few intuitive numbers to a shooting problem with its initial guess.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bielle/dynamics/ground.h"
#include "bielle/model/options.h"
#include "bielle/motion/goal.h"
#include "bielle/motion/problem_options.h"
#include "bielle/ocp/contact_schedule.h"
#include "bielle/ocp/robot_problem.h"
#include "bielle/solve/fddp.h"

namespace bielle {

/// \throws InputError naming the option unless `ok`
void requireOption(bool ok, const std::string& option, const std::string& problem, const std::string& remedy);

/// \throws InputError when a motion of this duration has more than 100000 stages, which may exceed the memory
void requireStages(double seconds, double time_step);

/// What a motion is, before and after it becomes a problem.
struct MotionOutline {
  std::string name;
  ContactSchedule schedule;
  Ground ground;
  ShootingTrajectory guess;  ///< quasi-static: where a solve begins unless told otherwise
  OptionValues options;      ///< every option of the motion by name
  std::vector<Goal> goals;   ///< requested quantities, to be measured on the trajectory
  /// Of a motion that repeats, one cycle: where it ends, over the ground, from where it began. Its first state is free, and its last
  /// one is that, moved by this (carryState).
  std::optional<SE3> cycle{};
};

/// A motion before it becomes a problem; a sequence joins several. It starts and ends standing, unless it is a cycle.
struct MotionPlan : MotionOutline {
  std::vector<StageSpec> stages;  ///< N running stages and the terminal stage
  VectorXd q_start, q_end;  ///< standing postures, nq; of a cycle, whose start they are not, those about which it moves
};

struct MotionRequest;

/// A problem ready to be solved (solve.h), with the data that reports need. Solving it changes nothing; copies share the problem.
struct Motion : MotionOutline {
  std::shared_ptr<RobotProblem> problem;
  ProblemOptions problem_options{};  ///< that the problem was made with
  /// That it was made of, if it was (registry.h): how to make another one like it.
  std::shared_ptr<const MotionRequest> request{};
  bool within_limits = false;  ///< whether torques are limited, at s = 1 of the peak torque
};

/// Where a solve begins.
struct StartingPoint {
  ShootingTrajectory trajectory;
  /// Of the constraints; taken where the motion has as many rows of them at every node, else zero.
  Multipliers multipliers{};
};

/// FddpOptions with one change: a cost that changed by less than 1e-4 of itself in 20 iterations is acceptable. Motions
/// of least effort near the limits of friction or of a linkage need that.
FddpOptions makeMotionSolverOptions();

/// FddpOptions::initial_regularization for solves from Motion::guess. That guess is at rest: without damping, the first
/// steps move the swing legs so far that dozens of short steps follow. Solves from a solution need no damping.
constexpr double kGuessRegularization = 1e-5;

/// The scale of an objective by Eq. (2) of problem_options.h. \param effort, trajectory  the motion of least effort and its
/// solution   \param limits  those of the motion
ObjectiveOptions scaleObjective(const Motion& effort, const ShootingTrajectory& trajectory,
                                const ObjectiveOptions& options, const LimitOptions& limits = {});

/// Turns a plan into a problem, adding limits, free durations, objective and step rule to its stages. It starts at rest; the start of
/// a cycle is free (solve() wraps it in a PeriodicProblem).
/// Gains are limited to values that are stable for a step (limitGains).
/// \throws InputError for an unknown motor or phase, a limit that is not positive, a margin or bound out of its range, a joint
/// whose range has zero width or excludes where the motion starts; for a cycle of free durations, of least peak torque or in the full
/// formulation
Motion makeMotion(const Model& model, MotionPlan plan, const ProblemOptions& options);

/// Motor torques that hold the robot still at q under the closures and contacts, as far as possible: with a = v = 0,
///     b(q, 0) = B u + J^T lambda (1)
/// solved in the least-squares sense with the smallest (u, lambda / weight of the robot).
struct StaticTorques {
  VectorXd u;           ///< nu
  double residual = 0;  ///< largest entry of the residual of (1), N m or N
};
StaticTorques calcStaticTorques(const Model& model, const ConstraintSet& constraints, ConstVectorRef q);

/// The posture next to q, with these contacts where they belong, at which springs that no motor moves balance the weight; q
/// itself where there are no such springs, or nothing balances them.
VectorXd settlePosture(const Model& model, const std::vector<ContactTarget>& contacts, ConstVectorRef q);

/// The starting posture: the reference `half_sitting`, or the only one; springs that it does not name and that no motor
/// holds are deflected until the robot stands still, if possible. \throws InputError when there is no reference, or it
/// cannot be closed
VectorXd makeStandingPosture(const Model& model);

class NeighbourPlans;

/// The robot as it stands at the start of a motion: made once, for everything that a plan asks of it.
struct StandingRobot {
  VectorXd q;                 ///< nq, closed
  Vector3d com;               ///< m
  std::vector<SE3> contacts;  ///< placements of the model's contacts, in their order
  /// Those beside which it is one of many, whose plans are not solved and stay rough; mostly null.
  NeighbourPlans* neighbours = nullptr;
};
/// In its starting posture. \throws InputError as makeStandingPosture() does
StandingRobot makeStandingRobot(const Model& model);
StandingRobot makeStandingRobot(const Model& model, const VectorXd& q, NeighbourPlans* neighbours = nullptr);

/// The posture q moved over the ground by X, a displacement and a rotation about the vertical. A robot without a
/// free-flyer stays in place.
VectorXd carryPosture(const Model& model, ConstVectorRef q, const SE3& X);

/// The state (q, v) moved likewise: velocities stay, since that of a free-flyer is in its own frame.
VectorXd carryState(const Model& model, const VectorXd& x, const SE3& X);

/// Stabilisation gains of contacts and closures, 1/s^2 and 1/s.
struct ContactGains {
  double kp = 0, kd = 0;
};
/// Limits gains to values that are stable for a step of length h. With D = h kd and K = h^2 kp, a displacement d of a
/// foot and its velocity e become, in one step,
///     Euler:     h e+ = (1 - D) h e - K d,    d+ = d + h e+                                                        (1)
///     midpoint:  h e+ = (1 - D) h e - K d,    d+ = d + h/2 (e + e+)                                                (2)
/// The limits are D <= 1, beyond which a velocity would change its sign, and K <= 1/2 or, of midpoint steps, 1/3. There
/// the eigenvalues of a step are 0 and 1/2, or 1/3 and 1/2.
void limitGains(StepRule rule, double h, ConstraintSet& constraints);
/// Sets the gains of the model's closures in a set of constraints.
void setClosureGains(const ContactGains& gains, ConstraintSet& constraints);

/// Contacts of the robot held at their places in q.
std::vector<ContactTarget> makeContactTargets(const Model& model, ConstVectorRef q, const std::vector<int>& contacts,
                                              double kp, double kd);

/// All contacts of the robot, held where it stands.
std::vector<ContactTarget> makeContactTargets(const StandingRobot& standing, double kp, double kd);

/// Soles whose heights differ by less stand on one plane, at the mean of their heights.
inline constexpr double kLevelSoles = 1e-4;  // m
/// Whether all stand on one plane.
bool areLevel(const std::vector<ContactTarget>& soles);
/// The ground under soles: a plane under the lowest, and a box under each that stands higher, with its inclination. Boxes exceed
/// soles by 2 cm, or less where another sole is near. Its friction is the default.
Ground makeGroundUnder(const Model& model, const std::vector<ContactTarget>& soles);
/// \throws InputError naming the heights of the soles unless they are level   \param motion  that needs it
void requireLevel(const Model& model, const std::vector<ContactTarget>& soles, const std::string& motion);

/// Names of the contacts of the targets, in their order.
std::vector<std::string> getContactNames(const Model& model, const std::vector<ContactTarget>& targets);

/// Weights of the state regularization, as the paper's example code gives them (ocp-figures: importance vectors,
/// squared): joints of the equivalent serial chain as listed, linkage joints zero, base position free.
VectorXd makeStateWeights(const Model& model);

/// Selects the joints of the state regularization: the equivalent serial chain, or all joints but the base; nv, 1 or 0.
VectorXd selectMainJoints(const Model& model);

/// Raises the weights of motor velocities to at least `weight` (weights: 2 nv); otherwise motors of linkages may
/// oscillate.
void raiseMotorWeights(const Model& model, double weight, VectorXd& weights);

inline constexpr double kConeMargin = 0.01;

/// The options that all motions have; motions set other defaults.
struct MotionOptions {
  double state_weight = 0.1;         ///< of the state regularization
  double torso_weight = 10;          ///< of the torso's roll and pitch (in jumps its heading too) within it
  double motor_weight = 1;           ///< of motor velocities within it
  double control_weight = 1e-3;      ///< of the motor torques, 1/(N m)^2
  double force_weight = 10;          ///< of the contact force reference, over (m g)^2
  double pressure_weight = 1;        ///< of the centre of pressure, over the half size of the sole squared
  double friction = 0.7;             ///< coefficient, 1
  double cone_margin = kConeMargin;  ///< of the wrench cones (addWrenchCones), 1
  double contact_kp = 1e4;           ///< stabilisation of contacts, in jumps also of closures, 1/s^2 (limitGains)
  double contact_kd = 200;           ///< 1/s; likewise
};
void describe(OptionFields& fields, MotionOptions& options);

/// Costs of the feet on the ground, the same for all motions.
struct GroundCosts {
  double force_weight = 10;             ///< of the force reference, over (m g)^2
  double pressure_weight = 1;           ///< of the centre of pressure, over the half size of the sole squared
  ForceAxes axes = ForceAxes::Contact;  ///< of force reference and centre of pressure
  double arm = 1;                       ///< about which a force counts as much as its moment, m
};
/// Adds a path constraint for every active contact: the wrench cone of its sole (ocp/cost.h), reduced by `margin` in
/// friction and in size, and by a thousandth of the robot's weight in the normal force. Its pyramids of
/// friction/sqrt(2) are inscribed in round cones. A violation of 1 is the weight of the robot.
/// \param friction  coefficient of the ground, positive   \param margin  relative reduction; at least a hundredth,
/// otherwise rounded results may leave the cone
void addWrenchCones(const Model& model, double friction, double margin, StageSpec& stage,
                    ForceAxes axes = ForceAxes::Contact);
/// The same of the impulses of an impact, where a violation of 1 is the mass of the robot times 1 m/s. Feet that
/// already stood may receive almost no impulse, so that their cones are lowered by 1e-4 of that: a cone has no interior
/// at its apex.
/// \param landing  index of the contact that lands, not at rest
void addImpulseCones(const Model& model, double friction, double margin, int landing, StageSpec& stage);

/// Adds the costs of every active contact of the stage. \param loads  vertical force of each, in their order, N
void addGroundCosts(const Model& model, const GroundCosts& costs, const VectorXd& loads, StageSpec& stage);

}  // namespace bielle
