#pragma once
/// \file Phases whose durations the solver chooses, within bounds (robot_problem.h Eq. (5)).
///
/// A motion is planned for its nominal durations. If the duration of a phase is free, all its steps become longer or
/// shorter together. Quantities planned as functions of the phase's progress remain so: contacts, footholds, paths of
/// feet and of the centre of mass, heights, loads; velocities to be followed change with the duration. Running costs
/// are integrated over the time that the motion takes. Gains of contacts and closures are limited for the longest steps
/// that the bounds allow.
#include <string>
#include <utility>
#include <vector>

#include "bielle/ocp/contact_schedule.h"
#include "bielle/ocp/robot_problem.h"

namespace bielle {

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

/// Makes the durations named by the options free, each phase of the schedule separately.
/// \param stages  those of the schedule, and the terminal one
/// \throws InputError when bounds are invalid, or there is no phase of a name
void freeTimings(const TimingOptions& options, const ContactSchedule& schedule, std::vector<StageSpec>& stages);

/// The options without names that are not phases of the schedule.
TimingOptions selectTimings(const TimingOptions& options, const ContactSchedule& schedule);

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

/// Fixes a plan's durations to the chosen ones, with the gains of the solve that chose them.
void fixTimings(const std::vector<PhaseTiming>& timings, StepRule rule, ContactSchedule& schedule,
                std::vector<StageSpec>& stages);

/// Gives a trajectory of the robot the sizes of a problem, with the time scale 1 where it has none.
void fitTimings(const RobotProblem& problem, ShootingTrajectory& trajectory);

}  // namespace bielle
