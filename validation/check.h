#pragma once
/// \file A motion checked from its files alone: what `bielle check` reports.
///
/// Nothing of the solver is used. Kinematics, inertial forces, the forces of wrenches, energies and the directions of
/// the loops are Simbody's. With q_k, v_k, a_k, u_k, lambda_k of the files and h the time step, a chain leads from the
/// recorded forces to the recorded states. Nothing in it is approximate, so its bounds are tight:
///     M(q_k) a_k + b(q_k, v_k) = B u_k + J^T lambda_k                                                             (1)
///     d_k = h (v_k + h a_k),    d_k = h v_{k+1},    d_k = q_{k+1} (-) q_k                                         (2)
/// The wrenches are recorded: (1) holds or not whatever stabilised the contacts. In the reduced formulation (2) holds
/// outside the loops; their joints are bent onto the closures along W^{-1} J_l^T (reduction.h; any W > 0 would do), so
/// that, with J_l N = 0 and N^T W N = 1,
///     N(q_k)^T W (d_k - h (v_k + h a_k)) = 0,    N(q_{k+1})^T W (d_k - h v_{k+1}) = 0                             (3)
/// Closed positions and velocities, which have rows of their own, settle the rest.
///
/// Recorded accelerations are compared with Simbody's own constrained ones as well: its standing feet (and,
/// in the full formulation, its loops) get the accelerations of the recorded ones, which hold what stabilisation there was. And the velocities alone
/// are differentiated, in the norm of M:
///     e_k = (v_{k+1} - v_k) / h - a_k (Simbody's)                                                                 (4)
/// The full formulation has e = 0; the reduced one turns its velocities with the loops at the end of a step, e = O(h).
#include <iosfwd>
#include <optional>

#include "check_input.h"

namespace bielle::validation {

/// What is allowed. Lengths are those that a robot of a metre would not notice; ratios are of what the motion itself
/// has most of.
struct CheckBounds {
  double time = 1e-9;  ///< between nodes, s: rounding of their sum
  /// Eq. (1), over the weight of the robot (as N or N m): solves in double precision leave 1e-10.
  double motion_equations = 1e-7;
  /// Recorded against Simbody's, in the norm of (4), over the largest of the motion or free fall: 5e-13 where loops are
  /// closed; where they have come open by half a millimetre, 3e-5.
  double accelerations = 1e-3;
  double velocity_steps = 1e-6;  ///< Eqs. (2), (3), m/s or rad/s: gaps that a converged solver may leave
  double position_steps = 1e-8;  ///< Eqs. (2), (3), m or rad
  /// Eq. (4), over the same, of first order in the step and in the speed of the loops: 1e-3 for a squat, 3e-3 for a walk
  /// at 0.5 m/s, 3e-2 at 1 m/s.
  double finite_differences = 0.05;

  double closed = 1e-8;           ///< gap of loops in the reduced formulation, m or rad
  double closed_velocity = 1e-7;  ///< m/s or rad/s
  double drift = 2e-3;            ///< gap of loops that are held by accelerations alone, m or rad
  double drift_velocity = 2e-2;   ///< m/s or rad/s

  double slip = 2e-3;             ///< m, of a standing foot from where it touched down
  double slip_angle = 1e-2;       ///< rad
  double sole_height = 1e-3;      ///< m, of the lowest corner of a standing sole over (or in) the ground
  double landing_velocity = 0.1;  ///< m/s, of a corner of a sole as it comes down
  double clearance = 5e-3;        ///< m, of a swinging sole in the middle half of its way
  double below_ground = 1e-3;     ///< m, of a foot in the air, at any time
  double feet_distance = 0;       ///< m, between soles seen from above

  double pressure = 0;         ///< m, of the centre of pressure beyond the sole
  double wrench_cone = 0;      ///< m, least margin of the whole wrench of a sole (wrench_cone.h)
  double point_moment = 1e-9;  ///< N m, on a contact that is a point
  double force_in_air = 1e-9;  ///< N or N m
  double range = 1e-6;         ///< m or rad beyond a limit
  double goal = 1e-9;          ///< between what the summary tells of a goal and what is measured, in the goal's unit
  /// Of the energy exchanged in the busiest interval. Euler steps lose or gain in the order of h: a squat 1e-2, a take-off
  /// by steps of 5 ms 6e-2.
  double interval_energy = 0.1;
  double total_energy = 0.02;  ///< of the energy exchanged: 1e-4 for a squat, 1.5e-2 for a walk at 1 m/s
};

struct CheckRow {
  /// Goal: what came out beside what was asked (`bound`, give or take `tolerance`). Missing it breaks no law of physics,
  /// so that it is told and the check passes all the same.
  enum class Kind { AtMost, AtLeast, Note, Goal };
  std::string name;
  Kind kind = Kind::AtMost;
  std::optional<double> value;  ///< none: there was nothing to measure
  double bound = 0;
  std::string unit, note;
  double tolerance = 0;  ///< of a goal
  bool passed() const;   ///< always, for notes and goals
  bool isMissedGoal() const;
};

struct CheckReport {
  std::string motion, robot;
  int nodes = 0;
  std::vector<CheckRow> rows;
  bool passed() const;
  const CheckRow* findRow(const std::string& name) const;
};

/// A trajectory with numbers that are not finite has one row, which says so.
CheckReport checkMotion(const CheckedMotion& motion, const CheckBounds& bounds = {});

/// The whole table, or its first line, the rows that fail and the goals that are missed.
enum class CheckPrint { All, Failures };
void printReport(std::ostream& out, const CheckReport& report, CheckPrint print = CheckPrint::All);

/// {"rows": [{"name", "value", "bound", "unit", "pass", "note"}], "pass"}; a value that was not measured and a bound
/// that there is not are null. Goals have "met" and "tolerance" as well; their bound is what was asked.
std::string formatReport(const CheckReport& report);

}  // namespace bielle::validation
