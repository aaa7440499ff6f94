#pragma once
/// \file Minimizing without derivatives inside bounds, by NLopt: a global algorithm, then a local one.
#include <functional>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

enum class SearchAlgorithm {
  Crs,     ///< controlled random search with local mutation; global
  Isres,   ///< improved stochastic ranking evolution strategy; global
  Bobyqa,  ///< quadratic models; local
  Sbplx    ///< simplex on subspaces; local, takes kinks
};
const char* getName(SearchAlgorithm algorithm);

struct SearchStage {
  SearchAlgorithm algorithm = SearchAlgorithm::Crs;
  int evaluations = 100;    ///< at most, but for the few that an algorithm makes in one go
  double tolerance = 1e-3;  ///< done when steps are below, as a share of the width of the bounds
};

struct SearchProblem {
  VectorXd lower, upper, start;
  std::function<double(const VectorXd& x, const SearchStage& stage)> objective;  ///< finite
};

struct SearchResult {
  VectorXd x;
  double value = 0;
  int evaluations = 0;
};

/// Each stage starts from the best point so far, the first one from the start. The same seed gives the same points, in
/// any thread. What the objective throws comes out of here.
SearchResult minimizeByStages(const SearchProblem& problem, const std::vector<SearchStage>& stages, unsigned seed);

}  // namespace bielle
