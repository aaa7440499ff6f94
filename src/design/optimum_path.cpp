#include "design/optimum_path.h"

#include <algorithm>
#include <stdexcept>

namespace bielle {

EvaluationList makeEvaluations(const ShootingProblem& problem, int count) {
  EvaluationList out;
  for (int i = 0; i < count; ++i) out.push_back(problem.makeEvaluation());
  return out;
}

bool allOk(const EvaluationList& evaluations, int count) {
  return std::all_of(evaluations.begin(), evaluations.begin() + count,
                     [](const auto& at) { return at->status == NumericalStatus::Ok; });
}

void requireSameSizes(const ShootingProblem& a, const ShootingProblem& b) {
  bool same = a.numStages() == b.numStages() && a.stateSize() == b.stateSize();
  for (int k = 0; same && k <= a.numStages(); ++k)
    same = a.tangentSize(k) == b.tangentSize(k) && a.constraintSize(k) == b.constraintSize(k) &&
           (k == a.numStages() || a.controlSize(k) == b.controlSize(k));
  if (!same) throw std::invalid_argument("the changed problem differs in stages, states, controls or constraints");
}

namespace {

ControlBox getControlBounds(const ShootingProblem& problem, int stage) {
  const int nu = problem.controlSize(stage);
  ControlBox out{VectorXd(nu), VectorXd(nu)};
  problem.getControlBounds(stage, out.lower, out.upper);
  return out;
}

VectorXd calcPathControl(const ShootingProblem& problem, const ShootingProblem& changed, int stage, VectorXd u) {
  const ControlBox from = getControlBounds(problem, stage), to = getControlBounds(changed, stage);
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    if (u[i] == from.lower[i])
      u[i] = to.lower[i];
    else if (u[i] == from.upper[i])
      u[i] = to.upper[i];
  }
  return u;
}

}  // namespace

std::optional<ShootingTrajectory> calcPath(const ShootingProblem& problem, const ShootingTrajectory& optimum,
                                           const ShootingProblem& changed) {
  const int N = problem.numStages(), size = std::max(1, changed.batchSize());
  ShootingTrajectory out = optimum;
  for (int k = 0; k < N; ++k) out.us[k] = calcPathControl(problem, changed, k, optimum.us[k]);
  // All states are evaluated as if they were at the last node, the cheapest one, to be closed there.
  const EvaluationList at = makeEvaluations(changed, size);
  const std::unique_ptr<ProblemScratch> scratch = changed.makeScratch();
  const VectorXd still = VectorXd::Zero(changed.tangentSize(N));
  for (int first = 0; first <= N; first += size) {
    const int count = std::min(size, N + 1 - first);
    std::vector<EvaluateTask> evaluations;
    std::vector<IntegrateTask> integrations;
    for (int i = 0; i < count; ++i) {
      evaluations.push_back({N, &optimum.xs[first + i], nullptr, nullptr, at[i].get()});
      integrations.push_back({N, at[i].get(), &still, &out.xs[first + i]});
    }
    changed.evaluate(evaluations.data(), count, scratch.get());
    if (!allOk(at, count)) return {};
    changed.integrate(integrations.data(), count, scratch.get());
  }
  out.xs[0] = changed.initialState();
  if (!std::all_of(out.xs.begin(), out.xs.end(), [](const VectorXd& x) { return x.allFinite(); })) return {};
  return out;
}

ConstraintWeights makeActiveWeights(const ShootingProblem& problem, int node, const VectorXd& y, const VectorXd& c,
                                    double penalty) {
  ConstraintWeights out{y, VectorXd::Zero(y.size())};
  VectorXd lower(y.size()), upper(y.size());
  problem.getConstraintBounds(node, lower, upper);
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    if (y[i] == 0 && lower[i] != upper[i]) continue;
    out.gradient[i] += penalty * (c[i] - getActiveBound(y[i], lower[i], upper[i]));
    out.hessian[i] = penalty;
  }
  return out;
}

std::vector<StageModel> linearizeNodes(const ShootingProblem& problem, const EvaluationList& at,
                                       ProblemScratch* scratch) {
  const int N = problem.numStages(), size = std::max(1, problem.batchSize());
  std::vector<StageModel> models(N + 1);
  std::vector<std::vector<char>> rows(N + 1);
  std::vector<LinearizeTask> tasks(N + 1);
  for (int k = 0; k <= N; ++k) {
    const bool running = k < N;
    models[k].resize(problem.tangentSize(k), running ? problem.controlSize(k) : 0,
                     running ? problem.tangentSize(k + 1) : 0, problem.constraintSize(k));
    rows[k].assign(problem.constraintSize(k), true);
    tasks[k].node = k;
    tasks[k].at = at[k].get();
    tasks[k].next = running ? at[k + 1].get() : nullptr;
    tasks[k].rows = &rows[k];
    tasks[k].out = &models[k];
  }
  for (int first = 0; first <= N; first += size)
    problem.linearize(&tasks[first], std::min(size, N + 1 - first), scratch);
  for (const LinearizeTask& task : tasks)
    if (task.status != NumericalStatus::Ok)
      throw std::invalid_argument("the optimum has no derivatives at node " + std::to_string(task.node) + ": " +
                                  task.failure);
  return models;
}

NumericalStatus sweepNodes(const ShootingProblem& problem, const std::vector<StageModel>& models,
                           const std::vector<ConstraintWeights>& weights, const std::vector<VectorXd>& us,
                           LqSweep& sweep, std::vector<VectorXd>& dx, std::vector<VectorXd>& du) {
  std::vector<ControlBox> boxes;
  for (size_t k = 0; k < us.size(); ++k) {
    const ControlBox bounds = getControlBounds(problem, static_cast<int>(k));
    boxes.push_back({(bounds.lower - us[k]).cwiseMin(0), (bounds.upper - us[k]).cwiseMax(0)});
  }
  const double regularization = FddpOptions().min_regularization;
  const NumericalStatus status = sweep.update(models, {regularization, regularization}, boxes, weights).status;
  if (status == NumericalStatus::Ok) sweep.calcStep(models, dx, du);
  return status;
}

}  // namespace bielle
