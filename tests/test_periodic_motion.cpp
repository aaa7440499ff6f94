// Motions that repeat, against the middle of long ones and against what a cycle is.
#include <array>
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/model/error.h"
#include "bielle/motion/run.h"
#include "bielle/motion/solve.h"
#include "bielle/motion/walk.h"
#include "math/so3.h"
#include "motion/half_cycle.h"
#include "own_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

SolveOptions makeOneThread() {
  SolveOptions options;
  options.solver.threads = 1;
  return options;
}

// Largest entry of the last state (-) the first one, moved by hand: the base turned about the vertical and displaced.
double calcSeam(const Model& model, const Solution& solution, const Vector3d& offset) {
  const VectorXd &first = solution.trajectory.xs.front(), &last = solution.trajectory.xs.back();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(offset.z(), Vector3d::UnitZ()));
  VectorXd q = first.head(model.nq());
  q.head<3>() = turn * Vector3d(first.head<3>()) + Vector3d(offset.x(), offset.y(), 0);
  q.segment<4>(3) = (turn * Eigen::Quaterniond(Eigen::Vector4d(first.segment<4>(3)))).coeffs();
  return std::max(model.difference(q, last.head(model.nq())).lpNorm<Eigen::Infinity>(),
                  (last.tail(model.nv()) - first.tail(model.nv())).lpNorm<Eigen::Infinity>());
}

Solution solveCycle(const Motion& motion) {
  REQUIRE(motion.cycle);
  Solution solution = solve(motion, makeOneThread());
  CAPTURE(solution.summary.message, solution.summary.iterations);
  REQUIRE(solution.converged());
  REQUIRE(solution.floquet_multiplier);
  CHECK(*solution.floquet_multiplier < 1);
  CHECK(solution.gains.size() == solution.trajectory.us.size());
  return solution;
}

}  // namespace

TEST_CASE("periodic walk: it costs what two more steps cost a walk") {
  WalkOptions options;
  options.periodic = true;
  const Solution cycle = solveCycle(makeWalk(getBipetto(), options));
  const Model& model = cycle.motion.problem->model();
  const double length = 2 * options.speed * options.gait.timing.stepDuration();
  CHECK(calcSeam(model, cycle, {length, 0, 0}) < 1e-7);
  CHECK(calcSeam(model, cycle, {length + 1e-3, 0, 0}) > 1e-4);
  const ContactSchedule& schedule = cycle.motion.schedule;
  CHECK(schedule.phases.size() == 5);  // from double support to double support
  CHECK(schedule.phases.front().contacts.size() == 2);
  CHECK(schedule.phases.back().contacts.size() == 2);

  // The difference of two whole walks: steps in the middle of one may borrow from those beside them, and cost 2e-5 less.
  options.periodic = false;
  std::array<double, 2> costs;
  for (int i : {0, 1}) {
    options.steps = 10 + 2 * i;
    const Solution walk = solve(makeWalk(getBipetto(), options), makeOneThread());
    REQUIRE(walk.converged());
    costs[i] = walk.summary.cost;
  }
  CHECK(cycle.summary.cost == Approx(costs[1] - costs[0]).epsilon(2e-7));

  // The record and its file have the period and the displacement.
  const MotionRecord record = makeRecord(cycle.motion, cycle.trajectory);
  REQUIRE(record.cycle.size() == 4);
  CHECK(record.cycle[0] == Approx(record.time.tail(1)[0]));
  CHECK(record.cycle[1] == Approx(length));
  CHECK(std::abs(record.cycle[2]) + std::abs(record.cycle[3]) < 1e-12);
}

TEST_CASE("periodic walk: two cycles are one, twice", "[long]") {
  WalkOptions options;
  options.periodic = true;
  const Solution once = solveCycle(makeWalk(getBipetto(), options));
  options.cycles = 2;
  const Motion twice = makeWalk(getBipetto(), options);
  const int nodes = once.motion.problem->numStages();
  REQUIRE(twice.problem->numStages() == 2 * nodes);
  CHECK(twice.cycle->p.x() == Approx(2 * once.motion.cycle->p.x()));
  // As solution of one, repeated, it is a solution of the other.
  SolveOptions start = makeOneThread();
  ShootingTrajectory repeated = once.trajectory;
  for (int k = 0; k < nodes; ++k) {
    repeated.us.push_back(once.trajectory.us[k]);
    repeated.xs.push_back(once.trajectory.xs[k + 1]);
    repeated.xs.back()[0] += once.motion.cycle->p.x();
  }
  start.start = StartingPoint{repeated};
  const Solution solution = solve(twice, start);
  REQUIRE(solution.converged());
  CHECK(solution.summary.cost == Approx(2 * once.summary.cost).epsilon(1e-8));
  double off = 0;
  for (size_t k = 0; k < repeated.us.size(); ++k)
    off = std::max(off, (solution.trajectory.us[k] - repeated.us[k]).cwiseAbs().maxCoeff());
  CHECK(off < 1e-3);  // N m, of 35
}

TEST_CASE("periodic turn: the cycle turns by two of its steps", "[long]") {
  TurnOptions options;
  options.periodic = true;
  const Solution cycle = solveCycle(makeTurn(getBipetto(), options));
  const double yaw = 2 * options.angle / (options.steps - 1);
  // About the middle of the feet at the start.
  const MotionRecord record = makeRecord(cycle.motion, cycle.trajectory);
  CHECK(record.cycle[3] == Approx(yaw));
  CHECK(calcSeam(cycle.motion.problem->model(), cycle, record.cycle.tail<3>()) < 1e-7);
}

TEST_CASE("periodic side walk and run: their ends are their beginnings, moved", "[long]") {
  SideWalkOptions side;
  side.periodic = true;
  const Solution aside = solveCycle(makeSideWalk(getBipetto(), side));
  CHECK(calcSeam(aside.motion.problem->model(), aside, {0, 2 * side.speed * side.gait.timing.stepDuration(), 0}) <
        1e-7);
  RunOptions run;
  run.periodic = true;
  const Solution ahead = solveCycle(makeRun(getBipetto(), run));
  CHECK(calcSeam(ahead.motion.problem->model(), ahead, {2 * run.speed * (run.stance + run.flight), 0, 0}) < 1e-7);
}

TEST_CASE("mirror image: twice is nothing, and its accelerations are mirrored") {
  for (const char* name : {"leg_biped", "cleobot", "kangaroo", "spring_biped"}) {
    CAPTURE(name);
    const LoadedRobot robot = loadOwn(name);
    const Model& model = robot.model;
    const int nq = model.nq(), nv = model.nv();
    std::string why;
    const auto mirror =
        MirroredRobot::find(model, model.findContact("foot_left"), model.findContact("foot_right"), why);
    CAPTURE(why);
    REQUIRE(mirror);
    // In a vertical plane that is not one of the axes.
    const Vector3d normal = Vector3d(0.3, 0.8, 0).normalized();
    const SE3 G(Matrix3d::Identity() - 2 * normal * normal.transpose(), 0.4 * normal);

    // A posture, a motion and torques without any symmetry.
    VectorXd x(nq + nv), u(model.nu());
    VectorXd dq(nv);
    for (int i = 0; i < nv; ++i) dq[i] = 0.1 * std::sin(1 + 2.3 * i);
    const AssemblyResult closed = closeConfiguration(model, model.integrate(makeStandingPosture(model), dq));
    REQUIRE(closed.status == NumericalStatus::Ok);
    const ConstraintSet loops = makeConstraintSet(model, {});
    Workspace ws(model);
    VectorXd v(nv);
    for (int i = 0; i < nv; ++i) v[i] = std::sin(2 + 1.7 * i);
    x << closed.q, projectVelocity(model, ws, loops, closed.q, v);
    for (int i = 0; i < model.nu(); ++i) u[i] = 20 * std::sin(3 + 1.3 * i);

    const VectorXd image = mirror->mapState(G, x), twice = mirror->mapState(G, image);
    CHECK(model.difference(x.head(nq), twice.head(nq)).lpNorm<Eigen::Infinity>() < 1e-12);
    CHECK((twice - x).tail(nv).lpNorm<Eigen::Infinity>() < 1e-12);
    CHECK(mirror->mapTorques(mirror->mapTorques(u)) == u);
    CHECK(model.difference(x.head(nq), image.head(nq)).lpNorm<Eigen::Infinity>() > 0.1);

    const auto calcAcceleration = [&](const VectorXd& state, const VectorXd& torques) {
      ConstrainedWorkspace cws;
      REQUIRE(updateConstrainedDynamics(model, ws, cws, loops, state.head(nq), state.tail(nv),
                                        calcMotorForces(model, torques)) == NumericalStatus::Ok);
      return cws.a;
    };
    // Accelerations go as velocities do.
    const VectorXd a = calcAcceleration(x, u), mirrored = calcAcceleration(image, mirror->mapTorques(u));
    VectorXd moving(nq + nv);
    moving << x.head(nq), a;
    const double size = a.lpNorm<Eigen::Infinity>();
    CHECK((mirror->mapState(G, moving).tail(nv) - mirrored).lpNorm<Eigen::Infinity>() < 1e-10 * size);
    // Notices torques that are not mirrored.
    const VectorXd other = calcAcceleration(image, u);
    CHECK((mirror->mapState(G, moving).tail(nv) - other).lpNorm<Eigen::Infinity>() > 1e-3 * size);
  }
}

TEST_CASE("periodic walk: of a robot that is its own mirror image, one step is solved") {
  const LoadedRobot robot = loadOwn("leg_biped");
  WalkOptions options;
  options.periodic = true;
  const Motion motion = makeWalk(robot.model, options);
  std::string why;
  const std::optional<HalfCycle> half = HalfCycle::find(motion, why);
  CAPTURE(why);
  REQUIRE(half);
  const Solution cycle = solveCycle(motion);
  const ShootingTrajectory& trajectory = cycle.trajectory;
  const size_t h = trajectory.us.size() / 2;
  for (size_t k = 1; k <= h; ++k) CHECK(trajectory.xs[k + h] == half->mapState(trajectory.xs[k]));

  // With its multipliers it is an optimum of the whole cycle: nothing is left to be done.
  const std::unique_ptr<PeriodicProblem> whole = makePeriodicProblem(motion);
  FddpOptions options_of_whole = makeOneThread().solver;
  const FddpResult again = bielle::solve(*whole, whole->wrap(trajectory), options_of_whole, {},
                                         whole->wrap({cycle.multipliers.values, cycle.summary.penalty}));
  CHECK(again.summary.termination == FddpTermination::Converged);
  CHECK(again.summary.iterations <= 1);
  CHECK(again.summary.cost == Approx(cycle.summary.cost).epsilon(1e-9));
  // And a start of it, which takes up its multipliers.
  SolveOptions start = makeOneThread();
  start.start = StartingPoint{trajectory, {cycle.multipliers.values, cycle.summary.penalty}};
  const Solution repeated = solve(motion, start);
  CHECK(repeated.converged());
  CHECK(repeated.summary.iterations < cycle.summary.iterations / 2);
  CHECK(repeated.summary.cost == Approx(cycle.summary.cost).epsilon(1e-9));
}

TEST_CASE("periodic motions: what is not its own mirror image is solved whole, and says why") {
  WalkOptions options;
  options.periodic = true;
  std::string why;
  CHECK_FALSE(HalfCycle::find(makeWalk(getBipetto(), options), why));
  CHECK(why == "trunk has no mirror image: it differs in its centre of mass by 0.00032 m");
  const LoadedRobot robot = loadOwn("leg_biped");
  TurnOptions turn;
  turn.periodic = true;
  CHECK_FALSE(HalfCycle::find(makeTurn(robot.model, turn), why));
  CHECK(why == "no step is the mirror image of the other");
  SideWalkOptions side;
  side.periodic = true;
  CHECK_FALSE(HalfCycle::find(makeSideWalk(robot.model, side), why));
  ProblemOptions problem;
  problem.limits.efforts["motor_knee_left"] = 50;
  CHECK_FALSE(HalfCycle::find(makeWalk(robot.model, options, problem), why));
  CHECK(why == "the limits of torques differ at stage 0 of the 34 of a step");
}

TEST_CASE("periodic motions: what they cannot be is refused") {
  WalkOptions options;
  options.periodic = true;
  ProblemOptions problem;
  problem.timings.phases.emplace_back(kAllPhases, TimingBounds());
  CHECK_THROWS_AS(makeWalk(getBipetto(), options, problem), InputError);
  problem = {};
  problem.objective.objective = Objective::PeakTorque;
  CHECK_THROWS_AS(makeWalk(getBipetto(), options, problem), InputError);
  CHECK_THROWS_AS(makeWalk(getBipetto(), options, {Formulation::Full}), InputError);
  MotionRequest sequence = makeSequenceRequest({"squat", "walk"});
  sequence.options.set("walk.periodic", true);
  CHECK_THROWS_AS(makeMotion(getBipetto(), sequence), InputError);
}
