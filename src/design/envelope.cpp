#include "design/envelope.h"

#include <limits>
#include <stdexcept>

#include "design/optimum_path.h"

namespace bielle {

struct Envelope::Data {
  const Model model;
  const ShootingProblem& problem;
  const ShootingTrajectory& optimum;
  std::vector<VectorXd> y;
  std::vector<VectorXd> costates;
  EvaluationList at;
  std::unique_ptr<ProblemScratch> scratch;
  double cost = 0;

  void evaluate();
  void updateCostates(double penalty);
  double calcConstraintPart(const ShootingProblem& changed, int node, const VectorXd& c) const;
  double calcGapPart(int first, const std::vector<VectorXd>& reached, const VectorXd* xs) const;
};

void Envelope::Data::evaluate() {
  const int N = problem.numStages();
  at = makeEvaluations(problem, N + 1);
  scratch = problem.makeScratch();
  std::vector<EvaluateTask> tasks;
  for (int k = 0; k <= N; ++k)
    tasks.push_back({k, &optimum.xs[k], k < N ? &optimum.us[k] : nullptr, nullptr, at[k].get()});
  problem.evaluate(tasks.data(), N + 1, scratch.get());
  if (!allOk(at, N + 1)) throw std::invalid_argument("Envelope: the optimum cannot be evaluated");
  for (const auto& node : at) cost += node->cost;
}

// Eq. (3)
void Envelope::Data::updateCostates(double penalty) {
  std::vector<ConstraintWeights> weights;
  for (int k = 0; k <= problem.numStages(); ++k) {
    weights.push_back(makeActiveWeights(problem, k, y[k], at[k]->constraints, penalty));
    weights[k].gradient = y[k];
  }
  const std::vector<StageModel> models = linearizeNodes(problem, at, scratch.get());
  LqSweep sweep;
  std::vector<VectorXd> dx, du;
  if (sweepNodes(problem, models, weights, optimum.us, sweep, dx, du) != NumericalStatus::Ok)
    throw std::invalid_argument("Envelope: the optimum is not a minimum to second order");
  for (size_t k = 0; k < models.size(); ++k) costates.push_back(sweep.nodes()[k].Vx + sweep.nodes()[k].Vxx * dx[k]);
}

// y . (c - b) of Eq. (1).
double Envelope::Data::calcConstraintPart(const ShootingProblem& changed, int node, const VectorXd& c) const {
  VectorXd lower(c.size()), upper(c.size());
  changed.getConstraintBounds(node, lower, upper);
  double sum = 0;
  for (Eigen::Index i = 0; i < c.size(); ++i)
    if (const double multiplier = y[node][i]; multiplier != 0)
      sum += multiplier * (c[i] - getActiveBound(multiplier, lower[i], upper[i]));
  return sum;
}

// lambda . (reached (-) x) of Eq. (1), summed over the nodes from `first` on.
double Envelope::Data::calcGapPart(int first, const std::vector<VectorXd>& reached, const VectorXd* xs) const {
  const Eigen::Index nq = model.nq(), others = problem.stateSize() - nq;
  std::vector<VectorXd> x1(reached.size()), dx(reached.size());
  std::vector<DifferenceTask> tasks;
  for (size_t i = 0; i < reached.size(); ++i) {
    const int node = first + static_cast<int>(i);
    const VectorXd d = model.difference(xs[i].head(nq), reached[i].head(nq));
    x1[i] = optimum.xs[node];
    model.integrate(optimum.xs[node].head(nq), d, x1[i].head(nq));
    x1[i].tail(others) += reached[i].tail(others) - xs[i].tail(others);
    dx[i].resize(problem.tangentSize(node));
    tasks.push_back({node, at[node].get(), &x1[i], &dx[i]});
  }
  problem.difference(tasks.data(), static_cast<int>(tasks.size()), scratch.get());
  double sum = 0;
  for (size_t i = 0; i < reached.size(); ++i) sum += costates[first + i].dot(dx[i]);
  return sum;
}

Envelope::Envelope(const Model& model, const ShootingProblem& problem, const ShootingTrajectory& optimum,
                   const Multipliers& multipliers)
    : data_(new Data{model, problem, optimum, multipliers.values, {}, {}, {}, 0}) {
  const size_t N = static_cast<size_t>(problem.numStages());
  if (data_->y.empty()) data_->y.resize(N + 1);
  bool same = optimum.xs.size() == N + 1 && optimum.us.size() == N && data_->y.size() == N + 1;
  for (size_t k = 0; same && k <= N; ++k) same = data_->y[k].size() == problem.constraintSize(static_cast<int>(k));
  if (!same) throw std::invalid_argument("Envelope: the optimum or its multipliers do not belong to this problem");
  data_->evaluate();
  data_->updateCostates(multipliers.penalty);
}
Envelope::~Envelope() = default;

double Envelope::cost() const { return data_->cost; }
const VectorXd& Envelope::getCostate(int node) const { return data_->costates[node]; }

double Envelope::calcLagrangian(const ShootingProblem& changed) const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Data& data = *data_;
  requireSameSizes(data.problem, changed);
  const int N = changed.numStages(), size = std::max(1, changed.batchSize());
  const std::optional<ShootingTrajectory> path = calcPath(data.problem, data.optimum, changed);
  if (!path) return kNone;
  const EvaluationList at = makeEvaluations(changed, size);
  const std::unique_ptr<ProblemScratch> scratch = changed.makeScratch();
  double sum = 0;
  for (int first = 0; first <= N; first += size) {
    const int count = std::min(size, N + 1 - first);
    std::vector<EvaluateTask> tasks;
    for (int k = first; k < first + count; ++k)
      tasks.push_back({k, &path->xs[k], k < N ? &path->us[k] : nullptr, nullptr, at[k - first].get()});
    changed.evaluate(tasks.data(), count, scratch.get());
    if (!allOk(at, count)) return kNone;
    std::vector<VectorXd> reached;
    for (int k = first; k < first + count; ++k) {
      sum += at[k - first]->cost + data.calcConstraintPart(changed, k, at[k - first]->constraints);
      if (k < N) reached.push_back(at[k - first]->x_next);
    }
    sum += data.calcGapPart(first + 1, reached, &path->xs[first] + 1);
  }
  return sum;
}

}  // namespace bielle
