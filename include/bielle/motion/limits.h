#pragma once
/// \file Limits of motors and joints, for every motion.
///
/// - Torques |u| <= effort limit, exactly: bounds of the controls, enforced by a solver with ControlBounds::Enforce.
/// - Ranges of joints with one degree of freedom, and velocities of motors, by barriers. With s the scale of a limit
///   (half the width of the range, 1 when it is open on one side; the velocity limit) and r the coordinate, either
///       quadratic:    1/2 w (excess of r / s over bounds drawn in by `quadratic_margin`)^2,                    (1)
///   which is zero inside and soft outside, where violations stay within the margin; or
///       logarithmic:  -w (ln(distance to a bound / (margin s))), relaxed closer than margin s (cost.h),        (2)
///   which keeps away from the bounds but also acts on all values inside them.
#include <map>
#include <string>
#include <vector>

#include "bielle/ocp/robot_problem.h"

namespace bielle {

enum class LimitBarrier { None, Quadratic, Logarithmic };

struct LimitOptions {
  LimitBarrier barrier = LimitBarrier::None;  ///< None: all limits, including torque, are ignored
  double quadratic_weight = 1e5;              ///< w of Eq. (1), 1
  double quadratic_margin = 0.01;             ///< of Eq. (1), 1
  double logarithmic_weight = 1;              ///< w of Eq. (2), 1
  double margin = 0.05;                       ///< of Eq. (2), 1
  std::map<std::string, double> efforts;      ///< by motor, N m or N, replacing the limits of the model
  std::map<std::string, double> velocities;   ///< by motor, rad/s or m/s, likewise

  bool areEnforced() const { return barrier != LimitBarrier::None; }
};

/// Sets the effort limits of the stages and adds the barriers to them.
/// \throws ModelError for an unknown motor, a limit that is not positive, or a joint whose range has no width
void addLimits(const Model& model, const LimitOptions& options, std::vector<StageSpec>& stages);

/// Options of a problem besides those of the motion.
struct ProblemOptions {
  Formulation formulation = Formulation::Reduced;
  LimitOptions limits;

  ProblemOptions() = default;
  ProblemOptions(Formulation formulation, const LimitOptions& limits = {}) : formulation(formulation), limits(limits) {}
};

}  // namespace bielle
