#pragma once
/// \file What a motion minimizes besides the costs that define it.
///
/// - Effort: the costs of the motion, weighted squares of torques, speeds, postures, forces.
/// - Energy: the electrical energy of the motors,
///       E = sum_m integral of max(P_m, 0) + r min(P_m, 0),   P = u w + loss u^2,                                   (1)
///   with u the torque of a motor and w its speed at the same instant (robot_problem.h), its loss that of the model, and r
///   the share of the regenerated energy that is reused. Behind a gear with losses P = c u w + loss (c u)^2 with the
///   factor c of MotorDrive Eq. (1), smoothed as in makeElectricalPower(). max is smoothed (cost.h): the cost exceeds (1)
///   by at most (1 - r) kPowerSmoothing / 2 per motor and second.
/// - Peak torque: s^2 with s the largest |u_m| / L_m of all motors and stages (solve/peak_problem.h), L_m the effort limit
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
#include <optional>

#include "bielle/motion/limits.h"
#include "bielle/ocp/robot_problem.h"

namespace bielle {

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

/// Weakens the costs that do not define the motion, and adds that of the energy.
/// \throws InputError when a number is out of its range
void setObjective(const Model& model, const ObjectiveOptions& options, std::vector<StageSpec>& stages);

/// L of the peak torque, nu. \param limits  those of the motion, which replace some of the model
VectorXd getPeakLimits(const Model& model, const LimitOptions& limits);

}  // namespace bielle
