#include "firmware/solution.h"

#include <Eigen/Dense>
#include <algorithm>
#include <set>

#include "bielle/model/error.h"

namespace bielle::firmware {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd, Eigen::Index;

MatrixXs multiply(const MatrixXs& A, const MatrixXs& B) {
  MatrixXs out = MatrixXs::Constant(A.rows(), B.cols(), Scalar(0));
  for (Index i = 0; i < A.rows(); ++i)
    for (Index j = 0; j < B.cols(); ++j)
      for (Index k = 0; k < A.cols(); ++k) out(i, j) += A(i, k) * B(k, j);
  return out;
}

MatrixXs makeIdentity(Index n) {
  MatrixXs out = MatrixXs::Constant(n, n, Scalar(0));
  for (Index i = 0; i < n; ++i) out(i, i) = 1;
  return out;
}

// A formula with some inputs replaced.
class Substitution {
 public:
  explicit Substitution(const std::map<int, Scalar>& values) : values_(values) {}
  Scalar operator()(const Scalar& formula) {
    if (const auto known = known_.find(&formula.node()); known != known_.end()) return known->second;
    const Scalar out = replace(formula);
    return known_.emplace(&formula.node(), out).first->second;
  }

 private:
  Scalar replace(const Scalar& formula) {
    const Node& node = formula.node();
    const auto a = [&] { return (*this)(node.operands[0]); };
    const auto b = [&] { return (*this)(node.operands[1]); };
    switch (node.op) {
      case Op::Constant:
        return formula;
      case Op::Input: {
        const auto value = values_.find(node.input);
        return value == values_.end() ? formula : value->second;
      }
      case Op::Negate:
        return -a();
      case Op::Sqrt:
        return sqrt(a());
      case Op::Sin:
        return sin(a());
      case Op::Cos:
        return cos(a());
      case Op::Add:
        return a() + b();
      case Op::Subtract:
        return a() - b();
      case Op::Multiply:
        return a() * b();
      case Op::Divide:
        return a() / b();
      case Op::Atan2:
        return atan2(a(), b());
      case Op::Min:
        return min(a(), b());
    }
    return formula;
  }
  const std::map<int, Scalar>& values_;
  std::map<const Node*, Scalar> known_;
};

// The root on the branch of the samples, in all of them.
std::optional<size_t> findRoot(const Mechanism& mechanism, const ClosedForm& form, int coordinate,
                               const Postures& samples) {
  const Program roots(form.roots);
  std::vector<bool> fits(form.roots.size(), true);
  for (const VectorXd& z : samples) {
    const std::vector<double> there = roots.evaluate(toInputs(mechanism, z));
    for (size_t k = 0; k < there.size(); ++k) fits[k] = fits[k] && std::abs(there[k] - z[coordinate]) < 1e-6;
  }
  const auto fit = std::find(fits.begin(), fits.end(), true);
  return fit == fits.end() ? std::nullopt : std::optional<size_t>(fit - fits.begin());
}

// Polynomials of the given coordinates that fit the unknowns over the samples.
std::vector<Scalar> fitGuesses(const Solution& solution, const Postures& samples) {
  const size_t n = solution.given.size();
  const int degree = n == 1 ? 7 : n == 2 ? 5 : 3;
  std::vector<double> middle(n), half(n);
  std::vector<Scalar> x(n);
  for (size_t i = 0; i < n; ++i) {
    double lower = INFINITY, upper = -INFINITY;
    for (const VectorXd& z : samples) {
      lower = std::min(lower, z[solution.given[i]]);
      upper = std::max(upper, z[solution.given[i]]);
    }
    middle[i] = (lower + upper) / 2;
    half[i] = std::max((upper - lower) / 2, 1e-6);
    x[i] = (makeInput(solution.given[i]) - middle[i]) * Scalar(1 / half[i]);
  }
  std::vector<std::vector<int>> powers = {{}};
  for (size_t i = 0; i < n; ++i) {
    std::vector<std::vector<int>> longer;
    for (const auto& power : powers) {
      int sum = 0;
      for (int p : power) sum += p;
      for (int p = 0; p + sum <= degree; ++p) {
        longer.push_back(power);
        longer.back().push_back(p);
      }
    }
    powers = std::move(longer);
  }
  const auto rows = static_cast<Index>(samples.size()), terms = static_cast<Index>(powers.size());
  MatrixXd A(rows, terms), B(rows, static_cast<Index>(solution.unknowns.size()));
  for (Index r = 0; r < rows; ++r) {
    const VectorXd& z = samples[static_cast<size_t>(r)];
    for (Index t = 0; t < terms; ++t) {
      A(r, t) = 1;
      for (size_t i = 0; i < n; ++i)
        A(r, t) *= std::pow((z[solution.given[i]] - middle[i]) / half[i], powers[static_cast<size_t>(t)][i]);
    }
    for (Index u = 0; u < B.cols(); ++u) B(r, u) = z[solution.unknowns[static_cast<size_t>(u)]];
  }
  const MatrixXd fit = A.completeOrthogonalDecomposition().solve(B);
  std::vector<std::vector<Scalar>> power_of(n, {Scalar(1)});
  for (size_t i = 0; i < n; ++i)
    for (int p = 1; p <= degree; ++p) power_of[i].push_back(power_of[i].back() * x[i]);
  std::vector<Scalar> out;
  for (Index u = 0; u < B.cols(); ++u) {
    Scalar sum = 0;
    for (Index t = 0; t < terms; ++t) {
      Scalar term = fit(t, u);
      Scalar monomial = 1;
      for (size_t i = 0; i < n; ++i)
        monomial = monomial * power_of[i][static_cast<size_t>(powers[static_cast<size_t>(t)][i])];
      sum += term * monomial;
    }
    out.push_back(sum);
  }
  return out;
}

}  // namespace

Elimination eliminate(MatrixXs A, MatrixXs B, const Postures& samples) {
  // Pivots are chosen by numbers, in every sample at once.
  const Program program(listEntries(A));
  std::vector<MatrixXd> numbers;
  for (const VectorXd& z : samples) {
    std::vector<double> inputs(z.data(), z.data() + z.size());
    inputs.resize(2 * inputs.size() + 3);
    numbers.push_back(toMatrix(program.evaluate(inputs), A.rows(), A.cols()));
  }
  std::vector<Index> rows, columns;
  for (Index r = 0; r < A.rows(); ++r) rows.push_back(r);
  for (Index c = 0; c < A.cols(); ++c) columns.push_back(c);
  std::vector<double> scale;  // of rows
  for (Index r : rows) {
    double most = 1e-300;
    for (const MatrixXd& x : numbers) most = std::max(most, x.row(r).cwiseAbs().maxCoeff());
    scale.push_back(most);
  }
  std::vector<std::pair<Index, Index>> pivots;
  while (!columns.empty() && !rows.empty()) {
    double best = 0;
    std::map<std::pair<Index, Index>, double> least;
    for (Index r : rows)
      for (Index c : columns) {
        if (A(r, c).is(0)) continue;
        double worst = INFINITY;
        for (const MatrixXd& x : numbers) worst = std::min(worst, std::abs(x(r, c)) / scale[static_cast<size_t>(r)]);
        least[{r, c}] = worst;
        best = std::max(best, worst);
      }
    if (best < 1e-7) break;
    std::pair<Index, Index> pivot;
    double cost = INFINITY;
    for (const auto& [place, worst] : least) {
      if (worst < 0.1 * best) continue;
      Index in_row = 0, in_column = 0;
      for (Index c : columns) in_row += !A(place.first, c).is(0);
      for (Index r : rows) in_column += !A(r, place.second).is(0);
      const double own =
          static_cast<double>((in_row - 1) * (in_column - 1)) + (A(place.first, place.second).isConstant() ? 0 : 0.5);
      if (own < cost) cost = own, pivot = place;
    }
    const auto [p, q] = pivot;
    rows.erase(std::find(rows.begin(), rows.end(), p));
    columns.erase(std::find(columns.begin(), columns.end(), q));
    pivots.push_back(pivot);
    for (Index r : rows) {
      if (A(r, q).is(0)) continue;
      const Scalar factor = A(r, q) / A(p, q);
      A(r, q) = 0;
      for (Index c : columns) A(r, c) -= factor * A(p, c);
      for (Index k = 0; k < B.cols(); ++k) B(r, k) -= factor * B(p, k);
      for (MatrixXd& x : numbers) x.row(r) -= x(r, q) / x(p, q) * x.row(p);
    }
  }
  Elimination out;
  for (const auto& [p, q] : pivots) out.determinant = out.determinant * A(p, q);
  MatrixXs& X = out.X;
  X = MatrixXs::Constant(A.cols(), B.cols(), Scalar(0));
  for (size_t i = pivots.size(); i-- > 0;) {
    const auto [p, q] = pivots[i];
    for (Index k = 0; k < B.cols(); ++k) {
      Scalar sum = B(p, k);
      for (size_t j = i + 1; j < pivots.size(); ++j) sum -= A(p, pivots[j].second) * X(pivots[j].second, k);
      X(q, k) = sum / A(p, q);
    }
  }
  return out;
}

Solution solve(const Mechanism& mechanism, const std::vector<int>& given, const Postures& samples) {
  Solution out;
  out.given = given;
  std::set<int> known(given.begin(), given.end());
  std::vector<bool> used(mechanism.equations.size());

  // Whatever an equation gives by itself.
  const auto takeClosedForms = [&](std::vector<std::pair<int, Scalar>>& list, Scalar& least) {
    std::map<int, Scalar> values;
    for (bool found = true; found;) {
      found = false;
      for (size_t e = 0; e < mechanism.equations.size(); ++e) {
        const Equation& equation = mechanism.equations[e];
        if (used[e]) continue;
        std::set<int> missing;
        for (int c : equation.coordinates)
          if (!known.count(c)) missing.insert(c);
        if (missing.size() != 1 || !equation.solved.count(*missing.begin())) continue;
        const int c = *missing.begin();
        const ClosedForm& form = equation.solved.at(c);
        const std::optional<size_t> root = findRoot(mechanism, form, c, samples);
        if (!root) continue;
        Substitution substitute(values);
        const Scalar value = substitute(form.roots[*root]);
        if (!form.radicand.isConstant())
          least = least.is(1) ? substitute(form.radicand) : min(least, substitute(form.radicand));
        values.emplace(c, value);
        list.emplace_back(c, value);
        known.insert(c);
        used[e] = found = true;
      }
    }
  };
  takeClosedForms(out.before, out.least_before);

  // What follows from the rest alone, each from an equation that nothing else needs, comes last.
  std::vector<std::pair<size_t, int>> tail;
  const auto isMissing = [&](int c) {
    return !known.count(c) &&
           std::none_of(tail.begin(), tail.end(), [c](const auto& last) { return last.second == c; });
  };
  for (bool found = true; found;) {
    found = false;
    std::map<int, std::vector<size_t>> uses;
    for (size_t e = 0; e < mechanism.equations.size(); ++e)
      for (int c : std::set<int>(mechanism.equations[e].coordinates.begin(), mechanism.equations[e].coordinates.end()))
        if (!used[e] && isMissing(c)) uses[c].push_back(e);
    for (const auto& [c, equations] : uses) {
      const size_t e = equations.front();
      if (equations.size() > 1 || !mechanism.equations[e].solved.count(c) || mechanism.equations[e].rows.size() != 1)
        continue;
      if (!findRoot(mechanism, mechanism.equations[e].solved.at(c), c, samples)) continue;
      tail.emplace_back(e, c);
      used[e] = found = true;
      break;
    }
  }
  std::vector<Scalar> rows;
  std::set<int> unknown;
  for (size_t e = 0; e < mechanism.equations.size(); ++e) {
    const Equation& equation = mechanism.equations[e];
    if (used[e] || std::none_of(equation.coordinates.begin(), equation.coordinates.end(), isMissing)) continue;
    rows.insert(rows.end(), equation.rows.begin(), equation.rows.end());
    for (int c : equation.coordinates)
      if (isMissing(c)) unknown.insert(c);
  }
  if (!unknown.empty()) {
    out.unknowns.assign(unknown.begin(), unknown.end());
    MatrixXs B(rows.size(), 1);
    for (size_t r = 0; r < rows.size(); ++r) B(static_cast<Index>(r), 0) = -rows[r];
    const MatrixXs J = derive(rows, out.unknowns);
    const std::vector<Scalar> entries = listEntries(J);
    out.steps = listEntries(eliminate(J, B, samples).X);
    if (std::all_of(entries.begin(), entries.end(), [](const Scalar& entry) { return entry.isConstant(); })) {
      // Linear: the step from zero is the solution.
      std::map<int, Scalar> zeros;
      for (int c : out.unknowns) zeros.emplace(c, 0.0);
      for (const auto& [c, formula] : out.before) zeros.emplace(c, formula);
      Substitution substitute(zeros);
      for (size_t u = 0; u < out.unknowns.size(); ++u)
        out.before.emplace_back(out.unknowns[u], substitute(out.steps[u]));
      out.unknowns.clear();
      out.steps.clear();
    } else {
      out.guesses = fitGuesses(out, samples);
    }
    known.insert(unknown.begin(), unknown.end());
  }
  for (const auto& [e, c] : tail) used[e] = false;
  takeClosedForms(out.after, out.least_after);
  for (size_t c = 0; c < mechanism.coordinates.size(); ++c)
    if (!known.count(static_cast<int>(c)))
      throw InputError("", "joint '" + mechanism.coordinates[c].name + "'", "no equation gives its angle",
                       "report this robot");
  return out;
}

RateSolution solveRates(const Mechanism& mechanism, const Postures& samples) {
  const Index m = mechanism.size, n = static_cast<Index>(mechanism.coordinates.size());
  const std::vector<Scalar> rows = listRows(mechanism);
  const MatrixXs J = derive(rows, listRange(0, static_cast<int>(n))), J_joints = J.leftCols(m),
                 J_rest = J.rightCols(n - m);
  RateSolution out;
  const Elimination rest = eliminate(J_rest, -J_joints, samples);
  out.determinant = rest.determinant;
  out.R = rest.X.topRows(m);
  const Elimination inverse = eliminate(out.R, makeIdentity(m), samples);
  out.S = inverse.X;
  out.ratio_determinant = inverse.determinant;

  out.T.resize(n, m);
  out.T.topRows(m) = makeIdentity(m);
  for (Index i = 0; i < m; ++i)
    for (Index k = 0; k < m; ++k) out.T(m + i, k) = makeInput(mechanism.ratio() + static_cast<int>(i * m + k));
  if (n > 2 * m)
    out.T.bottomRows(n - 2 * m) =
        eliminate(J.rightCols(n - 2 * m), -multiply(J.leftCols(2 * m), out.T.topRows(2 * m)), samples).X;
  std::map<int, Scalar> moving;
  for (Index c = 0; c < n; ++c) {
    Scalar rate = 0;
    for (Index k = 0; k < m; ++k) rate += out.T(c, k) * makeInput(mechanism.velocity() + static_cast<int>(k));
    moving.emplace(static_cast<int>(c), rate);
  }
  // J T = 0, so that J dT/dt = -dJ/dt T.
  Derivative derivative(moving);
  const MatrixXs J_rate = J.unaryExpr([&](const Scalar& entry) { return derivative(entry); });
  out.R_rate = eliminate(J_rest, -multiply(J_rate, out.T), samples).X.topRows(m);
  out.log_rate = derivative(out.determinant) / out.determinant;
  return out;
}

SolutionPrograms::SolutionPrograms(const Solution& s) : solution(s) {
  std::vector<Scalar> first, last;
  for (const auto& [c, formula] : s.before) first.push_back(formula);
  first.insert(first.end(), s.guesses.begin(), s.guesses.end());
  first.push_back(s.least_before);
  before = Program(first);
  step = Program(s.steps);
  for (const auto& [c, formula] : s.after) last.push_back(formula);
  last.push_back(s.least_after);
  after = Program(last);
}

OperationCount SolutionPrograms::count() const {
  OperationCount out = before.count();
  const std::vector<bool> varying = step.findVarying(solution.unknowns);
  out += step.count(varying, true) * solution.iterations;
  out += step.count(varying, false);
  if (!solution.after.empty()) out += after.count();
  return out;
}

}  // namespace bielle::firmware
