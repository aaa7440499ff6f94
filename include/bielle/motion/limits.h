#pragma once
/// \file Limits of motors and joints, for every motion.
///
/// - Torques |u| <= effort limit: bounds of the controls.
/// - Ranges of joints with one degree of freedom, velocities, and powers |u v| of motors: path constraints at every
///   node but the first, whose state is given. A violation of 1 is half the width of a range (1 rad or 1 m where one
///   side is open), or the limit of a velocity or power.
/// - Voltages of motors whose winding and supply are known (Motor::hasEnvelope()), in every step: the faster a motor turns, the
///   smaller its largest torque. A violation of 1 is the voltage of the supply.
/// - Dead points of linkages: the transmission of each (linkage.h) stays within margin .. 1/margin of that at the
///   start, at the same nodes. Beyond a dead point a linkage snaps into another configuration.
#include <map>
#include <string>
#include <vector>

#include "bielle/ocp/robot_problem.h"

namespace bielle {

struct LimitOptions {
  bool enforced = true;                      ///< false: all limits, including torque, are ignored
  std::map<std::string, double> efforts;     ///< by motor, N m or N, replacing the limits of the model
  std::map<std::string, double> velocities;  ///< by motor, rad/s or m/s, likewise
  std::map<std::string, double> powers;      ///< by motor, W; driving or braking
  double dead_point_margin = 0.15;           ///< least share of the transmission at the start, below 1; 0: none

  bool areGiven() const { return !(efforts.empty() && velocities.empty() && powers.empty()); }
};

/// Effort limits by motor (nu), those of the model or the given replacements. \throws InputError as addLimits() does
VectorXd getEffortLimits(const Model& model, const LimitOptions& options);

/// Sets the effort limits of the stages and adds the path constraints to them. Returns whether a torque is limited.
/// \param q0  configuration of the first node (nq)
/// \throws InputError for an unknown motor, a limit that is not positive, a margin outside 0 .. 1, a joint whose range
/// has zero width or excludes q0
bool addLimits(const Model& model, const LimitOptions& options, const VectorXd& q0, std::vector<StageSpec>& stages);

}  // namespace bielle
