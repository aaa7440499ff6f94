#include "bench/bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>

#include "bench/receding_horizon.h"
#include "bielle/dynamics/assembly.h"
#include "bielle/motion/locomotion.h"
#include "bielle/motion/squat.h"
#include "bielle/results/result.h"
#include "bielle/robots/fourbar_chain.h"
#include "motion/benchmark_walk.h"
#include "solve/fddp_solve.h"
#include "solve/lq_sweep.h"

namespace bielle {
namespace {

constexpr Formulation kFormulations[] = {Formulation::Full, Formulation::Reduced};

double calcSeconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double calcLeastSeconds(int repetitions, const std::function<void()>& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repetitions; ++i) least = std::min(least, calcSeconds(work));
  return least;
}

double calcUnit() {
  const MatrixXd a = MatrixXd::Random(108, 108), b = MatrixXd::Random(108, 108);
  MatrixXd c = MatrixXd::Zero(108, 108);
  constexpr int kProducts = 10;
  const double seconds = calcLeastSeconds(200, [&] {
    for (int i = 0; i < kProducts; ++i) c.noalias() += a * b;
  });
  return c.allFinite() ? seconds / kProducts : 0;  // c is used, so that the products are not optimized away
}

std::string readProcessor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
      return line.substr(line.find(": ") + 2);
  return "unknown";
}

// The same stages without costs.
std::unique_ptr<RobotProblem> makeWithoutCosts(const RobotProblem& problem) {
  const Model& model = problem.model();
  std::vector<StageSpec> stages(problem.numStages() + 1);
  for (size_t k = 0; k < stages.size(); ++k) {
    stages[k].dt = problem.spec(static_cast<int>(k)).dt;
    stages[k].constraints = problem.spec(static_cast<int>(k)).constraints;
  }
  const VectorXd& x0 = problem.initialState();
  return std::make_unique<RobotProblem>(model, x0.head(model.nq()), x0.tail(model.nv()), std::move(stages),
                                        problem.formulation());
}

// All nodes of a problem near a trajectory, in batches if the problem prefers them.
class Passes {
 public:
  Passes(const RobotProblem& problem, const ShootingTrajectory& trajectory)
      : problem_(problem),
        trajectory_(trajectory),
        scratch_(problem.makeScratch()),
        pieces_(std::max(1, problem.numStages() / kPiece)),
        models_(trajectory.xs.size()) {
    const int N = problem.numStages();
    for (int k = 0; k <= N; ++k) {
      evaluations_.push_back(problem.makeEvaluation());
      models_[k].resize(problem.tangentSize(k), k < N ? problem.controlSize(k) : 0,
                        k < N ? problem.tangentSize(k + 1) : 0);
    }
  }
  // In pieces of the horizon; each stage of a piece starts from the result of the previous one.
  void step() {
    const int N = problem_.numStages(), longest = (N + pieces_ - 1) / pieces_;
    for (int i = 0; i < longest; ++i) {
      steps_.clear();
      for (int p = 0; p < pieces_; ++p) {
        const int k = p * N / pieces_ + i, end = (p + 1) * N / pieces_;
        if (k >= end) continue;
        const NodeEvaluation* previous = i > 0 ? evaluations_[k - 1].get() : nullptr;
        steps_.push_back({k, previous ? &previous->x_next : &trajectory_.xs[k], &trajectory_.us[k], previous,
                          evaluations_[k].get()});
      }
      problem_.evaluate(steps_.data(), static_cast<int>(steps_.size()), scratch_.get());
    }
  }
  // About these steps: gaps are closed except for those between the pieces, as in most iterations.
  void linearize() {
    step();
    const int N = problem_.numStages();
    EvaluateTask terminal{N, &evaluations_[N - 1]->x_next, nullptr, evaluations_[N - 1].get(), evaluations_[N].get()};
    problem_.evaluate(&terminal, 1, scratch_.get());
    linearizations_.clear();
    for (int k = 0; k <= N; ++k) {
      linearizations_.emplace_back();
      linearizations_.back().node = k;
      linearizations_.back().at = evaluations_[k].get();
      linearizations_.back().next = k < N ? evaluations_[k + 1].get() : nullptr;
      linearizations_.back().out = &models_[k];
    }
    problem_.linearize(linearizations_.data(), N + 1, scratch_.get());
  }
  const std::vector<StageModel>& models() const { return models_; }

 private:
  static constexpr int kPiece = 15;  // stages: short enough for the controls to have little effect
  const RobotProblem& problem_;
  const ShootingTrajectory trajectory_;
  std::unique_ptr<ProblemScratch> scratch_;
  const int pieces_;
  std::vector<StageModel> models_;
  std::vector<std::unique_ptr<NodeEvaluation>> evaluations_;
  std::vector<EvaluateTask> steps_;
  std::vector<LinearizeTask> linearizations_;
};

// Every crank at about 1 rad/s.
VectorXd makeChainVelocity(const FourBarChain& chain) {
  VectorXd v = VectorXd::Zero(chain.model.nv());
  for (const Motor& motor : chain.model.motors()) v[motor.dof] = 1;
  Workspace ws(chain.model);
  return projectVelocity(chain.model, ws, makeConstraintSet(chain.model), chain.q_closed, v);
}

double countRollouts(const FddpSummary& summary) {
  double rollouts = 0;
  for (const FddpIteration& line : summary.log)
    if (line.step > 0) rollouts += 1 - std::log2(line.step);
  return std::max(1.0, rollouts);
}

FddpOptions makeOptions(int iterations, int threads) {
  FddpOptions options;
  options.max_iterations = iterations;
  options.threads = threads;
  return options;
}

// At most `iterations` iterations from the guess. The trajectory is stored in `result`, if given.
FddpSummary iterate(Motion& motion, int iterations, int threads, ShootingTrajectory* result = nullptr) {
  FddpResult solved = solve(*motion.problem, motion.guess, makeOptions(iterations, threads));
  if (result) *result = std::move(solved.trajectory);
  return solved.summary;
}

class Bench {
 public:
  Bench(const Model& model, const BenchOptions& options)
      : model_(model), options_(options), whole_(options.extent == BenchExtent::Whole) {}

  BenchReport run() {
    describe();
    measureUnit();
    for (Formulation formulation : kFormulations) measureWalk(formulation);
    for (Formulation formulation : kFormulations) measureSolves(formulation);
    for (Formulation formulation : kFormulations)
      for (bool cones : {false, true}) measureReceding(formulation, cones);
    for (Formulation formulation : kFormulations) measureChains(formulation);
    for (Formulation formulation : kFormulations) measureHorizons(formulation);
    measureUnit();
    return report_;
  }
  BenchReport runBatch() {
    describe();
    measureUnit();
    for (BatchMotion motion : {BatchMotion::Stand, BatchMotion::Walk, BatchMotion::Fall}) measureWorlds(motion);
    return report_;
  }

 private:
  void describe() {
    report_.robot = model_.name();
    report_.processor = readProcessor();
    report_.compiler = getBuildInfo().compiler;
    report_.flags = BIELLE_FLAGS;
  }
  void tell(const std::string& what, Formulation formulation) const {
    if (options_.progress) options_.progress(what + ", " + getName(formulation) + " formulation");
  }
  std::vector<int> threads() const {
    return options_.threads > 1 ? std::vector<int>{1, options_.threads} : std::vector<int>{1};
  }

  // The measured walk; a short one for tests.
  BenchmarkWalkOptions getWalk() const {
    BenchmarkWalkOptions walk;
    if (whole_) return walk;
    walk.start_nodes = 4;
    walk.swing_nodes = 6;
    walk.cycles = 1;
    walk.total_nodes = 24;
    return walk;
  }
  SquatOptions getSquat() const {
    SquatOptions squat;
    if (whole_) return squat;
    squat.depth = 0.95;
    squat.duration = 0.3;
    squat.settle = 0.03;
    return squat;
  }

  void measureUnit() {
    const double unit = calcUnit();
    report_.unit = report_.unit > 0 ? std::min(report_.unit, unit) : unit;
  }

  void measureWalk(Formulation formulation) {
    tell("benchmark walk", formulation);
    Motion motion = makeBenchmarkWalk(model_, getWalk(), formulation);
    const int n = motion.problem->numStages(), repetitions = whole_ ? 5 : 1;
    NodeTimes times;
    times.formulation = formulation;
    times.tangent_size = motion.problem->tangentSize(0);
    const std::unique_ptr<RobotProblem> bare = makeWithoutCosts(*motion.problem);
    ShootingTrajectory walking;
    iterate(motion, 3, 1, &walking);
    Passes dynamics(*bare, walking), all(*motion.problem, walking);
    dynamics.linearize();  // sizes the memory
    all.linearize();
    times.dynamics = calcLeastSeconds(repetitions, [&] { dynamics.step(); }) / n;
    times.derivatives = calcLeastSeconds(repetitions, [&] { dynamics.linearize(); }) / n;
    times.linearize = calcLeastSeconds(repetitions, [&] { all.linearize(); }) / n;
    LqSweep sweep;
    const LqRegularization regularization{1e-9, 1e-9};
    sweep.update(all.models(), regularization);
    times.sweep = calcLeastSeconds(repetitions, [&] { sweep.update(all.models(), regularization); }) / n;
    times.rollout = std::numeric_limits<double>::infinity();
    for (int threads : threads()) measureIterations(motion, threads, times);
    report_.nodes.push_back(times);
  }

  void measureIterations(Motion& motion, int threads, NodeTimes& times) {
    const int n = motion.problem->numStages();
    FddpSummary best;
    const FddpOptions options = makeOptions(whole_ ? 10 : 2, threads);
    FddpMemory memory;
    // The first solve starts the threads and allocates memory, which takes as long as several iterations.
    for (int i = 0; i < (whole_ ? 4 : 2); ++i) {
      ShootingTrajectory trajectory = motion.guess;
      const FddpSummary summary = FddpSolve(options, *motion.problem, trajectory, {}, memory).run();
      if (i <= 1 || summary.seconds < best.seconds) best = summary;
    }
    const double rollouts = countRollouts(best);
    if (threads == 1) times.rollout = best.rollout_seconds / rollouts / n;
    const double linearize = best.evaluate_seconds + best.linearize_seconds;
    const double work = std::max(best.seconds * (threads == 1), linearize + best.sweep_seconds + best.rollout_seconds);
    IterationTimes iteration;
    iteration.formulation = motion.problem->formulation();
    iteration.threads = threads;
    iteration.seconds = best.seconds / best.iterations / n;
    iteration.rollouts = rollouts / best.iterations;
    iteration.linearize = linearize / work;
    iteration.sweep = best.sweep_seconds / work;
    iteration.rollout = best.rollout_seconds / work;
    report_.iterations.push_back(iteration);
  }

  void measureSolve(const std::string& name, Formulation formulation, const std::function<Motion()>& make) {
    for (int threads : threads()) {
      SolveTime time;
      time.motion = name;
      time.formulation = formulation;
      time.threads = threads;
      time.seconds = calcSeconds([&] {
        Motion motion = make();
        const FddpSummary summary = iterate(motion, whole_ ? 200 : 3, threads);
        time.iterations = summary.iterations;
        time.converged = summary.termination == FddpTermination::Converged;
      });
      report_.solves.push_back(time);
    }
  }
  void measureSolves(Formulation formulation) {
    tell("squat from a cold start", formulation);
    measureSolve("squat", formulation, [&] { return makeSquat(model_, getSquat(), formulation); });
    tell("benchmark walk from a cold start", formulation);
    measureSolve("benchmark walk", formulation, [&] { return makeBenchmarkWalk(model_, getWalk(), formulation); });
  }

  ShiftOptions getReceding(Formulation formulation, bool cones, int threads) const {
    ShiftOptions options;
    options.threads = threads;
    options.walk = getWalk();
    if (cones) options.walk.friction = LocomotionOptions{}.friction;
    if (whole_) {
      const bool full = formulation == Formulation::Full;
      options.shifts = full ? std::max(1, options_.shifts / 30) : options_.shifts;
      return options;
    }
    options.shifts = 20;
    options.nodes = 12;
    options.first_iterations = 5;
    return options;
  }
  void measureReceding(Formulation formulation, bool cones) {
    tell(cones ? "receding horizon with wrench cones" : "receding horizon", formulation);
    for (int threads : threads())
      report_.receding.push_back(runRecedingHorizon(model_, formulation, getReceding(formulation, cones, threads)));
  }

  void measureChains(Formulation formulation) {
    tell("chains of four-bars", formulation);
    for (int count = 1; count <= (whole_ ? 64 : 4); count *= 2) {
      FourBarChainOptions options;
      options.count = count;
      const FourBarChain chain = makeFourBarChain(options);
      constexpr int kStages = 4;
      std::vector<StageSpec> stages(kStages + 1);
      for (StageSpec& stage : stages) {
        stage.dt = 1e-3;
        stage.constraints = makeConstraintSet(chain.model);
      }
      RobotProblem problem(chain.model, chain.q_closed, makeChainVelocity(chain), std::move(stages), formulation);
      Passes passes(problem, {std::vector<VectorXd>(kStages + 1, problem.initialState()),
                              std::vector<VectorXd>(kStages, VectorXd::Zero(count))});
      passes.linearize();
      const int repetitions = whole_ ? std::max(4, 200 / count) : 2;
      const double seconds = calcLeastSeconds(repetitions, [&] { passes.linearize(); }) / kStages;
      report_.chains.push_back({formulation, count, seconds});
    }
  }

  void measureWorlds(BatchMotion motion) {
    if (options_.progress) options_.progress(std::string("robots that ") + getName(motion));
    BatchTask task(model_, motion);
    for (double time_step : {1e-3, 2.5e-4}) {
      std::vector<BatchTime> times;
      for (int threads : threads()) times.push_back({motion, time_step, threads});
      for (int i = 0; i < (whole_ ? 5 : 1); ++i)
        for (BatchTime& time : times) {
          const BatchSpeed speed =
              measureBatch(task, whole_ ? kBatchWorlds : 8, whole_ ? 0.2 : 0.01, time_step, time.threads);
          time.rate = std::max(time.rate, speed.steps / speed.wall);
          time.rounds = speed.rounds;
          time.broken = speed.broken;
          time.deviation = speed.deviation;
        }
      report_.batch.insert(report_.batch.end(), times.begin(), times.end());
    }
  }

  void measureHorizons(Formulation formulation) {
    tell("horizons", formulation);
    for (int nodes : whole_ ? std::vector<int>{50, 100, 200, 500, 1000} : std::vector<int>{20, 40}) {
      BenchmarkWalkOptions options;
      options.cycles = (nodes - options.start_nodes) / (2 * (options.swing_nodes + options.switch_nodes));
      options.total_nodes = nodes;
      Motion motion = makeBenchmarkWalk(model_, options, formulation);
      double seconds = std::numeric_limits<double>::infinity();
      for (int i = 0; i < (whole_ ? 3 : 1); ++i) {
        const FddpSummary summary = iterate(motion, 1, 1);
        seconds = std::min(seconds, summary.evaluate_seconds + summary.linearize_seconds + summary.sweep_seconds +
                                        summary.rollout_seconds / countRollouts(summary));
      }
      report_.horizons.push_back({formulation, nodes, seconds / nodes});
    }
  }

  const Model& model_;
  const BenchOptions& options_;
  const bool whole_;
  BenchReport report_;
};

}  // namespace

BenchReport runBench(const Model& model, const BenchOptions& options) { return Bench(model, options).run(); }
BenchReport runBatchBench(const Model& model, const BenchOptions& options) { return Bench(model, options).runBatch(); }

}  // namespace bielle
