// Motions, measured on their trajectories by kinematics, independently of the solver.
#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "change_option.h"
#include "motion/benchmark_walk.h"
#include "own_robots.h"
#include "problem_probe.h"
#include "robot_directory.h"
#include "selection.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct SquatOutcome {
  double gap = 0;                                 ///< largest closure residual at any node, m or rad
  double slide = 0;                               ///< largest displacement of a contact, m
  double lowest = 1e9, highest = -1e9, last = 0;  ///< height of the CoM over its initial height
  double worst_height = 0;                        ///< largest distance of the CoM from the requested height, m
};

SquatOutcome measureSquat(const Model& model, const SquatOptions& options, const std::vector<VectorXd>& xs) {
  Workspace ws(model);
  const ConstraintSet set = makeConstraintSet(model);
  SquatOutcome out;
  std::vector<Vector3d> places;
  double initial = 0;
  for (size_t k = 0; k < xs.size(); ++k) {
    updatePositions(model, ws, xs[k].head(model.nq()));
    out.gap = std::max(out.gap, calcLargestGap(ws, set));
    for (size_t c = 0; c < model.contacts().size(); ++c) {
      const Vector3d p = getPlacement(ws, model.contacts()[c].body, model.contacts()[c].X_BF).p;
      if (k == 0) places.push_back(p);
      out.slide = std::max(out.slide, (p - places[c]).norm());
    }
    const double height = calcCom(model, ws).z();
    if (k == 0) initial = height;
    out.lowest = std::min(out.lowest, height / initial);
    out.highest = std::max(out.highest, height / initial);
    out.last = height / initial;
    out.worst_height =
        std::max(out.worst_height, std::abs(height - initial * calcSquatHeight(options, k * options.time_step)));
  }
  return out;
}

// Largest |x_{k+1} - f(x_k, u_k)| by stepping again.
double calcDefect(const RobotProblem& problem, const ShootingTrajectory& t) {
  double defect = 0, cost = 0;
  testing::ProblemProbe probe(problem);
  VectorXd next(problem.stateSize());
  for (int k = 0; k < problem.numStages(); ++k) {
    REQUIRE(probe.step(k, t.xs[k], t.us[k], next, cost) == NumericalStatus::Ok);
    defect = std::max(defect, probe.difference(t.xs[k + 1], next).cwiseAbs().maxCoeff());
  }
  return defect;
}

}  // namespace

TEST_CASE("squat: Bipetto goes down or up as requested, loops closed, feet in place", "[sweep]") {
  const Model model = loadOwn("bipetto").model;
  Selection selection(5);
  struct Row {
    Formulation formulation;
    double depth;
    double gap;               // of the loops, m or rad
    double height_tolerance;  // m
  };
  for (const Row& row : {Row{Formulation::Full, 0.7, 1e-3, 3e-3}, Row{Formulation::Full, 0.9, 1e-3, 2e-3},
                         Row{Formulation::Full, 1.1, 1e-3, 2e-3}, Row{Formulation::Reduced, 0.7, 1e-10, 3e-3},
                         Row{Formulation::Reduced, 0.9, 1e-10, 2e-3}, Row{Formulation::Reduced, 1.1, 1e-10, 2e-3}}) {
    if (selection.isLeftOut()) continue;
    CAPTURE(getName(row.formulation), row.depth);
    SquatOptions options;
    options.depth = row.depth;
    options.time_step = 0.015;
    Motion motion = makeSquat(model, options, row.formulation);
    FddpOptions solver;
    solver.max_iterations = 100;
    const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess, solver);
    CAPTURE(summary.message, summary.iterations);
    CHECK(summary.termination == FddpTermination::Converged);
    CHECK(calcDefect(*motion.problem, motion.guess) < 1e-9);
    const SquatOutcome outcome = measureSquat(model, options, motion.guess.xs);
    CHECK(outcome.gap < row.gap);
    CHECK(outcome.slide < 2e-3);
    CHECK(outcome.worst_height < row.height_tolerance);
    CHECK((row.depth < 1 ? outcome.lowest : outcome.highest) == Approx(row.depth).epsilon(0.01));
    CHECK(outcome.last == Approx(1).epsilon(2e-3));
  }
}

TEST_CASE("a leg on a rail squats and jumps, and comes to rest") {
  const Model model = loadOwn("fivebar_leg").model;
  SquatOptions squat;
  squat.depth = 0.8;
  std::vector<Motion> motions;
  motions.push_back(makeSquat(model, squat));
  motions.push_back(makeJump(model));
  for (Motion& motion : motions) {
    const FddpSummary summary = test::solveInPlace(*motion.problem, motion.guess);
    CAPTURE(motion.name, summary.message, summary.iterations);
    CHECK(summary.termination == FddpTermination::Converged);
    CHECK(motion.guess.xs.back().tail(model.nv()).lpNorm<Eigen::Infinity>() < 1e-5);
  }
}

TEST_CASE("squat: impossible options are refused, unknown ones are named") {
  const Model model = loadOwn("bipetto").model;
  const auto make = [&](const std::string& option, double value) {
    return makeSquat(model, changeOption(SquatOptions(), option, value));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_NOTHROW(make("depth", 0.8));
  for (const auto& [option, value] : std::vector<std::pair<std::string, double>>{{"depth", 3},
                                                                                 {"depth", -1},
                                                                                 {"depth", nan},
                                                                                 {"duration", 0},
                                                                                 {"duration", nan},
                                                                                 {"settle", -0.1},
                                                                                 {"time_step", -0.01},
                                                                                 {"time_step", 1},
                                                                                 {"com_weight", -1},
                                                                                 {"force_weight", nan},
                                                                                 {"friction", 0},
                                                                                 {"depht", 0.7}}) {
    CAPTURE(option, value);
    CHECK_THROWS_AS(make(option, value), InputError);
    CHECK_THROWS_WITH(make(option, value), Catch::Contains(option));
  }
  CHECK_THROWS_AS(makeSquat(loadOwn("fourbar").model, {}), InputError);  // no feet
}

TEST_CASE("weights by joint come with the robot's file, whatever the joints are called") {
  const Model bipetto = loadOwn("bipetto").model;
  const VectorXd weights = makeStateWeights(bipetto);
  const auto getWeights = [&](const std::string& joint) {
    const int k = bipetto.joints()[bipetto.findJoint(joint)].idx_v;
    return std::pair(weights[k], weights[bipetto.nv() + k]);
  };
  CHECK(getWeights("hipz_left") == std::pair(100.0, 25.0));
  CHECK(getWeights("hipx_right") == std::pair(9.0, 9.0));
  CHECK(getWeights("hipy_right") == std::pair(1.0, 1.0));
  CHECK(getWeights("motor_knee_left") == std::pair(0.0, 0.0));
  std::string texts[2];
  for (int i : {0, 1}) {
    std::ifstream file(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto/bipetto" + (i == 0 ? ".urdf" : ".yaml"));
    texts[i].assign(std::istreambuf_iterator<char>(file), {});
    for (size_t at; (at = texts[i].find("hipz_")) != std::string::npos;) texts[i].replace(at, 5, "yaw_");
  }
  CHECK(makeStateWeights(loadRobot(testing::RobotDirectory().writeRobot(texts[0], texts[1])).model) == weights);
}

TEST_CASE("contact gains and wrench cones follow one rule in all motions") {
  const Model model = loadOwn("bipetto").model;
  SquatOptions squat;
  JumpOptions jump;
  WalkOptions walk;
  squat.contact_kp = squat.contact_kd = jump.contact_kp = jump.contact_kd = 1e9;
  walk.gait.contact_kp = walk.gait.contact_kd = 1e9;
  const StandingRobot standing = makeStandingRobot(model);
  const auto rule = GENERATE(StepRule::Euler, StepRule::Midpoint);
  MotionPlan plans[] = {planSquat(model, squat, standing), planJump(model, jump, standing),
                        planWalk(model, walk, standing)};
  for (MotionPlan& plan : plans) {
    CAPTURE(plan.name, getName(rule));
    plan.stages.resize(1);
    limitGains(rule, plan.stages[0].dt, plan.stages[0].constraints);
    const StageSpec& stage = plan.stages[0];
    const ConstraintSet& set = stage.constraints;
    for (int c = set.num_loops; c < static_cast<int>(set.closures.size()); ++c) {
      CHECK(set.closures[c].kp == Approx((rule == StepRule::Euler ? 0.5 : 1.0 / 3) / (stage.dt * stage.dt)));
      CHECK(set.closures[c].kd == Approx(1 / stage.dt));
    }
    VectorXd lambda = VectorXd::Zero(set.rows), u, r(17);
    lambda[set.offsets[set.num_loops] + 2] = 1;  // N
    const Workspace ws(model);
    const ContactFrame& foot = model.contacts()[set.getContact(set.num_loops)];
    const double mu = 0.99 * 0.7 / std::sqrt(2);
    int found = 0;
    for (const PathConstraint& constraint : stage.path_constraints) {
      if (constraint.name != "wrench cone of " + foot.name) continue;
      constraint.residual->calc({model, ws, set, u, lambda}, r);
      CHECK(r[0] == 1);
      CHECK(r[1] == Approx(mu));
      CHECK(r[5] == Approx(0.99 * foot.half_width));
      CHECK(r[7] == Approx(0.99 * foot.half_length));
      CHECK(r[16] == Approx(0.99 * mu * (foot.half_length + foot.half_width)));
      CHECK(constraint.lower[0] == Approx(1e-3 * model.mass() * model.gravity().norm()));
      CHECK(constraint.lower.tail(16).isZero(0));
      ++found;
    }
    CHECK(found == 1);
  }
}

TEST_CASE("a foot beside its place returns as the limits of the gains have it") {
  const Model model = loadOwn("bipetto").model;
  const auto rule = GENERATE(StepRule::Euler, StepRule::Midpoint);
  const auto formulation = GENERATE(Formulation::Full, Formulation::Reduced);
  CAPTURE(getName(rule), getName(formulation));
  constexpr double kOff = 1e-6;  // m
  const VectorXd q0 = makeStandingPosture(model);
  std::vector<ContactTarget> contacts = makeContactTargets(model, q0, {0, 1}, 1e9, 1e9);
  for (ContactTarget& contact : contacts) contact.X_WT.p.x() += kOff;
  std::vector<StageSpec> stages(2);
  stages[0].step = rule;
  stages[0].constraints = makeConstraintSet(model, contacts);
  limitGains(rule, stages[0].dt, stages[0].constraints);
  const double h = stages[0].dt, D = 1, K = rule == StepRule::Euler ? 0.5 : 1.0 / 3;
  const RobotProblem problem(model, q0, VectorXd::Zero(model.nv()), std::move(stages), formulation);
  RobotEvaluator evaluator(problem);
  Workspace ws(model);
  const VectorXd u = calcStaticTorques(model, problem.spec(0).constraints, q0).u;
  VectorXd x = problem.initialState();
  double d = -kOff, e = 0;  // along x, m and m/s: Eqs. (1) and (2) of motion.h
  for (int k = 0; k < 12; ++k) {
    const RobotEvaluation& at = evaluator.evaluate(0, x, u);
    REQUIRE(at.status == NumericalStatus::Ok);
    x = at.x_next;
    const double before = e;
    e = (1 - D) * e - K * d / h;
    d += rule == StepRule::Euler ? h * e : h / 2 * (before + e);
    updatePositions(model, ws, x.head(model.nq()));
    for (const ContactTarget& contact : contacts) {
      const ContactFrame& frame = model.contacts()[contact.contact];
      CHECK(getPlacement(ws, frame.body, frame.X_BF).p.x() - contact.X_WT.p.x() == Approx(d).margin(1e-3 * kOff));
    }
  }
  CHECK(std::abs(d) < 1e-3 * kOff);
}

TEST_CASE("standing posture: springs that no motor holds are bent by the weight") {
  const Model model = loadOwn("spring_biped").model;
  const VectorXd unloaded = assembleReference(model, "half_sitting").q, q = makeStandingPosture(model);
  const ConstraintSet set = makeConstraintSet(model, makeContactTargets(model, unloaded, {0, 1}, 0, 0));
  CHECK(calcStaticTorques(model, set, unloaded).residual > 1);  // N m
  CHECK(calcStaticTorques(model, set, q).residual < 1e-6);
  Workspace ws(model);
  updatePositions(model, ws, q);
  for (const Closure& closure : set.closures) CHECK(calcClosureResidual(ws, closure).norm() < 1e-10);
  for (const JointForce& spring : model.jointForces()) {
    CAPTURE(model.joints()[spring.joint].name, q[spring.idx_q]);
    CHECK(std::abs(q[spring.idx_q]) > 0.01);
    CHECK(std::abs(q[spring.idx_q]) < 0.1);
  }
  CHECK(makeStandingPosture(loadOwn("belt_biped").model) ==
        assembleReference(loadOwn("belt_biped").model, "half_sitting").q);
}

TEST_CASE("contacts keep their index in the constraints of a stage") {
  const Model model = loadOwn("bipetto").model;
  const ConstraintSet set = makeConstraintSet(model, {{1, {}, 0, 0}, {0, {}, 0, 0}});
  CHECK(set.contacts == std::vector<int>{1, 0});
  for (int c = set.num_loops; c < static_cast<int>(set.closures.size()); ++c)
    CHECK(model.contacts()[set.getContact(c)].name == set.closures[c].name);
}

TEST_CASE("benchmark walk: the schedule that speed is measured on") {
  const Model model = loadOwn("bipetto").model;
  const auto formulation = GENERATE(Formulation::Full, Formulation::Reduced);
  CAPTURE(getName(formulation));
  const Motion motion = makeBenchmarkWalk(model, {}, formulation);
  const RobotProblem& problem = *motion.problem;
  REQUIRE(problem.numStages() == 250);
  REQUIRE(motion.schedule.numStages() == 250);
  const int left = model.findContact("foot_left"), right = model.findContact("foot_right");
  int node = 0;
  const auto expect = [&](int nodes, const std::vector<int>& stance, size_t costs) {
    for (int i = 0; i < nodes; ++i, ++node) {
      CAPTURE(node);
      const StageSpec& spec = problem.spec(node);
      CHECK(spec.dt == 0.015);
      CHECK(spec.costs.size() == costs);
      CHECK((spec.state.weights.array() > 0).all());
      const ConstraintSet& set = spec.constraints;
      REQUIRE(set.closures.size() == 6 + stance.size());
      for (size_t c = 0; c < stance.size(); ++c) {
        const Closure& closure = set.closures[6 + c];
        CHECK(closure.body1 == model.contacts()[stance[c]].body);
        CHECK(closure.kp == 0);
        CHECK(closure.kd == 100);
      }
    }
  };
  expect(13, {left, right}, 3);
  for (int i = 0; i < 4; ++i) {
    expect(26, {right}, 3);
    expect(1, {left, right}, 5);
    expect(26, {left}, 3);
    expect(1, {left, right}, 5);
  }
  expect(21, {left, right}, 3);
  CHECK(node == 250);

  BenchmarkWalkOptions options;
  options.total_nodes = 100;
  CHECK_THROWS_AS(makeBenchmarkWalk(model, options), InputError);
  CHECK_THROWS_AS(makeBenchmarkWalk(loadOwn("fourbar").model), InputError);
}

TEST_CASE("benchmark walk: it converges, and gets as far as it should", "[long]") {
  const Model model = loadOwn("bipetto").model;
  const auto formulation = GENERATE(Formulation::Full, Formulation::Reduced);
  CAPTURE(getName(formulation));
  Motion motion = makeBenchmarkWalk(model, {}, formulation);
  const RobotProblem& problem = *motion.problem;
  FddpOptions solver;
  solver.max_iterations = 60;
  const FddpSummary summary = test::solveInPlace(problem, motion.guess, solver);
  CAPTURE(summary.message);
  CHECK(summary.termination == FddpTermination::Converged);
  CHECK(calcDefect(problem, motion.guess) < 1e-9);
  Workspace ws(model);
  updatePositions(model, ws, motion.guess.xs.back().head(model.nq()));
  CHECK(calcCom(model, ws).x() > 0.5);  // 8 steps at 0.2 m/s
}
