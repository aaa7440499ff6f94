// Jumps, measured on their trajectories by kinematics and the ballistic parabola, independently of the solver.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/io/robot_loader.h"
#include "bielle/model/error.h"
#include "bielle/motion/jump.h"
#include "change_option.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

int findPhase(const ContactSchedule& schedule, const std::string& name) {
  int node = 0;
  for (const ContactPhase& phase : schedule.phases) {
    if (phase.name == name) return node;
    node += phase.nodes;
  }
  FAIL("there is no phase " << name);
  return -1;
}

struct JumpOutcome {
  double lowest_corner = 1e9, clearance = 0;      // of the soles over the ground: at any time; at mid-flight, m
  double touchdown = 0;                           // largest speed of a foot as it comes down, m/s
  double misplaced = 0;                           // largest distance of a foot from where it should land, m
  double slip = 0;                                // farthest a foot goes from where it stood when its contact began, m
  double tilt = 0;                                // of the torso from the vertical, rad
  double knee_lowest = 1e9, knee_highest = -1e9;  // bend of a knee, positive as at the start, rad
  double stone = 0;                               // largest distance of the CoM from the parabola in flight, m
  double rise = 0;                                // of the CoM from take-off to mid-flight, m
  double pressure = 0;                            // centre of pressure over half the sole, at most 1
  double force = 1e9, friction = 0;               // least vertical force, N; largest tangential over vertical force
  double end_speed = 0;                           // largest velocity coordinate at the end
  Vector3d travel;                                // of the CoM from start to end, m
};

void measureFeet(const Motion& motion, const ShootingTrajectory& t, JumpOutcome& out) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  const int flight = findPhase(motion.schedule, "flight"), land = findPhase(motion.schedule, "land");
  std::vector<Vector3d> places(model.contacts().size());
  for (int k = 0; k < static_cast<int>(t.xs.size()); ++k) {
    updatePositions(model, ws, t.xs[k].head(model.nq()));
    updateVelocities(model, ws, t.xs[k].tail(model.nv()));
    for (size_t c = 0; c < model.contacts().size(); ++c) {
      const ContactFrame& contact = model.contacts()[c];
      const SE3 X = getPlacement(ws, contact.body, contact.X_BF);
      double low = 1e9;
      for (int i : {-1, 1})
        for (int j : {-1, 1})
          low = std::min(low, (X.p + X.R * Vector3d(i * contact.half_length, j * contact.half_width, 0)).z());
      out.lowest_corner = std::min(out.lowest_corner, low);
      if (k == (flight + land) / 2) out.clearance = c == 0 ? low : std::min(out.clearance, low);
      if (k == 0 || k == land) places[c] = X.p;
      if (k < flight || k >= land) out.slip = std::max(out.slip, (X.p - places[c]).norm());
      if (k != land) continue;
      const Vector6d V = ws.V[contact.body];
      out.touchdown = std::max(out.touchdown, (V.head<3>() + V.tail<3>().cross(X.p)).norm());
      out.misplaced = std::max(out.misplaced, (X.p - motion.schedule.getPhase(land).contacts[c].X_WT.p).norm());
    }
  }
}

void measureBody(const Motion& motion, const ShootingTrajectory& t, JumpOutcome& out) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  const int flight = findPhase(motion.schedule, "flight"), land = findPhase(motion.schedule, "land");
  std::vector<Vector3d> com;
  for (const VectorXd& x : t.xs) {
    updatePositions(model, ws, x.head(model.nq()));
    com.push_back(calcCom(model, ws));
    out.tilt = std::max(out.tilt, std::acos(std::min(1.0, getPlacement(ws, 1, SE3()).R(2, 2))));
    for (const char* name : {"knee_left", "knee_right"}) {
      const int i = model.joints()[model.findJoint(name)].idx_q;
      const double bend = std::copysign(1, t.xs[0][i]) * x[i];
      out.knee_lowest = std::min(out.knee_lowest, bend);
      out.knee_highest = std::max(out.knee_highest, bend);
    }
  }
  // The stone through the places at take-off and touchdown.
  const double T = motion.schedule.getTime(land) - motion.schedule.getTime(flight);
  for (int k = flight; k <= land; ++k) {
    const double s = static_cast<double>(k - flight) / (land - flight);
    const Vector3d stone = (1 - s) * com[flight] + s * com[land] + 0.5 * 9.81 * T * T * s * (1 - s) * Vector3d::UnitZ();
    out.stone = std::max(out.stone, (com[k] - stone).norm());
  }
  out.rise = com[(flight + land) / 2].z() - 0.5 * (com[flight].z() + com[land].z());
  out.end_speed = t.xs.back().tail(model.nv()).cwiseAbs().maxCoeff();
  out.travel = com.back() - com.front();
}

void measureForces(const Motion& motion, const ShootingTrajectory& t, JumpOutcome& out) {
  const Model& model = motion.problem->model();
  RobotEvaluator evaluator(*motion.problem);
  for (size_t k = 0; k < t.us.size(); ++k) {
    const ConstraintSet& set = motion.problem->spec(static_cast<int>(k)).constraints;
    if (static_cast<int>(set.closures.size()) == set.num_loops) continue;
    const RobotEvaluation& at = evaluator.evaluate(static_cast<int>(k), t.xs[k], t.us[k]);
    REQUIRE(at.status == StepStatus::Ok);
    for (size_t c = set.num_loops; c < set.closures.size(); ++c) {
      const ContactFrame& contact = model.contacts()[set.getContact(static_cast<int>(c))];
      const Vector6d f = at.lambda.segment<6>(set.offsets[c]);
      out.force = std::min(out.force, f[2]);
      out.friction = std::max(out.friction, f.head<2>().norm() / f[2]);
      out.pressure = std::max(
          {out.pressure, std::abs(f[4] / f[2]) / contact.half_length, std::abs(f[3] / f[2]) / contact.half_width});
    }
  }
}

JumpOutcome solveJump(Motion& motion, FddpSummary& summary) {
  FddpOptions solver;
  solver.max_iterations = 100;
  summary = test::solveInPlace(*motion.problem, motion.guess, solver);
  JumpOutcome out;
  measureFeet(motion, motion.guess, out);
  measureBody(motion, motion.guess, out);
  measureForces(motion, motion.guess, out);
  return out;
}

}  // namespace

TEST_CASE("jump: the paper's problem has a solution, which flies as a stone") {
  JumpOptions options;
  setPaperWeights(options);
  CHECK(makeJump(getBipetto(), options).problem->numStages() == 4 * 10 + 26);
  options.flight = 0.3;  // in its own 0.39 s the push goes through the knee's dead point
  Motion motion = makeJump(getBipetto(), options);
  FddpSummary summary;
  const JumpOutcome out = solveJump(motion, summary);
  CAPTURE(summary.message, summary.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
  CHECK(out.stone < 1e-2);
  CHECK(out.rise == Approx(9.81 * 0.3 * 0.3 / 8).epsilon(0.05));
  CHECK(out.knee_lowest > 0);
  CHECK(out.tilt < 0.2);
}

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
    } catch (const ModelError& error) {
      CHECK(std::string(error.what()).find("'" + option + "'") != std::string::npos);
    }
  }
  const Model fourbar = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/fourbar").model;
  CHECK_THROWS_AS(makeJump(fourbar), ModelError);
}
