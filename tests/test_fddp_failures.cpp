// FDDP when interrupted, with failing problems, and with invalid options.
#include <catch2/catch.hpp>
#include <limits>
#include <sstream>

#include "fddp_oracle.h"
#include "solve/receding.h"

using namespace bielle;
using namespace bielle::test;

namespace {

/// Forwards to a problem and spoils some of its answers.
class SpoiledProblem : public NodewiseProblem {
 public:
  enum class Fault { None, Status, Nan, Throw };
  explicit SpoiledProblem(const PlainProblem& inner) : inner_(inner) {}

  Fault fault = Fault::Status;
  int bad_evaluation = -1;               ///< evaluate() of this stage is spoiled
  int bad_linearization = -1;            ///< linearize() of this stage is spoiled
  double largest_state = 1e300;          ///< evaluate() is spoiled where a state is larger
  const VectorXd* only_state = nullptr;  ///< evaluate() is spoiled at all others
  mutable std::atomic<int> num_spoiled{0};

  int numStages() const override { return inner_.numStages(); }
  int stateSize() const override { return inner_.stateSize(); }
  int tangentSize(int node) const override { return inner_.tangentSize(node); }
  int controlSize(int stage) const override { return inner_.controlSize(stage); }
  const VectorXd& initialState() const override { return inner_.initialState(); }
  void evaluate(EvaluateTask& task, ProblemScratch* scratch) const override {
    inner_.evaluate(task, scratch);
    const VectorXd& x = *task.x;
    if (task.node == bad_evaluation || x.lpNorm<Eigen::Infinity>() > largest_state || (only_state && x != *only_state))
      spoil(task.out->cost, task.out->status, task.out->failure);
  }
  void linearize(LinearizeTask& task, ProblemScratch* scratch) const override {
    inner_.linearize(task, scratch);
    if (task.node == bad_linearization) spoil(task.out->Fx()(0, 1), task.status, task.failure);
  }
  void integrate(const IntegrateTask& task, ProblemScratch* scratch) const override { inner_.integrate(task, scratch); }
  void difference(const DifferenceTask& task, ProblemScratch* scratch) const override {
    inner_.difference(task, scratch);
  }

 private:
  void spoil(double& value, NumericalStatus& status, std::string& failure) const {
    ++num_spoiled;
    switch (fault) {
      case Fault::None:
        break;
      case Fault::Status:
        status = NumericalStatus::Failed;
        failure = "the knee is locked";
        break;
      case Fault::Nan:
        value = std::numeric_limits<double>::quiet_NaN();
        break;
      case Fault::Throw:
        throw std::logic_error("a knee that is no joint");
    }
  }
  const PlainProblem& inner_;
};

}  // namespace

TEST_CASE("an interrupted solve keeps the iterate it had, by the flag as by the callback") {
  const bool by_flag = GENERATE(true, false);
  FddpOptions options;
  options.rollout_segments = GENERATE(1, 4);
  auto problem = makeCartPole();
  ShootingTrajectory t = makeGuess(problem), seen;
  std::atomic<bool> interrupt{false};
  FddpObserver observer;
  observer.interrupt = &interrupt;
  observer.callback = [&](const FddpIteration& line, const ShootingTrajectory& iterate) {
    if (line.iteration == 5) {
      seen = iterate;
      interrupt = by_flag;
      if (!by_flag) return FddpAction::Stop;
    }
    return FddpAction::Continue;
  };
  const double start = calcCost(problem, t.us);
  const FddpSummary summary = solveInPlace(problem, t, options, observer);
  CHECK(summary.termination == FddpTermination::Interrupted);
  CHECK(summary.iterations == 5);
  CHECK(t.xs == seen.xs);
  CHECK(t.us == seen.us);
  CHECK(calcCostAlong(problem, t) == Approx(summary.cost));
  CHECK(calcLargestGap(problem, t) == Approx(summary.gap).margin(1e-12));
  if (options.rollout_segments == 1) CHECK(calcCost(problem, t.us) == Approx(summary.cost));
  CHECK(summary.cost < start);
}

TEST_CASE("a problem that fails or gives NaN at a node ends the solve with the node's name") {
  using Fault = SpoiledProblem::Fault;
  const Fault fault = GENERATE(Fault::Status, Fault::Nan);
  const bool evaluating = GENERATE(true, false);
  auto inner = makePendulum();
  SpoiledProblem problem(inner);
  problem.fault = fault;
  (evaluating ? problem.bad_evaluation : problem.bad_linearization) = 37;
  ShootingTrajectory t = makeGuess(problem);
  const ShootingTrajectory guess = t;
  const FddpSummary summary = solveInPlace(problem, t);
  CHECK(summary.termination == FddpTermination::Failed);
  CAPTURE(summary.message);
  const bool named =
      summary.message.find("node 37") == 0 || (fault == Fault::Nan && summary.message.find("node 3") == 0);
  CHECK(named);
  if (fault == Fault::Status) CHECK(summary.message.find("the knee is locked") != std::string::npos);
  CHECK(t.us == guess.us);
}

TEST_CASE("trials on which the problem fails or gives NaN are only too long") {
  using Fault = SpoiledProblem::Fault;
  const Fault fault = GENERATE(Fault::Status, Fault::Nan);
  auto inner = makeCartPole();
  SpoiledProblem problem(inner);
  problem.fault = fault;
  problem.largest_state = 14;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = solveInPlace(problem, t, makeTightOptions());
  CHECK(problem.num_spoiled > 0);
  checkOptimal(inner, summary, t);
}

TEST_CASE(
    "what a problem throws comes out of solve() and step() as it is, from evaluations, rollouts and linearizations") {
  using Fault = SpoiledProblem::Fault;
  const int where = GENERATE(0, 1, 2), threads = GENERATE(1, 2);
  CAPTURE(where, threads);
  auto inner = makeCartPole();
  SpoiledProblem problem(inner);
  problem.fault = Fault::Throw;
  if (where == 0) problem.bad_evaluation = 37;
  if (where == 1) problem.largest_state = 14;  // of trials alone
  if (where == 2) problem.bad_linearization = 37;
  FddpOptions options = makeTightOptions();
  options.threads = threads;
  CHECK_THROWS_AS(solve(problem, makeGuess(problem), options), std::logic_error);
  CHECK(problem.num_spoiled > 0);

  RecedingOptions receding;
  receding.threads = threads;
  receding.gradient_tolerance = options.gradient_tolerance;
  receding.iterations = 300;
  Receding horizon(problem, receding);
  ShootingTrajectory t = makeGuess(problem), seen = t;
  FddpObserver observer;
  observer.callback = [&](const FddpIteration&, const ShootingTrajectory& iterate) {
    seen = iterate;
    return FddpAction::Continue;
  };
  CHECK_THROWS_AS(horizon.step(t, observer), std::logic_error);
  CHECK(t.xs == seen.xs);  // the current iterate
  CHECK(t.us == seen.us);
  problem.fault = Fault::None;  // its memory can be used again
  checkOptimal(inner, horizon.step(t), t);
}

TEST_CASE("an indefinite problem is regularized until it can be solved") {
  DoubleWell problem;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = solveInPlace(problem, t, makeTightOptions());
  checkOptimal(problem, summary, t);
  CHECK(t.xs.back()[0] == Approx(1).margin(0.01));
  CHECK(summary.log.front().regularization > 1e-4);
  CHECK(summary.log.back().regularization < 1e-3 * summary.log.front().regularization);
}

TEST_CASE("a problem nothing can improve ends at the largest regularization, with the reason of the first trial") {
  using Fault = SpoiledProblem::Fault;
  auto inner = makeCartPole();
  SpoiledProblem problem(inner);
  problem.fault = GENERATE(Fault::Status, Fault::Nan);
  problem.only_state = &inner.start;  // no rollout succeeds
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = solveInPlace(problem, t);
  CHECK(summary.termination == FddpTermination::RegularizationMax);
  CHECK(summary.iterations == 0);
  CHECK(summary.message == std::string("no step is acceptable even at the largest regularization") +
                               (problem.fault == Fault::Status ? "; node 1: the knee is locked" : ""));
}

TEST_CASE("options without sense are refused by name") {
  const auto problem = makePendulum();
  const auto check = [&](const FddpOptions& options) { solve(problem, makeGuess(problem), options); };
  FddpOptions options;
  options.min_regularization = 0;
  CHECK_THROWS_WITH(check(options), Catch::Contains("min_regularization"));
  options = FddpOptions();
  options.regularization_increase = 1;
  CHECK_THROWS_WITH(check(options), Catch::Contains("regularization_increase"));
  for (int threads : {-1, 1025, 100000}) {
    options = FddpOptions();
    options.threads = threads;
    CHECK_THROWS_WITH(check(options), Catch::Contains("threads must lie between 0, which means all, and 1024"));
  }
  options.threads = 1024;
  CHECK_NOTHROW(check(options));
  for (int iterations : {0, 1000001, std::numeric_limits<int>::max()}) {
    options.max_iterations = iterations;
    CHECK_THROWS_WITH(check(options), Catch::Contains("max_iterations"));
    RecedingOptions receding;
    receding.iterations = iterations;
    CHECK_THROWS_WITH(Receding(problem, receding), Catch::Contains("RecedingOptions: iterations"));
  }
  RecedingOptions receding;
  receding.rollout_segments = 0;
  CHECK_THROWS_WITH(Receding(problem, receding), Catch::Contains("RecedingOptions: rollout_segments"));
}

TEST_CASE("guesses of wrong sizes are refused with the sizes") {
  auto problem = makePendulum();
  ShootingTrajectory t = makeGuess(problem);
  t.us.pop_back();
  CHECK_THROWS_WITH(solveInPlace(problem, t), Catch::Contains("101 states and 99 controls"));
  t = makeGuess(problem);
  t.xs[4].resize(3);
  CHECK_THROWS_WITH(solveInPlace(problem, t), Catch::Contains("state 4 has size 3"));
}

TEST_CASE("the log prints a header and one line of the same columns per iteration") {
  std::ostringstream out;
  printFddpHeader(out);
  printFddpIteration(out, {7, 1.5, 4e-5, 2e-3, 3e-4, 0.5, 1e-9, 0.25});
  std::istringstream in(out.str());
  std::string header, line;
  std::getline(in, header);
  std::getline(in, line);
  CHECK(header.size() == line.size());
  CHECK(line.find("1.50000000e+00  2.000e-03  4.000e-05  3.000e-04  5.000e-01  1.000e-09     0.250") !=
        std::string::npos);
}
