// The only file of the layer that knows NLopt.
#include "bielle/design/search.h"

#include <cmath>
#include <exception>
#include <limits>
#include <nlopt.hpp>

namespace bielle {
namespace {

// Searches see the bounds as 0 and 1.
struct Search {
  const SearchProblem& problem;
  const SearchStage* stage = nullptr;
  SearchResult best;
  std::exception_ptr error;
};

double evaluate(const std::vector<double>& unit, std::vector<double>&, void* data) {
  Search& search = *static_cast<Search*>(data);
  const SearchProblem& p = search.problem;
  const VectorXd share = VectorXd::Map(unit.data(), static_cast<Eigen::Index>(unit.size()));
  const VectorXd x = p.lower + share.cwiseProduct(p.upper - p.lower);
  try {
    const double value = p.objective(x.cwiseMax(p.lower).cwiseMin(p.upper), *search.stage);
    ++search.best.evaluations;
    if (value < search.best.value) search.best.value = value, search.best.x = x.cwiseMax(p.lower).cwiseMin(p.upper);
    return value;
  } catch (...) {  // kept: NLopt would forget what it was
    search.error = std::current_exception();
    throw nlopt::forced_stop();
  }
}

nlopt::algorithm getAlgorithm(SearchAlgorithm algorithm) {
  switch (algorithm) {
    case SearchAlgorithm::Crs:
      return nlopt::GN_CRS2_LM;
    case SearchAlgorithm::Isres:
      return nlopt::GN_ISRES;
    case SearchAlgorithm::Bobyqa:
      return nlopt::LN_BOBYQA;
    case SearchAlgorithm::Sbplx:
      break;
  }
  return nlopt::LN_SBPLX;
}

void runStage(Search& search) {
  const SearchProblem& p = search.problem;
  const unsigned n = static_cast<unsigned>(p.start.size());
  nlopt::opt optimizer(getAlgorithm(search.stage->algorithm), n);
  optimizer.set_min_objective(evaluate, &search);
  optimizer.set_lower_bounds(0);
  optimizer.set_upper_bounds(1);
  optimizer.set_maxeval(search.stage->evaluations);
  optimizer.set_xtol_abs(search.stage->tolerance);
  optimizer.set_initial_step(0.1);
  std::vector<double> unit(n);
  for (unsigned i = 0; i < n; ++i) unit[i] = (search.best.x[i] - p.lower[i]) / (p.upper[i] - p.lower[i]);
  double value = 0;
  try {
    optimizer.optimize(unit, value);
  } catch (const nlopt::forced_stop&) {
    if (search.error) std::rethrow_exception(search.error);
  } catch (const std::runtime_error&) {
    // Rounding stops a local search near its minimum; the best point stands.
  }
}

}  // namespace

const char* getName(SearchAlgorithm algorithm) {
  switch (algorithm) {
    case SearchAlgorithm::Crs:
      return "crs";
    case SearchAlgorithm::Isres:
      return "isres";
    case SearchAlgorithm::Bobyqa:
      return "bobyqa";
    case SearchAlgorithm::Sbplx:
      break;
  }
  return "sbplx";
}

SearchResult minimizeByStages(const SearchProblem& problem, const std::vector<SearchStage>& stages, unsigned seed) {
  Search search{problem, nullptr, {problem.start, std::numeric_limits<double>::infinity(), 0}, nullptr};
  nlopt::srand(seed);  // of this thread alone
  for (const SearchStage& stage : stages) {
    search.stage = &stage;
    runStage(search);
  }
  return search.best;
}

}  // namespace bielle
