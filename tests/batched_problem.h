#pragma once
// A problem that works on several tasks at once, and holds the solver to the contract of shooting_problem.h.
#include <mutex>
#include <stdexcept>

#include "solve_problems.h"

namespace bielle::test {

/// Forwards to a problem, task by task, and throws std::logic_error if it is used against the contract.
class BatchedProblem : public ShootingProblem {
 public:
  BatchedProblem(const PlainProblem& inner, int batch_size) : inner_(inner), batch_size_(batch_size) {}

  /// Number of the first stage in a longer horizon: evaluations know their node by its number there.
  int first = 0;
  /// Poison: the error of a step grows with the number of steps per call.
  bool spread = false;
  mutable std::atomic<int> num_evaluated{0}, num_linearized{0}, num_integrated{0};  ///< nodes
  mutable std::atomic<int> num_made{0};                                             ///< evaluations
  mutable std::atomic<int> most_alike{0};  ///< tasks of one call at the same node

  int numStages() const override { return inner_.numStages(); }
  int stateSize() const override { return inner_.stateSize(); }
  int tangentSize(int node) const override { return inner_.tangentSize(node); }
  int controlSize(int stage) const override { return inner_.controlSize(stage); }
  const VectorXd& initialState() const override { return inner_.initialState(); }
  void getControlBounds(int stage, VectorRef lower, VectorRef upper) const override {
    inner_.getControlBounds(stage, lower, upper);
  }
  int batchSize() const override { return batch_size_; }

  std::unique_ptr<NodeEvaluation> makeEvaluation() const override {
    ++num_made;
    auto out = std::make_unique<Evaluation>();
    out->problem = id();
    return out;
  }
  std::unique_ptr<ProblemScratch> makeScratch() const override {
    auto out = std::make_unique<Scratch>();
    out->problem = id();
    return out;
  }

  void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const override {
    const Use use(*this, scratch, count);
    for (int i = 0; i < count; ++i) {
      EvaluateTask& task = tasks[i];
      int alike = 0;
      for (int j = 0; j < count; ++j) {
        alike += tasks[j].node == task.node;
        require(j == i || tasks[j].out != task.out, "two tasks fill one evaluation");
        require(tasks[j].previous != task.out, "an evaluation is read and filled at once");
      }
      if (alike > most_alike) most_alike = alike;
      if (task.previous) {
        require(getOwn(task.previous).node == getNumber(task.node - 1), "the evaluation before is of another node");
        require(task.previous->status == NumericalStatus::Ok, "the evaluation before is none");
        require(task.previous->x_next == *task.x, "the evaluation before leads elsewhere");
      }
      require(task.x->allFinite() && (task.node == numStages() || task.u->allFinite()),
              "what is evaluated is no number");
      static_cast<Evaluation&>(*task.out).node = getNumber(task.node);
      getOwn(task.out);
      inner_.evaluate(task, nullptr);
      if (spread && task.node < numStages()) task.out->x_next.array() += 1e-9 * (count - 1);
    }
    num_evaluated += count;
  }
  void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const override {
    const Use use(*this, scratch, count);
    for (int i = 0; i < count; ++i) {
      require(getOwn(tasks[i].at).node == getNumber(tasks[i].node), "the evaluation is of another node");
      require(tasks[i].at->status == NumericalStatus::Ok, "the evaluation is none");
      require((tasks[i].next != nullptr) == (tasks[i].node < numStages()),
              "the next evaluation is missing, or too many");
      if (tasks[i].next)
        require(getOwn(tasks[i].next).node == getNumber(tasks[i].node + 1), "the next evaluation is of another node");
      inner_.linearize(tasks[i], nullptr);
    }
    num_linearized += count;
  }
  void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const override {
    const Use use(*this, scratch, count);
    for (int i = 0; i < count; ++i) {
      require(getOwn(tasks[i].at).node == getNumber(tasks[i].node), "the evaluation is of another node");
      inner_.integrate(tasks[i], nullptr);
    }
    num_integrated += count;
  }
  void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const override {
    const Use use(*this, scratch, count);
    for (int i = 0; i < count; ++i) {
      require(getOwn(tasks[i].at).node == getNumber(tasks[i].node), "the evaluation is of another node");
      require(tasks[i].dx->size() == tangentSize(tasks[i].node), "the difference has no room");
      inner_.difference(tasks[i], nullptr);
    }
  }

 private:
  struct Evaluation : NodeEvaluation {
    std::uint64_t problem = 0;
    int node = -1;
  };
  struct Scratch : ProblemScratch {
    std::uint64_t problem = 0;
    std::mutex mutex;
  };
  // One call: its scratch is of this problem, and no other thread has it.
  class Use {
   public:
    Use(const BatchedProblem& problem, ProblemScratch* scratch, int count) : scratch_(static_cast<Scratch*>(scratch)) {
      require(count > 0 && count <= problem.batch_size_, "too many tasks at once, or none");
      require(scratch_->problem == problem.id(), "scratch of another problem");
      require(scratch_->mutex.try_lock(), "scratch of another thread");
    }
    ~Use() { scratch_->mutex.unlock(); }

   private:
    Scratch* scratch_;
  };
  static void require(bool holds, const char* what) {
    if (!holds) throw std::logic_error(what);
  }
  int getNumber(int node) const { return node < numStages() ? first + node : std::numeric_limits<int>::max(); }
  const Evaluation& getOwn(const NodeEvaluation* evaluation) const {
    const auto& own = static_cast<const Evaluation&>(*evaluation);
    require(own.problem == id(), "evaluation of another problem");
    return own;
  }

  const PlainProblem& inner_;
  int batch_size_;
};

}  // namespace bielle::test
