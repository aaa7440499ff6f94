// Speed of the benchmark walk (motion/benchmark_walk.h) on one thread, per node, in seconds and in units. A unit is one
// 108 x 108 double matrix product by Eigen, same flags, same run: it is measured between the repetitions of every
// benchmark, and the counter `units` is the ratio of the medians. Machines and neighbours come and go, ratios stay.
//
// What is measured over the whole walk is evaluated at the static guess under small random velocities and torques,
// node after node, so that memory is as cold as in a solve.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/reader.h"
#include "bielle/motion/benchmark_walk.h"
#include "bielle/robots/fourbar_chain.h"
#include "bielle/solve/fddp.h"

namespace {

using namespace bielle;

// Seconds that f takes on this thread alone: others who share the processor are not charged to it.
double calcSeconds(const std::function<void()>& f) {
  const auto getTime = [] {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
  };
  const double start = getTime();
  f();
  return getTime() - start;
}

double calcMedian(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

// Duration of one unit, s.
double calcUnit() {
  static const MatrixXd a = MatrixXd::Random(108, 108), b = MatrixXd::Random(108, 108);
  static MatrixXd c(108, 108);
  constexpr int kProducts = 10;
  return calcSeconds([] {
           for (int i = 0; i < kProducts; ++i) {
             c.noalias() = a * b;
             benchmark::DoNotOptimize(c.data());
             benchmark::ClobberMemory();
           }
         }) /
         kProducts;
}

// Repeats f, which returns the seconds spent on `nodes` nodes.
void run(benchmark::State& state, double nodes, const std::function<double()>& f) {
  std::vector<double> times, units;
  f();  // sizes the memory
  for (auto _ : state) {
    units.push_back(calcUnit());
    const double seconds = f() / nodes;
    state.SetIterationTime(seconds);
    times.push_back(seconds);
  }
  state.counters["units"] = calcMedian(times) / calcMedian(units);
}

struct NodeMemory {
  Workspace ws;
  ConstrainedWorkspace cws;
};

// The walk, its memory and where it is evaluated: two sets of controls, so that nothing is found already done.
struct Walk {
  explicit Walk(Formulation formulation)
      : model(loadRobot("bipetto").model), motion(makeBenchmarkWalk(model, {}, formulation)), problem(*motion.problem) {
    std::mt19937 rng(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const int n = problem.numStages();
    Workspace ws(model);
    for (int k = 0; k <= n; ++k) {
      xs.push_back(motion.guess.xs[k]);
      const VectorXd v = VectorXd::NullaryExpr(model.nv(), [&](Eigen::Index) { return 0.1 * uniform(rng); });
      xs[k].tail(model.nv()) = projectVelocity(model, ws, makeConstraintSet(model), xs[k].head(model.nq()), v);
    }
    for (auto& controls : us)
      for (int k = 0; k < n; ++k)
        controls.push_back(motion.guess.us[k] +
                           VectorXd::NullaryExpr(model.nu(), [&](Eigen::Index) { return uniform(rng); }));
    memory.assign(n, {Workspace(model), {}});
    models.resize(n + 1);
    statuses.resize(n + 1);
    next.assign(problem.getBatchSize(), xs[0]);
  }
  void updateDynamics(int k, const VectorXd& u) {
    updateConstrainedDynamics(model, memory[k].ws, memory[k].cws, problem.spec(k).constraints, xs[k].head(model.nq()),
                              xs[k].tail(model.nv()), calcMotorForces(model, u));
  }
  void updateDerivatives(int k) {
    updateConstrainedDerivatives(model, memory[k].ws, memory[k].cws, problem.spec(k).constraints);
  }
  void linearize(const std::vector<VectorXd>& controls) {
    problem.linearizeStages(0, problem.numStages(), xs, controls, models, statuses);
    problem.linearizeTerminal(xs.back(), models.back());
  }
  void step(const std::vector<VectorXd>& controls) {
    const int size = problem.getBatchSize();
    for (int first = 0; first < problem.numStages(); first += size) {
      tasks.clear();
      for (int k = first; k < std::min(problem.numStages(), first + size); ++k) {
        tasks.emplace_back();
        tasks.back().stage = k;
        tasks.back().x = &xs[k];
        tasks.back().u = &controls[k];
        tasks.back().x_next = &next[k - first];
      }
      problem.stepStages(tasks);
    }
  }
  const std::vector<VectorXd>& otherControls() { return us[turn = 1 - turn]; }

  Model model;
  Motion motion;
  RobotProblem& problem;
  std::vector<VectorXd> xs, us[2];
  std::vector<NodeMemory> memory;
  std::vector<StageModel> models;
  std::vector<StepStatus> statuses;
  std::vector<StepTask> tasks;
  std::vector<VectorXd> next;
  int turn = 0;
};

Walk& getWalk(Formulation formulation) {
  static Walk full(Formulation::Full), reduced(Formulation::Reduced);
  return formulation == Formulation::Full ? full : reduced;
}

void measureUnit(benchmark::State& state) { run(state, 1, calcUnit); }

// One node in double support, again and again (warm memory).
enum class Depth { Dynamics, Derivatives };
void measureNode(benchmark::State& state, Depth depth) {
  Walk& walk = getWalk(Formulation::Full);
  constexpr int kRepetitions = 50;
  run(state, kRepetitions, [&] {
    return calcSeconds([&] {
      for (int i = 0; i < kRepetitions; ++i) {
        walk.updateDynamics(0, walk.us[i % 2][0]);
        if (depth == Depth::Derivatives) walk.updateDerivatives(0);
      }
    });
  });
}

// Over all nodes of the walk. `prepare` is not measured.
void measureHorizon(benchmark::State& state, Formulation formulation, const std::function<void(Walk&)>& prepare,
                    const std::function<void(Walk&)>& work) {
  Walk& walk = getWalk(formulation);
  run(state, walk.problem.numStages(), [&] {
    prepare(walk);
    return calcSeconds([&] { work(walk); });
  });
}

void measureSweep(benchmark::State& state, Formulation formulation) {
  Walk& walk = getWalk(formulation);
  walk.linearize(walk.us[0]);
  LqSweep sweep;
  run(state, walk.problem.numStages(), [&] { return calcSeconds([&] { sweep.update(walk.models, {1e-9, 1e-9}); }); });
}

// The first iterations from the guess, as many linearizations, sweeps and line searches as they take.
void measureFddp(benchmark::State& state, Formulation formulation) {
  Walk& walk = getWalk(formulation);
  FddpOptions options;
  options.threads = 1;
  options.max_iterations = 10;
  Fddp solver(options);
  int iterations = 0;
  double trials = 0;
  run(state, walk.problem.numStages(), [&] {
    ShootingTrajectory trajectory = walk.motion.guess;
    FddpSummary summary;
    const double seconds = calcSeconds([&] { summary = solver.solve(walk.problem, trajectory); });
    iterations = summary.iterations;
    trials = 0;
    for (const FddpIteration& line : summary.log)
      if (line.step > 0) trials += 1 - std::log2(line.step);
    return seconds / iterations;
  });
  state.counters["rollouts"] = trials / iterations;
}

void nothing(Walk&) {}
void dynamics(Walk& walk) {
  const auto& us = walk.otherControls();
  for (int k = 0; k < walk.problem.numStages(); ++k) walk.updateDynamics(k, us[k]);
}
void derivatives(Walk& walk) {
  for (int k = 0; k < walk.problem.numStages(); ++k) walk.updateDerivatives(k);
}
void rollout(Walk& walk) { walk.step(walk.otherControls()); }
void linearize(Walk& walk) { walk.linearize(walk.otherControls()); }
void linearizeAfterStep(Walk& walk) { walk.linearize(walk.us[walk.turn]); }

// Google Benchmark would count iterations by the manual time, which is that of one node of many.
void add(const std::string& name, int iterations, const std::function<void(benchmark::State&)>& f) {
  benchmark::RegisterBenchmark(name.c_str(), f)->UseManualTime()->Iterations(iterations)->Unit(benchmark::kMicrosecond);
}

void addWalk(Formulation formulation) {
  const std::string name = std::string("walk per node, ") + getName(formulation) + ": ";
  const auto addHorizon = [&](const std::string& what, void (*prepare)(Walk&), void (*work)(Walk&)) {
    add(name + what, 30, [=](benchmark::State& state) { measureHorizon(state, formulation, prepare, work); });
  };
  if (formulation == Formulation::Full) {
    addHorizon("dynamics", nothing, dynamics);
    addHorizon("derivatives", dynamics, derivatives);
  }
  addHorizon("rollout (dynamics, cost values)", nothing, rollout);
  addHorizon("linearize after the rollout (derivatives, costs)", rollout, linearizeAfterStep);
  addHorizon("linearize (dynamics, derivatives, costs)", nothing, linearize);
  add(name + "backward pass", 30, [=](benchmark::State& state) { measureSweep(state, formulation); });
  add(name + "FDDP iteration", 4, [=](benchmark::State& state) { measureFddp(state, formulation); });
}

// Step and linearization of one node of a chain of four-bars, every crank at about 1 rad/s; no costs.
void measureChain(benchmark::State& state, Formulation formulation, int count) {
  FourBarChainOptions options;
  options.count = count;
  const FourBarChain chain = makeFourBarChain(options);
  const Model& model = chain.model;
  VectorXd v = VectorXd::Zero(model.nv());
  for (const Motor& motor : model.motors()) v[motor.dof] = 1;
  std::vector<StageSpec> stages(2);
  for (StageSpec& stage : stages) stage.constraints = makeConstraintSet(model);
  Workspace ws(model);
  RobotProblem problem(model, chain.q_closed, projectVelocity(model, ws, makeConstraintSet(model), chain.q_closed, v),
                       std::move(stages), formulation);
  const VectorXd& x = problem.initialState();
  VectorXd u = VectorXd::Zero(count), next = x;
  StageModel out;
  constexpr int kRepetitions = 10;
  run(state, kRepetitions, [&] {
    return calcSeconds([&] {
      double cost = 0;
      for (int i = 0; i < kRepetitions; ++i) {
        u.array() += 1e-3;
        problem.step(0, x, u, next, cost);
        problem.linearize(0, x, u, next, out);
      }
    });
  });
}

void addChains(Formulation formulation) {
  for (int count = 1; count <= 64; count *= 2)
    add("chain of " + std::to_string(count) + " four-bars, " + getName(formulation) + ": step and linearize", 20,
        [=](benchmark::State& state) { measureChain(state, formulation, count); });
}

void addAll() {
  add("unit: product 108 x 108", 200, measureUnit);
  add("node, double support, warm: dynamics", 200,
      [](benchmark::State& state) { measureNode(state, Depth::Dynamics); });
  add("node, double support, warm: dynamics and derivatives", 200,
      [](benchmark::State& state) { measureNode(state, Depth::Derivatives); });
  addWalk(Formulation::Full);
  addWalk(Formulation::Reduced);
  addChains(Formulation::Full);
  addChains(Formulation::Reduced);
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  addAll();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
