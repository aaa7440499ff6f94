#include "backward_pass.h"

#include <cmath>

#include "stopwatch.h"

namespace bielle {

void BackwardPass::resize(const ShootingProblem& problem) {
  const int N = problem.numStages();
  models_.resize(N + 1);
  failures_.resize(N + 1);
  statuses_.resize(N + 1);
  linearized_ = std::vector<std::atomic<bool>>(N + 1);
  for (int k = 0; k <= N; ++k) {
    const int ndx = problem.tangentSize(k), nu = k < N ? problem.controlSize(k) : 0;
    const int ndx_next = k < N ? problem.tangentSize(k + 1) : 0;
    if (!models_[k].hasSizes(ndx, nu, ndx_next)) models_[k].resize(ndx, nu, ndx_next);
  }
  hessians_.resize(models_);
  linearize_seconds_ = sweep_seconds_ = 0;
}

int BackwardPass::update(const BackwardInput& input) {
  const int N = input.problem.numStages();
  for (std::atomic<bool>& linearized : linearized_) linearized.store(false, std::memory_order_relaxed);
  for (StageModel& model : models_) hessians_.takeBack(model);  // of a sweep that stopped half way
  sweep_.start(models_, input.regularization);
  sweep_node_ = N;
  // Batches of stages, always the same ones, and the terminal node.
  const int size = input.problem.getBatchSize(), num_batches = (N + size - 1) / size;
  std::atomic<int> next{num_batches};
  std::atomic_flag sweeping = ATOMIC_FLAG_INIT;
  double linearize_seconds = 0, sweep_seconds = 0;
#pragma omp parallel num_threads(input.threads) reduction(+ : linearize_seconds, sweep_seconds)
  {
    for (int i; (i = next.fetch_sub(1, std::memory_order_relaxed)) >= 0;) {
      const Clock::time_point start = Clock::now();
      linearize(input, i < num_batches ? i * size : N, i < num_batches ? std::min(N, (i + 1) * size) : N + 1);
      linearize_seconds += calcSecondsSince(start);
      if (sweeping.test_and_set(std::memory_order_acquire)) continue;
      const Clock::time_point start_sweep = Clock::now();
      sweepReadyNodes(input);
      sweep_seconds += calcSecondsSince(start_sweep);
      sweeping.clear(std::memory_order_release);
    }
  }
  const Clock::time_point start_rest = Clock::now();
  sweepReadyNodes(input);
  linearize_seconds_ += linearize_seconds;
  sweep_seconds_ += sweep_seconds + calcSecondsSince(start_rest);
  for (int k = 0; k <= N; ++k)
    if (!failures_[k].empty()) return k;
  return -1;
}

// Stops for good at a node that could not be linearized or swept.
void BackwardPass::sweepReadyNodes(const BackwardInput& input) {
  const int N = input.problem.numStages();
  while (sweep_node_ >= 0 && sweep_.getResult().status == LqStatus::Ok &&
         linearized_[sweep_node_].load(std::memory_order_acquire)) {
    StageModel& model = models_[sweep_node_];
    sweep_.updateNode(sweep_node_, model,
                      sweep_node_ < N && !input.boxes.empty() ? &input.boxes[sweep_node_] : nullptr);
    hessians_.takeBack(model);
    --sweep_node_;
  }
}

// Stages, or the terminal node. Runs in parallel: nothing may leave but through their own entries.
void BackwardPass::linearize(const BackwardInput& input, int begin, int end) {
  const ShootingTrajectory& nodes = input.nodes;
  std::string thrown;
  for (int k = begin; k < end; ++k) hessians_.lend(models_[k]);
  try {
    if (begin < input.problem.numStages()) {
      input.problem.linearizeStages(begin, end, nodes.xs, nodes.us, models_, statuses_);
    } else {
      statuses_[begin] = input.problem.linearizeTerminal(nodes.xs[begin], models_[begin]);
    }
  } catch (const std::exception& error) {
    thrown = std::string("the linearization threw: ") + error.what();
  } catch (...) {
    thrown = "the linearization threw";
  }
  for (int k = begin; k < end; ++k) {
    failures_[k] = thrown.empty() ? checkModel(input.problem, k) : thrown;
    if (failures_[k].empty()) linearized_[k].store(true, std::memory_order_release);
  }
}

// What is wrong with the model of a node, empty if nothing is.
std::string BackwardPass::checkModel(const ShootingProblem& problem, int k) const {
  const StageModel& model = models_[k];
  if (statuses_[k] != StepStatus::Ok) {
    const std::string reason = problem.getFailure(k);
    return "the problem could not be linearized" + (reason.empty() ? "" : ": " + reason);
  }
  const int N = problem.numStages(), nu = k < N ? problem.controlSize(k) : 0;
  if (!model.hasSizes(problem.tangentSize(k), nu, k < N ? problem.tangentSize(k + 1) : 0))
    return "the quadratic model has other sizes than the problem says";
  if (!std::isfinite(model.cost) || !model.gap.allFinite()) return "the cost or the gap is not finite";
  return {};
}

}  // namespace bielle
