#pragma once
/// \file Goals of a motion, as quantities that can be measured on its trajectory.
///
/// Costs pull a motion towards its goals, but nothing enforces them: a solver that converges may still miss one.
/// Requested and achieved values are therefore reported side by side. With c the centre of mass, p_i the origins of the
/// contact frames, t the time, and e a unit vector, all from the node `first` to the node `last`:
///
///     Speed         e . (c(last) - c(first)) / (t(last) - t(first))                                              (1)
///     Height        (c_z - s) / (c_z(first) - s) where it is farthest from 1,  s the mean of p_iz(first)          (2)
///     Rise          max c_z - c_z(first)                                                                         (3)
///     FlightTime    duration of the stages in which no contact bears a force                                     (4)
///     Turn          change of the heading of the first body, counted over full turns                             (5)
///     Displacement  mean over i of e . (p_i(last) - p_i(first))                                                  (6)
///     Footholds     largest distance of p_i from its foothold, at the node where it lands                        (7)
#include <string>
#include <vector>

#include "bielle/math/se3.h"

namespace bielle {

enum class GoalKind { Speed, Height, Rise, FlightTime, Turn, Displacement, Footholds };

struct Foothold {
  std::string contact;
  int node = 0;                          ///< where the foot lands
  Vector3d position = Vector3d::Zero();  ///< of the origin of its contact frame, m
};

struct Goal {
  GoalKind kind = GoalKind::Speed;
  std::string name;                        ///< e.g. "speed"; in a sequence "walk.speed"
  double requested = 0;                    ///< in the unit of getUnit()
  double tolerance = 0;                    ///< largest difference that still meets the goal
  int first = 0, last = 0;                 ///< nodes
  Vector3d direction = Vector3d::UnitX();  ///< e of Eqs. (1), (6)
  std::vector<std::string> contacts{};     ///< i of Eqs. (2), (6)
  std::vector<Foothold> footholds{};       ///< of Eq. (7)
};

const char* getName(GoalKind kind);  ///< e.g. "height"
const char* getUnit(GoalKind kind);  ///< "m/s", "1", "m", "s", "rad"
/// \throws std::invalid_argument when no kind has this name
GoalKind parseGoalKind(const std::string& name);

/// The tolerance of most goals: five per cent of the requested value, but not less than `least`.
double calcTolerance(double requested, double least);

/// Data of a trajectory that the measurements above need.
struct MotionTrack {
  std::vector<double> time;            ///< N + 1, s
  std::vector<Vector3d> com;           ///< N + 1, m
  std::vector<double> heading;         ///< N + 1, of the first body, in (-pi, pi], rad
  std::vector<std::string> contacts;   ///< names of the robot's contacts
  std::vector<std::vector<SE3>> feet;  ///< N + 1, placement of every contact frame
  std::vector<double> load;            ///< N, sum over the contacts of the norms of their forces, N
};

/// Eqs. (1) to (7). \throws std::out_of_range when the goal names a node or a contact that the track does not have
double measureGoal(const Goal& goal, const MotionTrack& track);

struct GoalOutcome {
  Goal goal;
  double achieved = 0;
  bool met() const;  ///< false when achieved is not a number
};

/// E.g. "requested 0.5 m/s, achieved 0.4213 m/s: 84 %"; for a missed goal also its tolerance.
std::string formatOutcome(const GoalOutcome& outcome);

}  // namespace bielle
