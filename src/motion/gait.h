#pragma once
/// \file From footholds and durations to the desired motion of body and feet at every node.
///
/// - The swing foot follows a path with zero velocity at both ends: horizontally a quintic, vertically up to an apex
///   over the higher end and down again; it turns about one axis, the vertical between level footholds.
/// - In double support the weight shifts linearly from foot to foot.
/// - The centre of mass is that of the linear inverted pendulum whose zero-moment point p follows the weight: with z
///   the height of the CoM over the feet, w the load over the weight, g gravity and h the time step,
///       w_k c_k - z_k / (g h^2) (c_{k-1} - 2 c_k + c_{k+1}) = w_k p_k,    c_0 and c_N given                       (1)
///   a tridiagonal system for its only bounded solution (Kajita et al., "Biped walking pattern generation by using
///   preview control", ICRA 2003, where (1) with w = 1 is the table-cart model). In flight w = 0, and c moves evenly.
/// - Without flights w = 1; at touchdown the CoM is as high over the lower foot as at the start, and rises or falls
///   evenly in between.
/// - Before and after a flight of the duration T it is higher by `stretch`, with the vertical velocity and acceleration
///       v = +- g T / 2,    a = -g                                                                                  (2)
///   so that loads vanish when a foot takes off or lands. Each single support follows the polynomial of fifth degree
///   between these, or rest where there is no flight, and bears
///       w = 1 + z'' / g                                                                                            (3)
///   which between flights is a parabola, on average 1 + T / D with D the duration of the support.
#include "bielle/motion/locomotion.h"

namespace bielle {

/// Placement along a swing from a to b.
SE3 calcSwing(const SwingShape& shape, const SE3& a, const SE3& b, double s);

/// Length of the stages of a walk or, with flights, of a run, s: 12 ms or 5 ms while no foot swings faster than 4.1 m/s along its path, then less with the
/// square of the speed, in whole milliseconds, at least 2. (What midpoint steps of 12 ms leave, slip and differences of the
/// velocity, grows with the power 4.5 of the speed in Bipetto's walks from 0.8 to 1.2 m/s, whose feet swing at 3.6 to 5.3
/// m/s; and with the square of the step.)
/// \param longest  s, never exceeded
double chooseTimeStep(const LocomotionTask& task, const GaitTiming& timing, const SwingShape& shape, double longest);

struct GaitPhase {
  int nodes = 0;
  int steps_done = 0;                ///< number of steps completed
  std::array<int, 2> steps{-1, -1};  ///< that the left and the right foot, in the air, take; -1: it stands

  bool stands(Side side) const { return steps[static_cast<int>(side)] < 0; }
  bool flies() const { return !stands(Side::Left) && !stands(Side::Right); }
  bool isDoubleSupport() const { return stands(Side::Left) && stands(Side::Right); }
};

/// Nodes of a step from where its foot leaves the ground to where it lands, [begin, end).
struct SwingSpan {
  int begin = 0, end = 0;
};

/// A foot in the air.
struct SwingNode {
  double progress = 0;              ///< of the swing, in [0, 1)
  SE3 X_WF;                         ///< placement of the foot
  Vector6d V_F = Vector6d::Zero();  ///< its velocity and angular velocity, world axes
};

struct GaitNode {
  Vector3d com = Vector3d::Zero(), com_velocity = Vector3d::Zero();  ///< m, m/s
  double heading = 0, heading_rate = 0;                              ///< since the start; rad, rad/s
  double load[2] = {0.5, 0.5};  ///< on the left and on the right foot, over the weight
  int phase = 0;
  std::array<SwingNode, 2> swings;  ///< of the feet in the air, left and right
  int landed = -1;                  ///< step whose foot has just landed, at the first node of a phase; or -1
};

struct Gait {
  std::vector<GaitPhase> phases;
  std::vector<GaitNode> nodes;    ///< N + 1
  std::vector<SwingSpan> swings;  ///< of each step
};

/// Where the centre of mass begins.
struct GaitStart {
  Vector3d com = Vector3d::Zero();   ///< c_0 of Eq. (1), m
  Vector3d rest = Vector3d::Zero();  ///< where it would be if the robot stood still on its feet, m
};

/// \param timing  with the length of the stages
/// \param com  centre of mass at the start, where the robot stands still, m
/// \param gravity  m/s^2
/// \throws InputError on impossible durations
Gait makeGait(const LocomotionTask& task, const GaitTiming& timing, const SwingShape& shape, double stretch,
              const Vector3d& com, double gravity);
/// The same for given phases.
Gait makeGait(const LocomotionTask& task, std::vector<GaitPhase> phases, const GaitTiming& timing,
              const SwingShape& shape, double stretch, const GaitStart& start, double gravity);

/// Mean over +- window nodes, weighted by a triangle.
VectorXd smoothen(const VectorXd& raw, int window);

/// The number of stages of a duration.
int countNodes(double duration, double time_step);

// First nodes of the phases that begin with a landing, step by step.
std::vector<int> listLandings(const ContactSchedule& schedule);

}  // namespace bielle
