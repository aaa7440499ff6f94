// FDDP that is interrupted, given problems that fail, or asked for nonsense.
#include <catch2/catch.hpp>
#include <sstream>

#include "fddp_oracle.h"

using namespace bielle;
using namespace bielle::test;

namespace {

/// Forwards to a problem and spoils some of its answers.
class SpoiledProblem : public ShootingProblem {
 public:
  enum class Fault { Status, Nan, Throw };
  explicit SpoiledProblem(ShootingProblem& inner) : inner_(inner) {}

  Fault fault = Fault::Status;
  int bad_stage = -1;            ///< linearize() of this stage is spoiled
  double largest_state = 1e300;  ///< step() is spoiled where a state is larger
  std::atomic<int> num_spoiled{0};

  int numStages() const override { return inner_.numStages(); }
  int stateSize() const override { return inner_.stateSize(); }
  int tangentSize(int node) const override { return inner_.tangentSize(node); }
  int controlSize(int stage) const override { return inner_.controlSize(stage); }
  const VectorXd& initialState() const override { return inner_.initialState(); }
  void integrate(int k, ConstVectorRef x, ConstVectorRef dx, VectorRef out) const override {
    inner_.integrate(k, x, dx, out);
  }
  void difference(int k, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const override {
    inner_.difference(k, x0, x1, dx);
  }
  StepStatus step(int k, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) override {
    const StepStatus status = inner_.step(k, x, u, x_next, cost);
    return x.lpNorm<Eigen::Infinity>() > largest_state ? spoil(cost) : status;
  }
  StepStatus calcTerminalCost(ConstVectorRef x, double& cost) override { return inner_.calcTerminalCost(x, cost); }
  StepStatus linearize(int k, ConstVectorRef x, ConstVectorRef u, ConstVectorRef next, StageModel& out) override {
    const StepStatus status = inner_.linearize(k, x, u, next, out);
    return k == bad_stage ? spoil(out.Fx()(0, 1)) : status;
  }
  StepStatus linearizeTerminal(ConstVectorRef x, StageModel& out) override { return inner_.linearizeTerminal(x, out); }

 private:
  StepStatus spoil(double& value) {
    ++num_spoiled;
    if (fault == Fault::Throw) throw std::runtime_error("the knee is locked");
    if (fault == Fault::Nan) value = std::numeric_limits<double>::quiet_NaN();
    return fault == Fault::Status ? StepStatus::Failed : StepStatus::Ok;
  }
  ShootingProblem& inner_;
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
  observer.callback = [&](const FddpIteration& line) {
    if (line.iteration == 5) {
      seen = t;
      interrupt = by_flag;
      if (!by_flag) return FddpAction::Stop;
    }
    return FddpAction::Continue;
  };
  const double start = calcCost(problem, t.us);
  const FddpSummary summary = Fddp(options).solve(problem, t, observer);
  CHECK(summary.termination == FddpTermination::Interrupted);
  CHECK(summary.iterations == 5);
  CHECK(t.xs == seen.xs);
  CHECK(t.us == seen.us);
  CHECK(calcCostAlong(problem, t) == Approx(summary.cost));
  CHECK(calcLargestGap(problem, t) == Approx(summary.gap).margin(1e-12));
  if (options.rollout_segments == 1) CHECK(calcCost(problem, t.us) == Approx(summary.cost));
  CHECK(summary.cost < start);
}

TEST_CASE("a problem that fails, throws or gives NaN at a node ends the solve with the node's name") {
  using Fault = SpoiledProblem::Fault;
  const Fault fault = GENERATE(Fault::Status, Fault::Nan, Fault::Throw);
  auto inner = makePendulum();
  SpoiledProblem problem(inner);
  problem.fault = fault;
  problem.bad_stage = 37;
  ShootingTrajectory t = makeGuess(problem);
  const ShootingTrajectory guess = t;
  const FddpSummary summary = Fddp().solve(problem, t);
  CHECK(summary.termination == FddpTermination::Failed);
  const bool named =
      summary.message.find("node 37") == 0 || (fault == Fault::Nan && summary.message.find("node 3") == 0);
  CHECK(named);
  if (fault == Fault::Throw) CHECK(summary.message.find("the knee is locked") != std::string::npos);
  CHECK(t.us == guess.us);
}

TEST_CASE("trials on which the problem fails, throws or gives NaN are only too long") {
  using Fault = SpoiledProblem::Fault;
  const Fault fault = GENERATE(Fault::Status, Fault::Nan, Fault::Throw);
  auto inner = makeCartPole();
  SpoiledProblem problem(inner);
  problem.fault = fault;
  problem.largest_state = 14;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = Fddp(makeTightOptions()).solve(problem, t);
  CHECK(problem.num_spoiled > 0);
  checkOptimal(inner, summary, t);
}

TEST_CASE("an indefinite problem is regularized until it can be solved") {
  DoubleWell problem;
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = Fddp(makeTightOptions()).solve(problem, t);
  checkOptimal(problem, summary, t);
  CHECK(t.xs.back()[0] == Approx(1).margin(0.01));
  CHECK(summary.log.front().regularization > 1e-4);
  CHECK(summary.log.back().regularization < 1e-3 * summary.log.front().regularization);
}

TEST_CASE("a problem nothing can improve ends at the largest regularization") {
  auto inner = makeCartPole();
  SpoiledProblem problem(inner);
  problem.largest_state = 0;  // no rollout succeeds
  ShootingTrajectory t = makeGuess(problem);
  const FddpSummary summary = Fddp().solve(problem, t);
  CHECK(summary.termination == FddpTermination::RegularizationMax);
  CHECK(summary.iterations == 0);
  CHECK(summary.message == "no step is acceptable even at the largest regularization");
}

TEST_CASE("options without sense are refused by name") {
  FddpOptions options;
  options.min_regularization = 0;
  CHECK_THROWS_WITH(Fddp(options), Catch::Contains("min_regularization"));
  options = FddpOptions();
  options.regularization_increase = 1;
  CHECK_THROWS_WITH(Fddp(options), Catch::Contains("regularization_increase"));
}

TEST_CASE("guesses of wrong sizes are refused with the sizes") {
  auto problem = makePendulum();
  ShootingTrajectory t = makeGuess(problem);
  t.us.pop_back();
  CHECK_THROWS_WITH(Fddp().solve(problem, t), Catch::Contains("101 states and 99 controls"));
  t = makeGuess(problem);
  t.xs[4].resize(3);
  CHECK_THROWS_WITH(Fddp().solve(problem, t), Catch::Contains("state 4 has size 3"));
}

TEST_CASE("the log prints a header and one line of the same columns per iteration") {
  std::ostringstream out;
  printFddpHeader(out);
  printFddpIteration(out, {7, 1.5, 2e-3, 3e-4, 0.5, 1e-9, 0.25});
  std::istringstream in(out.str());
  std::string header, line;
  std::getline(in, header);
  std::getline(in, line);
  CHECK(header.size() == line.size());
  CHECK(line.find("1.50000000e+00  2.000e-03  3.000e-04  5.000e-01  1.000e-09     0.250") != std::string::npos);
}
