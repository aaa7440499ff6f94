#pragma once
/// \file Minimization of several objectives at once, by the evolutionary algorithms of pagmo.
///
/// A design dominates another if none of its objectives is larger and one is smaller. The front is what no design
/// dominates. pagmo's headers are in front_search.cpp alone; without the library no_front_search.cpp takes its place.
#include <functional>
#include <vector>

#include "bielle/design/search.h"

namespace bielle {

/// The objectives of designs, in their order, each finite.
using FrontObjectives = std::function<std::vector<std::vector<double>>(const std::vector<VectorXd>& designs)>;

struct FrontProblem {
  VectorXd lower, upper;
  std::vector<VectorXd> starts;  ///< of the first generation; one or more
  int objectives = 2;
  FrontObjectives evaluate;      ///< of a whole generation with Nsga2, of one design after the other with Moead
  std::vector<bool> whole = {};  ///< variables that are numbers of choices, without an order among them; not for Moead
};

struct FrontOptions {
  SearchAlgorithm algorithm = SearchAlgorithm::Nsga2;  ///< or Moead
  int population = 24;                                 ///< a multiple of 4 of at least 8
  int generations = 10;  ///< after the first one, which is filled up at random; 0: the starts alone
};

/// Whether Bielle was built with pagmo. The functions below throw std::logic_error without it.
bool hasFrontSearch();

/// Evaluates designs nearer and nearer to the front; what they are worth is known to `evaluate`. NSGA-II (Deb et al. 2002) or
/// MOEA/D with Tchebycheff's decomposition (Zhang and Li 2007). The same seed asks for the same designs. Exceptions of the
/// objectives propagate.
void searchFront(const FrontProblem& problem, const FrontOptions& options, unsigned seed);

/// Numbers of those that no other dominates, by increasing first objective. If they are more than `most`, those in the thick of
/// others are left out (the crowding distance of NSGA-II); the ends stay.
std::vector<size_t> selectFront(const std::vector<std::vector<double>>& objectives, size_t most);

}  // namespace bielle
