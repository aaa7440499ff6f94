#pragma once
// Code shared by the searches with and without gradients, which alone include NLopt.
#include <exception>
#include <nlopt.hpp>

#include "bielle/design/search.h"

namespace bielle {

struct Search {
  const SearchProblem& problem;
  const SearchStage* stage = nullptr;
  SearchResult best;
  std::exception_ptr error;

  void add(const VectorXd& x, double value);  // an evaluation
};

// NLopt's variables are scaled so that the bounds are 0 and 1.
VectorXd getPoint(const SearchProblem& problem, const std::vector<double>& unit);
std::vector<double> getShares(const SearchProblem& problem, const VectorXd& x);

// Uses the stage's number of evaluations and tolerance; rethrows exceptions of the objective.
void runOptimizer(Search& search, nlopt::opt& optimizer, std::vector<double>& unit);

// Eq. (1) of search.h.
void runSlopedStage(Search& search);

}  // namespace bielle
