// Gradients of designs: the measures of kept motions and the searches that use them. Oracles: fourth-order differences
// over designs, each made and lifted separately; minima by hand.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "bielle/model/error.h"
#include "bielle/motion/walk.h"
#include "check_derivative.h"
#include "design/run.h"
#include "design_trials.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;

namespace {

DesignMotion makeShortWalk() {
  WalkOptions options;
  options.speed = 0.4, options.steps = 2, options.gait.timing.time_step = 0.024;
  return {"walk",
          [options](const Model& model, const StandingRobot& standing) { return planWalk(model, options, standing); }};
}

Eigen::Index findActive(const MeasurePieces& term) {
  Eigen::Index active = 0;
  term.values.maxCoeff(&active);
  return active;
}

// Terms of an objective, and along a direction the margin that changes most, at x against robots beside x.
void checkKeptSlopes(const DesignEvaluator& evaluator, const VectorXd& x) {
  CAPTURE(x);
  const SlopedEvaluation here = evaluator.differentiate(x);
  REQUIRE(here.evaluation.status == DesignStatus::Feasible);
  const auto count = static_cast<Eigen::Index>(here.terms.size());
  MatrixXd slopes(count, x.size());
  const auto read = [&](const Evaluation& of) {
    VectorXd out(count);
    for (size_t i = 0; i < here.terms.size(); ++i)
      out[static_cast<Eigen::Index>(i)] = evaluator.objective()[i].weight / evaluator.start().terms[i] * of.terms[i];
    return out;
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    const MeasurePieces& term = here.terms[static_cast<size_t>(i)];
    const Eigen::Index active = findActive(term);
    slopes.row(i) = term.gradients.row(active);
    CHECK(term.values[active] == Approx(read(here.evaluation)[i]).epsilon(1e-9));
  }
  const MatrixXd numeric = differentiate(x, 1e-4, [&](const VectorXd& other) {
    const Evaluation there = evaluator.evaluate(other);
    REQUIRE(there.status == DesignStatus::Feasible);
    return read(there);
  });
  INFO(slopes << "\n\n" << numeric);
  for (Eigen::Index i = 0; i < count; ++i)
    checkDerivative(slopes.row(i), numeric.row(i), getName(evaluator.objective()[static_cast<size_t>(i)].measure));
  Eigen::Index linkage = 0;
  here.limits.gradients.rowwise().norm().maxCoeff(&linkage);
  const VectorXd along = here.limits.gradients.row(linkage).normalized();
  checkDerivative(here.limits.gradients.row(linkage) * along,
                  differentiate(VectorXd::Zero(1), 1e-4,
                                [&](const VectorXd& t) {
                                  return VectorXd::Constant(
                                      1, evaluator.differentiate(x + t[0] * along).limits.values[linkage]);
                                }),
                  "margin");
}

}  // namespace

TEST_CASE("design gradient: Bipetto's knee, torques and energy of kept motions") {
  const DesignSpec spec = readDesignSpec(kKnee);
  const Parametrization robot = makeParametrization(spec);
  const std::vector<std::string> knees = {"motor_knee_left", "motor_knee_right"};
  EvaluationOptions options;
  options.mode = MotionMode::Kept;
  const DesignEvaluator evaluator(robot, {makeSquat(0.9, 0.8, 0.1, 0.04), makeShortWalk()},
                                  {{Measure::PeakTorque, knees, 1},
                                   {Measure::RmsTorque, knees, 2},
                                   {Measure::Energy, knees, 0.5},
                                   {Measure::RmsTorque, {}, 1}},
                                  options);
  checkKeptSlopes(evaluator, robot.start());
  VectorXd x = robot.start();
  x[0] -= 0.006, x[1] += 0.004, x[2] -= 0.005, x[3] += 0.003, x[4] += 0.002;
  checkKeptSlopes(evaluator, x);
}

TEST_CASE("design gradient: the margin is that of the lift") {
  const Parametrization robot = makeParametrization(readDesignSpec(kKnee));
  const auto make = [&](double margin) {
    EvaluationOptions options;
    options.mode = MotionMode::Kept;
    options.margin = margin;
    return DesignEvaluator(robot, {makeSquat(0.9)}, {{Measure::RmsTorque, {}, 1}}, options);
  };
  const MeasurePieces limits = make(0.1).differentiate(robot.start()).limits;
  const double least = std::sqrt(square(1.01 * 0.1) - limits.values.maxCoeff());
  CHECK(least < 0.5);
  CHECK_NOTHROW(make(least * (1 - 1e-6)));
  CHECK_THROWS_WITH(make(least * (1 + 1e-6)), Contains("closer to a dead point"));
  // The measure of constraints comes to it from the singular values of the closed motions.
  EvaluationOptions options;
  options.mode = MotionMode::Kept;
  options.constraints = {{Measure::Margin, {}, 0.5, true}};
  const DesignEvaluator bounded(robot, {makeSquat(0.9)}, {{Measure::RmsTorque, {}, 1}}, options);
  CHECK(bounded.start().constraints[0] == Approx(least).epsilon(1e-9));
  CHECK(bounded.start().status == DesignStatus::Violated);
}

TEST_CASE("design gradient: searches with gradients take kinks and limits") {
  SearchProblem problem;
  problem.lower = Eigen::Vector2d(-1, 0), problem.upper = Eigen::Vector2d(3, 10), problem.start = Eigen::Vector2d(2, 9);
  int calls = 0;
  bool limited = false;
  problem.sloped = [&](const VectorXd& x, const SearchStage&) {
    ++calls;
    SlopedValue out;
    // max(|x - 1|, |y - 4|) + (x + y - 6)^2 / 8: with s = x - 1 = y - 4 the sum is s + (2 s - 1)^2 / 8, least at s = 0.
    MeasurePieces kinks{VectorXd(4), MatrixXd(4, 2)};
    kinks.values << x[0] - 1, 1 - x[0], x[1] - 4, 4 - x[1];
    kinks.gradients << 1, 0, -1, 0, 0, 1, 0, -1;
    const double rest = x[0] + x[1] - 6;
    out.terms = {kinks, {VectorXd::Constant(1, rest * rest / 8), MatrixXd::Constant(1, 2, rest / 4)}};
    out.value = kinks.values.maxCoeff() + rest * rest / 8;
    if (limited) out.limits = {VectorXd::Constant(1, x[0] * x[0] - 0.25), Eigen::RowVector2d(2 * x[0], 0)};  // x <= 1/2
    if (limited && x[0] > 0.501) out.value = 100;  // the search is told a tighter limit
    return out;
  };
  for (const SearchAlgorithm algorithm : {SearchAlgorithm::Slsqp, SearchAlgorithm::Mma}) {
    CAPTURE(getName(algorithm));
    calls = 0, limited = false;
    problem.start = Eigen::Vector2d(2, 9);
    SearchResult result = minimizeByStages(problem, {{algorithm, 200, 1e-7}}, 1);
    CHECK((result.x - Eigen::Vector2d(1, 4)).norm() < 1e-4);
    CHECK(result.value == Approx(0.125).epsilon(1e-4));
    CHECK(result.evaluations == calls);
    // With x <= 1/2 the largest is 1/2 for y in 3.5 .. 4.5, and y = 4.5 has the least rest.
    limited = true;
    problem.start = Eigen::Vector2d(-0.5, 9);
    result = minimizeByStages(problem, {{algorithm, 400, 1e-9}}, 1);
    CHECK((result.x - Eigen::Vector2d(0.5, 4.5)).norm() < 1e-3);
  }
  // From where nothing can be differentiated, nothing is searched; what is thrown comes out.
  problem.sloped = [](const VectorXd&, const SearchStage&) { return SlopedValue{3, {}, {}}; };
  CHECK(minimizeByStages(problem, {{SearchAlgorithm::Slsqp, 10, 1e-3}}, 1).evaluations == 1);
  problem.sloped = [](const VectorXd&, const SearchStage&) -> SlopedValue { throw InputError("a", "b", "c", "d"); };
  CHECK_THROWS_AS(minimizeByStages(problem, {{SearchAlgorithm::Mma, 10, 1e-3}}, 1), InputError);
}

namespace {

// Bipetto's knee with a short squat, searched by one algorithm.
std::string makeKneeSpec(const std::string& algorithm) {
  std::string text = readFile(kKnee);
  text = replaceOnce(text, "robot: bipetto", "robot: " + std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto");
  text = replaceOnce(text, "{depth: 0.6}", "{depth: 0.8, duration: 0.6, settle: 0.1, time_step: 0.04}");
  text = replaceOnce(text, "  - {motion: walk, set: {speed: 0.5}}\n", "");
  text = replaceOnce(text, "mode: reoptimized\nmargin: 0.1 ", "mode: kept\nmargin: 0.15 ");
  const size_t search = text.find("search:");
  return text.substr(0, search) + "search:\n  searches: 1\n  stages:\n    - {algorithm: " + algorithm +
         ", evaluations: 60}\n";
}

double readValue(const std::string& page) {
  const std::string row = "| value | 1 | ";
  return std::strtod(page.c_str() + page.find(row) + row.size(), nullptr);
}

}  // namespace

TEST_CASE("design gradient: bielle design by gradients, resumed, in fewer evaluations") {
  const RobotDirectory directory;
  const auto run = [&](const std::string& algorithm, const std::string& out) {
    const std::string spec = directory.write("spec.yaml", makeKneeSpec(algorithm));
    const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", out});
    INFO(result.err);
    REQUIRE(result.status == 0);
    return result;
  };
  const std::string whole = directory.path() + "/whole", cut = directory.path() + "/cut";
  run("slsqp", whole);
  const std::string log = readFile(whole + "/search1.jsonl"), page = readFile(whole + "/design.md");
  const auto evaluations = std::count(log.begin(), log.end(), '\n') - 1;
  CHECK_THAT(log, Contains("\"gradients\""));
  CHECK(evaluations < 30);

  // Cut in the middle of an evaluation: the same points from there on, and the same robot.
  std::filesystem::create_directory(cut);
  std::ofstream(cut + "/search1.jsonl", std::ios::binary) << log.substr(0, log.size() / 2);
  CHECK_THAT(run("slsqp", cut).out, !Contains(", 0 of them from the logs"));
  CHECK(readFile(cut + "/design.md") == page);
  CHECK(readFile(cut + "/best/best.urdf") == readFile(whole + "/best/best.urdf"));
  const std::string resumed = readFile(cut + "/search1.jsonl");
  CHECK(std::count(resumed.begin(), resumed.end(), '\n') - 1 == evaluations);

  // Without gradients twice the evaluations do not come as far; the other algorithm does.
  run("sbplx", directory.path() + "/sbplx");
  run("mma", directory.path() + "/mma");
  const double slsqp = readValue(page), sbplx = readValue(readFile(directory.path() + "/sbplx/design.md")),
               mma = readValue(readFile(directory.path() + "/mma/design.md"));
  CAPTURE(evaluations, slsqp, sbplx, mma);
  CHECK(slsqp < 0.9);
  CHECK(slsqp < sbplx + 1e-3);
  CHECK(mma == Approx(slsqp).epsilon(1e-2));
}

TEST_CASE("design gradient: what needs no motion is designed without one") {
  const RobotDirectory directory;
  const std::string spec = directory.write("spec.yaml",
                                           "generator: leg_biped\nvariables:\n"
                                           "  - {name: mass, parameter: motor_mass, unit: kg, bounds: [0.5, 3]}\n"
                                           "objective: [{measure: mass}]\n"
                                           "search: {searches: 1, stages: [{algorithm: slsqp, evaluations: 4}]}\n");
  const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", directory.path() + "/out"});
  INFO(result.err);
  REQUIRE(result.status == 0);
  CHECK_THAT(result.out, Contains("-> 0.5 kg"));

  const std::string bounded = directory.write(
      "bounded.yaml",
      replaceOnce(readFile(spec), "search:", "constraints: [{measure: electrical_energy, at_most: 10}]\nsearch:"));
  const CommandResult refused = runCommand({BIELLE_COMMAND, "design", bounded, "-o", directory.path() + "/bounded"});
  CHECK(refused.status == 2);
  CHECK_THAT(refused.err, Contains("motions: there are none"));
}

TEST_CASE("design gradient: motions made anew, against motions made anew for neighbours") {
  const Parametrization robot = makeParametrization(readDesignSpec(kKnee));
  const std::vector<std::string> knees = {"motor_knee_left", "motor_knee_right"};
  EvaluationOptions options;
  options.solver.gradient_tolerance = 1e-13;
  options.solver.cost_tolerance = 0;
  const DesignEvaluator evaluator(robot, {makeSquat(0.9, 0.8, 0.1, 0.04), makeShortWalk()},
                                  {{Measure::Cost, {}, 1},
                                   {Measure::PeakTorque, knees, 1},
                                   {Measure::RmsTorque, knees, 2},
                                   {Measure::ElectricalEnergy, {}, 1}},
                                  options);
  const VectorXd x = robot.start(), width = robot.upper() - robot.lower();
  const SlopedEvaluation here = evaluator.differentiate(x);
  REQUIRE(here.evaluation.status == DesignStatus::Feasible);
  CHECK(here.evaluation.goals.size() == 2);
  REQUIRE(here.limits.values.size() == 2);  // those of the goals
  CHECK(here.limits.values.maxCoeff() < 0);
  for (const Eigen::Index i : {0, 2}) {
    const VectorXd dx = 1e-3 * width[i] * VectorXd::Unit(x.size(), i);
    const Evaluation ahead = evaluator.evaluate(x + dx), behind = evaluator.evaluate(x - dx);
    for (size_t term = 0; term < here.terms.size(); ++term) {
      const Eigen::Index active = findActive(here.terms[term]);
      const double weight = evaluator.objective()[term].weight / evaluator.start().terms[term];
      CHECK(here.terms[term].values[active] == Approx(weight * here.evaluation.terms[term]).epsilon(1e-9));
      const double numeric = weight * (ahead.terms[term] - behind.terms[term]) / (2 * dx[i]);
      CAPTURE(i, term, here.terms[term].gradients(active, i), numeric);
      // The cost by the envelope theorem; others by sweeps that leave a thousandth, at optima known to 1e-6.
      const double tolerance = term == 0 ? 1e-4 : 5e-3;
      CHECK(here.terms[term].gradients(active, i) == Approx(numeric).epsilon(tolerance).scale(0));
    }
  }
}

TEST_CASE("design gradient: bielle design by gradients of motions made anew") {
  const RobotDirectory directory;
  std::string text = makeKneeSpec("slsqp");
  text = replaceOnce(text, "mode: kept\nmargin: 0.15", "mode: reoptimized\nmargin: 0.1");
  const std::string spec = directory.write("spec.yaml", text), out = directory.path() + "/out";
  const auto run = [&] { return runCommand({BIELLE_COMMAND, "design", spec, "-o", out}); };
  const CommandResult result = run();
  INFO(result.err);
  REQUIRE(result.status == 0);
  const std::string page = readFile(out + "/design.md"), log = readFile(out + "/search1.jsonl");
  CHECK(readValue(page) < 0.9);
  CHECK(std::count(log.begin(), log.end(), '\n') - 1 < 30);
  // From its log alone.
  CHECK_THAT(run().out, !Contains(" 0 of them from the logs"));
  CHECK(readFile(out + "/design.md") == page);
  CHECK(readFile(out + "/search1.jsonl") == log);
}

TEST_CASE("design gradient: stages that need gradients are refused where there are none") {
  const RobotDirectory directory;
  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    const std::string spec = directory.write("spec.yaml", replaceOnce(makeKneeSpec("slsqp"), from, to));
    const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", directory.path() + "/out"});
    CAPTURE(to, result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains(problem) && Contains("line "));
  };
  check("  - {measure: peak_torque, motors: [motor_knee_left, motor_knee_right]}", "  - {measure: cost}",
        "kept motions have no cost");
  check("measure: peak_torque", "measure: conditioning", "which conditioning does not have");
  check("margin: 0.15", "margin: 1.5", "outside");

  const Parametrization robot = makeParametrization(readDesignSpec(kKnee));
  CHECK_THROWS_WITH(
      DesignEvaluator(robot, {makeSquat(0.9)}, {{Measure::Conditioning, {}, 1}}).differentiate(robot.start()),
      Contains("conditioning"));
}
