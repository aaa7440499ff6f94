// Stairs: the feet land on the steps and stay over them, up and down.
#include <catch2/catch.hpp>

#include "bielle/model/error.h"
#include "bielle/motion/stairs.h"
#include "change_option.h"
#include "measure_steps.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("stairs: Bipetto goes up and down, every foot on its step", "[long]") {
  for (double height : {0.12, -0.12}) {  // tests check_stairs, check_stairs_down have lower ones
    CAPTURE(height);
    StairsOptions options;
    options.height = height;
    options.depth = 0.2;
    options.stairs = 2;
    Motion motion = makeStairs(getBipetto(), options);
    for (const ContactPhase& phase : motion.schedule.phases)
      for (const ContactTarget& foot : phase.contacts)
        CHECK(motion.ground.calcHeight(foot.X_WT.p.x(), foot.X_WT.p.y()) == Approx(foot.X_WT.p.z()).margin(1e-9));
    FddpOptions solver;
    solver.initial_regularization = kGuessRegularization;
    solver.max_iterations = 100;
    const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, solver);
    CAPTURE(summary.message, summary.iterations);
    CHECK(summary.termination == FddpTermination::Converged);
    const StepMeasures m = StepMeter(motion, motion.guess).measure();
    CHECK(m.end.x() - m.start.x() == Approx(options.stairs * options.depth).margin(0.01));
    CHECK(m.end.z() - m.start.z() == Approx(options.stairs * height).margin(0.01));
    checkFeet(m);
    CHECK(m.tilt < 0.15);
    CHECK(m.bend > 0.3);
    CHECK(m.velocity_jump < 5);
  }
}

TEST_CASE("stairs: the ground is where it was requested") {
  StairsOptions options;
  options.height = 0.05;
  options.depth = 0.2;
  options.stairs = 3;
  const Ground up = makeStairsGround(options, {Matrix3d::Identity(), Vector3d(1, 0, 0)});
  CHECK(up.calcHeight(1, 0) == 0);
  CHECK(up.calcHeight(1.09, 0) == 0);
  CHECK(up.calcHeight(1.11, 0) == Approx(0.05));
  CHECK(up.calcHeight(1.4, 0.3) == Approx(0.1));
  CHECK(up.calcHeight(1.4, 0.5) == 0);
  CHECK(up.calcHeight(1.6, 0) == Approx(0.15));
  CHECK(up.calcHeight(1.8, 0) == 0);
  options.height = -0.05;
  StairsOptions sloping = options;
  sloping.slope = -0.2;
  CHECK(makeStairs(getBipetto(), sloping).ground.calcHeight(0.6, 0) == Approx(-3 * 0.2 * options.depth));
  const Ground down = makeStairsGround(options, {Matrix3d::Identity(), Vector3d(1, 0, 0)});
  CHECK(down.calcHeight(1, 0) == Approx(0).margin(1e-12));
  CHECK(down.calcHeight(1.2, 0) == Approx(-0.05));
  CHECK(down.calcHeight(1.9, 0) == Approx(-0.15));
}

TEST_CASE("stairs: feet that may land off their footholds stay on their treads") {
  StairsOptions options;
  options.gait.foothold_room = 0.02;
  options.depth = 0.11;        // soles of 0.1
  const auto getReach = [&] {  // of a sole ahead of its middle, where it lands farthest ahead
    const MotionPlan plan = planStairs(getBipetto(), options, makeStandingRobot(getBipetto()));
    double reach = 0;
    int landings = 0;
    for (const StageSpec& stage : plan.stages)
      for (const PathConstraint& constraint : stage.path_constraints)
        if (constraint.name.rfind("landing of ", 0) == 0) {
          const ContactFrame& foot = getBipetto().contacts()[0];
          const double turn = constraint.upper[5] * std::hypot(foot.half_length, foot.half_width);
          CHECK((constraint.lower + constraint.upper).head<2>().norm() < 1e-12);
          reach = std::max(reach, foot.half_length + constraint.upper[0] + turn);
          CHECK(constraint.upper[1] == Approx(0.02));
          ++landings;
        }
    CHECK(landings > 1);
    return reach;
  };
  CHECK(getReach() <= options.depth / 2 + 1e-9);
  options.depth = 0.3;
  CHECK(getReach() == Approx(0.05 + 0.02 + 0.02));
}

TEST_CASE("stairs: what cannot be done is refused by name") {
  const auto make = [](const std::string& option, double value) {
    return makeStairs(getBipetto(), changeOption(StairsOptions(), option, value));
  };
  for (const auto& [option, value, word] :
       std::vector<std::tuple<std::string, double, std::string>>{{"height", 0.6, "reach"},
                                                                 {"height", -0.6, "reach"},
                                                                 {"depth", 0.08, "depth"},
                                                                 {"depth", 1.2, "speed"},
                                                                 {"stairs", 2.5, "stairs"},
                                                                 {"speed", 0, "speed"},
                                                                 {"speed", 2, "speed"},
                                                                 {"width", 0.2, "width"},
                                                                 {"single_support", 0.4, "no such option"}}) {
    CAPTURE(option, value);
    CHECK_THROWS_AS(make(option, value), InputError);
    CHECK_THROWS_WITH(make(option, value), Catch::Contains(word));
  }
}
