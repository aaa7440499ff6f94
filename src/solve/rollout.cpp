#include "rollout.h"

#include <algorithm>
#include <cmath>

#include "stopwatch.h"

namespace bielle {

void Rollout::resize(const ShootingProblem& problem, int max_segments) {
  const int N = problem.numStages();
  trial_.xs.assign(N + 1, VectorXd::Zero(problem.stateSize()));
  trial_.us.resize(N);
  deviations_.resize(N + 1);
  int largest = 0, most_controls = 0;
  for (int k = 0; k <= N; ++k) {
    deviations_[k].setZero(problem.tangentSize(k));
    largest = std::max(largest, problem.tangentSize(k));
    if (k == N) continue;
    trial_.us[k].setZero(problem.controlSize(k));
    most_controls = std::max(most_controls, problem.controlSize(k));
  }
  segments_.resize(max_segments);
  for (Segment& segment : segments_) {
    segment.start.setZero(largest);
    segment.end_state.setZero(problem.stateSize());
  }
  groups_.resize((max_segments + problem.getBatchSize() - 1) / problem.getBatchSize());
  for (Group& group : groups_) {
    group.tasks.reserve(problem.getBatchSize());
    group.starts.reserve(problem.getBatchSize());
  }
  for (VectorXd* x : {&joint_gap_, &joint_slope_, &shift_}) x->setZero(largest);
  control_.setZero(most_controls);
  seconds_ = 0;
}

bool Rollout::update(const RolloutInput& input, const RolloutOptions& options) {
  const int N = input.problem.numStages(), num = options.segments;
  for (int s = 0; s < num; ++s) {
    segments_[s].begin = s * N / num;
    segments_[s].end = (s + 1) * N / num;
    segments_[s].start = options.alpha * input.dx[segments_[s].begin];
  }
  return rollOut(input, options);
}

// Eq. (9), with the shift of the starts from segment to segment.
bool Rollout::close(const RolloutInput& input, const RolloutOptions& options) {
  shift_.setZero();
  for (int s = 1; s < options.segments; ++s) {
    const int joint = segments_[s].begin;
    for (int k = segments_[s - 1].begin; k < joint; ++k) {
      const StageModel& model = input.models[k];
      auto shift = shift_.head(model.lx.size()), next = joint_gap_.head(model.gap.size());
      auto control = control_.head(model.lu.size());
      control.noalias() = input.sweep.getNodes()[k].K * shift;
      next.noalias() = model.Fx() * shift;
      next.noalias() += model.Fu() * control;
      shift_.head(next.size()) = next;
    }
    VectorXd& start = segments_[s].start;
    auto gap = joint_gap_.head(start.size());
    input.problem.difference(joint, input.nodes.xs[joint], segments_[s - 1].end_state, gap);
    shift_.head(start.size()) += gap - start;
    start += shift_.head(start.size());
  }
  return rollOut(input, options);
}

bool Rollout::rollOut(const RolloutInput& input, const RolloutOptions& options) {
  const int num = options.segments, size = input.problem.getBatchSize(), num_groups = (num + size - 1) / size;
#pragma omp parallel for num_threads(std::min(options.threads, num_groups)) schedule(dynamic)
  for (int g = 0; g < num_groups; ++g) {
    const Clock::time_point start = Clock::now();
    Group& group = groups_[g];
    group.begin = g * size;
    group.end = std::min(num, (g + 1) * size);
    try {
      group.ok = rollOut(input, options.alpha, group);
    } catch (...) {  // a problem that throws on a wild trial has failed on it, no more
      group.ok = false;
    }
    group.seconds = calcSecondsSince(start);
  }
  cost_ = 0;
  bool ok = true;
  for (int s = 0; s < num; ++s) cost_ += segments_[s].cost;
  for (int g = 0; g < num_groups; ++g) {
    seconds_ += groups_[g].seconds;
    ok = ok && groups_[g].ok;
  }
  return ok && std::isfinite(cost_) && updateGaps(input, options);
}

// Eqs. (2), (3) and (7). Runs in parallel: of the node where the next segment starts, nothing is touched.
bool Rollout::rollOut(const RolloutInput& input, double alpha, Group& group) {
  if (!startSegments(input, group)) return false;
  int longest = 0;
  for (int s = group.begin; s < group.end; ++s) longest = std::max(longest, segments_[s].end - segments_[s].begin);
  for (int i = 0; i < longest; ++i) {
    group.tasks.clear();
    for (int s = group.begin; s < group.end; ++s) {
      const int k = segments_[s].begin + i;
      if (k >= segments_[s].end) continue;
      group.tasks.emplace_back();
      prepareTask(input, alpha, k, segments_[s], group.tasks.back());
    }
    input.problem.stepStages(group.tasks);
    auto task = group.tasks.begin();
    for (int s = group.begin; s < group.end; ++s)
      if (segments_[s].begin + i < segments_[s].end && !finishTask(input, alpha, *task++, segments_[s])) return false;
  }
  return true;
}

bool Rollout::startSegments(const RolloutInput& input, Group& group) {
  group.starts.clear();
  for (int s = group.begin; s < group.end; ++s) {
    const int k = segments_[s].begin;
    segments_[s].cost = 0;
    if (k == 0) {
      deviations_[k].setZero();
      trial_.xs[k] = input.nodes.xs[k];
    } else {
      deviations_[k] = segments_[s].start;
      group.starts.push_back({k, &input.nodes.xs[k], &deviations_[k], &trial_.xs[k]});
    }
  }
  input.problem.integrateNodes(group.starts);
  return std::all_of(group.starts.begin(), group.starts.end(),
                     [](const IntegrateTask& start) { return start.x_out->allFinite(); });
}

// Stage k of a segment, with the control of Eq. (2).
void Rollout::prepareTask(const RolloutInput& input, double alpha, int k, Segment& segment, StepTask& task) {
  const LqSweep::Node& gains = input.sweep.getNodes()[k];
  VectorXd& u = trial_.us[k];
  u = input.nodes.us[k] + alpha * gains.k;
  u.noalias() += gains.K * deviations_[k];
  if (!input.bounds.empty()) u = u.cwiseMax(input.bounds[k].lower).cwiseMin(input.bounds[k].upper);
  task.stage = k;
  task.continues = k > segment.begin && !contracts(input, alpha);
  task.x = &trial_.xs[k];
  task.u = &u;
  if (isJoint(segment, k + 1)) {
    task.x_next = &segment.end_state;
  } else {
    task.x_next = &trial_.xs[k + 1];
    task.origin = &input.nodes.xs[k + 1];
    task.deviation = &deviations_[k + 1];
  }
}

// Eq. (3) behind a step; at the end of the horizon its cost.
bool Rollout::finishTask(const RolloutInput& input, double alpha, const StepTask& task, Segment& segment) {
  ShootingProblem& problem = input.problem;
  const int next = task.stage + 1, N = problem.numStages();
  if (task.status != StepStatus::Ok) return false;
  segment.cost += task.cost;
  if (!std::isfinite(segment.cost) || !task.x_next->allFinite()) return false;
  if (isJoint(segment, next)) return true;
  if (contracts(input, alpha)) {
    deviations_[next] += (alpha - 1) * input.models[task.stage].gap;
    problem.integrate(next, input.nodes.xs[next], deviations_[next], *task.x_next);
  }
  if (next < N) return true;
  double cost = 0;
  if (problem.calcTerminalCost(*task.x_next, cost) != StepStatus::Ok) return false;
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
    const bool at_joint = isJoint(segments_[s], k + 1);
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
