// Goals and their outcomes: each kind by hand, then on solved motions and on trajectories that miss them.
#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "bielle/motion/jump.h"
#include "bielle/motion/registry.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "bielle/results/result.h"
#include "math/constants.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// Two feet, eleven nodes, 0.1 s apart.
MotionTrack makeTrackOfTwoFeet() {
  MotionTrack track;
  track.contacts = {"left", "right"};
  for (int k = 0; k <= 10; ++k) {
    track.time.push_back(0.1 * k);
    track.com.emplace_back(0.03 * k, 0, 0.5);
    track.heading.push_back(0);
    track.feet.push_back({SE3(), SE3()});
    if (k < 10) track.load.push_back(100);
  }
  return track;
}

Goal makeGoal(GoalKind kind, double requested, double tolerance, int first = 0, int last = 10) {
  return {kind, getName(kind), requested, tolerance, first, last};
}

// A walk of defaults, solved once.
const std::pair<Motion, FddpSummary>& getWalk() {
  static const auto walk = [] {
    Motion motion = makeWalk(getBipetto());
    const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess);
    return std::pair(std::move(motion), summary);
  }();
  return walk;
}

MotionResult solveForResult(Motion motion) {
  const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess);
  return makeResult({"bipetto", "", {}}, {motion, motion.guess, summary});
}

const GoalOutcome& find(const MotionResult& result, const std::string& name) {
  for (const GoalOutcome& outcome : result.goals)
    if (outcome.goal.name == name) return outcome;
  throw std::runtime_error("there is no goal '" + name + "'");
}

}  // namespace

TEST_CASE("goals: the mean speed is that between two nodes, along a direction") {
  MotionTrack track = makeTrackOfTwoFeet();
  Goal goal = makeGoal(GoalKind::Speed, 0.3, 0.015, 2, 8);
  CHECK(measureGoal(goal, track) == Approx(0.3));
  track.com[0].x() = -5;  // before the steady part
  track.com[5].x() = 9;   // it is a mean, what happens between does not count
  CHECK(measureGoal(goal, track) == Approx(0.3));
  goal.direction = Vector3d(0.6, 0.8, 0);
  CHECK(measureGoal(goal, track) == Approx(0.18));
}

TEST_CASE("goals: a height is over the soles, and is the one farthest from the first") {
  MotionTrack track = makeTrackOfTwoFeet();
  for (auto& feet : track.feet)
    for (SE3& foot : feet) foot.p.z() = 0.1;
  Goal goal = makeGoal(GoalKind::Height, 0.7, 0.01);
  goal.contacts = track.contacts;
  CHECK(measureGoal(goal, track) == 1);
  track.com[5].z() = 0.38;
  CHECK(measureGoal(goal, track) == Approx(0.7));
  track.com[6].z() = 0.66;  // 0.16 up outweighs 0.12 down
  CHECK(measureGoal(goal, track) == Approx(1.4));
  goal.last = 5;
  CHECK(measureGoal(goal, track) == Approx(0.7));
  CHECK(measureGoal(makeGoal(GoalKind::Rise, 0.2, 0.01), track) == Approx(0.16));
}

TEST_CASE("goals: time in the air counts stages without any force, by their own lengths") {
  MotionTrack track = makeTrackOfTwoFeet();
  const Goal goal = makeGoal(GoalKind::FlightTime, 0.3, 0.01);
  CHECK(measureGoal(goal, track) == 0);
  for (int k : {3, 4, 5}) track.load[k] = 0;
  CHECK(measureGoal(goal, track) == Approx(0.3));
  track.time[6] += 0.05;
  CHECK(measureGoal(goal, track) == Approx(0.35));
  track.load[4] = 1e-12;
  CHECK(measureGoal(goal, track) == Approx(0.25));
}

TEST_CASE("goals: an angle is counted over full turns") {
  MotionTrack track = makeTrackOfTwoFeet();
  for (int k = 0; k <= 10; ++k) track.heading[k] = std::remainder(1.0 + 0.8 * k, 2 * kPi);
  CHECK(measureGoal(makeGoal(GoalKind::Turn, 8, 0.1), track) == Approx(8));
}

TEST_CASE("goals: feet are displaced on average, and stand a distance from their footholds") {
  MotionTrack track = makeTrackOfTwoFeet();
  track.feet[10][0].p = Vector3d(0.2, 0, 0.1);
  track.feet[10][1].p = Vector3d(0.3, 0, 0.1);
  Goal length = makeGoal(GoalKind::Displacement, 0.25, 0.01);
  length.contacts = track.contacts;
  CHECK(measureGoal(length, track) == Approx(0.25));
  length.direction = Vector3d::UnitZ();
  CHECK(measureGoal(length, track) == Approx(0.1));
  length.contacts = {"right"};
  length.direction = Vector3d::UnitX();
  CHECK(measureGoal(length, track) == Approx(0.3));
  Goal footholds = makeGoal(GoalKind::Footholds, 0, 0.01);
  footholds.footholds = {{"left", 10, Vector3d(0.2, 0, 0.1)}, {"right", 10, Vector3d(0.3, 0.03, 0.14)}};
  CHECK(measureGoal(footholds, track) == Approx(0.05));
  track.feet[10][0].p.x() = std::nan("");
  CHECK(std::isnan(measureGoal(footholds, track)));
}

TEST_CASE("goals: nodes and contacts that the trajectory does not have are refused") {
  const MotionTrack track = makeTrackOfTwoFeet();
  CHECK_THROWS_AS(measureGoal(makeGoal(GoalKind::Rise, 0, 0, 0, 11), track), std::out_of_range);
  CHECK_THROWS_AS(measureGoal(makeGoal(GoalKind::Rise, 0, 0, -1, 3), track), std::out_of_range);
  CHECK_THROWS_AS(measureGoal(makeGoal(GoalKind::Rise, 0, 0, 4, 3), track), std::out_of_range);
  Goal goal = makeGoal(GoalKind::Footholds, 0, 0.01);
  goal.footholds = {{"hand", 3, Vector3d::Zero()}};
  CHECK_THROWS_WITH(measureGoal(goal, track), Catch::Contains("'hand'"));
  goal.footholds = {{"left", 11, Vector3d::Zero()}};
  CHECK_THROWS_AS(measureGoal(goal, track), std::out_of_range);
  CHECK_THROWS_AS(parseGoalKind("luck"), std::invalid_argument);
  for (int kind = 0; kind <= static_cast<int>(GoalKind::Footholds); ++kind)
    CHECK(parseGoalKind(getName(static_cast<GoalKind>(kind))) == static_cast<GoalKind>(kind));
}

TEST_CASE("goals: a miss is said with its share and tolerance; what is not a number is a miss") {
  GoalOutcome outcome{makeGoal(GoalKind::Speed, 0.5, 0.025), 0.4213};
  CHECK_FALSE(outcome.met());
  CHECK(formatOutcome(outcome) == "requested 0.5 m/s, achieved 0.4213 m/s: 84 %, missed (tolerance 0.025 m/s)");
  outcome.achieved = 0.51;
  CHECK(outcome.met());
  CHECK(formatOutcome(outcome) == "requested 0.5 m/s, achieved 0.51 m/s: 102 %");
  outcome.achieved = std::nan("");
  CHECK_FALSE(outcome.met());
  CHECK(formatOutcome({makeGoal(GoalKind::Height, 0.7, 0.015), 0.7011}) == "requested 0.7, achieved 0.7011");
  CHECK(formatOutcome({makeGoal(GoalKind::Footholds, 0, 0.01), 0.0123}) ==
        "requested within 0.01 m, achieved 0.0123 m, missed");
}

TEST_CASE("goals: motions of Bipetto have those requested", "[long]") {
  struct Row {
    std::string name;
    double requested;
  };
  const auto expect = [](const Motion& motion, const std::vector<Row>& rows) {
    CAPTURE(motion.name);
    REQUIRE(motion.goals.size() == rows.size());
    for (size_t i = 0; i < rows.size(); ++i) {
      CHECK(motion.goals[i].name == rows[i].name);
      CHECK(motion.goals[i].requested == Approx(rows[i].requested));
    }
  };
  expect(makeSquat(getBipetto()), {{"depth", 0.7}});
  expect(getWalk().first, {{"speed", 0.5}, {"footholds", 0}});
  expect(makeSideWalk(getBipetto()), {{"speed", 0.2}, {"footholds", 0}});
  expect(makeTurn(getBipetto()), {{"angle", 1.57}, {"footholds", 0}});
  expect(makeStairs(getBipetto()), {{"climb", 0.24}, {"speed", 0.3}, {"footholds", 0}});
  JumpOptions jump;
  jump.length = 0.2;
  expect(makeJump(getBipetto(), jump), {{"flight", 0.3}, {"height", 0.02 + 9.81 * 0.09 / 8}, {"length", 0.2}});
}

// The tests check_* solve the motions above, and more, and fail where a goal is missed.
TEST_CASE("goals: a walk, one backwards and a squat that goes up achieve what was requested", "[long]") {
  const auto expect = [](const MotionResult& result, double requested) {
    CAPTURE(result.motion);
    CHECK(result.converged());
    CHECK(result.goals.front().goal.requested == requested);
    for (const GoalOutcome& outcome : result.goals) {
      CAPTURE(outcome.goal.name, formatOutcome(outcome));
      CHECK(outcome.met());
    }
  };
  const auto& [walk, walked] = getWalk();
  expect(makeResult({"bipetto", "", {}}, {walk, walk.guess, walked}), 0.5);
  WalkOptions backward;
  backward.speed = -0.3;
  expect(solveForResult(makeWalk(getBipetto(), backward)), -0.3);
  SquatOptions up;
  up.depth = 1.05;
  expect(solveForResult(makeSquat(getBipetto(), up)), 1.05);
}

TEST_CASE("goals: a sequence has those of its motions, at their nodes", "[long]") {
  SquatOptions squat;
  WalkOptions walk;
  walk.gait.rigid_landing = true;  // its impacts are stages too
  const auto planBoth = [&](const Model& model, const StandingRobot& standing) {
    return planSequence(
        model,
        {{"squat", [&](const Model& m, const StandingRobot& from) { return planSquat(m, squat, from); }},
         {"walk", [&](const Model& m, const StandingRobot& from) { return planWalk(m, walk, from); }}},
        standing);
  };
  const Model& model = getBipetto();
  const StandingRobot standing = makeStandingRobot(model);
  const MotionPlan both = planBoth(model, standing), first = planSquat(model, squat, standing),
                   second = planWalk(model, walk, makeStandingRobot(model, first.q_end));
  REQUIRE(both.goals.size() == 3);
  CHECK(both.goals[0].name == "squat.depth");
  CHECK(both.goals[1].name == "walk.speed");
  const int start = first.schedule.numStages();
  CHECK(both.goals[1].first == second.goals[0].first + start);
  CHECK(both.goals[1].last == second.goals[0].last + start);
  REQUIRE(both.goals[2].footholds.size() == 6);
  for (size_t i = 0; i < 6; ++i) {
    const Foothold& foothold = both.goals[2].footholds[i];
    CHECK(foothold.node == second.goals[1].footholds[i].node + start);
    // There both feet stand, just before only one did.
    CHECK(both.schedule.getPhase(foothold.node).contacts.size() == 2);
    CHECK(both.schedule.getPhase(foothold.node).dt > 0);
    CHECK(both.schedule.getPhase(foothold.node - 1).dt == 0);
    CHECK(both.schedule.getPhase(foothold.node - 2).contacts.size() == 1);
  }
}

TEST_CASE("goals: trajectories that miss are reported") {
  const Motion& walk = getWalk().first;
  const auto measure = [&](const ShootingTrajectory& trajectory) {
    return makeResult({"bipetto", "", {}}, {walk, trajectory, getWalk().second});
  };
  const MotionResult good = measure(walk.guess);
  ShootingTrajectory slow = walk.guess;
  for (VectorXd& x : slow.xs) x[0] *= 0.84;
  const GoalOutcome speed = find(measure(slow), "speed");
  CHECK(speed.achieved == Approx(0.84 * find(good, "speed").achieved).epsilon(0.02));
  CHECK_FALSE(speed.met());
  CHECK_FALSE(find(measure(slow), "footholds").met());
  // One foot beside its foothold at one landing, by 2 cm; nothing else changes.
  ShootingTrajectory beside = walk.guess;
  beside.xs[find(good, "footholds").goal.footholds[2].node][1] += 0.02;
  CHECK(find(measure(beside), "footholds").achieved == Approx(0.02).margin(0.002));
  CHECK_FALSE(find(measure(beside), "footholds").met());
  CHECK(find(measure(beside), "speed").met());

  // Weights that pull towards something else: the squat converges and is too shallow.
  SquatOptions lazy;
  lazy.com_weight = 10;
  const MotionResult shallow = solveForResult(makeSquat(getBipetto(), lazy));
  CHECK(shallow.converged());
  CHECK(find(shallow, "depth").achieved > 0.72);
  CHECK_FALSE(find(shallow, "depth").met());
}

TEST_CASE("goals: a squat far out of reach stays finite, and says by how much it missed", "[long]") {
  for (const auto& [depth, least, most] : {std::tuple(0.1, 0.15, 0.5), std::tuple(1.9, 1.05, 1.4)}) {
    CAPTURE(depth);
    SquatOptions options;
    options.depth = depth;
    options.time_step = 0.03;
    Motion motion = makeSquat(getBipetto(), options);
    FddpOptions solver;
    solver.max_iterations = 60;
    const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, solver);
    CAPTURE(summary.message, summary.cost);
    CHECK(std::isfinite(summary.cost));
    for (const VectorXd& x : motion.guess.xs) REQUIRE(x.allFinite());
    for (const VectorXd& u : motion.guess.us) REQUIRE(u.allFinite());
    const MotionResult result = makeResult({"bipetto", "", {}}, {motion, motion.guess, summary});
    const GoalOutcome& outcome = find(result, "depth");
    CHECK_FALSE(outcome.met());
    CHECK(outcome.achieved > least);
    CHECK(outcome.achieved < most);
    CHECK(formatOutcome(outcome).find("missed") != std::string::npos);
  }
}
