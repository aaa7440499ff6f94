#include "solve/node_evaluations.h"

#include <atomic>
#include <stdexcept>

#include "solve/parallel_errors.h"
#include "solve/stopwatch.h"

namespace bielle {

namespace {

// Sizes evaluation k for node k, so that no iteration allocates.
void grow(const ShootingProblem& problem, int size, EvaluationList& list) {
  while (static_cast<int>(list.size()) < size) {
    const int node = std::min(static_cast<int>(list.size()), problem.numStages() - 1);
    list.push_back(problem.makeEvaluation());
    list.back()->x.setZero(problem.stateSize());
    list.back()->x_next.setZero(problem.stateSize());
    list.back()->u.setZero(problem.controlSize(node));
  }
}

}  // namespace

void NodeEvaluations::resize(const ShootingProblem& problem, int num_rolling, int threads) {
  if (problem_ != problem.id()) *this = NodeEvaluations();
  problem_ = problem.id();
  const int num_nodes = problem.numStages() + 1;
  grow(problem, num_nodes, iterate_);
  grow(problem, num_nodes, trial_);
  grow(problem, num_rolling, rolling_);
  while (static_cast<int>(scratch_.size()) < threads) scratch_.push_back(problem.makeScratch());
  tasks_.reserve(num_nodes);
  if (!advanced_ || static_cast<int>(fresh_.size()) != num_nodes) fresh_.assign(num_nodes, false);
  advanced_ = false;
  seconds_ = 0;
}

int NodeEvaluations::update(const ShootingProblem& problem, const ShootingTrajectory& nodes, int first, Team& team,
                            int threads) {
  const int num_nodes = static_cast<int>(fresh_.size());
  tasks_.clear();
  for (int k = first; k < num_nodes; ++k) {
    const VectorXd *x = &nodes.xs[k], *u = k + 1 < num_nodes ? &nodes.us[k] : nullptr;
    if (!fresh_[k]) {
      tasks_.push_back({k, x, u, nullptr, iterate_[k].get()});
    } else if (iterate_[k]->x != *x || (u && iterate_[k]->u != *u)) {
      throw std::invalid_argument("FDDP: node " + std::to_string(k) + " changed after the horizon advanced");
    }
  }
  std::fill(fresh_.begin() + first, fresh_.end(), true);
  swapped_ = false;
  const int num_tasks = static_cast<int>(tasks_.size()), size = problem.batchSize();
  const int num_batches = (num_tasks + size - 1) / size;
  ParallelErrors errors;
  std::atomic<int> next{0};
  std::atomic<double> seconds{seconds_};
  team.run(std::min(threads, num_batches), [&](int thread) {
    const Clock::time_point start = Clock::now();
    for (int batch; (batch = next.fetch_add(1, std::memory_order_relaxed)) < num_batches;) {
      const int begin = batch * size, count = std::min(size, num_tasks - begin);
      errors.run(batch, [&] { problem.evaluate(&tasks_[begin], count, getScratch(thread)); });
    }
    addSeconds(calcSecondsSince(start), seconds);
  });
  errors.rethrow();
  seconds_ = seconds;
  const auto isOk = [](const std::unique_ptr<NodeEvaluation>& e) { return e->status == NumericalStatus::Ok; };
  const auto end = iterate_.begin() + num_nodes, failed = std::find_if_not(iterate_.begin() + first, end, isOk);
  return failed == end ? -1 : static_cast<int>(failed - iterate_.begin());
}

void NodeEvaluations::move(const std::vector<NodeSource>& sources) {
  const size_t num_nodes = fresh_.size();
  if (num_nodes == 0) return;  // no solve so far
  if (sources.size() != num_nodes) throw std::invalid_argument("Receding: one source per node is needed");
  moved_.resize(iterate_.size());
  moved_fresh_.assign(num_nodes, false);
  for (size_t k = 0; k < num_nodes; ++k) {
    if (!sources[k].same) continue;
    std::unique_ptr<NodeEvaluation>& from = iterate_.at(sources[k].node);
    if (!from)
      throw std::invalid_argument("Receding: two nodes are the same as node " + std::to_string(sources[k].node));
    moved_[k] = std::move(from);
    moved_fresh_[k] = fresh_[sources[k].node];
  }
  auto left = iterate_.begin();  // memory for the others
  for (std::unique_ptr<NodeEvaluation>& to : moved_) {
    if (to) continue;
    while (!*left) ++left;
    to = std::move(*left);
  }
  iterate_.swap(moved_);
  fresh_.swap(moved_fresh_);
  advanced_ = true;
}

void NodeEvaluations::exchange(size_t node, std::unique_ptr<NodeEvaluation>& other) {
  iterate_.at(node).swap(other);
  fresh_.at(node) = false;
}

void NodeEvaluations::swapTrial() {
  iterate_.swap(trial_);
  swapped_ = true;
  std::fill(fresh_.begin(), fresh_.end(), true);
}

}  // namespace bielle
