#pragma once
/// \file Minimization within bounds by NLopt: a global algorithm, then a local one, with gradients where they exist.
///
/// Local algorithms with gradients minimize a sum of terms, each the largest of smooth pieces p_ij(x). An additional
/// variable t_i for every term of several pieces removes the kinks,
///     min_{x, t} sum_i t_i    s.t.  p_ij(x) <= t_i,  g_k(x) <= 0    (a term of one piece is added as it is)        (1)
#include <functional>
#include <string>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

enum class SearchAlgorithm {
  Crs,     ///< controlled random search with local mutation; global
  Isres,   ///< improved stochastic ranking evolution strategy; global
  Bobyqa,  ///< quadratic models; local
  Sbplx,   ///< simplex on subspaces; local, tolerates kinks
  Slsqp,   ///< sequential quadratic programs (Kraft 1994); local, needs gradients
  Mma,     ///< moving asymptotes (Svanberg 2002); local, needs gradients
  Nsga2,   ///< non-dominated sorting (Deb et al. 2002); for several separate objectives, not for minimizeByStages()
  Moead    ///< decomposition (Zhang and Li 2007); likewise
};
const char* getName(SearchAlgorithm algorithm);
bool needsGradient(SearchAlgorithm algorithm);

struct SearchStage {
  SearchAlgorithm algorithm = SearchAlgorithm::Crs;
  int evaluations = 100;    ///< at most, plus the few that an algorithm evaluates in one batch
  double tolerance = 1e-3;  ///< done when steps are smaller, relative to the width of the bounds
};

/// Smooth pieces, of which the largest counts, and their gradients.
struct MeasurePieces {
  VectorXd values;     ///< p
  MatrixXd gradients;  ///< pieces x variables
};

struct SlopedValue {
  double value = 0;                  ///< finite
  std::vector<MeasurePieces> terms;  ///< p_ij, in numbers that do not depend on x; none where x is infeasible
  MeasurePieces limits;              ///< g_k, which may be slightly violated where there are terms
};

struct SearchProblem {
  VectorXd lower, upper, start;
  std::function<double(const VectorXd& x, const SearchStage& stage)> objective;         ///< finite
  std::function<SlopedValue(const VectorXd& x, const SearchStage& stage)> sloped = {};  ///< for stages with gradients
};

struct StageEnd {
  SearchAlgorithm algorithm = SearchAlgorithm::Crs;
  int evaluations = 0;
  std::string reason;  ///< such as "its steps are smaller than the tolerance"
};

struct SearchResult {
  VectorXd x;
  double value = 0;
  int evaluations = 0;
  std::vector<StageEnd> ends;
};

/// Each stage starts from the best point so far, the first one from the start. A stage with gradients is skipped if
/// that point is infeasible, and retreats from infeasible points as from worse ones. The same seed gives the same
/// points, in any thread. Exceptions of the objective propagate. Whatever an algorithm of NLopt returns, the result is the best
/// point that was evaluated: some of them (2.7.1) call an end at infinity or NaN a success.
/// \throws std::invalid_argument for algorithms of several objectives
SearchResult minimizeByStages(const SearchProblem& problem, const std::vector<SearchStage>& stages, unsigned seed);

}  // namespace bielle
