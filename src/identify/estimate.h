#pragma once
/// \file The likeliest geometry and offsets of a linkage, their standard deviations, and what the log does not tell.
///
/// Of the unknowns x (log_fit.h), each has a scale d: a tenth of a length, of the linkage's size for a place, 0.1 rad or
/// kLengthOffset for an offset. More than that is not learnt by a linear estimate. The singular values s of the scaled Jacobian
///     J diag(d) = U diag(s) V^T                                                                                      (1)
/// tell by how much, in scales, each of the combinations v (columns of V) is known: its standard deviation is sigma/s, where
///     sigma^2 = |r|^2 / (numbers that the rows tell - combinations that are seen)                                    (2)
/// is the variance of the noise, over the one assumed. A combination is seen if s is above kLeastSeen of the largest one and
/// its deviation below 1. The search goes along seen combinations alone; the others keep their values. An unknown is seen if
/// it has no part in the others, up to kLeastPart of its scale, which then adds to its deviation:
///     deviation_i^2 = d_i^2 (sum over seen (sigma V_ij / s_j)^2 + sum over others V_ij^2)                            (3)
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "identify/log_fit.h"

namespace bielle {

constexpr double kLeastSeen = 1e-7, kLeastPart = 1e-3;
constexpr double kShareOfLength = 0.1, kAngleOffset = 0.1, kLengthOffset = 0.01;  // scales: 1, rad, m

/// One number of x.
struct Unknown {
  std::string name;
  std::string unit;
  bool is_offset = false;
  double before = 0, after = 0;  ///< m or rad
  double deviation = 0;          ///< standard deviation, likewise; infinite if it is not seen
  bool is_seen = true;
};

/// Unknowns that may change together, by these amounts, without that the log tells: the largest one is 1.
using Combination = std::vector<std::pair<std::string, double>>;

struct LinkageEstimate {
  std::vector<Unknown> unknowns;
  std::vector<Combination> unseen;
  VectorXd x;                                  ///< of the fit
  MatrixXd left_before, left_after;            ///< LogFit::calcLeft
  double misfit_before = 0, misfit_after = 0;  ///< root mean squares of these
  double noise = 0;                            ///< sigma of Eq. (2)
  int iterations = 0;
  bool converged = false, interrupted = false;
  std::string message;  ///< why it ended
};

struct EstimateOptions {
  std::vector<bool> fixed;  ///< of the offsets: known to be zero; empty: none
  int iterations = 50;
  /// Called at each iteration; false asks for the end, and the best so far is the result.
  std::function<bool(int iteration, double misfit)> progress = {};
};

/// Minimizes |r|^2 from the given robot by Levenberg's and Marquardt's method (Ceres). LogFit::follow() comes first.
LinkageEstimate estimate(LogFit& fit, const EstimateOptions& options);

}  // namespace bielle
