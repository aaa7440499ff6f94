#pragma once
/// \file What a problem has besides its motion: limits, free durations, an objective.
///
/// Limits of motors and joints, for every motion.
///
/// - Torques |u| <= effort limit: bounds of the controls.
/// - Ranges of joints with one degree of freedom, velocities, and powers |u v| of motors: path constraints at every
///   node but the first, whose state is given. A violation of 1 is half the width of a range (1 rad or 1 m where one
///   side is open), or the limit of a velocity or power.
/// - Voltages of motors whose winding and supply are known (Motor::hasEnvelope()), in every step: the faster a motor turns, the
///   smaller its largest torque. A violation of 1 is the voltage of the supply.
/// - Dead points of linkages: the transmission of each (linkage.h) stays within margin .. 1/margin of that at the
///   start, at the same nodes. Beyond a dead point a linkage snaps into another configuration.
///
/// Phases whose durations the solver chooses, within bounds (robot_problem.h Eq. (5)).
///
/// A motion is planned for its nominal durations. If the duration of a phase is free, all its steps become longer or
/// shorter together. Quantities planned as functions of the phase's progress remain so: contacts, footholds, paths of
/// feet and of the centre of mass, heights, loads; velocities to be followed change with the duration. Running costs
/// are integrated over the time that the motion takes. Gains of contacts and closures are limited for the longest steps
/// that the bounds allow.
///
/// What a motion minimizes besides the costs that define it.
///
/// - Effort: the costs of the motion, weighted squares of torques, speeds, postures, forces.
/// - Energy: the electrical energy of the motors,
///       E = sum_m integral of max(P_m, 0) + r min(P_m, 0),   P = u w + loss u^2,                                   (1)
///   with u the torque of a motor and w its speed at the same instant (robot_problem.h), its loss that of the model, and r
///   the share of the regenerated energy that is reused. Behind a gear with losses P = c u w + loss (c u)^2 with the
///   factor c of MotorDrive Eq. (1), smoothed as in makeElectricalPower(). max is smoothed (cost.h): the cost exceeds (1)
///   by at most (1 - r) kPowerSmoothing / 2 per motor and second.
/// - Peak torque: s^2 with s the largest |u_m| / L_m of all motors and stages (src/solve/peak_problem.h), L_m the effort limit
///   of the motor. Motors without a limit do not count; if none has one, all L_m are m g times kReferenceLever.
///
/// The costs of a motion that do not define it (Cost::defines) remain as a regularization rho: they determine what the
/// objective leaves undetermined. With C those costs, D those that define the motion, and J the energy or s^2, the
/// whole is
///
///     D + rho C + (C_0 + D_0) J / J_0                                                                              (2)
///
/// where the index 0 is the motion of least effort (scaleObjective()). So rho has the same meaning for all motions, robots and
/// units, and the cost has the magnitude for which the solver's penalties and tolerances are chosen.
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bielle/ocp/contact_schedule.h"
#include "bielle/ocp/robot_problem.h"

namespace bielle {

struct LimitOptions {
  bool enforced = true;                              ///< false: all limits, including torque, are ignored
  std::map<std::string, double> efforts;             ///< by motor, N m or N, replacing the limits of the model
  std::map<std::string, double> velocities;          ///< by motor, rad/s or m/s, likewise
  std::map<std::string, double> powers;              ///< by motor, W; driving or braking
  double dead_point_margin = 0.15;                   ///< least share of the transmission at the start, below 1; 0: none
  std::map<std::string, double> dead_point_margins;  ///< by Linkage::output, where larger than that

  bool areGiven() const { return !(efforts.empty() && velocities.empty() && powers.empty()); }
};

/// Bounds of a duration relative to the nominal one.
struct TimingBounds {
  double lower = 0.6, upper = 1.6;
};

inline constexpr const char* kAllPhases = "all";

struct TimingOptions {
  /// By name of the phase, e.g. "double support"; in a sequence of each motion that has it. "all" stands for every phase
  /// with contacts that is not named: a flight is free only if it is named, since its duration determines the height.
  std::vector<std::pair<std::string, TimingBounds>> phases;
  double time_weight = 0;  ///< cost per second of the free phases

  bool areGiven() const { return !phases.empty(); }
};

/// A phase of free duration.
struct PhaseTiming {
  std::string phase;
  int start_node = 0;
  double nominal = 0, chosen = 0;  ///< s
  double lower = 0, upper = 0;     ///< bounds, s
};

/// The durations of the free phases in a trajectory.
std::vector<PhaseTiming> listTimings(const RobotProblem& problem, const ContactSchedule& schedule,
                                     const ShootingTrajectory& trajectory);

enum class Objective { Effort, Energy, PeakTorque };
const char* getName(Objective objective);

inline constexpr double kPowerSmoothing = 0.1;  ///< W
inline constexpr double kReferenceLever = 0.1;  ///< m

struct ObjectiveOptions {
  Objective objective = Objective::Effort;
  double regeneration = 0;  ///< r of Eq. (1), within 0 .. 1; counts in reported energies whatever the objective
  std::optional<double> regularization{};  ///< rho, positive; if not given getDefaultRegularization()
  /// (C_0 + D_0) / J_0: cost of a joule, or of s = 1. If not given, solve() finds it for motions made of a request; else 1.
  std::optional<double> scale{};

  double getRegularization() const;
};
/// 0.2, but 1 for the effort. With 0.1, fast walks fail the check at their usual stages and need shorter ones, and
/// walks, stairs and jumps of least peak torque take hundreds of iterations.
double getDefaultRegularization(Objective objective);

/// Electrical power of a motor at speed w and torque u, the integrand of Eq. (1) without smoothing, W.
double calcElectricalPower(const Motor& motor, double u, double w, double regeneration);

/// Options of a problem besides those of the motion.
struct ProblemOptions {
  Formulation formulation = Formulation::Reduced;
  StepRule step = StepRule::Midpoint;
  LimitOptions limits;
  TimingOptions timings;
  ObjectiveOptions objective;

  ProblemOptions() = default;
  ProblemOptions(Formulation formulation, const LimitOptions& limits = {}) : formulation(formulation), limits(limits) {}
  ProblemOptions(Formulation formulation, StepRule step) : formulation(formulation), step(step) {}
};

}  // namespace bielle
