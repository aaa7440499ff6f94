// What solvers rely on in a shooting problem: linearizations without memory, no allocation, requests that do not fit refused.
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "count_allocations.h"
#include "get_error.h"
#include "problem_probe.h"
#include "random_problem.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("shooting problem: a linearization does not depend on what was computed before") {
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  std::mt19937 rng(26);
  const Model model = loadRobot("bipetto").model;
  const auto make = [&] { return makeSquat(model, {}, {how.formulation, how.step}); };
  const Motion used = make(), fresh = make();
  ProblemProbe problem(*used.problem), untouched(*fresh.problem);
  const VectorXd x0 = problem.initialState(), u = used.guess.us[0];
  const VectorXd x = problem.integrate(x0, randomVector(rng, problem.tangentSize(0), 0.05));
  StageModel once, again, other;
  REQUIRE(untouched.linearize(0, x, u, x0, once) == NumericalStatus::Ok);
  for (int i = 0; i < 3; ++i) {  // elsewhere, with other forces and velocities
    const VectorXd away = problem.integrate(x0, randomVector(rng, problem.tangentSize(0), 0.1));
    REQUIRE(problem.linearize(0, away, u + randomVector(rng, model.nu(), 20), x0, other) == NumericalStatus::Ok);
  }
  for (int i = 0; i < 2; ++i) {  // the second time nothing is new
    REQUIRE(problem.linearize(0, x, u, x0, again) == NumericalStatus::Ok);
    CHECK(calcRelativeError(again.Fx(), once.Fx()) < 1e-9);
    CHECK(calcRelativeError(again.Fu(), once.Fu()) < 1e-9);
    CHECK(calcRelativeError(again.lx, once.lx) < 1e-9);
    CHECK(calcRelativeError(again.lxx().triangularView<Eigen::Lower>(), once.lxx().triangularView<Eigen::Lower>()) <
          1e-9);
    CHECK(calcRelativeError(again.lux(), once.lux()) < 1e-9);
  }
  CHECK(calcRelativeError(other.Fx(), once.Fx()) > 1e-3);
}

TEST_CASE("shooting problem: steps and linearizations allocate nothing after the first") {
  std::mt19937 rng(24);
  const Model model = loadRobot("bipetto").model;
  const VectorXd q = makeStandingPosture(model);
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  const RobotProblem problem = makeProblem(rng, model, q, makeContactTargets(model, q, {0, 1}, 0, 100), how);
  const VectorXd x = problem.initialState();
  const VectorXd u = randomVector(rng, model.nu(), 1);
  const VectorXd small = randomVector(rng, problem.tangentSize(0), 1e-3);
  const VectorXd x2 = ProblemProbe(problem).integrate(x, small);
  const auto stage = problem.makeEvaluation(), terminal = problem.makeEvaluation();
  const auto scratch = problem.makeScratch();
  StageModel models[2];
  models[0].resize(problem.tangentSize(0), model.nu(), problem.tangentSize(1));
  models[1].resize(problem.tangentSize(1), 0, 0);
  VectorXd moved = x, dx(problem.tangentSize(0));
  const auto runAll = [&](const VectorXd& at) {
    std::vector<long> counts(4, 0);
    const auto measure = [&](int i, auto&& f) {
      const long before = num_allocations;
      f();
      counts[i] = num_allocations - before;
    };
    EvaluateTask steps[] = {{0, &at, &u, nullptr, stage.get()}, {1, &x, nullptr, nullptr, terminal.get()}};
    LinearizeTask linearizations[2];
    linearizations[0] = {0, stage.get(), terminal.get(), nullptr, &models[0], NumericalStatus::Failed, {}};
    linearizations[1] = {1, terminal.get(), nullptr, nullptr, &models[1], NumericalStatus::Failed, {}};
    const IntegrateTask move{0, stage.get(), &small, &moved};
    const DifferenceTask difference{0, stage.get(), &x, &dx};
    measure(0, [&] { problem.evaluate(steps, 2, scratch.get()); });
    measure(1, [&] { problem.linearize(linearizations, 2, scratch.get()); });
    measure(2, [&] { problem.integrate(&move, 1, scratch.get()); });
    measure(3, [&] { problem.difference(&difference, 1, scratch.get()); });
    for (const LinearizeTask& task : linearizations) CHECK(task.status == NumericalStatus::Ok);
    return counts;
  };
  const long before = num_allocations;
  const VectorXd counted(100);
  REQUIRE(num_allocations == before + 1);
  runAll(x);
  CHECK(runAll(x2) == std::vector<long>(4, 0));
}

TEST_CASE("shooting problem: a stage that replaces another is as if it had always been there") {
  const Discretization how = GENERATE(from_range(kDiscretizations));
  CAPTURE(how);
  const Model model = loadRobot("bipetto").model;
  const VectorXd q = makeStandingPosture(model), v = VectorXd::Zero(model.nv());
  std::mt19937 rng(27);
  const auto makeStage = [&](const std::vector<int>& contacts, double weight) {
    StageSpec stage;
    stage.step = how.step;
    stage.dt = 0.01;
    stage.constraints = makeConstraintSet(model, makeContactTargets(model, q, contacts, 0, 100));
    stage.state = {weight, q, v, VectorXd::Constant(2 * model.nv(), weight)};
    addGroundCosts(model, {}, VectorXd::Constant(static_cast<int>(contacts.size()), 100), stage);
    return stage;
  };
  const std::vector<StageSpec> stages{makeStage({0, 1}, 1), makeStage({0, 1}, 2), StageSpec()};
  std::vector<StageSpec> others = stages;
  others[1] = makeStage({1}, 3);
  RobotProblem replaced(model, q, v, stages, how.formulation);
  const RobotProblem direct(model, q, v, others, how.formulation);
  ProblemProbe probe(replaced), expected(direct);
  const VectorXd x = probe.integrate(replaced.initialState(), randomVector(rng, replaced.tangentSize(0), 0.01)),
                 u = randomVector(rng, model.nu(), 1);
  StageModel before, after, wanted;
  REQUIRE(probe.linearize(1, x, u, x, before) == NumericalStatus::Ok);  // what was computed before does not matter
  replaced.replaceStage(1, makeStage({1}, 3));
  REQUIRE(probe.linearize(1, x, u, x, after) == NumericalStatus::Ok);
  REQUIRE(expected.linearize(1, x, u, x, wanted) == NumericalStatus::Ok);
  CHECK(after.cost == wanted.cost);
  CHECK(after.Fx() == wanted.Fx());
  CHECK(after.lx == wanted.lx);
  CHECK(before.cost != wanted.cost);

  // The same of numbers that are changed where they are.
  const auto change = [](StageSpec& spec) {
    spec.dt = 0.02;
    spec.state.weight = 4;
    spec.costs[0].weight *= 3;
    for (Closure& closure : spec.constraints.closures) closure.kp = 25;
  };
  change(others[0]);
  const RobotProblem changed(model, q, v, others, how.formulation);
  REQUIRE(probe.linearize(0, x, u, x, before) == NumericalStatus::Ok);
  const long allocations = num_allocations;
  replaced.changeNumbers(0, change);
  CHECK(num_allocations == allocations);
  REQUIRE(probe.linearize(0, x, u, x, after) == NumericalStatus::Ok);
  REQUIRE(ProblemProbe(changed).linearize(0, x, u, x, wanted) == NumericalStatus::Ok);
  CHECK(after.cost == wanted.cost);
  CHECK(after.Fx() == wanted.Fx());
  CHECK(before.cost != wanted.cost);
  CHECK_THROWS_AS(replaced.changeNumbers(0, [](StageSpec& spec) { spec.dt = 0; }), InputError);
  replaced.changeNumbers(0, change);
  StageSpec large = makeStage({0, 1}, 1);
  addGroundCosts(model, {}, VectorXd::Constant(2, 100), large);
  CHECK_THROWS_AS(replaced.replaceStage(0, large), std::invalid_argument);
}

TEST_CASE("shooting problem: what does not fit is refused, what is not finite fails") {
  std::mt19937 rng(25);
  const Mechanism mechanism = makePlanarFourBar(0.4, 0.15, 0.35, 0.3, 0.7);
  const Model& model = mechanism.model;
  const VectorXd v = VectorXd::Zero(4);
  const auto make = [&](const std::function<void(StageSpec&)>& spoil, Formulation formulation = Formulation::Full) {
    std::vector<StageSpec> stages;
    stages.push_back(makeTerminal(rng, model, mechanism.q_closed));
    stages.push_back(makeTerminal(rng, model, mechanism.q_closed));
    spoil(stages[0]);
    return RobotProblem(model, mechanism.q_closed, v, std::move(stages), formulation);
  };
  CHECK_NOTHROW(make([](StageSpec&) {}));
  CHECK_THROWS_AS(make([](StageSpec& s) { s.dt = 0; }), InputError);
  CHECK_THROWS_AS(make([](StageSpec& s) { s.state.weights.resize(3); }), InputError);
  CHECK_THROWS_AS(make([](StageSpec& s) { s.control.reference.resize(0); }), InputError);
  CHECK_THROWS_AS(make([](StageSpec& s) { s.costs[0].activation.weights.resize(2); }), InputError);
  for (double weight : {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const auto refuse = [&](const auto& spoil, const std::string& what) {
      CHECK_THAT(getError([&] { make([&](StageSpec& s) { spoil(s) = weight; }); }), Catch::Contains(what));
    };
    refuse([](StageSpec& s) -> double& { return s.costs[0].weight; }, "cost 'com': a weight is negative or not finite");
    refuse([](StageSpec& s) -> double& { return s.costs[0].activation.weights[1]; }, "cost 'com': a weight is");
    refuse([](StageSpec& s) -> double& { return s.state.weight; }, "a weight of the state cost is");
    refuse([](StageSpec& s) -> double& { return s.state.weights[2]; }, "a weight of the state cost is");
    refuse([](StageSpec& s) -> double& { return s.control.weight; }, "a weight of the control cost is");
    refuse([](StageSpec& s) -> double& { return s.control.weights[0]; }, "a weight of the control cost is");
    refuse([](StageSpec& s) -> double& { return s.time_weight; }, "its cost per second is");
  }
  CHECK_THROWS_AS(RobotProblem(model, mechanism.q_closed, VectorXd::Zero(3), {}), InputError);
  CHECK_THROWS_AS(RobotProblem(model, mechanism.q_closed, v, {}), InputError);
  const RobotProblem whole = make([](StageSpec&) {});
  ProblemProbe problem(whole);
  VectorXd x = problem.initialState(), next = x;
  const VectorXd u = VectorXd::Zero(1);
  double cost = 0;
  CHECK(problem.step(0, x, u, next, cost) == NumericalStatus::Ok);
  x[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK(problem.step(0, x, u, next, cost) == NumericalStatus::Failed);
  StageModel out;
  CHECK(problem.linearize(0, x, u, next, out) == NumericalStatus::Failed);
  CHECK(problem.calcTerminalCost(x, cost) == NumericalStatus::Failed);
  CHECK(problem.linearizeTerminal(x, out) == NumericalStatus::Failed);

  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const std::function<void(StageSpec&)> spoils[] = {[&](StageSpec& s) { s.state.q_ref[0] = nan; },
                                                    [&](StageSpec& s) { s.state.v_ref[1] = nan; }};
  for (Formulation formulation : {Formulation::Full, Formulation::Reduced})
    for (const auto& spoil : spoils) {
      const RobotProblem whole_spoilt = make(spoil, formulation);
      ProblemProbe spoilt(whole_spoilt);
      CHECK(spoilt.step(0, spoilt.initialState(), u, next, cost) == NumericalStatus::Failed);
    }
}
