#pragma once
// The linearization of all nodes and the sweep over them (docs/solver.md, 1 and 2).
#include <atomic>
#include <string>

#include "solve/augmented_lagrangian.h"
#include "solve/lq_sweep.h"

namespace bielle {

/// The iterate to linearize about, the boxes of du (N or none), and the regularization of the sweep.
struct BackwardInput {
  const ShootingProblem& problem;
  const NodeEvaluations& evaluations;
  const AugmentedLagrangian& lagrangian;
  const std::vector<ControlBox>& boxes;
  LqRegularization regularization;
  Team& team;
  int threads;
};

/// The sweep visits nodes one by one, from the last on, and runs alongside the linearization: a thread that has
/// finished a batch of nodes sweeps as far as models are available, unless another thread is doing so.
class BackwardPass {
 public:
  void resize(const ShootingProblem& problem);

  /// Returns the first node that could not be linearized, or -1; in either case the sweep may have stopped.
  int update(const BackwardInput& input);
  /// The same in two parts: all nodes but the first, then that one. The input must be the same but for the first node.
  void prepare(const BackwardInput& input);
  int finish(const BackwardInput& input);
  /// Sweeps over the same models with another regularization or other weights. Only nodes where rows have weights that had none
  /// before are linearized again. Returns as update() does.
  int sweepAgain(const BackwardInput& input);
  /// Why a node could not be linearized, empty if it could.
  const std::string& getFailure(int node) const { return failures_[node]; }

  /// N + 1, of costs and dynamics alone, and of constraints with weights.
  const std::vector<StageModel>& models() const { return models_; }
  const LqSweep& sweep() const { return sweep_; }
  /// The first constraint with weights at a node whose derivatives are not finite, or -1.
  int findInfiniteRow(int node) const;
  /// Times of all updates since resize(), summed over the threads.
  double linearizeSeconds() const { return linearize_seconds_; }
  double sweepSeconds() const { return sweep_seconds_; }
  /// Nodes linearized since resize().
  int numLinearized() const { return num_linearized_; }

 private:
  void start(const BackwardInput& input);
  void findRows(const BackwardInput& input, int k);
  void addTask(const BackwardInput& input, int k);
  void startSweep(const BackwardInput& input);
  void updateNodes(const BackwardInput& input, int begin, int end);
  int findFailure(const ShootingProblem& problem) const;
  void linearize(const BackwardInput& input, int thread, int begin, int end);
  std::string checkModel(const ShootingProblem& problem, const LinearizeTask& task) const;
  void sweepReadyNodes(const BackwardInput& input);

  std::vector<StageModel> models_;             // N + 1
  std::vector<LinearizeTask> tasks_;           // at most N + 1, with increasing nodes
  std::vector<std::vector<char>> rows_;        // N + 1: the constraints that the model has
  std::vector<std::string> failures_;          // N + 1
  std::vector<std::atomic<bool>> linearized_;  // N + 1: the model is ready for the sweep
  LqSweep sweep_;
  int sweep_node_ = -1;  // the next one
  int num_linearized_ = 0;
  double linearize_seconds_ = 0, sweep_seconds_ = 0;
};

}  // namespace bielle
