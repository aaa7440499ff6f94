#include "solve/rollout.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "solve/parallel_errors.h"
#include "solve/stopwatch.h"

namespace bielle {

namespace {

// Coordinates about an iterate may be those of two states, as of a linkage in its two configurations. Where segments join, the
// state that arrives is made again from its coordinates if it is farther than this from where the next segment starts.
constexpr double kFar = 0.1;
constexpr double kSame = 1e-6;  // the most that it may then differ from itself

// Whether part of the gap after a stage is to stay open.
bool contracts(const RolloutInput& input, const Trial& trial, int stage) {
  return trial.alpha < 1 && input.open[stage];
}

}  // namespace

void Rollout::resize(const ShootingProblem& problem, int max_segments, int num_trials) {
  N_ = problem.numStages();
  int largest = 0, most_controls = 0;
  for (int k = 0; k <= N_; ++k) largest = std::max(largest, problem.tangentSize(k));
  for (int k = 0; k < N_; ++k) most_controls = std::max(most_controls, problem.controlSize(k));
  trials_.resize(num_trials);
  for (Trial& trial : trials_) {
    trial.nodes.xs.resize(N_ + 1);
    trial.nodes.us.resize(N_);
    trial.deviations.resize(N_ + 1);
    for (int k = 0; k <= N_; ++k) {
      trial.nodes.xs[k].resize(problem.stateSize());
      trial.deviations[k].resize(problem.tangentSize(k));
      if (k < N_) trial.nodes.us[k].resize(problem.controlSize(k));
    }
  }
  const int num_tracks = std::max(max_segments, num_trials), size = problem.batchSize();
  tracks_.resize(num_tracks);
  for (Track& track : tracks_) {
    track.start.setZero(largest);
    track.arrival.setZero(largest);
    track.arrived.setZero(problem.stateSize());
  }
  groups_.resize((num_tracks + size - 1) / size);
  for (Group& group : groups_) {
    group.active.reserve(size);
    group.evaluations.reserve(size);
    group.differences.reserve(size);
    group.states.reserve(size);
    group.moved.reserve(size);
  }
  for (VectorXd* x : {&joint_gap_, &joint_slope_, &shift_}) x->setZero(largest);
  arrivals_.reserve(num_tracks);
  control_.setZero(most_controls);
  seconds_ = search_seconds_ = 0;
}

void Rollout::cut(const RolloutInput& input, double alpha, int segments) {
  num_segments_ = segments;
  rolling_ = false;
  trials_[0].alpha = alpha;
  for (int s = 0; s < segments; ++s) {
    Track& track = tracks_[s];
    track.trial = &trials_[0];
    track.begin = s * N_ / segments;
    track.end = (s + 1) * N_ / segments;
    track.start = alpha * input.dx[track.begin];
    track.arrival.resize(input.dx[track.end].size());
    track.rolling = -1;
  }
  rollOut(input, segments);
  updateGaps(input, segments, trials_[0]);
}

// Eq. (9): carries each segment's start correction into the next.
void Rollout::close(const RolloutInput& input) {
  shift_.setZero();
  for (int s = 1; s < num_segments_; ++s) {
    const int joint = tracks_[s].begin;
    for (int k = tracks_[s - 1].begin; k < joint; ++k) {
      const StageModel& model = input.models[k];
      auto shift = shift_.head(model.lx.size()), next = joint_gap_.head(model.gap.size());
      auto control = control_.head(model.lu.size());
      control.noalias() = input.sweep.nodes()[k].K * shift;
      next.noalias() = model.Fx() * shift;
      next.noalias() += model.Fu() * control;
      shift_.head(next.size()) = next;
    }
    VectorXd& start = tracks_[s].start;
    shift_.head(start.size()) += tracks_[s - 1].arrival - start;
    start += shift_.head(start.size());
  }
  rollOut(input, num_segments_);
  updateGaps(input, num_segments_, trials_[0]);
}

void Rollout::search(const RolloutInput& input, double alpha, int num) {
  rolling_ = trials_.size() > 1;
  for (int i = 0; i < num; ++i, alpha *= 0.5) {
    trials_[i].alpha = alpha;
    Track& track = tracks_[i];
    track.trial = &trials_[i];
    track.begin = 0;
    track.end = N_;
    track.rolling = rolling_ ? 2 * i : -1;
  }
  const double before = seconds_;
  rollOut(input, num);
  search_seconds_ += seconds_ - before;
  for (int i = 0; i < num; ++i) updateGaps(input, 1, trials_[i]);
}

void Rollout::rollOut(const RolloutInput& input, int num_tracks) {
  const int size = input.problem.batchSize(), num_groups = (num_tracks + size - 1) / size;
  ParallelErrors errors;
  std::atomic<int> next{0};
  std::atomic<double> seconds{seconds_};
  input.team.run(std::min(input.threads, num_groups), [&](int thread) {
    const Clock::time_point start = Clock::now();
    for (int g; (g = next.fetch_add(1, std::memory_order_relaxed)) < num_groups;) {
      Group& group = groups_[g];
      group.begin = g * size;
      group.end = std::min(num_tracks, (g + 1) * size);
      group.scratch = input.evaluations.getScratch(thread);
      errors.run(g, [&] { rollOut(input, group); });
    }
    addSeconds(calcSecondsSince(start), seconds);
  });
  seconds_ = seconds;
  errors.rethrow();
  for (Trial& trial : trials_) {
    trial.ok = true;
    trial.cost = trial.merit = 0;
    trial.failed_node = -1;
  }
  for (int t = 0; t < num_tracks; ++t) {
    Trial& trial = *tracks_[t].trial;
    trial.cost += tracks_[t].cost;
    trial.merit += tracks_[t].merit;
    if (trial.ok && tracks_[t].failed_node >= 0) {
      trial.ok = false;
      trial.failed_node = tracks_[t].failed_node;
      trial.failure = tracks_[t].failure;
    }
  }
}

// Runs in parallel: writes nothing at the node where the next segment starts. A track that fails is dropped.
void Rollout::rollOut(const RolloutInput& input, Group& group) {
  startTracks(input, group);
  for (int step = 0; !group.active.empty(); ++step) {
    evaluateNodes(input, step, group);
    findDeviations(input, group);
    contractGaps(input, group);
  }
}

// Eq. (7).
void Rollout::startTracks(const RolloutInput& input, Group& group) {
  group.active.clear();
  group.states.clear();
  group.moved.clear();
  for (int t = group.begin; t < group.end; ++t) {
    Track& track = tracks_[t];
    track.cost = track.merit = 0;
    track.failed_node = -1;
    const int k = track.begin;
    VectorXd& deviation = track.trial->deviations[k];
    if (k == 0) {
      deviation.setZero();
      track.trial->nodes.xs[k] = input.nodes.xs[k];
    } else {
      deviation = track.start;
      group.states.push_back({k, input.evaluations.getIterate()[k].get(), &deviation, &track.trial->nodes.xs[k]});
      group.moved.push_back(&track);
    }
    group.active.push_back(&track);
  }
  integrate(input, group);
}

// Evaluates the node `step` steps after the start of each track, and its cost; tracks that end here become inactive.
void Rollout::evaluateNodes(const RolloutInput& input, int step, Group& group) {
  const auto hasEnded = [&](const Track* track) {
    const int k = track->begin + step;
    return track->failed_node >= 0 || k > track->end || (k == track->end && k < N_);
  };
  group.active.erase(std::remove_if(group.active.begin(), group.active.end(), hasEnded), group.active.end());
  group.evaluations.clear();
  for (Track* track : group.active) {
    Trial& trial = *track->trial;
    const int k = track->begin + step;
    if (k < N_) updateControl(input, k, trial);
    const bool continues = k > track->begin && !contracts(input, trial, k - 1);
    group.evaluations.push_back({k, &trial.nodes.xs[k], k < N_ ? &trial.nodes.us[k] : nullptr,
                                 continues ? getEvaluation(input, *track, k - 1) : nullptr,
                                 getEvaluation(input, *track, k)});
  }
  if (group.active.empty()) return;
  const int count = static_cast<int>(group.active.size());
  input.problem.evaluate(group.evaluations.data(), count, group.scratch);
  for (int i = 0; i < count; ++i) {
    Track& track = *group.active[i];
    const NodeEvaluation& out = *group.evaluations[i].out;
    const int k = group.evaluations[i].node;
    const bool ok = out.status == NumericalStatus::Ok;
    if (ok) track.cost += out.cost;
    if (ok) track.merit += out.cost + input.lagrangian.calc(k, out.constraints);
    if (!ok || !std::isfinite(track.merit) || (k < N_ && !out.x_next.allFinite())) track.fail(k, out.failure);
  }
}

// Eq. (2).
void Rollout::updateControl(const RolloutInput& input, int k, Trial& trial) const {
  const LqSweep::Node& gains = input.sweep.nodes()[k];
  VectorXd& u = trial.nodes.us[k];
  u = input.nodes.us[k] + trial.alpha * gains.k;
  u.noalias() += gains.K * trial.deviations[k];
  if (!input.bounds.empty()) u = u.cwiseMax(input.bounds[k].lower).cwiseMin(input.bounds[k].upper);
}

// Next states f as deviations from the iterate: the first term of Eq. (3).
void Rollout::findDeviations(const RolloutInput& input, Group& group) {
  group.differences.clear();
  group.moved.clear();
  for (size_t i = 0; i < group.active.size(); ++i) {
    Track& track = *group.active[i];
    Trial& trial = *track.trial;
    const int k = group.evaluations[i].node, next = k + 1;
    const NodeEvaluation& out = *group.evaluations[i].out;
    if (track.failed_node >= 0 || k == N_) continue;
    const bool at_joint = next == track.end && next < N_, contracted = contracts(input, trial, k);
    if (!at_joint && !contracted) trial.nodes.xs[next] = out.x_next;
    if (next == N_ && !contracted) continue;  // not needed
    group.differences.push_back({next, input.evaluations.getIterate()[next].get(), &out.x_next,
                                 at_joint ? &track.arrival : &trial.deviations[next]});
    group.moved.push_back(&track);
  }
  if (group.moved.empty()) return;
  input.problem.difference(group.differences.data(), static_cast<int>(group.differences.size()), group.scratch);
  for (size_t i = 0; i < group.moved.size(); ++i)
    if (!group.differences[i].dx->allFinite()) group.moved[i]->fail(group.differences[i].node, {});
}

// The rest of Eq. (3), for steps that leave part of the gaps open.
void Rollout::contractGaps(const RolloutInput& input, Group& group) {
  group.states.clear();
  group.moved.clear();
  for (size_t i = 0; i < group.active.size(); ++i) {
    Track& track = *group.active[i];
    Trial& trial = *track.trial;
    const int k = group.evaluations[i].node, next = k + 1;
    const bool at_joint = next == track.end && next < N_;
    if (track.failed_node >= 0 || k == N_ || at_joint || !contracts(input, trial, k)) continue;
    trial.deviations[next] += (trial.alpha - 1) * input.models[k].gap;
    group.states.push_back(
        {next, input.evaluations.getIterate()[next].get(), &trial.deviations[next], &trial.nodes.xs[next]});
    group.moved.push_back(&track);
  }
  integrate(input, group);
}

void Rollout::integrate(const RolloutInput& input, Group& group) {
  if (group.moved.empty()) return;
  input.problem.integrate(group.states.data(), static_cast<int>(group.states.size()), group.scratch);
  for (size_t i = 0; i < group.moved.size(); ++i)
    if (!group.states[i].x_out->allFinite()) group.moved[i]->fail(group.states[i].node, {});
}

NodeEvaluation* Rollout::getEvaluation(const RolloutInput& input, const Track& track, int node) const {
  if (track.rolling < 0) return input.evaluations.trial()[node].get();
  return input.evaluations.rolling()[track.rolling + node % 2].get();
}

// Updates the remainders of the old gaps, the gaps where segments join, and Eq. (8).
void Rollout::updateGaps(const RolloutInput& input, int num_tracks, Trial& trial) {
  trial.gap_sum = trial.gap_max = trial.closing_cost = 0;
  if (!trial.ok) return;
  int s = 0;
  for (int k = 0; k < N_; ++k) {
    const VectorXd& gap = input.models[k].gap;
    const double rest = contracts(input, trial, k) ? 1 - trial.alpha : 0;
    if (s + 1 < num_tracks && k + 1 == tracks_[s].end) {
      addJointGap(input, rest, tracks_[s], tracks_[s + 1], trial);
      ++s;
    } else if (rest > 0) {
      trial.gap_sum += rest * gap.norm();
      trial.gap_max = std::max(trial.gap_max, rest * gap.norm());
    }
  }
  trial.ok = std::isfinite(trial.merit) && std::isfinite(trial.gap_sum) && std::isfinite(trial.closing_cost);
  if (trial.ok) checkArrivals(input, num_tracks, trial);
}

// The gap between two segments, and its contribution to Eq. (8).
void Rollout::addJointGap(const RolloutInput& input, double rest, const Track& before, const Track& after,
                          Trial& trial) {
  if (after.start.size() == 0) return;
  const LqSweep::Node& value = input.sweep.nodes()[after.begin];
  auto gap = joint_gap_.head(after.start.size()), slope = joint_slope_.head(after.start.size());
  gap = before.arrival - after.start;
  trial.gap_sum += gap.norm();
  trial.gap_max = std::max(trial.gap_max, gap.norm());
  gap -= rest * input.models[before.end - 1].gap;
  slope = value.Vx;
  slope.noalias() += value.Vxx * after.start;
  trial.closing_cost += slope.dot(gap);
  slope.noalias() = value.Vxx * gap;
  trial.closing_cost += 0.5 * slope.dot(gap);
}

void Rollout::checkArrivals(const RolloutInput& input, int num_tracks, Trial& trial) {
  arrivals_.clear();
  for (int s = 0; s + 1 < num_tracks; ++s) {
    Track& track = tracks_[s];
    const VectorXd& arrived = getEvaluation(input, track, track.end - 1)->x_next;
    if ((arrived - trial.nodes.xs[track.end]).lpNorm<Eigen::Infinity>() <= kFar) continue;
    arrivals_.push_back({track.end, input.evaluations.getIterate()[track.end].get(), &track.arrival, &track.arrived});
  }
  if (arrivals_.empty()) return;
  const size_t size = static_cast<size_t>(input.problem.batchSize());
  for (size_t first = 0; first < arrivals_.size(); first += size)
    input.problem.integrate(&arrivals_[first], static_cast<int>(std::min(size, arrivals_.size() - first)),
                            input.evaluations.getScratch(0));
  for (const IntegrateTask& task : arrivals_) {
    const auto& arrived = input.evaluations.trial()[task.node - 1]->x_next.array();
    const auto& same = task.x_out->array();
    // Entries up to their signs: quaternions may have either.
    if ((arrived - same).abs().min((arrived + same).abs()).maxCoeff() <= kSame) continue;
    trial.ok = false;
    trial.failed_node = task.node;
    trial.failure = "a step in segments leads beyond the range of the coordinates about the iterate";
  }
}

}  // namespace bielle
