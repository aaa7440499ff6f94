#include "bielle/design/search.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "design/nlopt_search.h"

namespace bielle {
namespace {

double evaluate(const std::vector<double>& unit, std::vector<double>&, void* data) {
  Search& search = *static_cast<Search*>(data);
  const VectorXd x = getPoint(search.problem, unit);
  try {
    const double value = search.problem.objective(x, *search.stage);
    search.add(x, value);
    return value;
  } catch (...) {  // kept, because NLopt would lose it
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
      return nlopt::LN_SBPLX;
    default:
      throw std::invalid_argument(std::string(getName(algorithm)) + " does not support a single objective");
  }
}

void runStage(Search& search) {
  const SearchProblem& p = search.problem;
  nlopt::opt optimizer(getAlgorithm(search.stage->algorithm), static_cast<unsigned>(p.start.size()));
  optimizer.set_min_objective(evaluate, &search);
  optimizer.set_lower_bounds(0);
  optimizer.set_upper_bounds(1);
  optimizer.set_initial_step(0.1);
  std::vector<double> unit = getShares(p, search.best.x);
  runOptimizer(search, optimizer, unit);
}

}  // namespace

VectorXd getPoint(const SearchProblem& p, const std::vector<double>& unit) {
  const VectorXd share = VectorXd::Map(unit.data(), p.start.size());
  return (p.lower + share.cwiseProduct(p.upper - p.lower)).cwiseMax(p.lower).cwiseMin(p.upper);
}

std::vector<double> getShares(const SearchProblem& p, const VectorXd& x) {
  const VectorXd share = (x - p.lower).cwiseQuotient(p.upper - p.lower);
  return {share.begin(), share.end()};
}

void Search::add(const VectorXd& x, double value) {
  ++best.evaluations;
  if (value < best.value) best.value = value, best.x = x;
}

namespace {

std::string describeEnd(nlopt::result result) {
  switch (result) {
    case nlopt::XTOL_REACHED:
      return "its steps are smaller than the tolerance";
    case nlopt::MAXEVAL_REACHED:
      return "it had all its evaluations";
    case nlopt::ROUNDOFF_LIMITED:
      return "rounding leaves it no better step";
    default:
      return "the algorithm sees no further progress";
  }
}

}  // namespace

void runOptimizer(Search& search, nlopt::opt& optimizer, std::vector<double>& unit) {
  const int before = search.best.evaluations;
  optimizer.set_maxeval(search.stage->evaluations);
  optimizer.set_xtol_abs(search.stage->tolerance);
  double value = 0;
  nlopt::result result = nlopt::FAILURE;
  try {
    result = optimizer.optimize(unit, value);
  } catch (const nlopt::forced_stop&) {
    if (search.error) std::rethrow_exception(search.error);
  } catch (const nlopt::roundoff_limited&) {
    result = nlopt::ROUNDOFF_LIMITED;
  } catch (const std::runtime_error&) {
    // The best point so far is valid.
  }
  search.best.ends.push_back({search.stage->algorithm, search.best.evaluations - before, describeEnd(result)});
}

const char* getName(SearchAlgorithm algorithm) {
  switch (algorithm) {
    case SearchAlgorithm::Crs:
      return "crs";
    case SearchAlgorithm::Isres:
      return "isres";
    case SearchAlgorithm::Bobyqa:
      return "bobyqa";
    case SearchAlgorithm::Sbplx:
      return "sbplx";
    case SearchAlgorithm::Slsqp:
      return "slsqp";
    case SearchAlgorithm::Mma:
      return "mma";
    case SearchAlgorithm::Nsga2:
      return "nsga2";
    case SearchAlgorithm::Moead:
      break;
  }
  return "moead";
}

bool needsGradient(SearchAlgorithm algorithm) {
  return algorithm == SearchAlgorithm::Slsqp || algorithm == SearchAlgorithm::Mma;
}

SearchResult minimizeByStages(const SearchProblem& problem, const std::vector<SearchStage>& stages, unsigned seed) {
  Search search{problem, nullptr, {problem.start, std::numeric_limits<double>::infinity(), 0, {}}, nullptr};
  nlopt::srand(seed);  // only for this thread
  for (const SearchStage& stage : stages) {
    search.stage = &stage;
    needsGradient(stage.algorithm) ? runSlopedStage(search) : runStage(search);
  }
  return search.best;
}

}  // namespace bielle
