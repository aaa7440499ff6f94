#include <algorithm>
#include <cmath>

#include "design/nlopt_search.h"

namespace bielle {
namespace {

constexpr double kConstraintTolerance = 1e-9;  // of Eq. (1), whose values are of the size of 1

// Eq. (1) over (x, t), x as shares of the bounds.
class EpigraphProblem {
 public:
  EpigraphProblem(Search& search, const VectorXd& start)
      : search_(search), n_(start.size()), shares_(getShares(search.problem, start)) {
    update(start);
    feasible_ = !here_.terms.empty();
    for (const MeasurePieces& term : here_.terms) {
      sizes_.push_back(term.values.size());
      if (term.values.size() > 1) constraints_ += term.values.size(), ++bounds_;
    }
    limits_ = here_.limits.values.size();
    constraints_ += limits_;
  }

  bool feasible() const { return feasible_; }
  // From the best point to the last design, if that could not be evaluated: the largest share of the bounds.
  double calcBlockedStep() const {
    if (!here_.terms.empty()) return 0;
    const std::vector<double> best = getShares(search_.problem, search_.best.x);
    double step = 0;
    for (Eigen::Index i = 0; i < n_; ++i) step = std::max(step, std::abs(shares_[i] - best[i]));
    return step;
  }
  Eigen::Index size() const { return n_ + bounds_; }
  Eigen::Index constraints() const { return constraints_; }

  // x, and the terms of several pieces at x.
  std::vector<double> makeStart() const {
    std::vector<double> z = shares_;
    for (const MeasurePieces& term : here_.terms)
      if (term.values.size() > 1) z.push_back(term.values.maxCoeff());
    return z;
  }

  static double calcObjective(const std::vector<double>& z, std::vector<double>& gradient, void* data) {
    EpigraphProblem& self = *static_cast<EpigraphProblem*>(data);
    self.moveTo(z);
    return self.sum(z, gradient);
  }

  static void calcConstraints(unsigned, double* out, unsigned n, const double* z, double* gradient, void* data) {
    EpigraphProblem& self = *static_cast<EpigraphProblem*>(data);
    self.moveTo({z, z + n});
    self.writeConstraints(z, out, gradient);
  }

 private:
  void update(const VectorXd& x) {
    here_ = search_.problem.sloped(x, *search_.stage);
    search_.add(x, here_.value);
    const VectorXd width = search_.problem.upper - search_.problem.lower;
    for (MeasurePieces& term : here_.terms) term.gradients *= width.asDiagonal();
    if (here_.limits.values.size() > 0) here_.limits.gradients *= width.asDiagonal();
  }

  // Objective and constraints are requested for the same x in succession, with different t.
  void moveTo(const std::vector<double>& z) {
    std::vector<double> shares(z.begin(), z.begin() + n_);
    if (shares == shares_) return;
    shares_ = std::move(shares);
    try {
      update(getPoint(search_.problem, shares_));
    } catch (...) {  // kept, because NLopt would lose it
      search_.error = std::current_exception();
      throw nlopt::forced_stop();
    }
  }

  // Pieces of a term; if x is infeasible all have its value, which is worse than that of any feasible one.
  double getPiece(size_t term, Eigen::Index piece) const {
    return here_.terms.empty() ? here_.value : here_.terms[term].values[piece];
  }
  double getSlope(size_t term, Eigen::Index piece, Eigen::Index i) const {
    return here_.terms.empty() ? 0 : here_.terms[term].gradients(piece, i);
  }

  double sum(const std::vector<double>& z, std::vector<double>& gradient) const {
    std::fill(gradient.begin(), gradient.end(), 0);
    double value = 0;
    Eigen::Index t = n_;
    for (size_t k = 0; k < sizes_.size(); ++k) {
      const bool single = sizes_[k] == 1;
      value += single ? getPiece(k, 0) : z[t];
      if (!gradient.empty() && !single) gradient[t] = 1;
      for (Eigen::Index i = 0; i < n_ && single && !gradient.empty(); ++i) gradient[i] += getSlope(k, 0, i);
      if (!single) ++t;
    }
    return value;
  }

  void writeConstraints(const double* z, double* out, double* gradient) const {
    if (gradient) std::fill(gradient, gradient + constraints_ * size(), 0.0);
    Eigen::Index row = 0, t = n_;
    for (size_t k = 0; k < sizes_.size(); ++k) {
      if (sizes_[k] == 1) continue;
      for (Eigen::Index j = 0; j < sizes_[k]; ++j, ++row) {
        out[row] = getPiece(k, j) - z[t];
        if (!gradient) continue;
        for (Eigen::Index i = 0; i < n_; ++i) gradient[row * size() + i] = getSlope(k, j, i);
        gradient[row * size() + t] = -1;
      }
      ++t;
    }
    for (Eigen::Index j = 0; j < limits_ && !here_.terms.empty(); ++j, ++row) {
      out[row] = here_.limits.values[j];
      for (Eigen::Index i = 0; i < n_ && gradient; ++i) gradient[row * size() + i] = here_.limits.gradients(j, i);
    }
    for (; row < constraints_; ++row) out[row] = here_.value;
  }

  Search& search_;
  Eigen::Index n_ = 0, bounds_ = 0, limits_ = 0, constraints_ = 0;
  std::vector<double> shares_;  // of the last evaluation
  bool feasible_ = false;
  std::vector<Eigen::Index> sizes_;  // pieces of the terms
  SlopedValue here_;
};

// Searches within `reach` of the best point, a share of the bounds. Returns how far away a design was that could not be evaluated and
// that the algorithm has not come back from; 0 if there is none.
double searchWithin(Search& search, double reach) {
  const VectorXd start = search.best.x;
  EpigraphProblem problem(search, start);
  if (!problem.feasible()) {
    search.best.ends.push_back({search.stage->algorithm, 1, "it starts where nothing can be differentiated"});
    return 0;
  }
  std::vector<double> z = problem.makeStart();
  const bool slsqp = search.stage->algorithm == SearchAlgorithm::Slsqp;
  nlopt::opt optimizer(slsqp ? nlopt::LD_SLSQP : nlopt::LD_MMA, static_cast<unsigned>(problem.size()));
  optimizer.set_min_objective(EpigraphProblem::calcObjective, &problem);
  if (problem.constraints() > 0)
    optimizer.add_inequality_mconstraint(EpigraphProblem::calcConstraints, &problem,
                                         std::vector<double>(problem.constraints(), kConstraintTolerance));
  std::vector<double> lower(z.size(), 0), upper(z.size(), 1);
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    lower[i] = std::max(0.0, z[i] - reach);
    upper[i] = std::min(1.0, z[i] + reach);
  }
  for (Eigen::Index t = start.size(); t < problem.size(); ++t) upper[t] = 2 * z[t];
  optimizer.set_lower_bounds(lower);
  optimizer.set_upper_bounds(upper);
  runOptimizer(search, optimizer, z);
  return problem.calcBlockedStep();
}

}  // namespace

// Slopes say nothing of designs that cannot be evaluated: after a step to one, NLopt's SLSQP may ask for it until it has no evaluations
// left. It then begins again from the best point, and goes half as far.
void runSlopedStage(Search& search) {
  const SearchStage* const stage = search.stage;
  SearchStage rest = *stage;
  search.stage = &rest;
  const int before = search.best.evaluations;
  double reach = 1;
  while (true) {
    reach = 0.5 * searchWithin(search, reach);
    const int taken = search.best.evaluations - before;
    search.best.ends.back().evaluations = taken;
    rest.evaluations = stage->evaluations - taken;
    if (reach <= stage->tolerance || rest.evaluations <= 0) break;
    search.best.ends.pop_back();
  }
  search.stage = stage;
}

}  // namespace bielle
