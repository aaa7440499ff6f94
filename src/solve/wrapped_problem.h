#pragma once
// What problems that wrap another one have in common: they hand tasks on, and so keep evaluations and memory of the inner problem.
#include <algorithm>
#include <memory>
#include <vector>

#include "bielle/solve/shooting_problem.h"

namespace bielle {

struct WrappedEvaluation : NodeEvaluation {
  std::unique_ptr<NodeEvaluation> inner;
};
inline NodeEvaluation* getInner(const NodeEvaluation* at) {
  return at ? static_cast<const WrappedEvaluation*>(at)->inner.get() : nullptr;
}
inline std::unique_ptr<NodeEvaluation> wrapEvaluation(const ShootingProblem& inner) {
  auto out = std::make_unique<WrappedEvaluation>();
  out->inner = inner.makeEvaluation();
  return out;
}

// Things of various sizes that a scratch memory keeps.
template <typename T>
class Pool {
 public:
  void takeBack() { num_taken_ = 0; }
  template <typename Fits, typename Resize>
  T& take(const Fits& fits, const Resize& resize) {
    const auto free = items_.begin() + num_taken_++;
    const auto found = std::find_if(free, items_.end(), [&](const std::unique_ptr<T>& item) { return fits(*item); });
    if (found != items_.end()) {
      free->swap(*found);
      return **free;
    }
    items_.push_back(std::make_unique<T>());
    resize(*items_.back());
    items_[num_taken_ - 1].swap(items_.back());
    return *items_[num_taken_ - 1];
  }

 private:
  std::vector<std::unique_ptr<T>> items_;  // the first ones are taken
  std::ptrdiff_t num_taken_ = 0;
};

// Tasks of the inner problem, and what they point to.
struct WrappedScratch : ProblemScratch {
  explicit WrappedScratch(const ShootingProblem& problem) : inner(problem.makeScratch()) {}

  std::unique_ptr<ProblemScratch> inner;
  std::vector<EvaluateTask> evaluations;
  std::vector<LinearizeTask> linearizations;
  std::vector<IntegrateTask> integrations;
  std::vector<DifferenceTask> differences;
  Pool<StageModel> models;
  Pool<VectorXd> vectors;

  VectorXd& takeVector(Eigen::Index size) {
    return vectors.take([size](const VectorXd& v) { return v.size() == size; },
                        [size](VectorXd& v) { v.resize(size); });
  }
  StageModel& takeModel(int ndx, int nu, int ndx_next, int rows) {
    StageModel& out = models.take([=](const StageModel& model) { return model.hasSizes(ndx, nu, ndx_next); },
                                  [=](StageModel& model) { model.resize(ndx, nu, ndx_next); });
    out.setRows(rows);
    return out;
  }
};

}  // namespace bielle
