#pragma once
/// \file From a motion to its solution: the one way in, for the command, the binding, simulation and design.
///
/// A motion that was made of a plan is solved as it is. One that was made of a request (registry.h) can be made again, and is,
/// where that helps:
/// - A sequence starts from its motions, each solved separately.
/// - For another objective than effort without a scale, the motion of least effort is solved first; it gives the scale
///   (problem_options.h, Eq. 2) and the starting point.
/// - Stages that turn out too long are halved (refineStages()); if that does not help, linkages are kept farther from their
///   dead points (avoidDeadPoints()). A solution whose stages are still too long ends as Failed.
/// - A solution that comes nearer than kNearDeadPoint to a dead point is solved again from there with a larger margin
///   (keepFromDeadPoints()); if that does not converge, it stays.
/// - How far linkages are from their dead points is reported at the start, and added to the message of a failure near one.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bielle/motion/record.h"
#include "bielle/motion/registry.h"

namespace bielle {

struct Solution {
  Motion motion;  ///< that was solved: the given one, or what was made again of its request
  ShootingTrajectory trajectory;
  FddpSummary summary;  ///< iterations, times and log of all attempts
  Multipliers multipliers{};
  /// N, of the solver's last sweep; none for the least peak torque. Of a cycle that converged those of its endless repetition, with
  /// feet that stay where they land: calcCyclicFeedback() (src/solve/periodic_problem.h).
  std::vector<Gains> gains{};
  std::optional<double> floquet_multiplier{};  ///< the largest of such a cycle, modulus

  bool converged() const { return summary.termination == FddpTermination::Converged; }
};

struct SolveOptions {
  FddpOptions solver = makeMotionSolverOptions();  ///< acceptable_decrease applies to least effort alone
  std::optional<StartingPoint> start{};            ///< if not given, Motion::guess
  bool refine = true;                              ///< whether the motion may be made again
  bool keep_apart =
      true;  ///< and so with a larger margin to dead points; not where motions are compared, as of designs
};

struct SolveObserver {
  FddpObserver motion;                           ///< of every solve except those of parts
  FddpObserver part;                             ///< of the parts of a sequence, which are first solved separately
  std::function<void(const std::string&)> tell;  ///< receives lines of progress; may be null
  std::function<void(const std::string&)> warn;  ///< receives warnings; may be null
};

/// Solves a motion, by solve() of its problem (solve/fddp.h). For the least peak torque it solves the PeakProblem
/// of motion.problem, from the motion of least effort: from a quasi-static guess, motors that share a load gain nothing by
/// sharing it better. An infeasible end is only a local statement. The solve is then repeated from where it began, with
/// shorter first steps (regularization 1e-2). Where the start cannot be evaluated, such as with a leg that is nearly
/// straight, the posture at the start takes its place. Solves from Motion::guess begin with kGuessRegularization or more.
Solution solve(const Motion& motion, const SolveOptions& options = {}, const SolveObserver& observer = {});

/// The motions of a sequence, each solved separately and joined: a starting point for the whole. From a quasi-static guess a
/// long sequence may fail to converge, because all motions share one step length, and the hardest one slows the closing of all
/// gaps. Parts that do not converge contribute their last iterate.
/// \param report  receives the outcome of each; may be null
ShootingTrajectory solveParts(const Model& model, const std::vector<SequencePart>& parts, StandingRobot standing,
                              const ProblemOptions& problem = {}, const SolveOptions& options = {},
                              const FddpObserver& observer = {},
                              const std::function<void(const std::string& part, const FddpSummary&)>& report = {});

}  // namespace bielle
