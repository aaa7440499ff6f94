#pragma once
/// \file Bounds on the measures of a design, with their gradients.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "design/gradient.h"
#include "design/joint_reach.h"
#include "design/measures.h"

namespace bielle {

/// A bound on a measure, for every motion whatever its weight; on energies for their sum with the weights.
struct DesignConstraint {
  Measure measure = Measure::Envelope;  ///< but for the cost and the workspace
  std::vector<std::string> motors;      ///< empty: all
  double bound = 1;
  bool at_least = false;  ///< else at most
  std::vector<std::array<std::string, 2>> except =
      {};                  ///< of a distance: pairs of bodies that it leaves out (near_bodies.h)
  JointAngles range = {};  ///< of a measure of joints
};

/// Beyond a bound, over it: so much counts as kept, since solvers keep their own constraints to a tolerance.
inline constexpr double kConstraintSlack = 1e-3;

/// How far a value is beyond the bound, over the bound (a distance: over a centimetre); 0 within the slack.
double calcViolation(const DesignConstraint& constraint, double value);

/// How far a goal is missed beyond its tolerance, over the tolerance; 0 if it is met.
double calcMiss(const GoalOutcome& outcome);

/// The same of the pieces of a measure, as p <= 0.
/// \param motors  those of the constraint, by their numbers   \param motions  with the distances and margins that it is about
/// \param weights  as of getMeasure()
MeasurePieces calcConstraintPieces(const DesignConstraint& constraint, const std::vector<int>& motors,
                                   const std::vector<MotorSlopes>& motions, const std::vector<double>& weights,
                                   const RobotSlopes& robot);

/// Goals of motions made anew as pieces p <= 0: how far they are from what is requested, over their tolerance, within a
/// hundredth of it, so that searches that end at a tolerance end inside it.
MeasurePieces calcGoalPieces(const std::vector<MotorSlopes>& motions);

}  // namespace bielle
