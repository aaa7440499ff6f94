#include "rollout.h"

#include <chrono>
#include <cmath>

namespace bielle {

void Rollout::resize(const ShootingProblem& problem, int max_segments) {
  const int N = problem.numStages();
  trial_.xs.assign(N + 1, VectorXd::Zero(problem.stateSize()));
  trial_.us.resize(N);
  deviations_.resize(N + 1);
  int largest = 0;
  for (int k = 0; k <= N; ++k) {
    deviations_[k].setZero(problem.tangentSize(k));
    largest = std::max(largest, problem.tangentSize(k));
    if (k < N) trial_.us[k].setZero(problem.controlSize(k));
  }
  segments_.resize(max_segments);
  for (Segment& segment : segments_) segment.end_state.setZero(problem.stateSize());
  joint_gap_.setZero(largest);
  joint_slope_.setZero(largest);
  seconds_ = 0;
}

bool Rollout::update(const RolloutInput& input, const RolloutOptions& options) {
  const int N = input.problem.numStages(), num = options.segments;
#pragma omp parallel for num_threads(std::min(options.threads, num)) schedule(dynamic)
  for (int s = 0; s < num; ++s) {
    const auto start = std::chrono::steady_clock::now();
    Segment& segment = segments_[s];
    segment.begin = s * N / num;
    segment.end = (s + 1) * N / num;
    try {
      segment.ok = rollOut(input, options.alpha, segment);
    } catch (...) {  // a problem that throws on a wild trial has failed on it, no more
      segment.ok = false;
    }
    segment.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  cost_ = 0;
  bool ok = true;
  for (int s = 0; s < num; ++s) {
    cost_ += segments_[s].cost;
    seconds_ += segments_[s].seconds;
    ok = ok && segments_[s].ok;
  }
  return ok && std::isfinite(cost_) && updateGaps(input, options);
}

// Eqs. (2), (3) and (7). Runs in parallel: of the node where the next segment starts, nothing is touched.
bool Rollout::rollOut(const RolloutInput& input, double alpha, Segment& segment) {
  ShootingProblem& problem = input.problem;
  const int N = problem.numStages();
  const auto& [xs, us] = input.nodes;
  const bool contract = alpha < 1 && !input.feasible;
  auto& dx = deviations_;
  double cost = 0;
  segment.cost = 0;
  dx[segment.begin].setZero();
  trial_.xs[segment.begin] = xs[segment.begin];
  if (segment.begin > 0) {
    dx[segment.begin] = alpha * input.dx[segment.begin];
    problem.integrate(segment.begin, xs[segment.begin], dx[segment.begin], trial_.xs[segment.begin]);
    if (!trial_.xs[segment.begin].allFinite()) return false;
  }
  for (int k = segment.begin; k < segment.end; ++k) {
    const LqSweep::Node& gains = input.sweep.getNodes()[k];
    VectorXd& u = trial_.us[k];
    u = us[k] + alpha * gains.k;
    u.noalias() += gains.K * dx[k];
    if (!input.bounds.empty()) u = u.cwiseMax(input.bounds[k].lower).cwiseMin(input.bounds[k].upper);
    const bool at_joint = k + 1 == segment.end && k + 1 < N;
    VectorXd& next = at_joint ? segment.end_state : trial_.xs[k + 1];
    const bool continues = k > segment.begin && !contract;
    const StepStatus status =
        continues ? problem.continueStep(k, trial_.xs[k], u, next, cost) : problem.step(k, trial_.xs[k], u, next, cost);
    if (status != StepStatus::Ok) return false;
    segment.cost += cost;
    if (!std::isfinite(segment.cost) || !next.allFinite()) return false;
    if (at_joint) return true;
    problem.difference(k + 1, xs[k + 1], next, dx[k + 1]);
    if (!contract) continue;
    dx[k + 1] += (alpha - 1) * input.models[k].gap;
    problem.integrate(k + 1, xs[k + 1], dx[k + 1], next);
  }
  if (problem.calcTerminalCost(trial_.xs[N], cost) != StepStatus::Ok) return false;
  segment.cost += cost;
  return true;
}

// What is left of the old gaps, the gaps at the joints, and Eq. (8).
bool Rollout::updateGaps(const RolloutInput& input, const RolloutOptions& options) {
  const int N = input.problem.numStages();
  const double rest = input.feasible ? 0 : 1 - options.alpha;
  gap_sum_ = gap_max_ = closing_cost_ = 0;
  int s = 0;
  for (int k = 0; k < N; ++k) {
    const VectorXd& gap = input.models[k].gap;
    const bool at_joint = k + 1 == segments_[s].end && k + 1 < N;
    if (!at_joint) {
      if (rest == 0 || gap.size() == 0) continue;
      gap_sum_ += rest * gap.lpNorm<1>();
      gap_max_ = std::max(gap_max_, rest * gap.lpNorm<Eigen::Infinity>());
      continue;
    }
    auto opened = joint_gap_.head(gap.size());
    auto slope = joint_slope_.head(gap.size());
    const LqSweep::Node& value = input.sweep.getNodes()[k + 1];
    input.problem.difference(k + 1, input.nodes.xs[k + 1], segments_[s++].end_state, opened);
    opened -= deviations_[k + 1];
    gap_sum_ += opened.lpNorm<1>();
    gap_max_ = std::max(gap_max_, opened.size() > 0 ? opened.lpNorm<Eigen::Infinity>() : 0.0);
    opened -= rest * gap;
    slope = value.Vx;
    slope.noalias() += value.Vxx * deviations_[k + 1];
    closing_cost_ += slope.dot(opened);
    slope.noalias() = value.Vxx * opened;
    closing_cost_ += 0.5 * slope.dot(opened);
  }
  return std::isfinite(gap_sum_) && std::isfinite(closing_cost_);
}

}  // namespace bielle
