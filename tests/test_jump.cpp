// Jumps, measured on their trajectories by kinematics and the ballistic parabola, independently of the solver.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
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

// A hopper in the plane, its base free to move along x and z and to pitch: trunk, thigh and shank, a foot that is a
// point. It stands in balance with the foot under the hip: what the leg weighs before the hip, the trunk weighs behind it.
Model makePlanarHopper() {
  constexpr double kLink = 0.25, kBend = 0.5, kTrunk = 6, kThigh = 0.8, kShank = 0.4;  // m, rad, kg
  const double behind = (kThigh + kShank) * kLink / 2 * std::sin(kBend) / kTrunk;
  ModelBuilder builder("hopper");
  const auto add = [&builder](const std::string& link, const std::string& parent, const std::string& name,
                              JointKind kind, const Vector3d& place, const Inertia& inertia) {
    Joint joint;
    joint.name = name;
    joint.kind = kind;
    joint.axis = Vector3d::UnitY();
    joint.X_PJ.p = place;
    builder.addLink(link, parent, joint, inertia);
  };
  const auto makeInertia = [](double mass, const Vector3d& com, double moment) {
    return Inertia{mass, com, moment * Matrix3d::Identity()};
  };
  add("trunk", "world", "base", JointKind::Planar, {0, 0, 2 * kLink * std::cos(kBend)},
      makeInertia(kTrunk, {-behind, 0, 0.05}, 0.08));
  add("thigh", "trunk", "hip", JointKind::Revolute, {0, 0, 0}, makeInertia(kThigh, {0, 0, -kLink / 2}, 0.004));
  add("shank", "thigh", "knee", JointKind::Revolute, {0, 0, -kLink}, makeInertia(kShank, {0, 0, -kLink / 2}, 0.002));
  builder.addFrame("foot", "shank", {Matrix3d::Identity(), {0, 0, -kLink}});
  builder.addContact("foot", "foot", ContactKind::Point3D, 0, 0);
  for (const char* joint : {"hip", "knee"}) {
    builder.addMotor(joint, 0.005);
    builder.addSerialJoint(joint);
  }
  Reference standing;
  standing.name = "half_sitting";
  standing.joints = {{"base", {0, 0, 0}}, {"hip", {-kBend}}, {"knee", {2 * kBend}}};
  standing.feet["foot"] = Vector3d::Zero();
  builder.addReference(standing);
  return builder.build();
}

// Centre of mass, momentum and angular momentum about the centre of mass, body by body.
struct Ballistics {
  Vector3d com = Vector3d::Zero(), momentum = Vector3d::Zero(), angular = Vector3d::Zero();
};
Ballistics calcBallistics(const Model& model, const VectorXd& x) {
  Workspace ws(model);
  updatePositions(model, ws, x.head(model.nq()));
  updateVelocities(model, ws, x.tail(model.nv()));
  Ballistics sum;
  Vector3d about_origin = Vector3d::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Inertia& inertia = model.bodies()[i].inertia;
    const Vector3d place = ws.X_WB[i].act(inertia.com), rate = ws.V[i].tail<3>();
    const Vector3d momentum = inertia.mass * (ws.V[i].head<3>() + rate.cross(place));
    sum.com += inertia.mass / model.mass() * place;
    sum.momentum += momentum;
    about_origin += place.cross(momentum) + ws.X_WB[i].R * inertia.I_com * ws.X_WB[i].R.transpose() * rate;
  }
  sum.angular = about_origin - sum.com.cross(sum.momentum);
  return sum;
}

}  // namespace

TEST_CASE("jump: Bipetto flies as long and as far as requested, and lands softly", "[long]") {
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

TEST_CASE("jump: a planar hopper hops ahead on one foot, and flies by closed form", "[long]") {
  const Model model = makePlanarHopper();
  constexpr double kLength = 0.1;
  Eigen::Vector2d coarser = Eigen::Vector2d::Zero();
  for (double time_step : {0.005, 0.0025}) {
    CAPTURE(time_step);
    JumpOptions options;
    options.length = kLength;
    options.time_step = time_step;
    Motion motion = makeJump(model, options);
    const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, FddpOptions());
    CAPTURE(summary.message, summary.iterations);
    CHECK(summary.termination == FddpTermination::Converged);
    const int take_off = findPhase(motion.schedule, "flight"), landing = findPhase(motion.schedule, "land");
    const std::vector<VectorXd>& xs = motion.guess.xs;
    const std::vector<VectorXd> flight(xs.begin() + take_off, xs.begin() + landing + 1);
    // The largest distances from the parabola of the centre of mass, m, and from a constant angular momentum, kg m^2/s.
    const auto calcErrors = [&](const std::vector<VectorXd>& states) {
      const Ballistics start = calcBallistics(model, states.front());
      Eigen::Vector2d errors = Eigen::Vector2d::Zero();
      for (size_t k = 0; k < states.size(); ++k) {
        const Ballistics at = calcBallistics(model, states[k]);
        const double t = k * time_step;
        const Vector3d stone = start.com + start.momentum / model.mass() * t - 0.5 * 9.81 * t * t * Vector3d::UnitZ();
        errors = errors.cwiseMax(Eigen::Vector2d((at.com - stone).norm(), (at.angular - start.angular).norm()));
      }
      return errors;
    };
    const Eigen::Vector2d errors = calcErrors(flight);
    // Those of midpoint steps: of second order.
    CHECK(errors.maxCoeff() < 40 * time_step * time_step);
    if (!coarser.isZero()) CHECK((coarser - 3 * errors).minCoeff() > 0);
    coarser = errors;
    for (int i : {0, model.nq() + 2}) {  // a place, and the rate at which the trunk pitches
      std::vector<VectorXd> poisoned = flight;
      poisoned[flight.size() / 2][i] += 0.05;
      CHECK(calcErrors(poisoned).maxCoeff() > 40 * time_step * time_step);
    }
    const Ballistics begin = calcBallistics(model, xs.front()), end = calcBallistics(model, xs.back());
    CHECK((end.com - begin.com - Vector3d(kLength, 0, 0)).norm() < 5e-3);
    CHECK(end.momentum.norm() < 1e-3 * model.mass());
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

TEST_CASE("jump: what no leg can do does not pass for done, and stays finite", "[long]") {
  JumpOptions options;
  options.flight = 1;
  options.time_step = 0.01;
  CHECK_THROWS_WITH(makeJump(getBipetto(), options),
                    Catch::Contains("shorter flight"));  // legs would have to bend too far
  options.flight = 0.8;
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
