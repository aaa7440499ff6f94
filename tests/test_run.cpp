// Runs and hops: flights in their gaits, and the motions measured on their trajectories.
#include <algorithm>
#include <catch2/catch.hpp>

#include "bielle/model/error.h"
#include "bielle/motion/run.h"
#include "change_option.h"
#include "measure_steps.h"
#include "motion/gait.h"
#include "motion/quintic.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// Contacts of each phase, by the first letters of the feet; "-" in flight.
std::string describe(const ContactSchedule& schedule) {
  std::string text;
  for (const ContactPhase& phase : schedule.phases) {
    std::string feet;
    for (const ContactTarget& target : phase.contacts)
      feet += getBipetto().contacts()[target.contact].name == "foot_left" ? "L" : "R";
    text += (text.empty() ? "" : " ") + (feet.empty() ? "-" : feet);
  }
  return text;
}

double calcAirTime(const ContactSchedule& schedule) {
  double time = 0;
  for (const ContactPhase& phase : schedule.phases)
    if (phase.contacts.empty()) time += phase.nodes * phase.dt;
  return time;
}

// Least height of the lifted soles in the middle half of their ways through the air, flights included.
double calcClearance(const Motion& motion) {
  const Model& model = getBipetto();
  Workspace ws(model);
  double least = 1e9;
  for (int c = 0; c < 2; ++c) {
    std::vector<bool> lifted;
    for (const ContactPhase& phase : motion.schedule.phases)
      lifted.insert(lifted.end(), phase.nodes,
                    std::none_of(phase.contacts.begin(), phase.contacts.end(),
                                 [c](const ContactTarget& target) { return target.contact == c; }));
    const ContactFrame& sole = model.contacts()[c];
    for (size_t begin = 0, end = 0; begin < lifted.size(); begin = end + 1) {
      for (end = begin; end < lifted.size() && lifted[end];) ++end;
      for (size_t k = begin; k < end; ++k) {
        if (4 * (k - begin) < end - begin || 4 * (k - begin) > 3 * (end - begin)) continue;
        updatePositions(model, ws, motion.guess.xs[k].head(model.nq()));
        const SE3 X = getPlacement(ws, sole.body, sole.X_BF);
        for (double x : {-sole.half_length, sole.half_length})
          for (double y : {-sole.half_width, sole.half_width})
            least = std::min(least, X.act(Vector3d(x, y, 0)).z() - motion.ground.height);
      }
    }
  }
  return least;
}

struct SolvedRun {
  FddpSummary summary;
  StepMeasures measures;
  double clearance = 0;
  std::vector<Vector3d> coms;  // at every node
};

SolvedRun solveRun(Motion& motion) {
  FddpOptions options;
  options.max_iterations = 150;
  SolvedRun solved;
  solved.summary = test::solveInPlace(*motion.problem, motion.guess, options);
  solved.measures = StepMeter(motion, motion.guess).measure();
  solved.clearance = calcClearance(motion);
  Workspace ws(getBipetto());
  for (const VectorXd& x : motion.guess.xs) {
    updatePositions(getBipetto(), ws, x.head(getBipetto().nq()));
    solved.coms.push_back(calcCom(getBipetto(), ws));
  }
  return solved;
}

void checkRun(const SolvedRun& solved) {
  const StepMeasures& m = solved.measures;
  CAPTURE(solved.summary.message, solved.summary.iterations);
  CHECK(solved.summary.termination == FddpTermination::Converged);
  CHECK(solved.summary.violation <= 1e-8);
  CHECK(m.slip < 2e-4);
  CHECK(m.penetration < 1e-4);
  CHECK(m.lowest > -1e-4);
  CHECK(solved.clearance > 5.9e-3);  // the constraint keeps 6 mm
  CHECK(m.touchdown < 0.3);
  CHECK(m.feet > 0.1);
  CHECK(m.pressure < 1);
  CHECK(m.friction < 0.7);
  CHECK(m.load > 0);
  CHECK(m.foothold < 1e-8);
  CHECK(m.tilt_at_landing < 1e-6);
  CHECK(m.tilt < 0.15);
  CHECK(m.bend > 0.3);
  CHECK(m.final_speed < 2e-3);
  CHECK(m.velocity_jump < 3);  // a knee that snaps through its dead point changes by tens of rad/s
}

// In every flight the centre of mass falls freely and its horizontal velocity stays, by differences over three nodes.
void checkBallistics(const Motion& motion, const std::vector<Vector3d>& coms) {
  int node = 0, flights = 0;
  for (const ContactPhase& phase : motion.schedule.phases) {
    for (int k = node + 1; phase.contacts.empty() && k < node + phase.nodes; ++k) {
      const Vector3d a = (coms[k + 1] - 2 * coms[k] + coms[k - 1]) / (phase.dt * phase.dt);
      CHECK((a - getBipetto().gravity()).norm() < 0.2);
    }
    if (phase.contacts.empty()) ++flights;
    node += phase.nodes;
  }
  CHECK(flights > 0);
}

}  // namespace

TEST_CASE("quintic: position, velocity and acceleration of both ends, by differences") {
  const PolynomialEnd begin{0.1, -0.4, -9.81}, end{0.12, 0.5, -9.81};
  const double D = 0.3, d = 1e-4;
  const Quintic curve(begin, end, D);
  CHECK(curve.calc(0) == Approx(begin.position));
  CHECK(curve.calc(D) == Approx(end.position));
  CHECK((curve.calc(d) - curve.calc(-d)) / (2 * d) == Approx(begin.velocity).epsilon(1e-4));
  CHECK((curve.calc(D + d) - curve.calc(D - d)) / (2 * d) == Approx(end.velocity).epsilon(1e-4));
  CHECK(curve.calcAcceleration(0) == Approx(begin.acceleration));
  CHECK(curve.calcAcceleration(D) == Approx(end.acceleration));
  for (double t : {0.07, 0.2})
    CHECK((curve.calc(t + d) - 2 * curve.calc(t) + curve.calc(t - d)) / (d * d) ==
          Approx(curve.calcAcceleration(t)).epsilon(1e-4));
}

TEST_CASE("run, hop: which foot stands when") {
  RunOptions run;
  run.steps = 4;
  const MotionPlan plan = planRun(getBipetto(), run, makeStandingRobot(getBipetto()));
  CHECK(describe(plan.schedule) == "LR L - R - L - R LR");
  CHECK(calcAirTime(plan.schedule) == Approx(3 * run.flight));
  CHECK(plan.goals.front().kind == GoalKind::FlightTime);  // too short for its speed
  run.steps = 8;
  CHECK(planRun(getBipetto(), run, makeStandingRobot(getBipetto())).goals.front().kind == GoalKind::Speed);
  HopOptions hop;
  hop.foot = Side::Right;
  hop.hops = 2;
  hop.length = 0.1;
  const MotionPlan hops = planHop(getBipetto(), hop, makeStandingRobot(getBipetto()));
  CHECK(describe(hops.schedule) == "LR R - R - R LR");
  CHECK(calcAirTime(hops.schedule) == Approx(2 * hop.flight));
  const std::vector<ContactPhase>& phases = hops.schedule.phases;
  const auto getX = [&](size_t phase, size_t i) { return phases[phase].contacts.at(i).X_WT.p.x(); };
  CHECK(getX(3, 0) - getX(1, 0) == Approx(hop.length));
  CHECK(getX(5, 0) - getX(1, 0) == Approx(2 * hop.length));
  CHECK(getX(6, 0) - getX(0, 0) == Approx(2 * hop.length));
  CHECK(getX(6, 1) - getX(0, 1) == Approx(2 * hop.length));
}

TEST_CASE("gait: loads of a run carry the weight on average, and its centre of mass falls freely in flight") {
  const SE3 left{Matrix3d::Identity(), Vector3d(0, 0.1, 0)}, right{Matrix3d::Identity(), Vector3d(0, -0.1, 0)};
  GaitTiming timing;
  timing.time_step = 0.005;
  timing.flight = 0.08;
  timing.single = 0.24;
  const double g = 9.81, h = timing.time_step, stretch = 0.01;
  const Vector3d com(0, 0, 0.5);
  LocomotionTask task;
  task.plan = planFootsteps(left, right, {0.3, 0, 0}, 6, Side::Right);
  const Gait gait = makeGait(task, timing, {}, stretch, com, g);
  double impulse = 0;
  int node = 0;
  for (size_t p = 0; p < gait.phases.size(); ++p) {
    const GaitPhase& phase = gait.phases[p];
    double load = 0;
    for (int k = node; k < node + phase.nodes; ++k) {
      const double here = gait.nodes[k].load[0] + gait.nodes[k].load[1];
      CHECK(here >= 0);
      load += here / phase.nodes;
      if (phase.flies() && k > node) {
        const Vector3d a = (gait.nodes[k + 1].com - 2 * gait.nodes[k].com + gait.nodes[k - 1].com) / (h * h);
        CHECK((a + Vector3d(0, 0, g)).norm() < 1e-6);
      }
    }
    impulse += phase.nodes * (load - 1);
    if (phase.flies()) {
      CHECK(load == 0);
      CHECK(gait.nodes[node].com.z() == Approx(com.z() + stretch));
      CHECK(gait.nodes[node + phase.nodes].com.z() == Approx(com.z() + stretch));
    } else if (p > 2 && !phase.isDoubleSupport() && gait.phases[p + 1].flies()) {
      CHECK(load == Approx(1 + timing.flight / timing.single).epsilon(1e-3));
    }
    node += phase.nodes;
  }
  CHECK(impulse * g * h == Approx(0).margin(5e-3));  // m/s, from rest to rest; sums differ from integrals
}

TEST_CASE("run: stages are as short as the fastest swing needs") {
  const auto getStep = [](double speed) {
    RunOptions options;
    options.speed = speed;
    return planRun(getBipetto(), options, makeStandingRobot(getBipetto())).schedule.phases.front().dt;
  };
  CHECK(getStep(1) == 0.005);
  CHECK(getStep(1.5) == Approx(0.004));
}

TEST_CASE("run: Bipetto runs as fast as requested, flies in between, and lands softly", "[long]") {
  const RunOptions options;
  Motion motion = makeRun(getBipetto(), options, {Formulation::Reduced, StepRule::Midpoint});
  const SolvedRun solved = solveRun(motion);
  checkRun(solved);
  checkBallistics(motion, solved.coms);
  const StepMeasures& m = solved.measures;
  REQUIRE(m.touchdown_times.size() == 8);
  const Vector3d moved = m.touchdown_coms[5] - m.touchdown_coms[1];
  CHECK(moved.x() / (m.touchdown_times[5] - m.touchdown_times[1]) == Approx(options.speed).epsilon(0.05));
  CHECK(m.end.x() - m.start.x() == Approx(6 * options.speed * (options.stance + options.flight)).margin(0.01));
  CHECK(m.base_high - m.base_low < 0.1);
  CHECK(m.torque < 80);
}

TEST_CASE("hop: Bipetto hops on the requested foot, and ahead", "[long]") {
  HopOptions options;  // the test check_hop has the left foot, on the spot
  options.foot = Side::Right;
  options.length = 0.15;
  Motion motion = makeHop(getBipetto(), options, {Formulation::Reduced, StepRule::Midpoint});
  const SolvedRun solved = solveRun(motion);
  checkRun(solved);
  checkBallistics(motion, solved.coms);
  CHECK(solved.measures.end.x() - solved.measures.start.x() == Approx(options.length).margin(0.01));
  CHECK(solved.measures.torque < 100);
}

TEST_CASE("run, hop: what cannot be done is refused by name") {
  const auto make = [](bool run, const std::string& option, double value) {
    run ? makeRun(getBipetto(), changeOption(RunOptions(), option, value))
        : makeHop(getBipetto(), changeOption(HopOptions(), option, value));
  };
  for (const auto& [run, option, value, word] :
       std::vector<std::tuple<bool, std::string, double, std::string>>{{true, "speed", 5, "reach"},
                                                                       {true, "steps", 1, "steps"},
                                                                       {true, "flight", 0, "flight"},
                                                                       {true, "flight", 0.004, "flight"},
                                                                       {true, "stance", 0.005, "stance"},
                                                                       {true, "stretch", 1, "stretch"},
                                                                       {true, "time_step", -1, "time_step"},
                                                                       {false, "foot", 2, "foot"},
                                                                       {false, "hops", 0, "hops"},
                                                                       {false, "hops", 1.5, "hops"},
                                                                       {false, "flight", 3, "flight"},
                                                                       {false, "length", 2, "reach"}}) {
    CAPTURE(run, option, value);
    CHECK_THROWS_AS(make(run, option, value), InputError);
    CHECK_THROWS_WITH(make(run, option, value), Catch::Contains(word));
  }
}
