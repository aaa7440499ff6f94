// Goals in the check: measured independently of the summary, reported when missed, and compared with the summary.
#include <catch2/catch.hpp>
#include <set>
#include <sstream>

#include "bielle/motion/jump.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "check.h"
#include "get_error.h"
#include "robot_directory.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;
using namespace bielle::validation;

namespace {

constexpr double kStep = 0.03;  // s; Simbody takes milliseconds for a node
constexpr const char* kClaims = "goals: reported vs. measured";

const LoadedRobot& getBipetto() {
  static const LoadedRobot robot = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto");
  return robot;
}

// A motion after a few iterations, written and read back: measured values need not equal the requested ones.
CheckedMotion solveBriefly(Motion motion) {
  const RobotDirectory directory;
  FddpOptions options;
  options.max_iterations = 4;
  const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, options);
  writeResult(directory.path(), makeResult({"bipetto", getBipetto().file, {}}, {motion, motion.guess, summary}));
  return readMotion(directory.path());
}

CheckedMotion makeShortWalk() {
  static const CheckedMotion walk = [] {
    WalkOptions options;
    options.steps = 3;
    options.gait.timing.time_step = kStep;
    return solveBriefly(makeWalk(getBipetto().model, options));
  }();
  return walk;
}

const CheckRow& find(const CheckReport& report, const std::string& name) {
  const CheckRow* row = report.findRow(name);
  if (row == nullptr) throw std::runtime_error("there is no row '" + name + "'");
  return *row;
}

}  // namespace

TEST_CASE("check: every kind of goal comes out of Simbody's kinematics as the summary tells it") {
  const Model& model = getBipetto().model;
  JumpOptions jump;
  jump.length = 0.1;
  TurnOptions turn;
  turn.steps = 3;
  turn.angle = 0.4;
  turn.gait.timing.time_step = kStep;
  StairsOptions stairs;
  stairs.stairs = 1;
  stairs.gait.timing.time_step = kStep;
  jump.time_step = 0.004;
  SquatOptions squat;
  squat.time_step = kStep;
  std::vector<CheckedMotion> motions = {makeShortWalk()};
  motions.push_back(solveBriefly(makeSquat(model, squat)));
  motions.push_back(solveBriefly(makeJump(model, jump)));
  motions.push_back(solveBriefly(makeTurn(model, turn)));
  motions.push_back(solveBriefly(makeStairs(model, stairs)));
  std::set<GoalKind> kinds;
  for (const CheckedMotion& motion : motions) {
    const CheckReport report = checkMotion(motion);
    CAPTURE(motion.summary.motion);
    REQUIRE(!motion.summary.goals.empty());
    for (const GoalOutcome& reported : motion.summary.goals) {
      CAPTURE(reported.goal.name, reported.achieved);
      const CheckRow& row = find(report, "goal: " + reported.goal.name);
      CHECK(*row.value == Approx(reported.achieved).margin(1e-10));
      CHECK(row.bound == reported.goal.requested);
      CHECK(row.isMissedGoal() == !reported.met());
      kinds.insert(reported.goal.kind);
    }
    CHECK(find(report, kClaims).passed());
  }
  CHECK(kinds.size() == 7);
}

TEST_CASE("check: a missed goal is reported, and fails nothing") {
  CheckedMotion motion = makeShortWalk();
  for (GoalOutcome& reported : motion.summary.goals)
    if (reported.goal.kind == GoalKind::Speed) reported.goal.requested *= 1.2;
  const CheckReport report = checkMotion(motion);
  const CheckRow& row = find(report, "goal: speed");
  CHECK(row.isMissedGoal());
  CHECK(row.passed());
  for (CheckPrint print : {CheckPrint::All, CheckPrint::Failures}) {
    std::ostringstream text;
    printReport(text, report, print);
    CHECK_THAT(text.str(), Catch::Contains("1 goal missed") && Catch::Contains("MISS  requested; tolerance 0.025 m/s"));
  }
  CHECK_THAT(formatReport(report), Catch::Contains("\"met\": false"));
}

TEST_CASE("check: a summary that tells of a goal what the trajectory does not do fails") {
  const CheckedMotion good = makeShortWalk();
  const auto expectFailure = [&good](const std::function<void(CheckedMotion&)>& poison) {
    CheckedMotion motion = good;
    poison(motion);
    CHECK_FALSE(find(checkMotion(motion), kClaims).passed());
  };
  expectFailure([](CheckedMotion& m) { m.summary.goals[0].achieved = m.summary.goals[0].goal.requested; });
  expectFailure([](CheckedMotion& m) { m.summary.goals[0].achieved = std::nan(""); });
  expectFailure([](CheckedMotion& m) { m.summary.goals[1].achieved += 1e-6; });
  // The trajectory is slower than it was when the summary was written.
  expectFailure([](CheckedMotion& m) { m.record.q.col(0) *= 0.84; });
}

TEST_CASE("check: goals that do not fit their trajectory are refused") {
  const auto refuse = [](const std::string& what, const std::function<void(Goal&, Goal&)>& poison) {
    CheckedMotion motion = makeShortWalk();
    poison(motion.summary.goals.at(0).goal, motion.summary.goals.at(1).goal);
    CHECK_THAT(getError([&] { checkMotion(motion); }), Catch::Contains(what));
  };
  refuse("nodes do not fit", [](Goal& speed, Goal&) { speed.last = 100000; });
  refuse("no time passes", [](Goal& speed, Goal&) { speed.last = speed.first; });
  refuse("not finite", [](Goal& speed, Goal&) { speed.requested = std::nan(""); });
  refuse("nodes do not fit", [](Goal&, Goal& footholds) { footholds.footholds[0].node = 100000; });
  refuse("no contact 'hand'", [](Goal&, Goal& footholds) { footholds.footholds[0].contact = "hand"; });
}
