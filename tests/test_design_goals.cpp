// Designs whose motions miss their goals. Oracles: the goals of plans that ask for something else than their costs;
// central differences of what neighbours achieve; `bielle solve`, run by itself.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bielle/model/error.h"
#include "design/run.h"
#include "design/spec.h"
#include "design_trials.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

// A squat that its costs pull to 0.8 of the height, by so much, while its goal asks for `requested`.
DesignMotion makeAskedSquat(double requested, double tolerance, double com_weight = 1e5) {
  SquatOptions options;
  options.depth = 0.8, options.duration = 0.6, options.settle = 0.06, options.time_step = 0.03;
  options.com_weight = com_weight;
  return {"squat", [=](const Model& model, const StandingRobot& standing) {
            MotionPlan plan = planSquat(model, options, standing);
            plan.goals.at(0).requested = requested, plan.goals[0].tolerance = tolerance;
            return plan;
          }};
}

Parametrization makeLeg() {
  DesignVariable upper, lower;
  upper.name = "upper", upper.parameter = "upper_length", upper.lower = 0.06, upper.upper = 0.14;
  lower.name = "lower", lower.parameter = "lower_length", lower.lower = 0.15, lower.upper = 0.25;
  return Parametrization("fivebar_leg", {}, {upper, lower});
}

const std::vector<ObjectiveTerm> kPeak = {{Measure::PeakTorque, {}, 1}};

const char* const kLegSpec = R"(generator: fivebar_leg
variables:
  - {name: upper, parameter: upper_length, bounds: [0.06, 0.14]}
motions:
  - {motion: squat, set: {depth: 0.8, duration: 0.6, settle: 0.06, time_step: 0.03, com_weight: WEIGHT}}
objective: [{measure: peak_torque}]
search: {searches: 1, stages: [{algorithm: sbplx, evaluations: 4}]}
)";

std::string makeSpec(const std::string& weight) { return replaceOnce(kLegSpec, "WEIGHT", weight); }

}  // namespace

TEST_CASE("design goals: a design that misses one is not feasible, and the nearer the better") {
  const Parametrization robot = makeLeg();
  const DesignEvaluator met(robot, {makeAskedSquat(0.8, 0.04)}, kPeak);
  REQUIRE(met.start().status == DesignStatus::Feasible);
  REQUIRE(met.start().goals.size() == 1);
  CHECK(describeGoal(met.start().goals[0]) == "squat: depth");
  const double achieved = met.start().goals[0].outcome.achieved;
  CHECK(achieved == Approx(0.8).epsilon(0.01));

  double last = 1.5;
  for (const double requested : {0.75, 0.7, 0.5}) {
    CAPTURE(requested);
    const DesignEvaluator missed(robot, {makeAskedSquat(requested, 0.02)}, kPeak);  // the start is accepted, and told
    const Evaluation& start = missed.start();
    CHECK(start.status == DesignStatus::GoalMissed);
    CHECK_THAT(start.message, Contains("squat: depth: requested 0.") && Contains("missed (tolerance 0.02)"));
    CHECK(start.terms == met.start().terms);
    const double V = (achieved - requested) / 0.02 - 1;
    CHECK(start.value == Approx(1.5 + 0.25 * V / (1 + V)));  // Eq. (4)
    CHECK(start.value > last);
    last = start.value;
  }
  // Violated constraints and missed goals add up.
  EvaluationOptions bounded;
  bounded.constraints = {{Measure::Mass, {}, robot.startModel().mass() / 2, false}};
  const Evaluation both = DesignEvaluator(robot, {makeAskedSquat(0.75, 0.02)}, kPeak, bounded).start();
  const double V = (achieved - 0.75) / 0.02 - 1 + 1;
  CHECK(both.status == DesignStatus::GoalMissed);
  CHECK(both.value == Approx(1.5 + 0.25 * V / (1 + V)));
  CHECK_THAT(both.message, Contains("mass is") && Contains("squat: depth"));

  EvaluationOptions kept;
  kept.mode = MotionMode::Kept;
  DesignVariable moved;
  moved.name = "motor", moved.lower = -0.01, moved.upper = 0.01, moved.shifts = {{"motor_knee_left", {1, 0, 0}}};
  const Parametrization bipetto(loadBipetto(), {moved});
  const DesignEvaluator anew(bipetto, {makeAskedSquat(0.75, 0.02)}, kPeak),
      same(bipetto, {makeAskedSquat(0.75, 0.02)}, kPeak, kept);
  CHECK(same.start().status == DesignStatus::GoalMissed);
  CHECK(same.start().goals.at(0).outcome.achieved == Approx(anew.start().goals.at(0).outcome.achieved).epsilon(1e-6));
}

TEST_CASE("design goals: the log has what was requested and achieved, and why a motion failed") {
  const Parametrization robot = makeLeg();
  const DesignEvaluator evaluator(robot, {makeAskedSquat(0.7, 0.02)}, kPeak);
  const LoggedEvaluation missed = evaluateDesign(evaluator, SearchAlgorithm::Sbplx, robot.start());
  const std::string line = formatEvaluation(missed);
  const json logged = json::parse(line);
  CHECK(logged["status"] == "goal missed");
  CHECK(logged["message"] == missed.message);
  CHECK(logged["goals"][0]["goal"] == "depth");
  CHECK(logged["goals"][0]["requested"] == 0.7);
  CHECK(logged["goals"][0]["achieved"] == evaluator.start().goals[0].outcome.achieved);
  const LoggedEvaluation again = readEvaluation(line);
  CHECK(formatEvaluation(again) == line);
  CHECK(findFlaw(again, 2, 1, 0).empty());
  CHECK_FALSE(findFlaw(again, 3, 1, 0).empty());
  CHECK_FALSE(findFlaw(again, 2, 2, 0).empty());
  CHECK_THAT(findFlaw(readEvaluation(replaceOnce(line, "goal missed", "feasible")), 2, 1, 0),
             Contains("misses a goal"));
  CHECK_THROWS(readEvaluation(replaceOnce(line, "\"depth\",\"kind\":\"height\"", "\"depth\",\"kind\":\"weight\"")));

  const LoggedEvaluation failed = evaluateDesign(evaluator, SearchAlgorithm::Sbplx, Eigen::Vector2d(0.14, 0.02));
  CHECK(failed.status == DesignStatus::MotionFailed);
  CHECK_THAT(formatEvaluation(failed), Contains("\"message\":\"") && Contains("the lower rods do not meet"));
  FddpOptions hasty = EvaluationOptions::makeSolverOptions();
  hasty.max_iterations = 1;
  const MotionOutcome stopped = remakeMotion(robot.startModel(), makeAskedSquat(0.8, 0.02), nullptr, hasty, {});
  CHECK(stopped.missing == 1);
  DesignMotion odd = makeAskedSquat(0.8, 0.02);
  odd.request.emplace();
  odd.request->planner = [](const Model&, const StandingRobot&, const OptionSet&) -> MotionPlan {
    throw InputError("leg", "depth", "it is too large");
  };
  const DesignEvaluator impossible(robot, {odd}, kPeak);
  CHECK(impossible.start().status == DesignStatus::Feasible);
  const Evaluation usual = impossible.solveUsually(robot.start());
  CHECK(usual.status == DesignStatus::MotionFailed);
  CHECK_THAT(usual.message, Contains("squat: leg: depth: it is too large"));
  CHECK_THAT(stopped.message, Contains("squat: ") && Contains("iteration"));
}

TEST_CASE("design goals: their gradients, against differences of what neighbours achieve") {
  const Parametrization robot = makeLeg();
  EvaluationOptions exact;
  exact.solver.gradient_tolerance = 1e-13;
  exact.solver.cost_tolerance = 0;
  for (const double requested : {0.7, 0.9}) {  // on either side
    const DesignEvaluator evaluator(robot, {makeAskedSquat(requested, 0.01, 30)}, kPeak, exact);
    const SlopedEvaluation here = evaluator.differentiate(robot.start());
    REQUIRE(here.evaluation.goals.size() == 1);
    REQUIRE(here.limits.values.size() == 1);
    const double achieved = here.evaluation.goals[0].outcome.achieved, off = achieved - requested;
    REQUIRE(std::abs(off) > 0.01);
    CHECK(here.limits.values[0] == Approx(std::abs(off) / 0.01 - 0.99));
    Eigen::RowVector2d numeric;
    for (int i = 0; i < 2; ++i) {
      const double step = 1e-3 * (robot.upper()[i] - robot.lower()[i]);
      const VectorXd dx = step * VectorXd::Unit(2, i);
      const Evaluation ahead = evaluator.evaluate(robot.start() + dx), behind = evaluator.evaluate(robot.start() - dx);
      numeric[i] = (std::abs(ahead.goals.at(0).outcome.achieved - requested) -
                    std::abs(behind.goals.at(0).outcome.achieved - requested)) /
                   (2 * step * 0.01);
    }
    CAPTURE(requested, numeric, here.limits.gradients.row(0));
    CHECK(numeric.norm() > 0.1);
    CHECK((here.limits.gradients.row(0) - numeric).norm() < 5e-3 * numeric.norm());
  }
}

TEST_CASE("design goals: a search by gradients does not gain by squatting less") {
  const RobotDirectory directory;
  DesignSpec spec;
  spec.searches = 1;
  spec.stages = {{SearchAlgorithm::Slsqp, 12, 1e-3}};
  const Parametrization robot = makeLeg();
  const auto search = [&](double tolerance, const std::string& name) {
    const DesignEvaluator evaluator(robot, {makeAskedSquat(0.8, tolerance, 1e3)}, kPeak);
    REQUIRE(evaluator.start().status == DesignStatus::Feasible);
    return runDesign(evaluator, spec, {directory.path() + "/" + name, 1, nullptr, {}});
  };
  const DesignRun free = search(1, "free");
  const double off = std::abs(free.evaluation.goals.at(0).outcome.achieved - 0.8);
  const double start_off = std::abs(free.searches[0][0].goals.at(0).outcome.achieved - 0.8);
  CAPTURE(off, start_off, free.value);
  REQUIRE(off > 1.2 * start_off);
  const double tolerance = 0.5 * (off + start_off);
  const DesignRun held = search(tolerance, "held");
  CHECK(held.evaluation.status == DesignStatus::Feasible);
  CHECK(std::abs(held.evaluation.goals.at(0).outcome.achieved - 0.8) <= tolerance);
  CHECK(held.value < 1);
  CHECK(held.value > free.value);
}

TEST_CASE("design goals: a start that misses its goal is told, and the best design is solved as `bielle solve` does") {
  const RobotDirectory directory;
  const std::string spec = directory.write("spec.yaml", makeSpec("1e-3")), out = directory.path() + "/out";
  const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", out});
  INFO(result.err << result.out);
  REQUIRE(result.status == 0);
  CHECK_THAT(result.err, Contains("the start design: goal missed: squat: depth: requested 0.8, achieved") &&
                             Contains("no design is feasible"));
  CHECK_THAT(result.out, Contains("4 goal missed") && Contains("goal missed by the usual steps"));
  const std::string page = readFile(out + "/design.md");
  CHECK_THAT(page, Contains("| squat: depth | 0.8 ± 0.01 |") && Contains("**missed**") &&
                       Contains("**No design is feasible**") && Contains("0 feasible") &&
                       Contains("4 that miss a goal"));

  const std::string good = directory.write("good.yaml", makeSpec("1e5")), found = directory.path() + "/found";
  const CommandResult done = runCommand({BIELLE_COMMAND, "design", good, "-o", found});
  INFO(done.err << done.out);
  REQUIRE(done.status == 0);
  CHECK(done.err.empty());
  const auto calcPeak = [&](const std::string& robot) {
    const std::string solved = directory.path() + "/solved_" + robot;
    REQUIRE(runCommand({BIELLE_COMMAND, "solve", "squat", "--robot", found + "/" + robot, "--depth", "0.8", "--set",
                        "duration=0.6", "--set", "settle=0.06", "--quiet", "--no-report", "--no-check", "-o", solved})
                .status == 0);
    double peak = 0;
    const json summary = json::parse(readFile(solved + "/summary.json"));
    for (const auto& [motor, torque] : summary["peak_torques"].items()) peak = std::max(peak, torque.get<double>());
    return peak;
  };
  const double peak = calcPeak("best"), before = calcPeak("start");
  REQUIRE(peak < before);
  const std::string headline = done.out.substr(done.out.find("by the usual steps of `bielle solve`: peak_torque "));
  CHECK(std::stod(headline.substr(50)) == Approx(before).epsilon(1e-3));
  CHECK(std::stod(headline.substr(headline.find("-> ") + 3)) == Approx(peak).epsilon(1e-3));
  CHECK(std::stod(headline.substr(headline.find(" (") + 2)) == Approx(100 * (peak / before - 1)).margin(0.06));
  const std::string text = readFile(found + "/design.md"), table = text.substr(text.find("## By the usual steps"));
  const std::string row = table.substr(table.find("| peak_torque | ")), told = row.substr(row.find("| ", 16) + 2);
  CHECK(std::stod(told) == Approx(peak).epsilon(1e-3));  // of four digits
  CHECK(std::stod(row.substr(16)) != std::stod(told));   // the search's own, by its steps
  CHECK_THAT(table, Contains("| squat: depth | 0.8"));

  // A line of the log that was changed by hand.
  const std::string log = found + "/search1.jsonl", whole = readFile(log);
  const size_t second = whole.find("\"x\":[", whole.find("\n{") + 2);
  for (const auto& [length, to, problem] :
       std::vector<std::tuple<size_t, std::string, std::string>>{{5, "\"x\":[1,", "it belongs to another design"},
                                                                 {4, "\"x\":{},\"y\":", "another design"},
                                                                 {4, "\"y\":", "it has no entry 'x'"},
                                                                 {5, "\"x\":[\"a\",", "type must be number"}}) {
    std::string changed = whole;
    std::ofstream(log) << changed.replace(second, length, to);
    const CommandResult refused = runCommand({BIELLE_COMMAND, "design", good, "-o", found});
    CAPTURE(to, refused.err);
    CHECK(refused.status == 2);
    CHECK_THAT(refused.err, Contains("search1.jsonl: line 2: it was changed or damaged: ") && Contains(problem) &&
                                Contains("remove the file") && !Contains("json.exception"));
  }
}

TEST_CASE("design goals: a walk that ends before it reaches its speed is warned of") {
  const RobotDirectory directory;
  const std::string spec = R"(generator: rsu_biped
variables:
  - {name: offset, parameter: hip_offset, bounds: [0.12, 0.13]}
motions:
  - {motion: walk, set: {speed: 0.4, STEPS, time_step: 0.03}}
objective: [{measure: peak_torque}]
search: {searches: 1, stages: [{algorithm: sbplx, evaluations: 1}]}
)";
  for (const char* steps : {"steps: 2", "steps: 4"}) {
    const DesignSpec read = readDesignSpec(directory.write("spec.yaml", replaceOnce(spec, "STEPS", steps)));
    const std::vector<std::string> warnings = listShortMotions(read, makeEvaluator(read).start().goals);
    REQUIRE(warnings.size() == (steps[7] == '2' ? 1 : 0));
    for (const std::string& warning : warnings)
      CHECK_THAT(warning, Contains("the walk has too few steps to reach its speed"));
  }
}
