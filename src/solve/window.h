#pragma once
// The part of a problem that a receding horizon sees.
#include "bielle/solve/shooting_problem.h"

namespace bielle {

// Stages [first, first + nodes) of a longer problem, from its own initial state, with the terminal costs of that
// problem. They are counted modulo the number of its stages: a problem may be a ring, whose stages are replaced.
class Window : public ShootingProblem {
 public:
  Window(const ShootingProblem& whole, int nodes) : whole_(whole), nodes_(nodes), x0_(whole.initialState()) {}
  // \param first  a stage of the whole problem, which must have more stages than the window
  void move(int first, const VectorXd& x0) {
    first_ = first;
    x0_ = x0;
  }

  int numStages() const override { return nodes_; }
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
    renumber(tasks, count, [&] { whole_.evaluate(tasks, count, getScratch(scratch).whole.get()); });
  }
  void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const override {
    renumber(tasks, count, [&] { whole_.linearize(tasks, count, getScratch(scratch).whole.get()); });
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
  int getBatchSize() const override { return whole_.getBatchSize(); }

 private:
  struct Scratch : ProblemScratch {
    std::unique_ptr<ProblemScratch> whole;
    std::vector<IntegrateTask> integrations;
    std::vector<DifferenceTask> differences;
  };
  static Scratch& getScratch(ProblemScratch* scratch) { return static_cast<Scratch&>(*scratch); }
  int getNode(int node) const { return node < nodes_ ? (first_ + node) % whole_.numStages() : whole_.numStages(); }
  // Calls `work` with tasks numbered by their nodes in the whole problem.
  template <typename Task, typename Work>
  void renumber(Task* tasks, int count, const Work& work) const {
    const int size = whole_.numStages();
    for (int i = 0; i < count; ++i) tasks[i].node = getNode(tasks[i].node);
    work();
    for (int i = 0; i < count; ++i)
      tasks[i].node = tasks[i].node == size ? nodes_ : (tasks[i].node - first_ + size) % size;
  }

  const ShootingProblem& whole_;
  const int nodes_;
  int first_ = 0;
  VectorXd x0_;
};

}  // namespace bielle
