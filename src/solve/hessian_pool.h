#pragma once
// Second derivatives are wanted from the linearization of a node to its sweep, which soon follows: pieces of memory that go
// from node to node, the one that came back last first, stay in the cache.
#include <algorithm>
#include <mutex>

#include "bielle/ocp/shooting_problem.h"

namespace bielle {

class HessianPool {
 public:
  /// One piece for each of the models, whose own it takes away.
  void resize(std::vector<StageModel>& models) {
    Eigen::Index size = 0;
    for (StageModel& model : models) {
      size = std::max(size, model.H().outerStride() * model.H().cols());
      VectorXd none;
      model.swapHessian(none);
    }
    free_.resize(models.size());
    for (VectorXd& memory : free_)
      if (memory.size() < size) memory.setZero(size);
  }
  void lend(StageModel& model) {
    const std::lock_guard<std::mutex> lock(mutex_);
    model.swapHessian(free_.back());
    free_.pop_back();
  }
  /// From a model that has one; from others nothing.
  void takeBack(StageModel& model) {
    VectorXd memory;
    model.swapHessian(memory);
    if (memory.size() == 0) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    free_.push_back(std::move(memory));
  }

 private:
  std::mutex mutex_;
  std::vector<VectorXd> free_;
};

}  // namespace bielle
