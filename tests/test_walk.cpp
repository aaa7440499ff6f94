// Walking motions, measured on their trajectories by kinematics and dynamics.
#include <algorithm>
#include <catch2/catch.hpp>

#include "bielle/dynamics/impact.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/motion/solve.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "change_option.h"
#include "measure_steps.h"
#include "motion/gait.h"
#include "own_robots.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct SolvedWalk {
  FddpSummary summary;
  StepMeasures measures;
};

SolvedWalk solveWalk(Motion motion) {
  FddpOptions options;
  options.initial_regularization = kGuessRegularization;
  options.max_iterations = 100;
  SolvedWalk solved;
  solved.summary = test::solveInPlace(*motion.problem, motion.guess, options);
  solved.measures = StepMeter(motion, motion.guess).measure();
  return solved;
}

// Velocity of the centre of mass from the second touchdown to the last but two.
Vector3d calcSpeed(const StepMeasures& m) {
  const size_t first = 1, last = m.touchdown_times.size() - 3;
  return (m.touchdown_coms[last] - m.touchdown_coms[first]) / (m.touchdown_times[last] - m.touchdown_times[first]);
}

// Requirements for every motion with steps.
void checkWalk(const SolvedWalk& solved) {
  const StepMeasures& m = solved.measures;
  CAPTURE(solved.summary.message, solved.summary.iterations);
  CHECK(solved.summary.termination == FddpTermination::Converged);
  CHECK(m.slip < 2e-3);
  CHECK(m.slip_angle < 6e-3);
  CHECK(m.penetration < 1.5e-3);
  CHECK(m.lowest > -1e-3);
  CHECK(m.clearance > 0.01);
  CHECK(m.foothold < 1e-8);
  CHECK(m.tilt_at_landing < 1e-6);
  CHECK(m.feet > 0.05);
  CHECK(m.pressure < 1);
  CHECK(m.friction < 0.7);
  CHECK(m.load > 0.999e-3 * getBipetto().mass() * 9.81);  // what the wrench cones keep
  CHECK(m.tilt < 0.15);
  CHECK(m.bend > 0.3);
  CHECK(m.torque < 80);
  CHECK(m.final_speed < 2e-3);
}

LocomotionTask makeTask(const FootstepPlan& plan) {
  LocomotionTask task;
  task.plan = plan;
  return task;
}

const SE3 kLeft{Matrix3d::Identity(), Vector3d(0, 0.1, 0)}, kRight{Matrix3d::Identity(), Vector3d(0, -0.1, 0)};

}  // namespace

TEST_CASE("footsteps: forward, sideways and turning, counted by hand") {
  const FootstepPlan forward = planFootsteps(kLeft, kRight, {0.2, 0, 0}, 4, Side::Right);
  const std::vector<Vector3d> expected{{0.2, -0.1, 0}, {0.4, 0.1, 0}, {0.6, -0.1, 0}, {0.6, 0.1, 0}};
  for (size_t i = 0; i < 4; ++i) {
    CHECK((forward.steps[i].X_WF.p - expected[i]).norm() < 1e-12);
    CHECK(forward.steps[i].side == (i % 2 == 0 ? Side::Right : Side::Left));
  }
  CHECK((forward.getStance(2)[0].p - expected[1]).norm() < 1e-12);
  CHECK((forward.getStance(2)[1].p - expected[0]).norm() < 1e-12);

  // To the left: the left foot goes away by twice the step, the right one follows.
  const FootstepPlan side = planFootsteps(kLeft, kRight, {0, 0.1, 0}, 4, Side::Left);
  const std::vector<double> ys{0.3, 0.1, 0.5, 0.3};
  for (size_t i = 0; i < 4; ++i) CHECK(side.steps[i].X_WF.p.y() == Approx(ys[i]));

  // A quarter of a circle of radius 1 to the left ends at (1, 1).
  const double yaw = 0.1, angle = 1.5707963267948966;
  const int steps = 17;
  const double exact = angle / (steps - 1);
  const FootstepPlan arc = planFootsteps(kLeft, kRight, {2 * std::sin(exact / 2), 0, exact}, steps, Side::Left);
  const SE3 end = calcMiddle(arc.getStance(steps)[0], arc.getStance(steps)[1]);
  CHECK((end.p - Vector3d(1, 1, 0)).norm() < 1e-12);
  CHECK(calcHeading(end) == Approx(angle));
  const FootstepPlan spot = planFootsteps(kLeft, kRight, {0, 0, yaw}, 3, Side::Left);
  for (const Footstep& step : spot.steps) CHECK(step.X_WF.p.norm() == Approx(0.1));
}

TEST_CASE("footsteps: distance of soles seen from above") {
  ContactFrame sole;
  sole.half_length = 0.1;
  sole.half_width = 0.05;
  CHECK(calcSoleDistance(sole, kLeft, sole, kRight) == Approx(0.1));
  CHECK(calcSoleDistance(sole, kLeft, sole, {Matrix3d::Identity(), Vector3d(0.3, 0.1, 0)}) == Approx(0.1));
  CHECK(calcSoleDistance(sole, kLeft, sole, {Matrix3d::Identity(), Vector3d(0.05, 0.02, 0)}) < 0);
  const SE3 turned{makeAxisRotation(Vector3d::UnitZ(), 1.5707963267948966), Vector3d(0, -0.1, 0)};
  CHECK(calcSoleDistance(sole, kLeft, sole, turned) == Approx(0.05));
}

TEST_CASE("gait: swings start and end at rest, the pendulum's zero-moment point is under the stance foot") {
  const SE3 end{makeAxisRotation(Vector3d::UnitZ(), 0.4), Vector3d(0.3, 0.1, 0.05)};
  SwingShape shape;
  shape.height = 0.03;
  CHECK((calcSwing(shape, kLeft, end, 0).p - kLeft.p).norm() < 1e-12);
  CHECK((calcSwing(shape, kLeft, end, 1).p - end.p).norm() < 1e-12);
  CHECK(calcHeading(calcSwing(shape, kLeft, end, 1)) == Approx(0.4));
  CHECK(calcSwing(shape, kLeft, end, shape.apex).p.z() == Approx(0.08));
  CHECK((calcSwing(shape, kLeft, end, 1e-3).p - kLeft.p).norm() < 1e-7);
  CHECK((calcSwing(shape, kLeft, end, 1 - 1e-3).p - end.p).norm() < 1e-7);

  const FootstepPlan plan = planFootsteps(kLeft, kRight, {0.2, 0, 0}, 5, Side::Right);
  GaitTiming timing;
  timing.time_step = 0.012;
  const Vector3d com(0.01, 0, 0.5);
  const double g = 9.81, h = timing.time_step;
  const Gait gait = makeGait(makeTask(plan), timing, shape, 0, com, g);
  CHECK((gait.nodes.front().com - com).norm() < 1e-12);
  CHECK((gait.nodes.back().com - com - Vector3d(0.8, 0, 0)).norm() < 1e-12);
  for (size_t k = 1; k + 1 < gait.nodes.size(); ++k) {
    const GaitNode& node = gait.nodes[k];
    CHECK(node.load[0] + node.load[1] == Approx(1));
    CHECK(node.com.z() == Approx(0.5));
    const GaitPhase& phase = gait.phases[node.phase];
    if (phase.isDoubleSupport()) continue;
    const int stance = static_cast<int>(getOther(plan.steps[phase.steps_done].side));
    const Vector3d zmp = node.com - 0.5 / (g * h * h) * (gait.nodes[k - 1].com - 2 * node.com + gait.nodes[k + 1].com);
    CHECK((zmp - plan.getStance(phase.steps_done)[stance].p).head<2>().norm() < 1e-9);
  }
}

TEST_CASE("walk: Bipetto walks as fast as requested, on its feet", "[long]") {
  for (double speed : {0.5, 1.0}) {  // tests check_walk_* have others, and the full formulation
    CAPTURE(speed);
    WalkOptions options;
    options.speed = speed;
    const SolvedWalk solved = solveWalk(makeWalk(getBipetto(), options));
    checkWalk(solved);
    const Vector3d velocity = calcSpeed(solved.measures);
    CHECK(velocity.x() == Approx(speed).epsilon(0.05));
    CHECK(std::abs(solved.measures.end.y() - solved.measures.start.y()) < 0.02);
    CHECK(solved.measures.touchdown < 0.25 * speed + 0.1);
    if (speed > 0.5) continue;
    CHECK(solved.summary.iterations < 40);
    CHECK(solved.measures.slip < 1e-3);
    CHECK(solved.measures.base_high - solved.measures.base_low < 0.03);
    CHECK(solved.measures.heading < 0.05);
  }
}

TEST_CASE("walk: a fast one with short stages, whose contacts are stiff, is found from the guess", "[long]") {
  WalkOptions options;
  options.speed = 0.9;
  options.gait.timing.time_step = 0.01;
  SolveOptions how;
  how.solver = FddpOptions();
  const FddpSummary summary = solve(makeWalk(getBipetto(), options), how).summary;
  CAPTURE(summary.message, summary.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
}

TEST_CASE("walk: stages are as short as the fastest swing needs, unless their length is given") {
  const Model& model = getBipetto();
  const StandingRobot standing = makeStandingRobot(model);
  const auto getStep = [&](double speed, double single, double height, double time_step) {
    WalkOptions options;
    options.speed = speed;
    options.steps = 3;  // the second is a whole stride
    options.gait.timing.single = single;
    options.gait.timing.time_step = time_step;
    options.gait.swing.height = height;
    return planWalk(model, options, standing).schedule.phases.front().dt;
  };
  CHECK(getStep(0.5, 0.36, 0.04, 0) == 0.012);
  CHECK(getStep(-0.8, 0.36, 0.04, 0) == 0.012);
  // The quintic of a stride of 2 v (0.36 + 0.045) s has 15/8 of its mean velocity in the middle, where the foot is highest.
  const double fastest = 15.0 / 8 * 2 * 1.2 * 0.405 / (0.95 * 0.36);
  CHECK(getStep(1.2, 0.36, 0.04, 0) == Approx(1e-3 * std::floor(12 * std::pow(4.1 / fastest, 2))));
  CHECK(getStep(1.2, 0.36, 0.04, 0.012) == 0.012);
  CHECK(getStep(0.9, 0.36, 0.04, 0) == 0.012);
  CHECK(getStep(0.9, 0.18, 0.04, 0) < 0.012);
  CHECK(getStep(0, 0.1, 0.15, 0) < 0.012);  // the height counts
}

TEST_CASE("walk: the first double support is as long as the soles need to set off") {
  const Model& model = getBipetto();
  const ContactFrame& sole = model.contacts()[0];
  const StandingRobot standing = makeStandingRobot(model);
  const auto count = [&](const WalkOptions& options) {
    return planWalk(model, options, standing).schedule.phases.front().nodes;
  };
  WalkOptions options;
  const double h = options.gait.timing.time_step = 0.012;
  CHECK(count(options) == std::lround(options.gait.timing.start / h));
  options.speed = 0.9;
  options.gait.start_pressure = 0.3;
  const int nodes = count(options);
  CHECK(nodes > std::lround(options.gait.timing.start / h));
  // Simulates a pendulum at rest whose centre of pressure is held back by d: the distance by which it ends ahead of the
  // path (the growing part of its error).
  const Stance stance = makeStance(model, options.gait, standing);
  const double d = options.gait.start_pressure * sole.half_length, g = 9.81, height = stance.com.z();
  const FootstepPlan plan = planFootsteps(stance.feet[0], stance.feet[1],
                                          {options.speed * options.gait.timing.stepDuration(), 0, 0}, 6, Side::Right);
  const auto runAhead = [&](double duration) {
    GaitTiming timing = options.gait.timing;
    timing.start = duration;
    const Gait gait = makeGait(makeTask(plan), timing, options.gait.swing, 0, stance.com, g);
    double error = 0, rate = -gait.nodes[0].com_velocity.x();
    const int steps = 20000;
    for (int i = 0; i < steps; ++i) {
      rate += duration / steps * g / height * (error + d);
      error += duration / steps * rate;
    }
    return error + std::sqrt(height / g) * rate;
  };
  CHECK(runAhead(nodes * h) > 0);
  CHECK(runAhead(nodes * h - 0.062) < 0);  // a step of the search and the rounding to nodes less
  options.gait.start_pressure = 0;
  CHECK(count(options) == std::lround(options.gait.timing.start / h));
}

TEST_CASE("side walk and turns: where they were requested to go", "[long]") {
  SideWalkOptions side;
  side.speed = -0.4;
  const SolvedWalk right = solveWalk(makeSideWalk(getBipetto(), side));
  checkWalk(right);
  CHECK(calcSpeed(right.measures).y() == Approx(-0.4).epsilon(0.05));
  CHECK(std::abs(right.measures.end.x() - right.measures.start.x()) < 0.02);

  TurnOptions turn;
  turn.angle = -1.2;
  turn.radius = 0.4;
  turn.steps = 6;
  Motion motion = makeTurn(getBipetto(), turn);
  const ContactPhase last = motion.schedule.phases.back();
  const SolvedWalk arc = solveWalk(std::move(motion));
  checkWalk(arc);
  const Vector3d moved = arc.measures.end - arc.measures.start;
  CHECK(moved.x() == Approx(0.4 * std::sin(1.2)).margin(0.02));
  CHECK(moved.y() == Approx(-0.4 * (1 - std::cos(1.2))).margin(0.02));
  for (const ContactTarget& foot : last.contacts) CHECK(calcHeading(foot.X_WT) == Approx(-1.2).margin(0.01));
}

TEST_CASE("walk: feet that have room land near their footholds, and stand where they landed", "[long]") {
  WalkOptions options;
  options.speed = 0.4;
  options.steps = 4;
  options.gait.foothold_room = 0.03;
  Motion motion = makeWalk(getBipetto(), options);
  const auto goal = std::find_if(motion.goals.begin(), motion.goals.end(),
                                 [](const Goal& each) { return each.kind == GoalKind::Footholds; });
  REQUIRE(goal != motion.goals.end());
  CHECK(goal->tolerance == Approx(0.03 * std::sqrt(2)));
  const SolvedWalk solved = solveWalk(std::move(motion));
  CHECK(solved.summary.termination == FddpTermination::Converged);
  CHECK(solved.measures.foothold > 1e-3);
  CHECK(solved.measures.foothold < 0.03 * std::sqrt(2) + 1e-6);
  CHECK(solved.measures.tilt_at_landing < 1e-6);
  CHECK(solved.measures.slip < 2e-3);
}

TEST_CASE("walk: feet that come down strike within the cone of friction", "[long]") {
  WalkOptions walk;
  walk.steps = 2;
  walk.gait.rigid_landing = true;
  walk.gait.landing_speed = 0.05;
  walk.gait.friction = 0.35;
  const Model& model = getBipetto();
  const MotionPlan plan = planWalk(model, walk, makeStandingRobot(model));
  // The largest tangential impulse over the normal one of a foot that lands.
  const auto strike = [&](const MotionPlan& solved, Formulation formulation) {
    Motion motion = makeMotion(model, solved, ProblemOptions(formulation));
    FddpOptions options;
    options.initial_regularization = kGuessRegularization;
    const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, options);
    CAPTURE(summary.message, summary.iterations);
    REQUIRE(summary.termination == FddpTermination::Converged);
    double largest = 0;
    int impacts = 0;
    ImpactWorkspace impact(model);
    for (int k = 0; k < motion.problem->numStages(); ++k) {
      const StageSpec& stage = motion.problem->spec(k);
      if (stage.kind != StageKind::Impact) continue;
      const ConstraintSet& set = stage.constraints;
      const VectorXd& x = motion.guess.xs[k];
      REQUIRE(updateImpact(model, impact, set, x.head(model.nq()), x.segment(model.nq(), model.nv())) ==
              NumericalStatus::Ok);
      double normal = 0;
      for (size_t c = set.num_loops; c < set.closures.size(); ++c) {
        const Vector3d impulse = impact.impulse.segment<3>(set.offsets[c]);
        if (impulse.z() < normal) continue;  // the foot that stood gets next to none
        normal = impulse.z();
        largest = std::max(largest, impulse.head<2>().norm() / normal);
      }
      CHECK(normal > 1e-3 * model.mass());
      ++impacts;
    }
    CHECK(impacts == 2);
    return largest;
  };
  for (Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    const double within = strike(plan, formulation);
    CHECK(within < 0.35);
    CHECK(within > 0.35 / std::sqrt(2) * 0.98);  // a side of the pyramid binds
  }
  MotionPlan slippery = plan;
  for (StageSpec& stage : slippery.stages)
    if (stage.kind == StageKind::Impact)
      stage.path_constraints.erase(
          std::remove_if(stage.path_constraints.begin(), stage.path_constraints.end(),
                         [](const PathConstraint& c) { return c.name.find("wrench cone") == 0; }),
          stage.path_constraints.end());
  CHECK(strike(slippery, Formulation::Reduced) > 0.35);

  walk.gait.rigid_landing = false;
  CHECK_THROWS_WITH(planWalk(model, walk, makeStandingRobot(model)), Catch::Contains("landing_speed"));
}

namespace {

// A walk of two steps, the first of which should land a metre up. \param landing  its node
Motion makeFarLanding(int& landing) {
  WalkOptions options;
  options.steps = 2;
  options.gait.timing.time_step = 0.03;
  MotionPlan plan = planWalk(getBipetto(), options, makeStandingRobot(getBipetto()));
  landing = -1;
  for (size_t k = 0; k < plan.stages.size() && landing < 0; ++k)
    for (PathConstraint& constraint : plan.stages[k].path_constraints)
      if (constraint.name.rfind("landing of ", 0) == 0) {
        constraint.residual = makeFramePlacement(getBodyFrame(getBipetto(), constraint.name.substr(11)),
                                                 SE3{Matrix3d::Identity(), Vector3d(0, 0, 1)});
        landing = static_cast<int>(k);
      }
  REQUIRE(landing > 0);
  return makeMotion(getBipetto(), std::move(plan), {});
}

}  // namespace

TEST_CASE("walk: a foothold out of reach ends as infeasible, and is named with its node", "[long]") {
  int landing = -1;
  const SolvedWalk far = solveWalk(makeFarLanding(landing));
  CAPTURE(far.summary.message, far.summary.iterations);
  CHECK(far.summary.termination == FddpTermination::Infeasible);
  CHECK_THAT(far.summary.message,
             Catch::Contains("landing of foot_") && Catch::Contains("at node " + std::to_string(landing)));
}

TEST_CASE("walk: it is called infeasible after two attempts", "[long]") {
  int landing = -1;
  SolveOptions how;
  how.solver = FddpOptions();
  const FddpSummary summary = solve(makeFarLanding(landing), how).summary;
  CAPTURE(summary.message);
  CHECK(summary.termination == FddpTermination::Infeasible);
  CHECK_THAT(summary.message, Catch::Contains("landing of foot_") && Catch::Contains("two attempts"));
  // The log starts again, and counts for both.
  int attempts = 0, steps = 0;
  for (const FddpIteration& line : summary.log) {
    attempts += line.iteration == 1;
    steps += line.step > 0;
  }
  CHECK(attempts == 2);
  CHECK(steps == summary.iterations);
}

TEST_CASE("walk: what cannot be done is refused by name") {
  const auto make = [](const std::string& option, double value) {
    return makeWalk(getBipetto(), changeOption(WalkOptions(), option, value));
  };
  CHECK_NOTHROW(make("speed", -0.3));
  for (const auto& [option, value, word] :
       std::vector<std::tuple<std::string, double, std::string>>{{"speed", 3, "reach"},
                                                                 {"steps", 1, "steps"},
                                                                 {"steps", 4.5, "steps"},
                                                                 {"single_support", 0, "single_support"},
                                                                 {"double_support", -1, "double_support"},
                                                                 {"time_step", -0.01, "time_step"},
                                                                 {"friction", 0, "friction"},
                                                                 {"swing_height", -0.1, "swing_height"},
                                                                 {"start_pressure", -0.1, "start_pressure"},
                                                                 {"com_weight", -1, "com_weight"},
                                                                 {"swing_apex", 1, "swing_apex"}}) {
    CAPTURE(option, value);
    CHECK_THROWS_AS(make(option, value), InputError);
    CHECK_THROWS_WITH(make(option, value), Catch::Contains(word));
  }
  TurnOptions turn;
  turn.angle = 6;
  turn.steps = 3;
  CHECK_THROWS_WITH(makeTurn(getBipetto(), turn), Catch::Contains("collide"));
  turn.radius = -1;
  CHECK_THROWS_WITH(makeTurn(getBipetto(), turn), Catch::Contains("radius"));
  const LoadedRobot fourbar = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/fourbar");
  CHECK_THROWS_AS(makeWalk(fourbar.model), InputError);
}

TEST_CASE("walk: on soles and on edges, the same whichever way the robot faces") {
  const bool has_edges = GENERATE(false, true);
  CAPTURE(has_edges);
  ModelParts parts = takeParts(getBipetto());
  for (ContactFrame& contact : parts.contacts)
    if (has_edges) contact.kind = ContactKind::Edge5D, contact.half_width = 0;
  const Model model = ModelBuilder::restore(std::move(parts));
  WalkOptions walk;
  walk.steps = 2;
  walk.speed = 0.3;
  walk.gait.timing.time_step = 0.02;
  const auto solve = [&](double heading) {
    const SE3 X{Eigen::AngleAxisd(heading, Vector3d::UnitZ()).toRotationMatrix(), Vector3d::Zero()};
    const StandingRobot standing = makeStandingRobot(model, carryPosture(model, makeStandingPosture(model), X));
    SolveOptions how;
    how.refine = false;
    return bielle::solve(makeMotion(model, planWalk(model, walk, standing), ProblemOptions()), how);
  };
  const Solution ahead = solve(0), turned = solve(2);
  REQUIRE(ahead.converged());
  REQUIRE(turned.converged());
  // Step by step, and not only at the same optimum.
  const auto &a = ahead.summary.log, &b = turned.summary.log;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    CHECK(b[i].cost == Approx(a[i].cost).epsilon(1e-9));
    CHECK(b[i].violation == Approx(a[i].violation).epsilon(1e-6).margin(1e-9));
  }
  CHECK(turned.summary.cost == Approx(ahead.summary.cost).epsilon(1e-12));
}
