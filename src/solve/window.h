#pragma once
// The part of a problem that a receding horizon sees.
#include <numeric>

#include "bielle/solve/shooting_problem.h"

namespace bielle {

// Some stages of a longer problem, from its own initial state, with the terminal costs of that problem.
class Window : public ShootingProblem {
 public:
  // Shows the first stages.
  Window(const ShootingProblem& whole, int nodes) : whole_(whole), stages_(nodes), x0_(whole.initialState()) {
    std::iota(stages_.begin(), stages_.end(), 0);
  }
  // Those from one on, which the whole problem must have.
  void move(int first, const VectorXd& x0) {
    std::iota(stages_.begin(), stages_.end(), first);
    x0_ = x0;
  }
  // \param stages  of the whole problem, as many as the window has
  void move(const std::vector<int>& stages, const VectorXd& x0) {
    stages_ = stages;
    x0_ = x0;
  }

  int numStages() const override { return static_cast<int>(stages_.size()); }
  int stateSize() const override { return whole_.stateSize(); }
  int tangentSize(int node) const override { return whole_.tangentSize(getNode(node)); }
  int controlSize(int stage) const override { return whole_.controlSize(getNode(stage)); }
  const VectorXd& initialState() const override { return x0_; }
  void getControlBounds(int stage, VectorRef lower, VectorRef upper) const override {
    whole_.getControlBounds(getNode(stage), lower, upper);
  }
  int constraintSize(int node) const override { return whole_.constraintSize(getNode(node)); }
  void getConstraintBounds(int node, VectorRef lower, VectorRef upper) const override {
    whole_.getConstraintBounds(getNode(node), lower, upper);
  }
  std::string getConstraintName(int node, int row) const override {
    return whole_.getConstraintName(getNode(node), row);
  }
  std::unique_ptr<NodeEvaluation> makeEvaluation() const override { return whole_.makeEvaluation(); }
  std::unique_ptr<ProblemScratch> makeScratch() const override {
    auto out = std::make_unique<Scratch>();
    out->whole = whole_.makeScratch();
    return out;
  }
  void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const override {
    Scratch& own = getScratch(scratch);
    renumber(tasks, count, own, [&] { whole_.evaluate(tasks, count, own.whole.get()); });
  }
  void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const override {
    Scratch& own = getScratch(scratch);
    renumber(tasks, count, own, [&] { whole_.linearize(tasks, count, own.whole.get()); });
  }
  void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const override {
    Scratch& own = getScratch(scratch);
    own.integrations.assign(tasks, tasks + count);
    for (IntegrateTask& task : own.integrations) task.node = getNode(task.node);
    whole_.integrate(own.integrations.data(), count, own.whole.get());
  }
  void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const override {
    Scratch& own = getScratch(scratch);
    own.differences.assign(tasks, tasks + count);
    for (DifferenceTask& task : own.differences) task.node = getNode(task.node);
    whole_.difference(own.differences.data(), count, own.whole.get());
  }
  int batchSize() const override { return whole_.batchSize(); }

 private:
  struct Scratch : ProblemScratch {
    std::unique_ptr<ProblemScratch> whole;
    std::vector<IntegrateTask> integrations;
    std::vector<DifferenceTask> differences;
    std::vector<int> numbers;
  };
  static Scratch& getScratch(ProblemScratch* scratch) { return static_cast<Scratch&>(*scratch); }
  int getNode(int node) const { return node < numStages() ? stages_[node] : whole_.numStages(); }
  // Calls `work` with tasks numbered by their nodes in the whole problem.
  template <typename Task, typename Work>
  void renumber(Task* tasks, int count, Scratch& own, const Work& work) const {
    own.numbers.resize(count);
    for (int i = 0; i < count; ++i) {
      own.numbers[i] = tasks[i].node;
      tasks[i].node = getNode(tasks[i].node);
    }
    work();
    for (int i = 0; i < count; ++i) tasks[i].node = own.numbers[i];
  }

  const ShootingProblem& whole_;
  std::vector<int> stages_;
  VectorXd x0_;
};

}  // namespace bielle
