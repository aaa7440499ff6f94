// Problems in engines: errors fall as settings become finer, and what goes wrong is told.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/model/builder.h"
#include "get_error.h"
#include "loops/trial.h"

using namespace bielle;
using namespace bielle::loops;

namespace {

double findError(const Problem& problem, const std::string& engine, double setting, double duration) {
  const Trial trial = runTrial(problem, getEngine(engine), setting, {20, duration});
  CAPTURE(problem.name, engine, setting, trial.end);
  REQUIRE(trial.end.empty());
  REQUIRE(!trial.errors.empty());
  return trial.errors.back();
}

}  // namespace

TEST_CASE("all engines move Bricard's mechanism, the more exactly the finer") {
  Problem problem = makeBricard();
  const auto check = [&problem](const char* engine, double coarse, double fine, double most, double least_ratio) {
    const double error = findError(problem, engine, coarse, 1), finer = findError(problem, engine, fine, 1);
    CAPTURE(engine, error, finer);
    CHECK(finer < most);
    CHECK(error > least_ratio * finer);
  };
  check("bielle", 2e-3, 1e-3, 1e-6, 3.5);    // of second order
  check("manifold", 1e-3, 1e-12, 1e-13, 0);  // exact at any tolerance, since it is looked at often
  check("simbody", 1e-6, 1e-8, 1e-7, 8);     // coarser ones leave the branch
  check("simbody3", 1e-6, 1e-7, 1e-7, 5);
#ifdef BIELLE_WITH_MUJOCO
  check("mujoco", 2e-3, 1e-3, 2e-5, 3.5);  // of second order, by its closures
  check("mujoco_euler", 2e-3, 1e-3, 2e-3, 1.8);
#endif
  for (const Engine& engine : getEngines()) {
    const std::string name = engine.name;
    if (name == "dart") check("dart", 1e-4, 2e-5, 3e-5, 4);
    if (name == "ode") check("ode", 1e-4, 1e-5, 2e-5, 8);
    if (name == "mujoco3") check("mujoco3", 2e-3, 1e-3, 2e-6, 3.5);
    if (name == "mujoco3_discrete") check("mujoco3_discrete", 2e-3, 1e-3, 2e-3, 1.8);
  }
}

TEST_CASE("a trial notices a mechanism that is not that of its true motion") {
  Problem problem = makeSpatialFourbar();
  const double error = findError(problem, "simbody", 1e-8, 0.5);
  ModelParts parts = takeParts(problem.model);
  parts.bodies.back().inertia.mass *= 1.001;
  problem.model = ModelBuilder::restore(parts);
  CHECK(findError(problem, "simbody", 1e-8, 0.5) > 100 * error);
}

TEST_CASE("trials keep loops closed and energy, and say how long they took") {
  const Problem problem = makeSqueezer();
  const Trial trial = runTrial(problem, getEngine("simbody"), 1e-8, {20, 0.01});
  CAPTURE(trial.end, trial.drift, trial.gap);
  CHECK(trial.end.empty());
  CHECK(trial.gap < 1e-8);
  CHECK(trial.drift < 1e-5);
  CHECK(trial.cpu > 0);
  CHECK(trial.until == Approx(0.01));
  CHECK(trial.errors.size() == 1);
}

TEST_CASE("a trial that takes too long ends, and finer ones are not begun") {
  const Problem problem = makeSliderCrank();
  const Trial trial = runTrial(problem, getEngine("bielle"), 1e-3, {1e-6, 0});
  CHECK(trial.end == "the time was up");
  CHECK(trial.until < problem.duration);
  CHECK(runTrials(problem, getEngine("bielle"), {1e-6, 0}).size() == 1);
}

TEST_CASE("engines in programs of their own carry out all kinds of parts, and tell when they break off") {
  for (const Engine& engine : getEngines()) {
    const std::string name = engine.name;
    if (name != "dart" && name != "ode" && name != "mujoco3") continue;
    CAPTURE(name);
    // A spring, a motor and balls; universal joints; slides; dampers.
    CHECK(findError(makeSqueezer(), name, 2e-4, 0.01) < 1e-3);
    CHECK(findError(makeSpatialFourbar(), name, 1e-4, 0.5) < 1e-3);
    CHECK(findError(makeSliderCrank(), name, 1e-4, 0.5) < 1e-2);
    CHECK(findError(makeGovernor(), name, 5e-5, 1) < 1e-4);
    const Trial trial = runTrial(makeGovernor(), engine, 1e-3);
    CAPTURE(trial.end);
    CHECK(!trial.end.empty());
    CHECK(trial.errors.empty());
    Problem problem = makeSpatialFourbar();
    ModelParts parts = takeParts(problem.model);
    parts.closures[0].kind = ClosureKind::Distance;
    parts.closures[0].length = 0.1;
    problem.model = ModelBuilder::restore(parts);
    CHECK_THAT(runTrial(problem, engine, 1e-3).end, Catch::Contains("distance"));
  }
}

TEST_CASE("unknown problems and engines are named with those that there are") {
  CHECK_THAT(bielle::testing::getError([] { makeProblem("fivebar"); }), Catch::Contains("squeezer"));
  CHECK_THAT(bielle::testing::getError([] { makeProblem("fourbars_0"); }), Catch::Contains("fourbars_N"));
  CHECK_THAT(bielle::testing::getError([] { getEngine("newton"); }), Catch::Contains("simbody"));
  CHECK(makeProblem("fourbars_3").model.nv() == 7);
}
