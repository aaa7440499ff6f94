// A solve that starts from the result of another one.
#include <catch2/catch.hpp>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/walk.h"
#include "bielle/results/result.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

Motion makeShortWalk(double speed, double end = 0.3) {
  WalkOptions options;
  options.speed = speed;
  options.steps = 3;
  options.gait.timing.end = end;
  return makeWalk(getBipetto(), options);
}

}  // namespace

TEST_CASE("warm start: a result is its own solution, and near that of a walk a little faster") {
  Motion motion = makeShortWalk(0.4);
  const FddpResult first = solve(*motion.problem, motion.guess);
  const FddpSummary& cold = first.summary;
  motion.guess = first.trajectory;
  REQUIRE(cold.termination == FddpTermination::Converged);
  const MotionRecord record = makeRecord(motion, motion.guess);

  // The trajectory itself, and what a file keeps of it, both with the multipliers of its constraints.
  Motion same = makeShortWalk(0.4);
  same.guess = motion.guess;
  CHECK(solve(*same.problem, same.guess, {}, {}, first.multipliers).summary.iterations <= 1);
  same.guess = makeStart(record, same).trajectory;
  const FddpSummary again = solve(*same.problem, same.guess, {}, {}, first.multipliers).summary;
  CHECK(again.termination == FddpTermination::Converged);
  CHECK(3 * again.iterations <= cold.iterations);
  CHECK(again.cost == Approx(cold.cost).epsilon(1e-8));

  Motion faster = makeShortWalk(0.48), warm = makeShortWalk(0.48);
  const FddpSummary faster_cold = test::solveInPlace(*faster.problem, faster.guess);
  warm.guess = makeStart(record, warm).trajectory;
  const FddpSummary faster_warm = test::solveInPlace(*warm.problem, warm.guess);
  CHECK(faster_warm.termination == FddpTermination::Converged);
  CHECK(faster_warm.iterations < faster_cold.iterations);
  CHECK(faster_warm.cost == Approx(faster_cold.cost).epsilon(1e-6));
}

TEST_CASE("warm start: what a solve was cut off with goes on where it was, multipliers included") {
  const Motion motion = makeShortWalk(0.4), other = makeShortWalk(0.4, 0.6);
  SolveOptions options, few;
  options.solver = few.solver = FddpOptions();
  const FddpSummary cold = solve(motion, options).summary;
  few.solver.max_iterations = cold.iterations - 3;
  const Solution cut = solve(motion, few);
  REQUIRE(cut.summary.termination == FddpTermination::MaxIterations);
  CHECK(motion.guess.xs.back() == makeShortWalk(0.4).guess.xs.back());  // a solve leaves its motion as it is
  MotionRecord record = makeRecord(motion, cut.trajectory);

  options.start = makeStart(record, motion);
  const FddpSummary without = solve(motion, options).summary;
  record.multipliers = cut.multipliers;
  options.start = makeStart(record, motion);
  const Solution with = solve(motion, options);
  CHECK(with.converged());
  CHECK(with.summary.iterations < without.iterations);
  CHECK(with.summary.cost == Approx(cold.cost).epsilon(1e-8));
  CHECK(with.multipliers.penalty > 0);

  // Those of a motion with other nodes are not taken.
  options.solver.max_iterations = 1;
  options.start = StartingPoint{other.guess};
  const FddpSummary alone = solve(other, options).summary;
  options.start->multipliers = cut.multipliers;
  CHECK(solve(other, options).summary.cost == alone.cost);
}

TEST_CASE("warm start: other lengths are resampled, feet carried to their places, other robots refused") {
  Motion motion = makeShortWalk(0.4);
  MotionRecord record = makeRecord(motion, motion.guess);
  Motion longer = makeShortWalk(0.6, 0.6);
  REQUIRE(longer.problem->numStages() == motion.problem->numStages() + 25);
  longer.guess = makeStart(record, longer).trajectory;
  const Model& model = getBipetto();
  Workspace ws(model);
  for (size_t k = 0; k < longer.guess.xs.size(); ++k) {
    updatePositions(model, ws, longer.guess.xs[k].head(model.nq()));
    Vector3d error = Vector3d::Zero();
    for (const ContactTarget& target : longer.schedule.getPhase(static_cast<int>(k)).contacts) {
      const ContactFrame& foot = model.contacts()[target.contact];
      error += getPlacement(ws, foot.body, foot.X_BF).p - target.X_WT.p;
    }
    CHECK(error.norm() < 1e-12);
  }
  CHECK((longer.guess.us.back() - motion.guess.us.back()).norm() == 0);

  record.u(3, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(makeStart(record, motion), Catch::Contains("finite"));
  record.u_names.front() = "other";
  CHECK_THROWS_WITH(makeStart(record, motion), Catch::Contains("motors"));
  CHECK_THROWS_AS(readResultRecord("/nowhere/at/all"), InputError);
}
