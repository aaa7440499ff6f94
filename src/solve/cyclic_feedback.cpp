#include <algorithm>
#include <array>
#include <optional>

#include "math/decompositions.h"
#include "solve/lq_sweep.h"
#include "solve/periodic_problem.h"

namespace bielle {
namespace {

// Of constraints that hold at a solution as equations.
ConstraintWeights makeWeights(const Multipliers& multipliers, size_t node, int rows) {
  ConstraintWeights weights{VectorXd::Zero(rows), VectorXd::Zero(rows)};
  if (multipliers.values.size() > node && multipliers.values[node].size() >= rows) {
    weights.gradient = multipliers.values[node].head(rows);
    weights.hessian = (weights.gradient.array() != 0).select(VectorXd::Constant(rows, multipliers.penalty), 0.0);
  }
  return weights;
}

// About a solution.
struct CycleModels {
  std::vector<StageModel> nodes;           // the last one is zero
  std::vector<ConstraintWeights> weights;  // none of the last one
  MatrixXd E;                              // derivative of S^{-1} at the end
};

// None if a node cannot be evaluated or linearized.
std::optional<CycleModels> makeModels(const ShootingProblem& problem, const StateMap& map,
                                      const ShootingTrajectory& solution, const Multipliers& multipliers) {
  const int N = problem.numStages(), n = problem.tangentSize(0);
  std::array<NodeEvaluator, 2> evaluators{NodeEvaluator(problem), NodeEvaluator(problem)};  // of even, odd nodes
  const auto evaluate = [&](NodeEvaluator& evaluator, size_t k) {
    const VectorXd u = k < solution.us.size() ? solution.us[k] : VectorXd();
    return evaluator.evaluate(static_cast<int>(k), solution.xs[k], u).status == NumericalStatus::Ok;
  };
  CycleModels out{std::vector<StageModel>(solution.xs.size()), std::vector<ConstraintWeights>(solution.xs.size()), {}};
  out.nodes.back().resize(problem.tangentSize(N), 0, 0);
  for (size_t k = solution.xs.size(); k-- > 0;) {
    NodeEvaluator &at = evaluators[k % 2], &next = evaluators[(k + 1) % 2];
    if (!evaluate(at, k)) return {};
    if (k == solution.us.size()) continue;
    out.weights[k] = makeWeights(multipliers, k, problem.constraintSize(static_cast<int>(k)));
    if (at.linearize(&next.evaluation(), out.nodes[k]) != NumericalStatus::Ok) return {};
  }
  evaluate(evaluators[1], solution.us.size());
  out.E = differentiateMap(map, n, evaluators[0], evaluators[1]).fullPivLu().inverse();
  return out;
}

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

MatrixXd differentiateMap(const StateMap& map, int size, NodeEvaluator& from, NodeEvaluator& to) {
  constexpr double kStep = 1e-3;
  const auto calc = [&](int i, double step) {
    return to.difference(map(from.integrate(step * VectorXd::Unit(size, i))));
  };
  MatrixXd out(size, size);
  for (int i = 0; i < size; ++i)
    out.col(i) = (8 * (calc(i, kStep) - calc(i, -kStep)) - calc(i, 2 * kStep) + calc(i, -2 * kStep)) / (12 * kStep);
  return out;
}

CyclicFeedback calcCyclicFeedback(const ShootingProblem& inner, const StateMap& map, const ShootingTrajectory& solution,
                                  const Multipliers& multipliers) {
  constexpr int kMostCycles = 200;
  constexpr double kChange = 1e-9;  // of the value function, over itself
  CyclicFeedback out;
  std::optional<CycleModels> cycle = makeModels(inner, map, solution, multipliers);
  if (!cycle) return out;
  std::vector<StageModel>& models = cycle->nodes;
  const int n = inner.tangentSize(0);
  const MatrixXd& E = cycle->E;
  // At a solution the value falls along S(x_0) (-) x_N as the multiplier of (3) says.
  if (!multipliers.values.empty() && multipliers.values.back().size() >= n)
    models.back().lx = -multipliers.values.back().tail(n);
  const std::vector<ControlBox> boxes = listBoxes(inner, solution);
  LqSweep sweep;
  MatrixXd value = MatrixXd::Zero(n, n);
  for (int i = 0; i < kMostCycles; ++i) {
    models.back().lxx() = E.transpose() * value * E;
    const LqResult result = sweep.update(models, {}, boxes, cycle->weights);
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
