#pragma once
/// \file Derivatives of an optimal motion, of its cost and of itself, with respect to the robot and to the request.
#include "bielle/motion/solve.h"
#include "design/envelope.h"
#include "design/followed_optimum.h"
#include "motion/applied_options.h"
#include "solve/peak_problem.h"

namespace bielle {

/// Envelope of a solved motion, whatever it minimizes. Other motions are made like it, with the same options, for a robot
/// that differs a little: postures at the start and at the end, references and footholds are those planned for that robot.
/// Options hold, among them ObjectiveOptions::scale.
class MotionEnvelope {
 public:
  explicit MotionEnvelope(const Solution& optimum);

  double cost() const { return envelope_.cost(); }  ///< J*
  /// As in Envelope.
  double calcLagrangian(const Motion& changed) const;
  double calcDerivative(const Motion& ahead, const Motion& behind, double step) const {
    return (calcLagrangian(ahead) - calcLagrangian(behind)) / (2 * step);
  }

 private:
  Motion motion_;
  std::unique_ptr<PeakProblem> peak_;
  ShootingTrajectory trajectory_;
  Envelope envelope_;
};

/// The optimum of another motion like it to first order, as a trajectory of changed.problem (followed_optimum.h).
std::optional<ShootingTrajectory> followOptimum(const Solution& optimum, const Motion& changed, int sweeps = 2);

/// FollowedOptimum of a motion, whatever it minimizes.
class FollowedMotion {
 public:
  /// \param here  the motion of the optimum, made as changed ones are   \param read  numbers computed from a trajectory of it
  /// Both must outlive it.
  FollowedMotion(const Solution& optimum, const Motion& here, const OptimumReader& read);

  /// \param changed  a motion like it   \param read  of a trajectory of its problem
  std::optional<OptimumDerivative> differentiate(const Motion& changed, double step, const OptimumReader& read);

 private:
  std::unique_ptr<PeakProblem> peak_, peak_here_;
  FollowedOptimum followed_;
};

}  // namespace bielle
