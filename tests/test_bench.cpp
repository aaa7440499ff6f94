// The report of `bielle bench` is whole. Nothing here depends on how fast anything is.
#include <catch2/catch.hpp>
#include <cmath>

#include "bench/bench.h"
#include "bielle/model/error.h"
#include "bielle/model/reader.h"

using namespace bielle;

namespace {
Model loadOwn(const std::string& name) { return loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/" + name).model; }
}  // namespace

TEST_CASE("bench: every work is measured, in both formulations") {
  BenchOptions options;
  options.extent = BenchExtent::Quick;
  std::vector<std::string> told;
  options.progress = [&told](const std::string& what) { told.push_back(what); };
  const BenchReport report = runBench(loadOwn("bipetto"), options);
  CHECK(told.size() == 12);
  CHECK(report.robot == "bipetto");
  CHECK_FALSE(report.processor.empty());
  CHECK_THAT(report.flags, Catch::Contains("-O"));
  CHECK(report.unit > 0);
  REQUIRE(report.nodes.size() == 2);
  CHECK(report.nodes[0].tangent_size == 108);
  CHECK(report.nodes[1].tangent_size == 36);
  for (const NodeTimes& t : report.nodes)
    for (double seconds : {t.dynamics, t.derivatives, t.linearize, t.sweep, t.rollout})
      CHECK((seconds > 0 && std::isfinite(seconds)));
  REQUIRE(report.iterations.size() == 4);  // two formulations, one and two threads
  for (const IterationTimes& t : report.iterations) {
    const double shares = t.linearize + t.sweep + t.rollout;
    CHECK((t.seconds > 0 && t.rollouts >= 1 && shares > 0 && shares < 1 + 1e-9));
  }
  REQUIRE(report.solves.size() == 8);
  for (const SolveTime& t : report.solves) CHECK((t.seconds > 0 && t.iterations > 0));
  REQUIRE(report.receding.size() == 4);
  for (const RecedingHorizon& t : report.receding) {
    CHECK(t.shifts == 5);
    CHECK(t.up);
    CHECK((t.seconds > 0 && t.seconds <= t.worst));
  }
  REQUIRE(report.chains.size() == 6);
  REQUIRE(report.horizons.size() == 4);
}

TEST_CASE("bench: a robot that cannot walk is refused") {
  CHECK_THROWS_AS(runBench(loadOwn("fourbar"), {}), ModelError);
  CHECK_THROWS_WITH(runBench(loadOwn("fourbar"), {}), Catch::Contains("foot_left"));
}
