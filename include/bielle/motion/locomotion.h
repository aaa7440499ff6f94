#pragma once
/// \file Steps as an optimal control problem, shared by walk, side walk, turn, stairs, run and hop.
///
/// Soft objectives are costs of a stage; costs with zero weight are omitted. References of body and feet are those of
/// gait.h. Without flights, the centre of mass is also raised where a leg with a flat sole would bend too far, as on
/// high stairs, and lowered where it would be too short.
/// - state regularization about the standing posture at rest, the base heading as the feet do; motor torques;
/// - centre of mass: position and velocity;
/// - swing foot: placement along its path, and its velocity;
/// - forces of stance feet: share of the weight, centre of pressure.
/// Path constraints:
/// - wrench cones of the soles on the ground;
/// - landing, at the first node of a double support or at the impact before it: the foot is on its foothold, flat and
///   at rest, so that the impulses of an impact vanish; with `foothold_room` it may deviate by that much along x and y of
///   the foothold, and turn by that over the reach of a sole; costs of the foothold and, with less weight than otherwise,
///   of the horizontal swing path then keep it near;
/// - swing foot: no corner below the ground, and 6 mm over it in the middle half of the swing; distance from the other
///   foot;
/// - at the end the centre of mass is at rest and the torso does not turn.
///
/// With `timing.flight` the robot is in the air between single supports: a foot that has landed stands alone until it
/// takes off or until the foot of the last step lands beside it. With alternating feet that is a run; with one foot
/// taking all steps but the last it is a hop on that foot. Feet in flight have the costs and constraints of swing feet,
/// and forces follow the load of gait.h Eq. (3).
///
/// The pendulum of gait.h starts with a velocity v, but the robot starts at rest. With the time constant
/// tau = sqrt(z / g), a centre of pressure held back by d for a time T brings the robot onto the pendulum's path if
///     d (1 - exp(-T / tau)) = v tau,                                                                           (1)
/// where v falls with T as well. The first double support is long enough for d to fit in the soles.
#include "bielle/motion/footsteps.h"
#include "bielle/motion/motion.h"

namespace bielle {

struct GaitTiming {
  double start = 0.3;    ///< double support before the first step, s
  double single = 0.36;  ///< single support, s
  double both = 0.045;   ///< double support between steps, s
  double flight = 0;     ///< between single supports, in place of double support, s; 0: a walk
  double end = 0.45;     ///< double support after the last step, s
  /// Length of a stage, s; 0: by the swings (chooseTimeStep). The error of steps of order p grows with its power p.
  double time_step = 0;

  double stepDuration() const { return single + (flight > 0 ? flight : both); }  ///< s
};

/// Shape of a swing, over its progress s in [0, 1].
struct SwingShape {
  double height = 0.04;             ///< of the apex over the higher of both ends, m
  double apex = 0.5;                ///< s of the apex
  double leave = 0, arrive = 0.95;  ///< the horizontal motion takes place between these
};

struct LocomotionOptions : MotionOptions {
  LocomotionOptions() { torso_weight = 1e4, pressure_weight = 10, contact_kp = 2e3, contact_kd = 100; }

  GaitTiming timing;
  double start_pressure = 0.4;  ///< largest d of Eq. (1) over the soles' half length; 0: timing.start as given
  double stretch = 0;           ///< height of the CoM at take-off and touchdown over that at the start, m
  SwingShape swing;
  /// Every landing is a rigid impact (StageKind::Impact), a stage of its own that takes no time. Otherwise the contact's
  /// stabilisation stops any remaining velocity of a foot.
  bool rigid_landing = false;
  double landing_speed = 0;  ///< with rigid_landing: at which a foot comes down, m/s; 0: at rest
  double foothold_room = 0;  ///< largest distance of a landing foot from its foothold along each of its axes, m

  double heading_weight = 1e3;         ///< of its heading within the state regularization
  double com_weight = 100;             ///< of the horizontal position of the CoM, 1/m^2
  double com_height_weight = 3e3;      ///< of its height, 1/m^2
  double com_velocity_weight = 0;      ///< of its horizontal velocity, s^2/m^2
  double swing_weight = 1e4;           ///< of the path of the swing foot, 1/m^2
  double swing_velocity_weight = 200;  ///< of its velocity, s^2/m^2 (and s^2)
  double swing_rotation_weight = 1e3;  ///< of its orientation, 1
  double foothold_weight = 20;         ///< of the distance from the foothold, and of the horizontal path, 1/m^2
  double feet_distance = 0.01;         ///< least distance of the soles, or what the footholds leave if less, m
  double terminal_weight = 1e3;        ///< of the place of the CoM at the end, 1/m^2
  double closure_kp = 1e4;  ///< stabilisation of the closures, limited like that of the contacts; used only by
  double closure_kd = 100;  ///< the full formulation

  std::string left = "foot_left", right = "foot_right";  ///< contact frames
};

void describe(OptionFields& fields, LocomotionOptions& options);

/// The robot as it stands before the first step.
struct Stance {
  VectorXd q;                     ///< nq, standing posture
  Vector3d com;                   ///< m
  std::array<int, 2> contacts{};  ///< indices of the left and right foot
  std::array<SE3, 2> feet;        ///< their placements
  SE3 middle;                     ///< of the feet (calcMiddle), where they are not level at the height of the lower
  NeighbourPlans* neighbours = nullptr;  ///< of the standing robot
};
/// Both feet where they stand.
std::vector<ContactTarget> listSoles(const Stance& stance);
/// \throws InputError when the robot lacks a foot
Stance makeStance(const Model& model, const LocomotionOptions& options, const StandingRobot& standing);

/// The steps to take and the ground to take them on.
struct LocomotionTask {
  std::string name;
  FootstepPlan plan;  ///< steps in the order of their landings
  Ground ground;
  Side support = Side::Left;              ///< foot that stands before the first flight, if there are flights
  Vector3d direction = Vector3d::Zero();  ///< unit vector of the walking direction, or zero if there is none
  double speed = 0;                       ///< of the CoM along it, at steady steps, m/s
  /// Of cycles of two steps: the number of steps planned before them. These and the steps after them, at least two more, only make
  /// the cycles steady and are left out of the motion. 0: the whole motion.
  int lead = 0;
  int cycles = 1;
};
/// Steps after which a gait no longer depends on how it began: each step of duration T leaves e^{-T / tau} of a deviation of its
/// pendulum.
inline constexpr int kCycleLead = 12;
/// Steps to plan for so many cycles.
constexpr int countCycleSteps(int cycles) { return 2 * (kCycleLead + cycles); }

/// Mean speed of the centre of mass over the steady steps: from the second landing to the last but two (in short
/// motions from the first to the last but one), over a whole number of cycles of `steps_per_cycle` steps. Motions start
/// and end at rest. Empty if there are too few steps. \param direction  unit vector, world
std::vector<Goal> makeSpeedGoals(const ContactSchedule& schedule, double speed, const Vector3d& direction,
                                 int steps_per_cycle = 1);

/// The speed of a cycle, over all of it.
Goal makeCycleSpeedGoal(const ContactSchedule& schedule, double speed, const Vector3d& direction);

/// Its goals are the footholds. A cycle begins in the middle of a stance phase (of both feet, of a run of one), where the robot stands.
/// \throws InputError when the request is impossible: footholds out of the legs' reach, soles that collide, durations
MotionPlan planLocomotion(const Model& model, const Stance& stance, const LocomotionTask& task,
                          const LocomotionOptions& options);

}  // namespace bielle
