#pragma once
// The part of a problem that a receding horizon sees.
#include "bielle/ocp/robot_problem.h"

namespace bielle {

// Stages [first, first + nodes) of a longer problem, from a state of its own, with the terminal costs of that problem.
class Window : public ShootingProblem {
 public:
  Window(ShootingProblem& whole, int nodes) : whole_(whole), nodes_(nodes), x0_(whole.initialState()) {}
  // first + nodes is at most the stages of the whole.
  void move(int first, const VectorXd& x0) {
    first_ = first;
    x0_ = x0;
  }

  int numStages() const override { return nodes_; }
  int stateSize() const override { return whole_.stateSize(); }
  int tangentSize(int node) const override { return whole_.tangentSize(getNode(node)); }
  int controlSize(int stage) const override { return whole_.controlSize(first_ + stage); }
  const VectorXd& initialState() const override { return x0_; }
  void integrate(int node, ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) const override {
    whole_.integrate(getNode(node), x, dx, x_out);
  }
  void integrateNodes(const std::vector<IntegrateTask>& tasks) const override {
    static thread_local std::vector<IntegrateTask> whole_tasks;
    whole_tasks = tasks;
    for (IntegrateTask& task : whole_tasks) task.node = getNode(task.node);
    whole_.integrateNodes(whole_tasks);
  }
  void difference(int node, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const override {
    whole_.difference(getNode(node), x0, x1, dx);
  }
  void getControlBounds(int stage, VectorRef lower, VectorRef upper) const override {
    whole_.getControlBounds(first_ + stage, lower, upper);
  }
  StepStatus step(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) override {
    return whole_.step(first_ + stage, x, u, x_next, cost);
  }
  StepStatus continueStep(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) override {
    return whole_.continueStep(first_ + stage, x, u, x_next, cost);
  }
  StepStatus calcTerminalCost(ConstVectorRef x, double& cost) override { return whole_.calcTerminalCost(x, cost); }
  StepStatus linearize(int stage, ConstVectorRef x, ConstVectorRef u, ConstVectorRef x_next_node,
                       StageModel& out) override {
    return whole_.linearize(first_ + stage, x, u, x_next_node, out);
  }
  void stepStages(std::vector<StepTask>& tasks) override {
    for (StepTask& task : tasks) task.stage += first_;
    whole_.stepStages(tasks);
    for (StepTask& task : tasks) task.stage -= first_;
  }
  // The whole problem counts nodes from its own first one: what it works on is lent to the places where it looks.
  void linearizeStages(int begin, int end, const std::vector<VectorXd>& xs, const std::vector<VectorXd>& us,
                       std::vector<StageModel>& models, std::vector<StepStatus>& statuses) override {
    static thread_local ShootingTrajectory trajectory;
    static thread_local std::vector<StageModel> whole_models;
    static thread_local std::vector<StepStatus> whole_statuses;
    const size_t size = whole_.numStages() + 1;
    if (whole_models.size() != size) {
      trajectory.xs.resize(size);
      trajectory.us.resize(size);
      whole_models.resize(size);
      whole_statuses.resize(size);
    }
    for (int k = begin; k < end; ++k) {
      trajectory.xs[first_ + k] = xs[k];
      trajectory.us[first_ + k] = us[k];
      std::swap(whole_models[first_ + k], models[k]);
    }
    trajectory.xs[first_ + end] = xs[end];
    whole_.linearizeStages(first_ + begin, first_ + end, trajectory.xs, trajectory.us, whole_models, whole_statuses);
    for (int k = begin; k < end; ++k) {
      std::swap(whole_models[first_ + k], models[k]);
      statuses[k] = whole_statuses[first_ + k];
    }
  }
  int getBatchSize() const override { return whole_.getBatchSize(); }
  StepStatus linearizeTerminal(ConstVectorRef x, StageModel& out) override { return whole_.linearizeTerminal(x, out); }
  std::string getFailure(int node) const override { return whole_.getFailure(getNode(node)); }

 private:
  int getNode(int node) const { return node < nodes_ ? first_ + node : whole_.numStages(); }
  ShootingProblem& whole_;
  const int nodes_;
  int first_ = 0;
  VectorXd x0_;
};

}  // namespace bielle
