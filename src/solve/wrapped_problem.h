#pragma once
/// \file A problem made of another one, the inner problem: it hands tasks on, and keeps evaluations and memory of that one.
#include <algorithm>
#include <memory>
#include <vector>

#include "bielle/solve/shooting_problem.h"

namespace bielle {

struct WrappedEvaluation : NodeEvaluation {
  std::unique_ptr<NodeEvaluation> inner;
};

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
  // For a node of the inner problem.
  StageModel& takeModel(const ShootingProblem& problem, int node);
};

/// States have numbers after those of the inner problem, and so have tangent vectors of all nodes but the first; there may be a node
/// before those of the inner problem, whose tangent space is empty. What all that does is said by the derived class.
class WrappedProblem : public ShootingProblem {
 public:
  int numStages() const override { return inner_.numStages() + before_; }
  int stateSize() const override { return inner_.stateSize() + added_; }
  int tangentSize(int node) const override {
    if (node == 0) return before_ > 0 ? 0 : inner_.tangentSize(0);
    return inner_.tangentSize(node - before_) + added_;
  }
  const VectorXd& initialState() const override { return start_; }
  std::unique_ptr<NodeEvaluation> makeEvaluation() const override;
  std::unique_ptr<ProblemScratch> makeScratch() const override;
  void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const override;
  void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const override;
  void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const override;
  void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const override;
  int batchSize() const override { return inner_.batchSize(); }

 protected:
  /// \param inner  must outlive it   \param before  0 or 1: nodes before those of the inner problem
  /// \param added  numbers after a state of the inner problem
  WrappedProblem(const ShootingProblem& inner, int before, int added)
      : inner_(inner), start_(inner.stateSize() + added), before_(before), added_(added) {
    start_.head(inner.stateSize()) = inner.initialState();
  }

  static NodeEvaluation* getInner(const NodeEvaluation* at) {
    return at ? static_cast<const WrappedEvaluation*>(at)->inner.get() : nullptr;
  }

  const ShootingProblem& inner_;
  VectorXd start_;  // what was added is the derived class's to set

 private:
  /// Controls of the inner problem at an evaluation whose x and u are known.
  virtual void setControls(int node, WrappedEvaluation& at) const = 0;
  /// Everything about an evaluation but x and u. Status, failure, cost and constraints of a node of the inner problem are those of
  /// the latter. \param inner  scratch of the inner problem, here and below
  virtual void finish(int node, WrappedEvaluation& at, ProblemScratch* inner) const = 0;
  /// \param model  of the inner problem; null at the node before
  virtual void setModel(LinearizeTask& task, const StageModel* model, ProblemScratch* inner) const = 0;

  int before_, added_;
};

}  // namespace bielle
