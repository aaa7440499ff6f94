// Fronts of several objectives: what no other design dominates, resumed after being killed, refined within constraints.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "design/front_search.h"
#include "design/run.h"
#include "design/spec.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

TEST_CASE("design: choices among numbers, on the front of two distances") {
  if (!hasFrontSearch()) return;
  // Choice 2 of 0 .. 3 has the least of the first objective, choice 0 of the second; the number is no measure of either.
  const double first[] = {1, 2, 0, 3}, second[] = {0, 2, 1, 3};
  std::set<std::pair<double, double>> seen;
  std::vector<VectorXd> designs;
  std::vector<std::vector<double>> objectives;
  FrontProblem problem{
      Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 3, 1), {Eigen::Vector3d(1, 3, 1)}, 2, {}, {false, true}};
  problem.evaluate = [&](const std::vector<VectorXd>& xs) {
    std::vector<std::vector<double>> out;
    for (const VectorXd& x : xs) {
      REQUIRE(x[1] == std::round(x[1]));
      const auto choice = static_cast<size_t>(x[1]);
      seen.insert({x[1], 0});
      out.push_back({first[choice] + std::pow(x[0] - 0.3, 2) + std::pow(x[2], 2),
                     second[choice] + std::pow(x[0] - 0.3, 2) + std::pow(x[2] - 0.5, 2)});
      designs.push_back(x), objectives.push_back(out.back());
    }
    return out;
  };
  searchFront(problem, {SearchAlgorithm::Nsga2, 24, 30}, 3);
  CHECK(seen.size() == 4);
  std::set<double> chosen;
  for (size_t i : selectFront(objectives, 24)) {
    chosen.insert(designs[i][1]);
    CHECK(designs[i][0] == Approx(0.3).margin(0.1));
  }
  CHECK(chosen == std::set<double>{0, 2});
  CHECK_THROWS_AS(searchFront(problem, {SearchAlgorithm::Moead, 24, 3}, 3), std::invalid_argument);
  // One choice alone stays what it is.
  problem.lower[1] = problem.upper[1] = problem.starts[0][1] = 2;
  seen.clear();
  searchFront(problem, {SearchAlgorithm::Nsga2, 8, 3}, 3);
  CHECK(seen == std::set<std::pair<double, double>>{{2, 0}});
}

namespace {

bool dominates(const std::vector<double>& a, const std::vector<double>& b) {
  bool better = false;
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i] > b[i]) return false;
    better |= a[i] < b[i];
  }
  return better;
}

int countDominated(const std::vector<std::vector<double>>& points) {
  return static_cast<int>(std::count_if(points.begin(), points.end(), [&](const auto& b) {
    return std::any_of(points.begin(), points.end(), [&](const auto& a) { return dominates(a, b); });
  }));
}

}  // namespace

TEST_CASE("design: the front of two distances is the line between the points") {
  if (!hasFrontSearch()) return;
  const Eigen::Vector2d a(0.2, 0.3), b(0.8, 0.6);
  std::vector<VectorXd> designs;
  std::vector<std::vector<double>> objectives;
  int batches = 0;
  FrontProblem problem{
      Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 1), {Eigen::Vector2d(1, 0), Eigen::Vector2d(0.5, 0)}, 2, {}};
  problem.evaluate = [&](const std::vector<VectorXd>& xs) {
    ++batches;
    std::vector<std::vector<double>> out;
    for (const VectorXd& x : xs) {
      out.push_back({(x - a).squaredNorm(), (x - b).squaredNorm()});
      designs.push_back(x);
      objectives.push_back(out.back());
    }
    return out;
  };
  for (SearchAlgorithm algorithm : {SearchAlgorithm::Nsga2, SearchAlgorithm::Moead}) {
    const FrontOptions options{algorithm, 24, 40};
    const auto search = [&](unsigned seed) {
      designs.clear(), objectives.clear(), batches = 0;
      searchFront(problem, options, seed);
      return designs;
    };
    const std::vector<VectorXd> first = search(7);
    CAPTURE(getName(algorithm), designs.size(), batches);
    CHECK(std::equal(problem.starts.begin(), problem.starts.end(), first.begin()));
    CHECK(first.size() == 24 * 41);
    if (algorithm == SearchAlgorithm::Nsga2) CHECK(batches == 41);
    const std::vector<size_t> front = selectFront(objectives, 24);
    CHECK(front.size() == 24);
    std::vector<std::vector<double>> chosen;
    double gap = 0, off = 0;
    const Eigen::Vector2d along = (b - a).normalized(), across(-along.y(), along.x());
    for (size_t i : front) {
      if (!chosen.empty()) gap = std::max(gap, objectives[i][0] - chosen.back()[0]);
      chosen.push_back(objectives[i]);
      off = std::max(off, std::abs(across.dot(designs[i] - a)));
    }
    CHECK(countDominated(chosen) == 0);
    // A design beside the line by d is dominated by those within 2 d^2 / |b - a| along it: of 24 on 0.67 by one if d > 0.1.
    CHECK(off < 0.1);
    if (algorithm == SearchAlgorithm::Nsga2) CHECK(gap < 0.15);  // of 0.45; the weights of MOEA/D leave wider ones
    CHECK(chosen.front()[0] < 0.01);
    CHECK(chosen.back()[1] < 0.01);
    chosen.push_back({chosen[3][0] + 1e-9, chosen[3][1]});  // would the checks see one?
    CHECK(countDominated(chosen) == 1);
    CHECK(search(7) == first);
    CHECK(search(8) != first);
  }
  problem.evaluate = [](const auto&) -> std::vector<std::vector<double>> { throw InputError("a", "b", "c", "d"); };
  CHECK_THROWS_AS(searchFront(problem, {}, 1), InputError);

  const std::vector<std::vector<double>> points = {{3, 1}, {2, 2}, {2, 3}, {1, 4}, {4, 1}, {2.1, 1.9}};
  CHECK(selectFront(points, 10) == std::vector<size_t>{3, 1, 5, 0});
  CHECK(selectFront(points, 3) == std::vector<size_t>{3, 1, 0});
  CHECK(selectFront({{1, 1}}, 5) == std::vector<size_t>{0});
  CHECK(selectFront({}, 5).empty());
}

namespace {

const char* const kFrontSpec = R"(generator: fivebar_leg
variables:
  - {name: upper, parameter: upper_length, bounds: [0.06, 0.14]}
  - {name: lower, parameter: lower_length, bounds: [0.15, 0.25]}
motions:
  - {motion: squat, set: {depth: 0.8}}
objective:
  - {measure: peak_torque}
  - {measure: cost}
search:
  pareto: {population: 12, generations: 4, refine: {algorithm: slsqp, evaluations: 3}}
)";

// The objectives of a table: of the start, then of the front.
std::vector<std::vector<double>> readFront(const std::string& page) {
  std::vector<std::vector<double>> out;
  std::istringstream lines(page.substr(page.find("## Front")));
  for (std::string line, bar, name; std::getline(lines, line);) {
    if (line.rfind("| achieved", 0) == 0) break;  // the goals
    std::istringstream row(line);
    std::vector<double> values(2);
    if (row >> bar >> name >> bar >> values[0] >> bar >> values[1] && bar == "|") out.push_back(values);
  }
  return out;
}

}  // namespace

TEST_CASE("design: a front that is killed goes on and ends at the same bytes") {
  if (!hasFrontSearch()) return;
  const RobotDirectory directory;
  const std::string spec = directory.write("spec.yaml", kFrontSpec);
  const std::string whole = directory.path() + "/whole", killed = directory.path() + "/killed";
  const CommandResult first = runCommand({BIELLE_COMMAND, "design", spec, "-o", whole, "--jobs", "1"});
  INFO(first.err);
  REQUIRE(first.status == 0);
  const std::string page = readFile(whole + "/design.md");
  const std::vector<std::vector<double>> front = readFront(page);
  REQUIRE(front.size() > 4);
  CHECK_THAT(page, Contains("| achieved | squat: depth, 0.8 ± 0.01 |\n") && Contains("\n| 01 | 0.8"));
  for (size_t i = 1; i < front.size(); ++i) {
    CAPTURE(i);
    // To the digits of the table, one is better than its neighbours in one way and worse in the other.
    if (i > 1) CHECK(front[i][0] >= front[i - 1][0]);
    if (i > 1) CHECK(front[i][1] < front[i - 1][1]);
    CHECK_NOTHROW(loadRobot(whole + "/front/" + (i < 10 ? "0" : "") + std::to_string(i)));
  }
  CHECK(std::any_of(front.begin() + 1, front.end(), [&](const auto& d) { return dominates(d, front[0]); }));
  CHECK_FALSE(fs::exists(whole + "/front/" + (front.size() < 10 ? "0" : "") + std::to_string(front.size())));
  CHECK(fs::exists(whole + "/design_front.svg") == fs::exists(whole + "/design.svg"));
  CHECK_THAT(readFile(whole + "/front.jsonl"), Contains("slsqp") && Contains("gradients"));

  for (const char* progress : {"nsga2, evaluation 20", "slsqp, evaluation"}) {  // in a generation, in the refinement
    Command command({BIELLE_COMMAND, "design", spec, "-o", killed, "--jobs", "3"});
    REQUIRE(command.waitForOutput(progress, 120));
    command.sendSignal(9);
    CHECK(command.wait().status == 128 + 9);
    CHECK_FALSE(fs::exists(killed + "/design.md"));
  }
  const int done = countLines(killed + "/front.jsonl") - 1;
  const CommandResult last = runCommand({BIELLE_COMMAND, "design", spec, "-o", killed, "--jobs", "2"});
  INFO(last.err);
  REQUIRE(last.status == 0);
  CHECK_THAT(last.out, Contains(", " + std::to_string(done) + " of them from the logs"));
  std::vector<std::string> files = {"/design.md",        "/best/best.urdf", "/best/best.yaml",      "/front/01/01.urdf",
                                    "/front/02/02.yaml", "/design.html",    "/design_mechanism.svg"};
  if (fs::exists(whole + "/design.svg")) files.insert(files.end(), {"/design.svg", "/design_front.svg"});
  for (const std::string& file : files) {
    CAPTURE(file);
    CHECK_FALSE(readFile(whole + file).empty());
    CHECK(readFile(whole + file) == readFile(killed + file));
  }
  // Nothing twice, and nothing else: the same lines but for their order and times.
  const auto list = [&](const std::string& out) {
    std::vector<std::string> lines;
    std::ifstream log(out + "/front.jsonl");
    for (std::string line; std::getline(log, line);)
      if (const size_t at = line.find("\"seconds\""); at != std::string::npos) lines.push_back(line.substr(0, at));
    std::sort(lines.begin(), lines.end());
    return lines;
  };
  const std::vector<std::string> lines = list(whole);
  CHECK(std::adjacent_find(lines.begin(), lines.end()) == lines.end());
  CHECK(list(killed) == lines);
}

TEST_CASE("design: a front with constraints is refined within them, and resumed at the same bytes") {
  if (!hasFrontSearch()) return;
  const RobotDirectory directory;
  std::string text = replaceOnce(kFrontSpec, "population: 12, generations: 4", "population: 8, generations: 2");
  text = replaceOnce(text, "search:\n", "constraints:\n  - {measure: rms_torque, at_most: 0.7}\nsearch:\n");
  const std::string spec = directory.write("spec.yaml", text), whole = directory.path() + "/whole",
                    cut = directory.path() + "/cut";
  const CommandResult first = runCommand({BIELLE_COMMAND, "design", spec, "-o", whole, "--jobs", "2"});
  INFO(first.err << first.out);
  REQUIRE(first.status == 0);
  std::ifstream log(whole + "/front.jsonl");
  std::string line, half;
  std::getline(log, line);
  half = line + "\n";
  int refined = 0, violated = 0, lines = 0;
  while (std::getline(log, line)) {
    const LoggedEvaluation e = readEvaluation(line);
    if (lines++ < 30) half += line + "\n";
    CHECK(findFlaw(e, static_cast<size_t>(e.x.size()), 2, 1)
              .empty());  // what a design that violates the constraint has is in its line, too
    violated += e.status == DesignStatus::Violated && e.constraints.at(0) > 0.7;
    if (e.status != DesignStatus::Feasible) continue;
    CHECK(e.constraints.at(0) < 0.7 * 1.001);
    refined += e.stage == "slsqp" && e.limits.values.size() > 0;
  }
  CHECK(refined > 5);
  CHECK(violated > 0);
  CHECK(lines > 30);
  fs::create_directory(cut);
  std::ofstream(cut + "/front.jsonl", std::ios::binary) << half;
  REQUIRE(runCommand({BIELLE_COMMAND, "design", spec, "-o", cut, "--jobs", "1"}).status == 0);
  for (const char* file : {"/design.md", "/best/best.urdf", "/front/01/01.urdf"}) {
    CAPTURE(file);
    CHECK_FALSE(readFile(whole + file).empty());
    CHECK(readFile(whole + file) == readFile(cut + file));
  }
}

TEST_CASE("design: a front of given starts alone, refined") {
  if (!hasFrontSearch()) return;
  const RobotDirectory directory;
  const std::string text =
      replaceOnce(kFrontSpec, "pareto: {population: 12, generations: 4",
                  "starts: [{upper: 0.11}, {lower: 0.22}]\n  pareto: {population: 8, generations: 0");
  const std::string spec = directory.write("spec.yaml", text), out = directory.path() + "/out";
  const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", out});
  INFO(result.err << result.out);
  REQUIRE(result.status == 0);
  std::ifstream log(out + "/front.jsonl");
  std::set<std::vector<double>> first, refined;
  std::string line;
  std::getline(log, line);
  while (std::getline(log, line)) {
    const LoggedEvaluation e = readEvaluation(line);
    (e.stage == "nsga2" ? first : refined).insert({e.x.begin(), e.x.end()});
  }
  const Eigen::Vector2d start = makeParametrization(readDesignSpec(spec)).start();
  CHECK(first == std::set<std::vector<double>>{{start[0], start[1]}, {0.11, start[1]}, {start[0], 0.22}});
  CHECK(refined.size() > first.size());
}

TEST_CASE("design: fronts that cannot be are refused") {
  const RobotDirectory directory;
  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    const std::string spec =
        directory.write("spec.yaml", from.empty() ? kFrontSpec : replaceOnce(kFrontSpec, from, to));
    const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", directory.path() + "/out"});
    CAPTURE(to, result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains(problem) && Contains("line "));
    CHECK_FALSE(fs::exists(directory.path() + "/out"));
  };
  if (!hasFrontSearch()) {
    check("", "", "install libpagmo-dev");
    return;
  }
  check("  - {measure: cost}\n", "", "a single objective has no front");
  check("population: 12", "population: 10", "multiple of 4");
  check("{population: 12", "{algorithm: crs, population: 12", "use one of nsga2, moead");
  check("algorithm: slsqp", "algorithm: sbplx", "use one of slsqp, mma");
  check("measure: cost", "measure: conditioning", "which conditioning does not have");
  check("search:\n", "search:\n  searches: 2\n", "it cannot be combined with `stages` and `searches`");
  check("search:\n", "search:\n  starts: [{upper: 9}]\n", "outside the bounds of variable 'upper'");
  check("search:\n", "search:\n  starts: [{uppper: 0.1}]\n", "there is no variable 'uppper'");
  check("search:\n", "search:\n  starts: [{}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}]\n", "enlarge `population`");
  CHECK_THROWS_AS(minimizeByStages({VectorXd::Zero(1), VectorXd::Ones(1), VectorXd::Zero(1), {}, {}},
                                   {{SearchAlgorithm::Nsga2, 10, 0}}, 1),
                  std::invalid_argument);
}
