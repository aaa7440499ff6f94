#include <algorithm>

#include "math/decompositions.h"
#include "solve/lq_sweep.h"
#include "solve/periodic_problem.h"

namespace bielle {
namespace {

// Models of all nodes about a solution, with the constraints that hold there as equations.
class CycleModels {
 public:
  CycleModels(const ShootingProblem& problem, const ShootingTrajectory& solution, const Multipliers& multipliers)
      : problem_(problem), N_(problem.numStages()), scratch_(problem.makeScratch()), models_(N_ + 1), weights_(N_ + 1) {
    for (int k = 0; k <= N_; ++k) {
      nodes_.push_back(problem.makeEvaluation());
      EvaluateTask task{k, &solution.xs[k], k < N_ ? &solution.us[k] : nullptr, nullptr, nodes_.back().get()};
      problem.evaluate(&task, 1, scratch_.get());
      if (nodes_.back()->status != NumericalStatus::Ok) return;
    }
    for (int k = 0; k < N_; ++k)
      if (!linearize(k, multipliers)) return;
    models_[N_].resize(problem.tangentSize(N_), 0, 0);
    ok_ = true;
  }

  bool ok() const { return ok_; }
  std::vector<StageModel>& models() { return models_; }
  const std::vector<ConstraintWeights>& weights() const { return weights_; }

  // Derivative of S^{-1} at the end, from that of S at the beginning, by central differences of fourth order.
  MatrixXd calcReturn(const StateMap& map) const {
    constexpr double kStep = 1e-3;
    const int n = problem_.tangentSize(0);
    const auto calc = [&](int column, double step) {
      const VectorXd dx = step * VectorXd::Unit(n, column);
      VectorXd x(problem_.stateSize()), out(n);
      const IntegrateTask sum{0, nodes_.front().get(), &dx, &x};
      problem_.integrate(&sum, 1, scratch_.get());
      x = map(x);
      const DifferenceTask difference{N_, nodes_.back().get(), &x, &out};
      problem_.difference(&difference, 1, scratch_.get());
      return out;
    };
    MatrixXd by_start(n, n);
    for (int i = 0; i < n; ++i)
      by_start.col(i) =
          (8 * (calc(i, kStep) - calc(i, -kStep)) - calc(i, 2 * kStep) + calc(i, -2 * kStep)) / (12 * kStep);
    return by_start.fullPivLu().inverse();
  }

 private:
  bool linearize(int k, const Multipliers& multipliers) {
    const int rows = problem_.constraintSize(k);
    ConstraintWeights& weights = weights_[k];
    weights = {VectorXd::Zero(rows), VectorXd::Zero(rows)};
    if (static_cast<int>(multipliers.values.size()) > k && multipliers.values[k].size() >= rows) {
      weights.gradient = multipliers.values[k].head(rows);
      weights.hessian = (weights.gradient.array() != 0).select(VectorXd::Constant(rows, multipliers.penalty), 0.0);
    }
    models_[k].resize(problem_.tangentSize(k), problem_.controlSize(k), problem_.tangentSize(k + 1), rows);
    const std::vector<char> all(rows, true);
    LinearizeTask task;
    task.node = k;
    task.at = nodes_[k].get();
    task.next = nodes_[k + 1].get();
    task.rows = &all;
    task.out = &models_[k];
    problem_.linearize(&task, 1, scratch_.get());
    return task.status == NumericalStatus::Ok;
  }

  const ShootingProblem& problem_;
  const int N_;
  std::unique_ptr<ProblemScratch> scratch_;
  std::vector<StageModel> models_;
  std::vector<ConstraintWeights> weights_;  // none of the last node
  std::vector<std::unique_ptr<NodeEvaluation>> nodes_;
  bool ok_ = false;
};

std::vector<ControlBox> listBoxes(const ShootingProblem& problem, const ShootingTrajectory& solution) {
  std::vector<ControlBox> boxes(problem.hasControlBounds() ? solution.us.size() : 0);
  for (size_t k = 0; k < boxes.size(); ++k) {
    const VectorXd& u = solution.us[k];
    boxes[k] = {u, u};
    problem.getControlBounds(static_cast<int>(k), boxes[k].lower, boxes[k].upper);
    boxes[k].lower -= u;
    boxes[k].upper -= u;
  }
  return boxes;
}

}  // namespace

CyclicFeedback calcCyclicFeedback(const ShootingProblem& inner, const StateMap& map, const ShootingTrajectory& solution,
                                  const Multipliers& multipliers) {
  constexpr int kMostCycles = 200;
  constexpr double kChange = 1e-9;  // of the value function, over itself
  CyclicFeedback out;
  CycleModels cycle(inner, solution, multipliers);
  if (!cycle.ok()) return out;
  std::vector<StageModel>& models = cycle.models();
  const int n = inner.tangentSize(0);
  const MatrixXd E = cycle.calcReturn(map);
  // At a solution the value falls along S(x_0) (-) x_N as the multiplier of (3) says.
  if (!multipliers.values.empty() && multipliers.values.back().size() >= n)
    models.back().lx = -multipliers.values.back().tail(n);
  const std::vector<ControlBox> boxes = listBoxes(inner, solution);
  LqSweep sweep;
  MatrixXd value = MatrixXd::Zero(n, n);
  for (int i = 0; i < kMostCycles; ++i) {
    models.back().lxx() = E.transpose() * value * E;
    const LqResult result = sweep.update(models, {}, boxes, cycle.weights());
    if (result.status != NumericalStatus::Ok) {
      out.status = result.status;
      return out;
    }
    const MatrixXd& next = sweep.nodes().front().Vxx;
    const double change = (next - value).norm(), size = next.norm();
    value = next;
    if (change <= kChange * size) break;
  }
  MatrixXd all = MatrixXd::Identity(n, n);
  for (size_t k = 0; k + 1 < models.size(); ++k) {
    const LqSweep::Node& node = sweep.nodes()[k];
    out.gains.push_back(node);
    out.gains.back().x = solution.xs[k];
    all = (models[k].Fx() * all + models[k].Fu() * (node.K * all)).eval();
  }
  const MatrixXd returned = E * all;
  if (!returned.allFinite()) {
    out.status = NumericalStatus::NotFinite;
    return out;
  }
  const Eigen::EigenSolver<MatrixXd> solver(returned, false);
  out.multipliers = solver.eigenvalues();
  std::sort(out.multipliers.begin(), out.multipliers.end(),
            [](const auto& a, const auto& b) { return std::abs(a) > std::abs(b); });
  out.status = NumericalStatus::Ok;
  return out;
}

}  // namespace bielle
