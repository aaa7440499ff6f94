#include "motion/slsqp.h"

#include <limits>
#include <nlopt.hpp>

namespace bielle {
namespace {

struct Search {
  const SlsqpObjective& objective;
  SlsqpResult best;
};

double evaluate(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  Search& search = *static_cast<Search*>(data);
  const VectorXd point = VectorXd::Map(x.data(), x.size());
  VectorXd slope(gradient.empty() ? 0 : x.size());
  const double value = search.objective(point, gradient.empty() ? nullptr : &slope);
  std::copy(slope.begin(), slope.end(), gradient.begin());
  ++search.best.evaluations;
  if (value < search.best.value) search.best.value = value, search.best.x = point;
  return value;
}

}  // namespace

SlsqpResult minimizeBySlsqp(const VectorXd& start, const SlsqpObjective& objective, const SlsqpOptions& options) {
  Search search{objective, {start, std::numeric_limits<double>::infinity(), 0}};
  nlopt::opt optimizer(nlopt::LD_SLSQP, static_cast<unsigned>(start.size()));
  optimizer.set_min_objective(evaluate, &search);
  optimizer.set_xtol_abs(options.tolerance);
  optimizer.set_maxeval(options.max_evaluations);
  std::vector<double> x(start.begin(), start.end());
  double value = 0;
  try {
    optimizer.optimize(x, value);
  } catch (const std::runtime_error&) {
    // Rounding stops the line search near the minimum; the best point is valid.
  }
  return search.best;
}

}  // namespace bielle
