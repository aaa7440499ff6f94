#pragma once
/// \file Gradients of the measures of motions, with respect to the variables of a design.
///
/// With a variable x_i, speeds and torques of the motors change at every node: dv_i(k), du_i(k) (motion_slopes.h). A measure is the
/// largest of smooth pieces p_j, each with its gradient:
///     rms torque of one motor in one motion     p = (sum h u^2 / T)^1/2,  dp = sum h u du / (T p)                  (1)
///     energy                                    p = sum h |u v|,          dp = sum h sign(u v) (du v + u dv)       (2)
///     electrical energy, Eq. (1) of measures.h  p = sum h r P,  dp = sum h r (du v + u dv + 2 u du / K_m^2 + u^2 d(1/K_m^2))
///                                               of c u in place of u
///     peak torque in a stretch of the motion    p = |u(k)|,               dp = sign(u(k)) du(k)                    (3)
/// with r = 1 where P is positive, else the share that is recovered, and k the node of the largest |u| in the stretch.
/// A peak torque has a piece for every motor, motion and stretch: when one peak falls another becomes the largest, and
/// a search that minimizes the largest needs both gradients. So has the envelope of a motor, with |u| over its limit, |v|
/// over its, or the share of the supply in place of |u|, whichever is the largest of a stretch. Heat is Eq. (1) of c u (model.h)
/// over the motor's continuous torque. Limits and losses change with gears, and the mass with most variables (robot_slopes.h).
///
/// A kept motion is infeasible where a linkage reaches a dead point of its joints, and torques fall just before it,
/// which attracts searches. With T_c the tangent of a loop cluster for unit speeds of its joints, w the right singular
/// vector of its largest singular value and mu = 1 / |T_c w| its margin (ratio.h), designs are kept away from it by
///     mu(k)^2 >= least^2                                                                                           (4)
/// for the smallest mu in every stretch. The square falls linearly towards a dead point, where mu itself has a vertical
/// slope.
#include <string>

#include "bielle/design/search.h"
#include "bielle/motion/goal.h"
#include "design/measures.h"
#include "design/robot_slopes.h"

namespace bielle {

/// Whether calcMeasurePieces knows the measure.
bool hasGradient(Measure measure);

/// Torques and speeds of the motors over the N stages of a motion, and their derivatives. A stage without duration has no
/// torque.
struct MotorSlopes {
  std::vector<double> dt;                     ///< N, s
  MatrixXd u, v;                              ///< nu x N
  std::vector<MatrixXd> du, dv;               ///< per variable, nu x N
  MatrixXd margin;                            ///< loop clusters x nodes, mu^2 of Eq. (4), if it was requested
  std::vector<MatrixXd> dmargin;              ///< only at the entries that listLeast() names
  Eigen::RowVectorXd distance;                ///< of the nearest shapes at all nodes, if it was requested
  std::vector<Eigen::RowVectorXd> ddistance;  ///< only at the entries that listLeast() names
  double cost = 0;                            ///< of motions that were optimized for the design, and its derivatives
  VectorXd dcost;
  std::vector<GoalOutcome> goals;  ///< of motions made anew
  MatrixXd dgoals;                 ///< goals x variables: of achieved less requested values
  std::string failure;             ///< reason if there are none, or empty
};

/// Adds pieces to others by the same variables.
void append(const MeasurePieces& pieces, MeasurePieces& all);

/// Eqs. (1) to (3) over the named motors and all motions, the cost of all motions, and the mass: the number of pieces depends
/// only on these.
/// \param weights  of the motions, as of getMeasure()   \param robot  without drives: the default of all motors
MeasurePieces calcMeasurePieces(Measure measure, const std::vector<int>& motors,
                                const std::vector<MotorSlopes>& motions, const std::vector<double>& weights = {},
                                const RobotSlopes& robot = {});

/// The least entry of every row in every stretch of the columns, the first of equal ones: row, column. Of motions with fewer nodes
/// than stretches some have none.
std::vector<std::pair<Eigen::Index, Eigen::Index>> listLeast(const MatrixXd& values);

/// Eq. (4) as pieces p <= 0: least^2 - mu^2 of every cluster, motion and stretch.
MeasurePieces calcMarginPieces(double least, const std::vector<MotorSlopes>& motions);

/// The least distance of every motion and stretch: the least of these pieces counts, not the largest.
MeasurePieces calcDistancePieces(const std::vector<MotorSlopes>& motions);

}  // namespace bielle
