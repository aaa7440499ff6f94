// Plans carried out many at a time, against the same ones by themselves; and what of a batch they need.
#include <catch2/catch.hpp>

#include "bielle/worlds/batch.h"
#include "own_robots.h"
#include "predictive_trials.h"
#include "worlds/lane_worlds.h"
#include "worlds/made_ground.h"
#include "worlds/make_world.h"
#include "worlds/posture_hold.h"
#include "worlds/robot_errors.h"

namespace bielle::worlds {
namespace {

using bielle::testing::getBipetto;
using bielle::testing::getShortSquat;

constexpr double kStep = 1e-3;  // s

// The squat under pushes from all sides, on other masses, friction and delays.
std::unique_ptr<LaneRun> makeRun(const Plan& plan, Controller& controller, int i) {
  auto run = std::make_unique<LaneRun>(LaneRun{&controller, plan.robot.model, {}});
  if (i % 3 == 1) run->machine = makeMachine(plan.robot.model, {0.04, 0, static_cast<unsigned>(i)});
  run->ground.friction = 0.6 + 0.05 * i;
  run->options.pushes = {{0.1 + 0.02 * i, i == 3 ? 60.0 : 2.0, 40.0 * i, 0.1}};
  run->options.duration = 0.8;
  run->options.delay.delay = i % 2 * 1e-3;
  if (i == 2) run->sensors.sensors = SensorOptions{makeRealParts(), 1, 7, {}};
  return run;
}

Plan makeSquat() {
  Plan plan{*getShortSquat().gains};
  plan.schedule = getShortSquat().solution.motion.schedule;
  plan.robot.model = getShortSquat().gains->model();
  return plan;
}

std::vector<Execution> runInLanes(const Plan& plan, int count, int lanes, int threads) {
  std::vector<Execution> out(static_cast<size_t>(count));
  Policy policy = plan.policy;
  carryOutInLanes(
      plan, plan.robot.model, count, {kStep, lanes, threads}, [&](int i) { return makeRun(plan, policy, i); },
      [&](int i, const LaneRun&, const Execution& e, const World&) { out[static_cast<size_t>(i)] = e; });
  return out;
}

double calcLargestDifference(const MatrixXd& a, const MatrixXd& b) {
  return a.rows() == b.rows() ? (a - b).cwiseAbs().maxCoeff() : 1e9;
}

}  // namespace

TEST_CASE("lane_worlds: runs that share a batch are those in worlds of their own") {
  const Plan plan = makeSquat();
  const std::vector<Execution> together = runInLanes(plan, 6, 4, 1);
  for (int i = 0; i < 6; ++i) {
    CAPTURE(i);
    Policy policy = plan.policy;
    const std::unique_ptr<LaneRun> run = makeRun(plan, policy, i);
    const auto world = makeWorld("bielle", run->machine, {run->ground, kStep, nullptr, 0});
    const Execution alone = carryOut(plan, policy, *world, run->sensors, run->options), &e = together[i];
    CHECK(e.outcome == alone.outcome);
    CHECK(e.outcome == (i == 3 ? Outcome::Fell : Outcome::Stood));
    CHECK(e.duration == Approx(alone.duration));
    // Where masses differ, closures are weighed otherwise (ClosedTreeOf::setInertias()), which the length of steps lets one see.
    const double most = i == 3 ? 1e-3 : i % 3 == 1 ? 1e-5 : 1e-8;
    CHECK(calcLargestDifference(e.record.q, alone.record.q) < most);
    CHECK(calcLargestDifference(e.record.u, alone.record.u) < 1e3 * most);
    // Forces of a fall are not those of another one.
    if (i != 3) CHECK(calcLargestDifference(e.record.contact_wrenches, alone.record.contact_wrenches) < 1e4 * most);
    CHECK(e.largest_slip == Approx(alone.largest_slip).margin(most));
    CHECK(e.end.energy() == Approx(alone.end.energy()).margin(1e2 * most));
    CHECK(e.end.contact_loss == Approx(alone.end.contact_loss).margin(1e2 * most));
    CHECK(e.end.push_work == Approx(alone.end.push_work).margin(1e2 * most));
    CHECK(std::abs(e.energy_balance) < 1e-3);
    CHECK(e.integration.longest_step == Approx(kStep));
  }
}

TEST_CASE("lane_worlds: what comes of a run depends neither on lanes nor on threads, to the last bit") {
  const Plan plan = makeSquat();
  const std::vector<Execution> few = runInLanes(plan, 6, 1, 1), many = runInLanes(plan, 6, 16, 2);
  for (size_t i = 0; i < few.size(); ++i) {
    CHECK(calcLargestDifference(few[i].record.q, many[i].record.q) == 0);
    CHECK(few[i].energy_balance == many[i].energy_balance);
    CHECK(few[i].message == many[i].message);
  }
}

TEST_CASE("lane_worlds: worlds of a batch stand on grounds of their own, and stay when they are left out") {
  const Model& model = getBipetto();
  const PostureHold posture(model);
  constexpr int kCount = 9;
  std::vector<std::shared_ptr<const Ground>> grounds;
  for (int i = 0; i < kCount; ++i) {
    TileOptions tiles;
    tiles.start = -1;
    tiles.height = 4e-3;
    tiles.seed = static_cast<unsigned>(i / 2);  // two stand on the same
    grounds.push_back(i % 2 == 1 ? grounds.back() : std::make_shared<const Ground>(makeTiles(tiles)));
  }
  WorldBatchOptions options;
  options.world.world = {*grounds[0], kStep};
  options.threads = 1;
  WorldBatch batch(model, kCount, options);
  batch.set({{}, {}, {}, {}, {}, grounds});
  MatrixXd q = posture.posture().replicate(1, kCount), v = MatrixXd::Zero(model.nv(), kCount);
  q.row(2).array() += 5e-3;
  const MatrixXd u = MatrixXd::Zero(model.nu(), kCount), push = MatrixXd::Zero(3, kCount);
  batch.reset(q, v);
  std::vector<char> where(kCount, 1);
  where[3] = 0;
  for (int k = 0; k < 50; ++k) REQUIRE(batch.step(u, push, kStep, where));
  CHECK(batch.times()[3] == 0);
  CHECK(batch.configurations().col(3) == q.col(3));
  CHECK_THROWS_WITH(batch.step(u, push, kStep, {1}), Catch::Contains("where has 1 entries; give 9"));
  double spread = 0;
  for (int i : {0, 2, 5, 8}) {
    BielleWorldOptions single;
    single.world = {*grounds[i], kStep};
    const auto world = makeBielleWorld(model, single);
    world->reset(q.col(i), v.col(i));
    for (int k = 0; k < 50; ++k) REQUIRE(world->advance(kStep));
    CAPTURE(i);
    CHECK((batch.configurations().col(i) - world->configuration()).cwiseAbs().maxCoeff() < 1e-9);
    CHECK(batch.works(i).contact == Approx(-world->books().contact_loss - batch.springs(i).contacts).margin(1e-6));
    CHECK(batch.springs(i).contacts + batch.springs(i).stops == Approx(world->books().elastic).margin(1e-6));
    spread = std::max(spread, (batch.configurations().col(i) - batch.configurations().col(0)).cwiseAbs().maxCoeff());
  }
  CHECK(spread > 1e-3);  // the grounds do differ
  CHECK(batch.configurations().col(4) == batch.configurations().col(5));
  grounds[1] = std::make_shared<const Ground>();
  CHECK_THROWS_WITH(batch.set({{}, {}, {}, {}, {}, grounds}), Catch::Contains("a ground has no steps"));
  grounds.pop_back();
  CHECK_THROWS_WITH(batch.set({{}, {}, {}, {}, {}, grounds}), Catch::Contains("there are 8 grounds; give 9"));
}

}  // namespace bielle::worlds
