#include "bench/receding_horizon.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"

namespace bielle {
namespace {

constexpr double kPositionNoise = 1e-4, kVelocityNoise = 1e-3;  // rad or m, rad/s or m/s

// Stages [first, first + nodes) of a longer problem from a state of its own, with the terminal costs of that problem.
class Window : public ShootingProblem {
 public:
  Window(RobotProblem& whole, int nodes) : whole_(whole), nodes_(nodes), x0_(whole.initialState()) {}
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
  RobotProblem& whole_;
  const int nodes_;
  int first_ = 0;
  VectorXd x0_;
};

class Disturbance {
 public:
  explicit Disturbance(const Model& model) : model_(model), ws_(model) {}
  // A state near x with closed loops, and a velocity that keeps the constraints.
  VectorXd apply(const ConstraintSet& constraints, const VectorXd& x) {
    const int nq = model_.nq(), nv = model_.nv();
    VectorXd out(x.size());
    out.head(nq) = closeConfiguration(model_, model_.integrate(x.head(nq), makeNoise(kPositionNoise))).q;
    out.tail(nv) = projectVelocity(model_, ws_, constraints, out.head(nq), x.tail(nv) + makeNoise(kVelocityNoise));
    return out;
  }

 private:
  VectorXd makeNoise(double scale) {
    std::normal_distribution<double> normal(0, scale);
    return VectorXd::NullaryExpr(model_.nv(), [&](Eigen::Index) { return normal(rng_); });
  }
  const Model& model_;
  Workspace ws_;
  std::mt19937 rng_{1};
};

// One stage on: the new last one comes with the torques that hold the robot still there, and steps to the new last state.
void shift(RobotProblem& whole, int new_stage, ShootingTrajectory& trajectory) {
  std::rotate(trajectory.xs.begin(), trajectory.xs.begin() + 1, trajectory.xs.end());
  std::rotate(trajectory.us.begin(), trajectory.us.begin() + 1, trajectory.us.end());
  const VectorXd& last = *(trajectory.xs.end() - 2);
  VectorXd& u = trajectory.us.back();
  u = calcStaticTorques(whole.model(), whole.spec(new_stage).constraints, last.head(whole.model().nq())).u;
  double cost = 0;
  if (whole.step(new_stage, last, u, trajectory.xs.back(), cost) != StepStatus::Ok) trajectory.xs.back() = last;
}

// Height of the first body and the direction that was up in it.
struct Torso {
  double height;
  Vector3d up;
};
Torso findTorso(const Model& model, Workspace& ws, const VectorXd& x) {
  updatePositions(model, ws, x.head(model.nq()));
  return {ws.X_WB[1].p.z(), ws.X_WB[1].R.row(2).transpose()};
}

}  // namespace

RecedingHorizon runRecedingHorizon(const Model& model, Formulation formulation, const RecedingOptions& receding) {
  const int nodes = receding.nodes;
  Motion motion = makeBenchmarkWalk(model, receding.walk, formulation);
  RobotProblem& whole = *motion.problem;
  Window window(whole, nodes);
  ShootingTrajectory trajectory{{motion.guess.xs.begin(), motion.guess.xs.begin() + nodes + 1},
                                {motion.guess.us.begin(), motion.guess.us.begin() + nodes}};
  FddpOptions options;
  options.threads = receding.threads;
  options.max_iterations = receding.first_iterations;
  Fddp(options).solve(window, trajectory);  // the plan before the first shift, without haste
  options.max_iterations = 1;
  options.last_rollout = LastRollout::Segments;
  Fddp solver(options);

  RecedingHorizon out;
  out.formulation = formulation;
  out.threads = receding.threads;
  out.least_height = 1;
  out.up = true;
  Workspace ws(model);
  Disturbance disturbance(model);
  VectorXd x = whole.initialState(), next = x;
  const Torso start = findTorso(model, ws, x);
  std::vector<double> times;
  for (int k = 0; k < std::min(receding.shifts, whole.numStages() - nodes) && out.up; ++k) {
    window.move(k, x);
    const auto begin = std::chrono::steady_clock::now();
    if (k > 0) shift(whole, k + nodes - 1, trajectory);
    const FddpSummary summary = solver.solve(window, trajectory);
    times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    double cost = 0;
    out.up = summary.termination != FddpTermination::Failed &&
             whole.step(k, x, trajectory.us[0], next, cost) == StepStatus::Ok;
    if (!out.up) break;
    x = disturbance.apply(whole.spec(k + 1).constraints, next);
    const Torso torso = findTorso(model, ws, x);
    out.least_height = std::min(out.least_height, torso.height / start.height);
    out.largest_tilt = std::max(out.largest_tilt, std::acos(std::min(1.0, torso.up.dot(start.up))));
    out.up = out.least_height > 0.8 && out.largest_tilt < 0.5;
  }
  out.shifts = static_cast<int>(times.size());
  std::sort(times.begin(), times.end());
  out.seconds = times[times.size() / 2];
  out.worst = times.back();
  return out;
}

}  // namespace bielle
