#pragma once
/// \file The likeliest values of what is not known, their standard deviations, and what the log does not tell: geometry and offsets of a
/// linkage (log_fit.h), or masses, armatures and friction of a robot (torque_fit.h).
///
/// Each of the unknowns x has a scale d: a tenth of a length, of the linkage's size for a place, 0.1 rad or kLengthOffset for an
/// offset and for play; those of masses, armatures and friction are in torque_fit.h. More than that is not learnt by a linear estimate. The singular
/// values s of the scaled Jacobian
///     J diag(d) = U diag(s) V^T                                                                                      (1)
/// tell by how much, in scales, each of the combinations v (columns of V) is known: its standard deviation is sigma/s, where
///     sigma^2 = |r|^2 / (numbers that the rows tell - combinations that are seen)                                    (2)
/// is the variance of the noise, over the one assumed. A combination is seen if s is above kLeastSeen of the largest one and
/// its deviation below 1. The search goes along seen combinations alone; the others keep their values. An unknown is seen if
/// it has no part in the others, up to kLeastPart of its scale, which then adds to its deviation:
///     deviation_i^2 = d_i^2 (sum over seen (sigma V_ij / s_j)^2 + sum over others V_ij^2)                            (3)
/// The first sum takes residuals for independent. Those of encoders that round, or of filters, repeat from row to row. With
/// g_b = diag(d) J^T r over stretch b of kStretches of the log, which hardly depend on each other, it is at least
///     sum over b ((V diag(1/s^2) V^T g_b)_i)^2     of seen combinations,                                             (4)
/// the same for independent residuals (batch means).
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "identify/log_fit.h"
#include "identify/torque_fit.h"

namespace bielle {

constexpr double kLeastSeen = 1e-7, kLeastPart = 1e-3;
constexpr int kStretches = 100;
constexpr double kShareOfLength = 0.1, kAngleOffset = 0.1, kLengthOffset = 0.01;  // scales: 1, rad, m

/// One number of x.
struct Unknown {
  std::string name;
  std::string kind;  ///< "length", "offset", "play", or those of loads.h
  std::string unit;  ///< of the next three
  double before = 0, after = 0;
  double deviation = 0;  ///< standard deviation; infinite if it is not seen
  bool is_seen = true;
};

/// What is minimized: |r(x)|^2, x being changes of the unknowns.
struct EstimateProblem {
  std::vector<Unknown> unknowns;  ///< with name, kind, unit and value before
  VectorXd scales;                ///< d; 0 of what is known
  /// r over the noise that is assumed, and J if it is asked for; false where there is none
  std::function<bool(const VectorXd& x, VectorXd& r, MatrixXd* J)> evaluate;
  std::function<long()> countTold;                      ///< numbers that the rows tell at the last evaluation
  std::function<double(const VectorXd& r)> calcMisfit;  ///< what is left, as users read it
};
/// Geometry, offsets and play of a linkage, whose fit has followed the log. \param fixed  offsets that are zero; empty: none
EstimateProblem makeProblem(LogFit& fit, const std::vector<bool>& fixed);
EstimateProblem makeProblem(const TorqueFit& fit);

/// Unknowns that may change together, by these amounts, without that the log tells: the largest one is 1.
using Combination = std::vector<std::pair<std::string, double>>;

struct Estimate {
  std::vector<Unknown> unknowns;
  std::vector<Combination> unseen;
  VectorXd x;                                  ///< changes
  VectorXd r_before, r_after;                  ///< of the problem
  double misfit_before = 0, misfit_after = 0;  ///< of these
  double noise = 0;                            ///< sigma of Eq. (2)
  int iterations = 0;
  bool converged = false, interrupted = false;
  std::string message;  ///< why it ended
};

struct EstimateOptions {
  int iterations = 50;
  /// Called at each iteration; false asks for the end, and the best so far is the result.
  std::function<bool(int iteration, double misfit)> progress = {};
};

/// Minimizes |r|^2 from x = 0 by Levenberg's and Marquardt's method (Ceres). Without unknowns in the result there is no r.
Estimate estimate(const EstimateProblem& problem, const EstimateOptions& options);

}  // namespace bielle
