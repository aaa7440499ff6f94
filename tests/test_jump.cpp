// Jumps, measured on their trajectories by kinematics and the ballistic parabola, independently of the solver.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/model/error.h"
#include "bielle/motion/jump.h"
#include "bielle/robots/robot_loader.h"
#include "change_option.h"
#include "measure_jump.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

JumpOutcome solveJump(Motion& motion, FddpSummary& summary) {
  FddpOptions solver;
  solver.max_iterations = 100;
  summary = test::solveInPlace(*motion.problem, motion.guess, solver);
  return measureJump(motion);
}

}  // namespace

TEST_CASE("jump: Bipetto flies as long and as far as requested, and lands softly") {
  struct Row {
    Formulation formulation;
    double flight, length;
  };
  for (const Row& row : {Row{Formulation::Reduced, 0.3, 0}, Row{Formulation::Reduced, 0.3, 0.3},
                         Row{Formulation::Reduced, 0.2, -0.1}, Row{Formulation::Full, 0.3, 0.1}}) {
    CAPTURE(getName(row.formulation), row.flight, row.length);
    JumpOptions options;
    options.flight = row.flight;
    options.length = row.length;
    options.time_step = 0.01;
    Motion motion = makeJump(getBipetto(), options, row.formulation);
    FddpSummary summary;
    const JumpOutcome out = solveJump(motion, summary);
    CAPTURE(summary.message, summary.iterations);
    CHECK(summary.termination == FddpTermination::Converged);
    CHECK(out.lowest_corner > -2e-3);
    CHECK(out.clearance > 0.02);
    CHECK(out.touchdown < 0.02);
    CHECK(out.misplaced < 3e-3);
    CHECK(out.slip < 2e-3);
    CHECK(out.tilt < 0.3);
    CHECK(out.knee_lowest > 0);
    CHECK(out.knee_highest < 1.3);
    CHECK(out.rise == Approx(9.81 * row.flight * row.flight / 8).epsilon(1e-3));
    CHECK(out.stone < 1e-3);
    CHECK(out.pressure < 0.9);
    CHECK(out.force > 5);
    CHECK(out.friction < 0.7);
    CHECK(out.end_speed < 0.01);
    CHECK((out.travel - Vector3d(row.length, 0, 0)).norm() < 5e-3);
  }
}

TEST_CASE("jump: its height follows from its time, its load from its height") {
  const double g = 9.81;
  JumpOptions options;
  options.flight = 0.314;
  options.time_step = 0.005;
  const JumpFigures figures = calcJumpFigures(options, g);
  CHECK(figures.flight == Approx(0.31));  // an even number of steps of 5 ms
  CHECK(figures.take_off == Approx(g * 0.31 / 2));
  CHECK(figures.rise == Approx(figures.take_off * figures.take_off / (2 * g)));
  // The height is twice differentiable on the ground, and its velocity is that of a stone at both ends of the flight.
  const double h = 1e-4, take_off = figures.stand + figures.push, touchdown = take_off + figures.flight;
  const auto height = [&](double t) { return calcJumpHeight(options, g, t).height; };
  for (double t = 0.01; t < touchdown + figures.land + options.settle; t += 0.0173) {
    CAPTURE(t);
    if (std::abs(t - take_off) < 2 * h || std::abs(t - touchdown) < 2 * h) continue;
    const double acceleration = (height(t + h) - 2 * height(t) + height(t - h)) / (h * h);
    CHECK(calcJumpHeight(options, g, t).acceleration == Approx(acceleration).margin(0.05));
  }
  for (double t : {take_off, touchdown}) {
    CHECK(height(t - 1e-9) == Approx(height(t + 1e-9)).margin(1e-7));
    CHECK((height(t) - height(t - h)) / h == Approx((height(t + h) - height(t)) / h).margin(0.01));
  }
  CHECK((height(take_off + h) - height(take_off - h)) / (2 * h) == Approx(figures.take_off).margin(0.01));
  double load = 0;  // mean of the push, Eq. (2)
  for (int i = 0; i < 1000; ++i)
    load += (1 + calcJumpHeight(options, g, figures.stand + (i + 0.5) / 1000 * figures.push).acceleration / g) / 1000;
  CHECK(load == Approx(1 + figures.take_off / (g * figures.push)).epsilon(1e-4));
}

TEST_CASE("jump: what no leg can do does not pass for done, and stays finite") {
  JumpOptions options;
  options.flight = 1;
  options.time_step = 0.01;
  Motion motion = makeJump(getBipetto(), options);
  FddpOptions solver;
  solver.max_iterations = 30;
  const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, solver);
  CHECK(summary.termination != FddpTermination::Converged);
  CHECK(std::isfinite(summary.cost));
  for (const VectorXd& x : motion.guess.xs) REQUIRE(x.allFinite());
  for (const VectorXd& u : motion.guess.us) REQUIRE(u.allFinite());
}

TEST_CASE("jump: impossible options are refused by name") {
  const auto make = [&](const std::string& option, double value) {
    return makeJump(getBipetto(), changeOption(JumpOptions(), option, value));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_NOTHROW(make("stand", 0));
  for (const auto& [option, value] : std::vector<std::pair<std::string, double>>{{"flight", -0.3},
                                                                                 {"flight", 0},
                                                                                 {"flight", nan},
                                                                                 {"flight", 5},
                                                                                 {"push", 0},
                                                                                 {"push", -1},
                                                                                 {"land", -1},
                                                                                 {"stand", -1},
                                                                                 {"settle", nan},
                                                                                 {"length", 10},
                                                                                 {"length", nan},
                                                                                 {"time_step", 0},
                                                                                 {"time_step", -0.01},
                                                                                 {"clearance", -1},
                                                                                 {"stretch", -1},
                                                                                 {"friction", 0},
                                                                                 {"contact_kp", -1},
                                                                                 {"contact_kd", nan}}) {
    CAPTURE(option, value);
    try {
      make(option, value);
      FAIL("accepted");
    } catch (const InputError& error) {
      CHECK(std::string(error.what()).find("'" + option + "'") != std::string::npos);
    }
  }
  const Model fourbar = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/fourbar").model;
  CHECK_THROWS_AS(makeJump(fourbar), InputError);
}
