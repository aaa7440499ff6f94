#include "solve/backward_pass.h"

#include <algorithm>
#include <cmath>

#include "solve/parallel_errors.h"
#include "solve/stopwatch.h"

namespace bielle {

void BackwardPass::resize(const ShootingProblem& problem) {
  const int N = problem.numStages();
  models_.resize(N + 1);
  tasks_.reserve(N + 1);
  rows_.resize(N + 1);
  failures_.resize(N + 1);
  if (linearized_.size() != models_.size()) linearized_ = std::vector<std::atomic<bool>>(N + 1);
  for (int k = 0; k <= N; ++k) {
    const int ndx = problem.tangentSize(k), nu = k < N ? problem.controlSize(k) : 0;
    const int ndx_next = k < N ? problem.tangentSize(k + 1) : 0;
    if (!models_[k].hasSizes(ndx, nu, ndx_next)) models_[k].resize(ndx, nu, ndx_next);
    models_[k].setRows(problem.constraintSize(k));
  }
  num_linearized_ = 0;
  linearize_seconds_ = sweep_seconds_ = 0;
}

int BackwardPass::update(const BackwardInput& input) {
  start(input);
  updateNodes(input, 0, input.problem.numStages() + 1);
  return findFailure(input.problem);
}

void BackwardPass::prepare(const BackwardInput& input) {
  start(input);
  updateNodes(input, 1, input.problem.numStages() + 1);
}

int BackwardPass::sweepAgain(const BackwardInput& input) {
  tasks_.clear();
  for (int k = 0; k <= input.problem.numStages(); ++k) {
    if (input.lagrangian.addWeighted(k, rows_[k])) addTask(input, k);
  }
  startSweep(input);
  updateNodes(input, 0, static_cast<int>(tasks_.size()));
  return findFailure(input.problem);
}

int BackwardPass::finish(const BackwardInput& input) {
  findRows(input, 0);
  updateNodes(input, 0, 1);
  return findFailure(input.problem);
}

void BackwardPass::start(const BackwardInput& input) {
  tasks_.clear();
  for (int k = 0; k <= input.problem.numStages(); ++k) {
    findRows(input, k);
    addTask(input, k);
  }
  startSweep(input);
}

void BackwardPass::findRows(const BackwardInput& input, int k) {
  rows_[k].assign(input.problem.constraintSize(k), false);
  input.lagrangian.addWeighted(k, rows_[k]);
}

void BackwardPass::addTask(const BackwardInput& input, int k) {
  const EvaluationList& nodes = input.evaluations.getIterate();
  tasks_.emplace_back();
  LinearizeTask& task = tasks_.back();
  task.node = k;
  task.at = nodes[k].get();
  task.next = k < input.problem.numStages() ? nodes[k + 1].get() : nullptr;
  task.rows = &rows_[k];
  task.out = &models_[k];
  linearized_[k].store(false, std::memory_order_relaxed);
}

void BackwardPass::startSweep(const BackwardInput& input) {
  sweep_.start(models_, input.regularization);
  sweep_node_ = input.problem.numStages();
}

// Tasks in batches, independent of the threads, from the last on.
void BackwardPass::updateNodes(const BackwardInput& input, int begin, int end) {
  const int size = input.problem.batchSize(), num_batches = (end - begin + size - 1) / size;
  std::atomic<int> next{num_batches - 1};
  std::atomic_flag sweeping = ATOMIC_FLAG_INIT;
  ParallelErrors errors;
  std::atomic<double> linearize_seconds{linearize_seconds_}, sweep_seconds{sweep_seconds_};
  input.team.run(std::min(input.threads, num_batches), [&](int thread) {
    for (int i; (i = next.fetch_sub(1, std::memory_order_relaxed)) >= 0;) {
      const Clock::time_point start = Clock::now();
      const int first = begin + i * size;
      errors.run(i, [&] { linearize(input, thread, first, std::min(end, first + size)); });
      addSeconds(calcSecondsSince(start), linearize_seconds);
      if (sweeping.test_and_set(std::memory_order_acquire)) continue;
      const Clock::time_point start_sweep = Clock::now();
      sweepReadyNodes(input);
      addSeconds(calcSecondsSince(start_sweep), sweep_seconds);
      sweeping.clear(std::memory_order_release);
    }
  });
  errors.rethrow();
  num_linearized_ += end - begin;
  const Clock::time_point start_rest = Clock::now();
  sweepReadyNodes(input);
  linearize_seconds_ = linearize_seconds;
  sweep_seconds_ = sweep_seconds + calcSecondsSince(start_rest);
}

int BackwardPass::findFailure(const ShootingProblem& problem) const {
  for (int k = 0; k <= problem.numStages(); ++k)
    if (!failures_[k].empty()) return k;
  return -1;
}

// Stops at the first node that could not be linearized or swept.
void BackwardPass::sweepReadyNodes(const BackwardInput& input) {
  const int N = input.problem.numStages();
  while (sweep_node_ >= 0 && sweep_.result().status == NumericalStatus::Ok &&
         linearized_[sweep_node_].load(std::memory_order_acquire)) {
    const ControlBox* box = sweep_node_ < N && !input.boxes.empty() ? &input.boxes[sweep_node_] : nullptr;
    sweep_.updateNode(sweep_node_, models_[sweep_node_], box, input.lagrangian.getWeights(sweep_node_));
    --sweep_node_;
  }
}

// Runs in parallel: writes only to entries of its own nodes.
void BackwardPass::linearize(const BackwardInput& input, int thread, int begin, int end) {
  for (int i = begin; i < end; ++i) tasks_[i].status = NumericalStatus::Failed;
  input.problem.linearize(&tasks_[begin], end - begin, input.evaluations.getScratch(thread));
  for (int i = begin; i < end; ++i) {
    const int k = tasks_[i].node;
    failures_[k] = checkModel(input.problem, tasks_[i]);
    if (failures_[k].empty()) linearized_[k].store(true, std::memory_order_release);
  }
}

// Describes what is wrong with the model of a node; empty if nothing is.
std::string BackwardPass::checkModel(const ShootingProblem& problem, const LinearizeTask& task) const {
  const StageModel& model = *task.out;
  if (task.status != NumericalStatus::Ok)
    return "the problem could not be linearized" + (task.failure.empty() ? "" : ": " + task.failure);
  const int k = task.node, N = problem.numStages(), nu = k < N ? problem.controlSize(k) : 0;
  if (!model.hasSizes(problem.tangentSize(k), nu, k < N ? problem.tangentSize(k + 1) : 0))
    return "the sizes of the quadratic model differ from those of the problem";
  if (!std::isfinite(model.cost) || !model.gap.allFinite()) return "the cost or the gap is not finite";
  return {};
}

int BackwardPass::findInfiniteRow(int node) const {
  for (Eigen::Index row = 0; row < models_[node].Ct().cols(); ++row)
    if (rows_[node][row] && !models_[node].Ct().col(row).allFinite()) return static_cast<int>(row);
  return -1;
}

}  // namespace bielle
