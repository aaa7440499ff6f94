#pragma once
/// \file Motions one after the other, as one optimal control problem.
///
/// Each motion starts from the standing posture that the one before ends in; of the terminal costs only those of the last
/// one are kept, so that a motion may lean into the next. The ground has the steps of all, its plane is the lowest of
/// theirs: what happens higher stands on platforms under the soles.
#include <functional>

#include "bielle/motion/motion.h"

namespace bielle {

struct SequencePart {
  std::string name;  ///< heads its phases and options: "NAME.depth"
  std::function<MotionPlan(const Model&, const VectorXd& q_start)> plan;  ///< e.g. planSquat with its options
};

/// \throws ModelError when there is no part, when one is impossible, or when they differ in friction or do not fit on one ground
MotionPlan planSequence(const Model& model, const std::vector<SequencePart>& parts, const VectorXd& q0);

struct PartsOptions {
  ProblemOptions problem;
  FddpOptions solver;
  FddpObserver observer;                                                            ///< watches every solve
  std::function<void(const std::string& part, const FddpSummary& summary)> report;  ///< is told how each one ended
};

/// A guess for the sequence: each motion solved by itself. From a quasi-static guess a long sequence may stop half-way,
/// since one step length moves all motions at the pace of the hardest, and leaves the others with open gaps for long.
/// Parts that do not converge contribute what they came to.
ShootingTrajectory solveParts(const Model& model, const std::vector<SequencePart>& parts, const VectorXd& q0,
                              const PartsOptions& options = {});

/// From the robot's standing posture.
Motion makeSequence(const Model& model, const std::vector<SequencePart>& parts, const ProblemOptions& problem = {});

}  // namespace bielle
