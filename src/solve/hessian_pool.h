#pragma once
// Memory for second derivatives, which are needed only from the linearization of a node to its sweep soon after. Pieces
// passed from node to node, the most recently returned one first, stay in the cache.
#include <algorithm>
#include <mutex>

#include "bielle/solve/shooting_problem.h"

namespace bielle {

class HessianPool {
 public:
  /// One piece per model; the models give up their own.
  void resize(std::vector<StageModel>& models) {
    Eigen::Index size = 0;
    for (StageModel& model : models) {
      size = std::max(size, model.hessian().outerStride() * model.hessian().cols());
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
  /// Does nothing for a model without a piece.
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
