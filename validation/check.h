#pragma once
/// \file Checks a motion from its files alone; the report of `bielle check`.
///
/// **Independent** of the program that made the motion are the dynamics: kinematics, mass matrix, bias, accelerations,
/// impacts, the forces of wrenches, energies and the directions of the loops are Simbody's; the friction of soles,
/// gaps, feet and limits are computed here. **Shared** with it are the readers of robots and results (a robot that is
/// misread is misread twice; `tests/test_published.cpp` compares them with another library's), the construction of
/// serial models, the difference of two configurations with its rotations (notation.h), and the place and friction of
/// the ground, which are taken from the summary.
///
/// With q_k, v_k, a_k, u_k, lambda_k of the files and h the time step, a chain leads from the recorded forces to the
/// recorded states. Nothing in it is approximate, so its bounds are tight:
///     M(q_k) a_k + b(q_k, v_k) = B u_k + J^T lambda_k                                                             (1)
///     d_k = h (v_k + h a_k),    d_k = h v_{k+1},    d_k = q_{k+1} (-) q_k                                         (2)
/// The wrenches are recorded, so that (1) does not depend on the stabilisation of contacts. In the reduced formulation
/// (2) holds outside the loops; their joints are corrected onto the closures along W^{-1} J_l^T, with W the inertia of
/// each joint at the start over the largest of its loop cluster, at least a thousandth. With J_l N = 0 and N^T W N = 1,
///     N(q_k)^T W (d_k - h (v_k + h a_k)) = 0,    N(q_{k+1})^T W (d_k - h v_{k+1}) = 0                             (3)
/// The closure of positions and velocities, which has separate rows, determines the rest.
///
/// (1) does not determine the wrenches. Therefore Simbody also solves for the accelerations, from q, v and u alone,
/// with its own loops and standing feet,
///     M a + b = B u + J^T m,    J a + dJ/dt v = s,                                                                (4)
/// where s is a stabilisation that is not recorded: of residuals r and velocities nu that the feet and, in the full
/// formulation, the loops have at the node,
///     s = -kd nu + kp r,    0 <= h kd <= 1,    0 <= h^2 kp <= 1,                                                  (5)
/// so that a step removes at most the whole residual and velocity: it adds -h kd nu + h kp r to nu, and at most h times
/// that to r. At every node the two gains of feet and of loops are those that bring a nearest to the recorded
/// accelerations. In addition, velocities are differentiated, in the norm of M:
///     e_k = (v_{k+1} - v_k) / h - a_k (Simbody's)                                                                 (6)
/// The full formulation has e = 0; the reduced one turns its velocities with the loops at the end of a step, e = O(h).
///
/// Energy: with T the kinetic energy, v_m = (v_k + v_{k+1}) / 2, and forces taken at the start of a step,
///     T_{k+1} - T_k = h v_m (B u + J^T lambda) + h/2 (g_k v_k + g_{k+1} v_{k+1}) + rest                           (7)
/// would have no rest if M, the inertial part c of b = c - g and the forces g of gravity, springs, dampers and friction
/// did not change during the step, and velocities did not turn. With T_{k+1} - T(q_k, v_{k+1}) = h v c + O(h^2), since 2 v c = v dM/dt v, to
/// first order
///     |rest| <= h |(v c)_{k+1} - (v c)_k| + h^2/2 |a c| + h/2 |(g_{k+1} - g_k) v_{k+1}|
///               + |(v_{k+1} - v_k - h a) M v_m|.                                                                  (8)
/// For a single interval the mean right side of the motion is added, since terms of second order may dominate there.
///
/// A midpoint step (robot_problem.h Eq. (2)) records the point (q_m, v_m) of its accelerations and forces, where (1) and
/// (4) hold. With e = q_m (-) q_k, f = q_{k+1} (-) q_m, and P = N N^T W at the point named (the identity in the full
/// formulation),
///     P(q_k) (e - h/2 v_k) = 0,    P(q_m) (2 f / h - w) = 0,    P(q_{k+1}) (f - h/2 v_{k+1}) = 0,
///     w = v- + h P(q_m) a,    v- = P(q_m) 2 e / h  (full: v_k)                                                    (9)
/// s is still that of the node. The acceleration that foresees v_m is not recorded, but follows: along the closures at
/// q_m it is 2/h (v_m - v-), which is compared with Simbody's at (q_m, v-), without stabilisation, in the row of (4).
/// e_k of (6) is taken with a at (q_m, v_m), and
///     T_{k+1} - T_k + U_{k+1} - U_k = h/2 (v- + w) (B u + J^T lambda) + rest,                                     (10)
/// U the potential energy; dampers and friction count among the torques u here, not in f. The rest is of third order. For a drift changes T + U at the rate
///     p(q, v) = v f(q, v),    f = b + M a_n,    a_n = -W^{-1} J^T (J W^{-1} J^T)^+ dJ/dt v                        (11)
/// with J the rows of the loops that it follows (none in the full formulation), while the kick takes h v' f(q_m, v_m),
/// v' = (v- + w) / 2. Trapezoids for both drifts, with the errors of the midpoint rule for them, leave
///     |rest| <= h/4 |p(q_k, v_k) - p(q_m, v-) - p(q_m, w) + p(q_{k+1}, v_{k+1})|
///               + h/2 |p(q_m, v-) + p(q_m, w) - 2 p(q_m, v')| + h |v' (f(q_m, v_m) - f(q_m, v'))|                 (12)
/// up to terms of fourth order: what changes of the power within the drifts, its curvature over the kick, and the
/// foreseen velocity leave. A motion whose forces and velocities are right keeps to it whatever its steps; whether they
/// are short enough is judged by finite differences and by feet.
#include <iosfwd>
#include <optional>

#include "check_input.h"

namespace bielle::validation {

/// Bounds of the check. Lengths are negligible for a robot of one metre; ratios are relative to the largest value in
/// the motion itself.
struct CheckBounds {
  double time = 1e-9;  ///< between nodes, s: rounding of their sum
  /// Eq. (1), over the weight of the robot (as N or N m): solves in double precision leave 1e-10.
  double motion_equations = 1e-7;
  double com = 1e-9;  ///< recorded against Simbody's, m: rounding
  /// Recorded against those of (4), in the norm of (6), over the largest of the motion or free fall.
  double accelerations = 1e-3;
  double velocity_steps = 1e-6;  ///< Eqs. (2), (3), m/s or rad/s: gaps that a converged solver may leave
  double position_steps = 1e-8;  ///< Eqs. (2), (3), m or rad
  double cycle =
      1e-6;  ///< of a motion that repeats, its end against its beginning, moved; m, rad, m/s, rad/s: as the former two
  /// Eq. (6), over the same, of first order in the step and in the speed of the loops: 1e-3 for a squat, 3e-3 for a
  /// walk at 0.5 m/s, 3e-2 at 1 m/s.
  double finite_differences = 0.05;

  double closed = 1e-8;           ///< gap of loops in the reduced formulation, m or rad
  double closed_velocity = 1e-7;  ///< m/s or rad/s
  double drift = 2e-3;            ///< gap of loops held only by accelerations, m or rad
  double drift_velocity = 2e-2;   ///< m/s or rad/s

  double slip = 2e-3;             ///< m, of a standing foot from where it touched down
  double slip_angle = 1e-2;       ///< rad
  double sole_height = 1e-3;      ///< m, of any corner of a standing sole over (or in) the ground
  double landing_velocity = 0.1;  ///< m/s, of a corner of a landing sole
  double clearance = 5e-3;        ///< m, of a swinging sole in the middle half of its path
  double below_ground = 1e-3;     ///< m, of a foot in the air, at any time
  double feet_distance = 0;       ///< m, between soles seen from above
  double shapes = 0;              ///< m, between shapes of two legs, and of shapes over the ground

  double pressure = 0;         ///< m, of the centre of pressure beyond the sole
  double wrench_cone = 0;      ///< m, least margin of the whole wrench of a sole (wrench_cone.h)
  double point_moment = 1e-9;  ///< N m, on a point contact
  double force_in_air = 1e-9;  ///< N or N m
  double range = 1e-6;         ///< m or rad beyond a limit
  /// Of speeds, torques and voltages, over what joint or motor allows: constraints that the solver keeps to its
  /// tolerance.
  double limit = 1 + 1e-6;
  double goal = 1e-9;          ///< between the summary's value of a goal and the measured one, in the goal's unit
  double interval_energy = 2;  ///< left side of (8) or (12) over its right side, which terms of higher order may exceed
  double total_energy = 1;     ///< the same for the sums over the motion
};

/// The bounds of a motion by Euler steps, or of one by midpoint steps: a tenth for what is due to the steps alone, finite
/// differences of velocities, and the places of standing feet and of feet over the ground.
CheckBounds makeBounds(StepRule rule);

struct CheckRow {
  /// Goal: the achieved value beside the requested one (`bound`, within `tolerance`). Missing it breaks no law of
  /// physics: it is reported, and the check still passes.
  enum class Kind { AtMost, AtLeast, Note, Goal };
  std::string name;
  Kind kind = Kind::AtMost;
  std::optional<double> value;  ///< empty: there was nothing to measure
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

/// A trajectory with numbers that are not finite gives a single row, which says so.
CheckReport checkMotion(const CheckedMotion& motion);

/// Prints the whole table, or its first line, the failed rows and the missed goals.
enum class CheckPrint { All, Failures };
void printReport(std::ostream& out, const CheckReport& report, CheckPrint print = CheckPrint::All);

/// {"rows": [{"name", "value", "bound", "unit", "pass", "note"}], "pass"}; a missing value or bound is null. Goals also
/// have "met" and "tolerance"; their bound is the requested value.
std::string formatReport(const CheckReport& report);

}  // namespace bielle::validation
