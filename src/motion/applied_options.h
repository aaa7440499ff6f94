#pragma once
/// \file What the options of a problem (bielle/motion/problem_options.h) make of the stages of a motion.
#include <memory>
#include <string>
#include <vector>

#include "bielle/motion/motion.h"

namespace bielle {

class PeakProblem;

/// Effort limits by motor (nu), those of the model or the given replacements. \throws InputError as Limits does
VectorXd getEffortLimits(const Model& model, const LimitOptions& options);

/// Velocity limits by coordinate (nv), likewise.
VectorXd getVelocityLimits(const Model& model, const LimitOptions& options);

/// Power limits by motor (nu), W, likewise; infinite where there is none.
VectorXd getPowerLimits(const Model& model, const LimitOptions& options);

/// The margin that the transmission of a linkage keeps from its dead points: its own, where that is larger than that of all.
double getDeadPointMargin(const LimitOptions& options, const std::string& linkage);

/// The limits of a model, as its file and the options give them.
class Limits {
 public:
  /// \param q0  configuration of the first node (nq)
  /// \throws InputError for an unknown motor, a limit that is not positive, a margin outside 0 .. 1, a joint whose range
  /// has zero width or excludes q0
  Limits(const Model& model, const LimitOptions& options, const VectorXd& q0);
  /// Sets the effort limits of the stages and adds the path constraints to them. Returns whether a torque is limited.
  /// \param cycle  whether the first state is free, which then has the constraints of the last one
  bool addTo(std::vector<StageSpec>& stages, bool cycle) const;

 private:
  VectorXd efforts_;
  std::vector<PathConstraint> voltages_, powers_;  // of steps
  std::vector<PathConstraint> states_;
};

/// Makes the durations named by the options free, each phase of the schedule separately.
/// \param stages  those of the schedule, and the terminal one
/// \throws InputError when bounds are invalid, or there is no phase of a name
void freeTimings(const TimingOptions& options, const ContactSchedule& schedule, std::vector<StageSpec>& stages);

/// The options without names that are not phases of the schedule.
TimingOptions selectTimings(const TimingOptions& options, const ContactSchedule& schedule);

/// Fixes a plan's durations to the chosen ones, with the gains of the solve that chose them.
void fixTimings(const std::vector<PhaseTiming>& timings, StepRule rule, ContactSchedule& schedule,
                std::vector<StageSpec>& stages);

/// Gives a trajectory of the robot the sizes of a problem, with the time scale 1 where it has none.
void fitTimings(const RobotProblem& problem, ShootingTrajectory& trajectory);

/// Weakens the costs that do not define the motion, and adds that of the energy.
/// \throws InputError when a number is out of its range
void setObjective(const Model& model, const ObjectiveOptions& options, std::vector<StageSpec>& stages);

/// L of the peak torque, nu. \param limits  those of the motion, which replace some of the model
VectorXd getPeakLimits(const Model& model, const LimitOptions& limits);

/// The problem that solve() solves for the least peak torque; null for other objectives. The motion must outlive it.
std::unique_ptr<PeakProblem> makePeakProblem(const Motion& motion);

}  // namespace bielle
