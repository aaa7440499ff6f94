#pragma once
/// \file Measures of the effort of motors and linkages in a motion.
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/linkage.h"
#include "bielle/model/model.h"
#include "bielle/solve/fddp.h"
#include "bielle/solve/shooting_problem.h"
#include "design/near_bodies.h"

namespace bielle {

enum class Measure {
  PeakTorque,
  RmsTorque,
  Energy,
  ElectricalEnergy,
  Cost,
  Conditioning,
  Workspace,
  Mass,               ///< of the robot, kg
  Envelope,           ///< most of a motor's torque, speed or voltage over what it can give
  Heat,               ///< most of a motor's root mean square torque over what it bears for ever
  Margin,             ///< from dead points: least motion of a joint in a unit motion of its linkage
  DeadPointDistance,  ///< least way of a motor or joint to a dead point (linkage.h), at most kFarthestDeadPoint, rad or m
  Distance,           ///< least one of bodies that are not neighbours, m
  Range,              ///< least share of angles that joints reach through their linkages (joint_reach.h)
  LeastRatio,         ///< of motor and joint over the angles that are reached
  LargestRatio
};

/// Conversion of electrical into mechanical power. For a motor with motor constant K (torque over the square root of
/// the heat it makes) behind a gear of ratio n, the model's motor has K_m = n K. The power at its terminals is
///     P = c u v + (c u / K_m)^2                                                                                    (1)
/// with c of MotorDrive Eq. (1), which is 1 for a gear without losses. It consumes max(P, 0) and recovers the share r
/// of the negative part, so that braking first covers its own heat. No iron losses, no standby.
struct MotorConversion {
  /// K_m, N m/sqrt(W) (N/sqrt(W) of a linear motor). The default is ours, of the order of geared motors of 0.8 kg that
  /// hold some 15 N m with 50 W of heat.
  double motor_constant = 2;
  double regeneration = 0;                     ///< r, 0 .. 1
  double efficiency = 1, back_efficiency = 1;  ///< of the gear (MotorDrive)

  /// c. \param power  u v
  double getEffortFactor(double power) const { return power >= 0 ? 1 / efficiency : back_efficiency; }
};

/// Drives by motor: constants by name, else one for all, else those of the robot's motors, 1 /
/// sqrt(Motor::torqueLoss()). The gears are always the robot's.
struct DriveTable {
  std::optional<double> motor_constant;
  double regeneration = 0;
  std::vector<std::pair<std::string, double>> motor_constants;
};
/// \throws InputError for unknown motors, constants that are not positive, shares outside 0 .. 1
std::vector<MotorConversion> makeDrives(const Model& model, const DriveTable& table);

/// Measures of one motor over a motion of N stages.
struct MotorMeasures {
  double peak_torque = 0;        ///< max |u|, N m or N
  double rms_torque = 0;         ///< sqrt(sum h u^2 / sum h)
  double peak_speed = 0;         ///< max |v|, rad/s or m/s
  double energy = 0;             ///< sum h |u v|, J: braking energy is not recovered
  double electrical_energy = 0;  ///< sum h (max(P, 0) + r min(P, 0)), Eq. (1), J
  double envelope = 0;           ///< most of |u|, |v| or the voltage over its limit
  double heat = 0;               ///< root mean square of c u over Motor::continuous_effort (model.h)
};

/// Torques and speeds of the motors over N stages; speeds are those at the beginning of a stage.
struct MotorTrace {
  std::vector<double> time, dt;  ///< of the stages, s
  MatrixXd torque, speed;        ///< nu x N; an impact (dt = 0) has no torque
};
/// \param dt  N, s   \param trajectory  states (q, v) of the model at N + 1 nodes; N controls
MotorTrace makeMotorTrace(const Model& model, const std::vector<double>& dt, const ShootingTrajectory& trajectory);

/// \param drives  by motor; empty: the default of all
std::vector<MotorMeasures> calcMotorMeasures(const MotorTrace& trace, const std::vector<MotorConversion>& drives = {});

struct MotionMeasures {
  std::vector<MotorMeasures> motors;                ///< in the order of the model
  double conditioning = 1;                          ///< the worst over the nodes (conditioning.h)
  double cost = 0;                                  ///< of a motion that was optimized for the design
  double margin = 1;                                ///< least inverse of the conditioning by joints, 0 at a dead point
  double dead_point_distance = kFarthestDeadPoint;  ///< least of the linkages, if it was requested
  double distance = std::numeric_limits<double>::infinity();  ///< least one of shapes, of those listPairsBut() names, m
  std::string nearest;                                        ///< the two bodies of it
  MotorTrace trace;
};
/// \param trajectory  closed at its nodes
MotionMeasures calcMotionMeasures(const Model& model, const std::vector<double>& dt,
                                  const ShootingTrajectory& trajectory,
                                  const std::vector<MotorConversion>& drives = {});

/// Envelope and heat of the limits of the motors, into the motors of a motion; the margin if the robot has serial joints, which it is
/// about; distances if they are among those requested.
/// \param trajectory  closed at its nodes   \param left_out  of distances
void addLimitMeasures(const Model& model, const ShootingTrajectory& trajectory, const std::set<Measure>& requested,
                      const BodyPairs& left_out, MotionMeasures& measures);

const char* getName(Measure measure);
/// Of torques that of motors that turn, and empty where there is none.
const char* getUnit(Measure measure);
bool isOfMotors(Measure measure);
/// Whether it is about ranges of joints.
bool isOfJoints(Measure measure);
/// Whether it does not depend on motions.
bool isOfRobot(Measure measure);
/// Whether larger values are better, and that of all motions is the least of them.
bool isLeast(Measure measure);
/// Whether that of all motions is the sum over them, as of energies and costs.
bool isSum(Measure measure);

/// The largest peak torque, rms torque or conditioning over the named motors and all motions, or the sum of an energy
/// over them; the sum of the costs of all motions; the largest share of a limit; the least margin or distance. Not those of
/// isOfRobot().
/// \param weights  by which the measure of each motion is multiplied before; empty: 1. Margins and distances have none
double getMeasure(Measure measure, const std::vector<int>& motors, const std::vector<MotionMeasures>& motions,
                  const std::vector<double>& weights = {});

}  // namespace bielle
