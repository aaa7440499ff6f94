#include "solve/backward_pass.h"

#include <algorithm>
#include <cmath>

#include "solve/parallel_errors.h"
#include "solve/stopwatch.h"

namespace bielle {

void BackwardPass::resize(const ShootingProblem& problem) {
  const int N = problem.numStages();
  models_.resize(N + 1);
  tasks_.resize(N + 1);
  failures_.resize(N + 1);
  if (linearized_.size() != models_.size()) linearized_ = std::vector<std::atomic<bool>>(N + 1);
  for (int k = 0; k <= N; ++k) {
    const int ndx = problem.tangentSize(k), nu = k < N ? problem.controlSize(k) : 0;
    const int ndx_next = k < N ? problem.tangentSize(k + 1) : 0;
    if (!models_[k].hasSizes(ndx, nu, ndx_next)) models_[k].resize(ndx, nu, ndx_next);
  }
  hessians_.resize(models_);
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

int BackwardPass::finish(const BackwardInput& input) {
  updateNodes(input, 0, 1);
  return findFailure(input.problem);
}

void BackwardPass::start(const BackwardInput& input) {
  const int N = input.problem.numStages();
  const EvaluationList& nodes = input.evaluations.getIterate();
  for (int k = 0; k <= N; ++k) {
    hessians_.takeBack(models_[k]);  // if the last sweep stopped halfway
    tasks_[k].node = k;
    tasks_[k].at = nodes[k].get();
    tasks_[k].next = k < N ? nodes[k + 1].get() : nullptr;
    tasks_[k].weights = input.lagrangian.getWeights(k);
    tasks_[k].out = &models_[k];
    linearized_[k].store(false, std::memory_order_relaxed);
  }
  sweep_.start(models_, input.regularization);
  sweep_node_ = N;
}

// In batches, independent of the threads, from the last on.
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
    StageModel& model = models_[sweep_node_];
    sweep_.updateNode(sweep_node_, model,
                      sweep_node_ < N && !input.boxes.empty() ? &input.boxes[sweep_node_] : nullptr);
    hessians_.takeBack(model);
    --sweep_node_;
  }
}

// Runs in parallel: writes only to entries of its own nodes.
void BackwardPass::linearize(const BackwardInput& input, int thread, int begin, int end) {
  for (int k = begin; k < end; ++k) {
    hessians_.lend(models_[k]);
    tasks_[k].status = NumericalStatus::Failed;
    tasks_[k].failure.clear();
  }
  input.problem.linearize(&tasks_[begin], end - begin, input.evaluations.getScratch(thread));
  for (int k = begin; k < end; ++k) {
    failures_[k] = checkModel(input.problem, k);
    if (failures_[k].empty()) linearized_[k].store(true, std::memory_order_release);
  }
}

// Describes what is wrong with the model of a node; empty if nothing is.
std::string BackwardPass::checkModel(const ShootingProblem& problem, int k) const {
  const StageModel& model = models_[k];
  if (tasks_[k].status != NumericalStatus::Ok) {
    const std::string& reason = tasks_[k].failure;
    return "the problem could not be linearized" + (reason.empty() ? "" : ": " + reason);
  }
  const int N = problem.numStages(), nu = k < N ? problem.controlSize(k) : 0;
  if (!model.hasSizes(problem.tangentSize(k), nu, k < N ? problem.tangentSize(k + 1) : 0))
    return "the sizes of the quadratic model differ from those of the problem";
  if (!std::isfinite(model.cost) || !model.gap.allFinite()) return "the cost or the gap is not finite";
  return {};
}

}  // namespace bielle
