#include "design/constraint.h"

#include <algorithm>
#include <cmath>

namespace bielle {
namespace {

constexpr double kCentimetre = 0.01;  // the scale of distances, whose bound may be 0

double getScale(const DesignConstraint& constraint) {
  return constraint.measure == Measure::Distance || constraint.bound == 0 ? kCentimetre : std::abs(constraint.bound);
}

constexpr double kMost = 1e6;  // linkages at a singularity are infinitely far beyond their bound

}  // namespace

double calcMiss(const GoalOutcome& outcome) {
  const Goal& goal = outcome.goal;
  if (outcome.met()) return 0;
  const double beyond = (std::abs(outcome.achieved - goal.requested) - goal.tolerance) / goal.tolerance;
  return beyond < kMost ? beyond : kMost;  // as is what cannot be measured
}

double calcViolation(const DesignConstraint& constraint, double value) {
  const double beyond =
      (constraint.at_least ? constraint.bound - value : value - constraint.bound) / getScale(constraint);
  if (beyond <= kConstraintSlack) return 0;
  return beyond < kMost ? beyond : kMost;  // as is what cannot be measured
}

MeasurePieces calcConstraintPieces(const DesignConstraint& constraint, const std::vector<int>& motors,
                                   const std::vector<MotorSlopes>& motions, const std::vector<double>& weights,
                                   const RobotSlopes& robot) {
  const double bound = constraint.bound;
  MeasurePieces out;
  if (constraint.measure == Measure::Margin) {
    // The square of the margin, over twice its bound: near the bound the same as the margin itself.
    out = calcMarginPieces(bound, motions);
    out.values /= 2 * bound * bound;
    out.gradients /= 2 * bound * bound;
    return out;
  }
  if (constraint.measure == Measure::Distance) {
    out = calcDistancePieces(motions);
  } else {
    out = calcMeasurePieces(constraint.measure, motors, motions, weights, robot);
  }
  const double sign = constraint.at_least ? -1 : 1, scale = sign / getScale(constraint);
  out.values = scale * (out.values.array() - bound);
  out.gradients *= scale;
  return out;
}

MeasurePieces calcGoalPieces(const std::vector<MotorSlopes>& motions) {
  constexpr double kShare = 0.99;  // of the tolerance
  MeasurePieces out;
  for (const MotorSlopes& motion : motions)
    for (size_t i = 0; i < motion.goals.size(); ++i) {
      const Goal& goal = motion.goals[i].goal;
      const double off = motion.goals[i].achieved - goal.requested, sign = off < 0 ? -1 : 1;
      append({VectorXd::Constant(1, sign * off / goal.tolerance - kShare),
              sign / goal.tolerance * motion.dgoals.row(static_cast<Eigen::Index>(i))},
             out);
    }
  return out;
}

}  // namespace bielle
