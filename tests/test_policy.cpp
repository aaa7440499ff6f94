// The policy of a solved motion: its torques, and gains that are those of the solver.
#include <catch2/catch.hpp>

#include "bielle/control/policy.h"
#include "bielle/control/predictive_controller.h"
#include "bielle/dynamics/ball_cuts.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/motion/serial_model.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "bielle/solve/shooting_problem.h"
#include "control/restricted_controller.h"
#include "count_allocations.h"
#include "selection.h"

namespace bielle {
namespace {

struct SolvedSquat {
  SolvedSquat() : robot(loadRobot(BIELLE_SOURCE_DIR "/robots/bipetto")) {
    SquatOptions options;
    options.depth = 0.85;
    options.time_step = 0.02;
    SolveOptions how;
    how.solver = FddpOptions();
    solution = solve(makeSquat(robot.model, options), how);
    REQUIRE(solution.converged());
  }
  LoadedRobot robot;
  Solution solution;
};

SolvedSquat& getSquat() {
  static SolvedSquat squat;
  return squat;
}

Measurement measure(const Model& model, double time, const VectorXd& x) {
  return {time, x.head(model.nq()), x.segment(model.nq(), model.nv())};
}

}  // namespace

TEST_CASE("policy: on the plan it gives the torques of the plan, each in the middle of its stage") {
  SolvedSquat& squat = getSquat();
  const Model& model = squat.robot.model;
  Policy policy = makePolicy(squat.solution);
  const auto& stages = policy.stages();
  REQUIRE(static_cast<int>(stages.size()) == squat.solution.motion.problem->numStages());
  CHECK(policy.duration() ==
        Approx(squat.solution.motion.schedule.getTime(squat.solution.motion.problem->numStages())));
  VectorXd u(model.nu());
  for (size_t k : {size_t(0), stages.size() / 3, stages.size() - 1}) {
    Measurement at{stages[k].start + 0.5 * stages[k].duration, model.makeNeutral(), VectorXd::Zero(model.nv())};
    policy.getReference(at.time, at.q, at.v);
    policy.update(at, u);
    CHECK((u - squat.solution.trajectory.us[k].head(model.nu())).norm() < 1e-9 * (1 + u.norm()));
  }
}

TEST_CASE("policy: torques that act later are those of the time when they act") {
  SolvedSquat& squat = getSquat();
  const Model& model = squat.robot.model;
  Policy policy = makePolicy(squat.solution);
  constexpr double kTime = 0.8, kDelay = 0.0137;
  Measurement at{kTime + kDelay, model.makeNeutral(), VectorXd::Zero(model.nv())};
  VectorXd expected(model.nu()), u(model.nu());
  policy.getReference(at.time, at.q, at.v);
  policy.update(at, expected);
  at.time = kTime;
  at.delay = kDelay;
  policy.getReference(at.time, at.q, at.v);
  policy.update(at, u);  // on the plan when it was measured: no feedback
  CHECK((u - expected).norm() < 1e-9 * expected.norm());
  at.delay = 0;
  policy.update(at, u);
  CHECK((u - expected).norm() > 1e-3 * expected.norm());
}

TEST_CASE("policy: its gains are those of the solver's last sweep") {
  SolvedSquat& squat = getSquat();
  const Model& model = squat.robot.model;
  Policy policy = makePolicy(squat.solution);
  NodeEvaluator evaluator(*squat.solution.motion.problem);
  for (int k : {1, 40, 120}) {
    const VectorXd& x = squat.solution.trajectory.xs[k];
    evaluator.evaluate(k, x, squat.solution.trajectory.us[k]);
    const RowMatrixXd& K = squat.solution.gains[k].K;
    VectorXd dx(K.cols());
    for (int i = 0; i < dx.size(); ++i) dx[i] = 1e-3 * std::sin(1 + 2.1 * i);
    const VectorXd moved = evaluator.integrate(dx);
    const double time = policy.stages()[k].start;
    VectorXd there(model.nu()), here(model.nu());
    policy.update(measure(model, time, moved), there);
    policy.update(measure(model, time, x), here);
    const VectorXd expected = K * dx, found = there - here;
    CHECK((found - expected).norm() < 1e-6 * expected.norm());
    dx[3] *= 1.001;
    CHECK((found - K * dx).norm() > 1e-6 * expected.norm());
  }
}

namespace {

// K d(x (-) x_k) at x_k by differences, the loops of x open.
RowMatrixXd calcDifferences(const Solution& solution, int node, const VectorXd& x) {
  const Model& model = solution.motion.problem->model();
  const int nq = model.nq(), nv = model.nv();
  NodeEvaluator evaluator(*solution.motion.problem);
  evaluator.evaluate(node, x, solution.trajectory.us[node]);
  RowMatrixXd differences(model.nu(), 2 * nv);
  constexpr double kStep = 0.01;  // along one coordinate the difference is linear
  for (int i = 0; i < 2 * nv; ++i) {
    VectorXd moved = x;
    if (i < nv)
      model.integrate(x.head(nq), kStep * VectorXd::Unit(nv, i), moved.head(nq));
    else
      moved[nq + i - nv] += kStep;
    differences.col(i) = solution.gains[node].K * evaluator.difference(moved) / kStep;
  }
  return differences;
}

}  // namespace

TEST_CASE("policy: its gains on states whose loops are open are those on the difference that the solver sees") {
  const Solution& solution = getSquat().solution;
  constexpr int kNode = 40;
  REQUIRE(solution.gains[kNode].x == solution.trajectory.xs[kNode]);
  RowMatrixXd gains = makePolicy(solution).stages()[kNode].K;
  const RowMatrixXd differences = calcDifferences(solution, kNode, solution.gains[kNode].x);
  const double scale = differences.cwiseAbs().maxCoeff();
  CHECK((gains - differences).cwiseAbs().maxCoeff() < 1e-11 * scale);
  gains(3, gains.cols() / 2 - 2) += 1e-9 * scale;
  CHECK_FALSE((gains - differences).cwiseAbs().maxCoeff() < 1e-11 * scale);
}

TEST_CASE(
    "policy: gains of a solve that was cut off are about the states of its last sweep, not those that it led to") {
  SquatOptions options;
  options.depth = 0.85;
  SolveOptions how;
  how.solver.max_iterations = 2;
  const Solution solution = solve(makeSquat(getSquat().robot.model, options), how);
  REQUIRE(solution.summary.termination == FddpTermination::MaxIterations);
  constexpr int kNode = 80;
  const VectorXd &about = solution.gains[kNode].x, &after = solution.trajectory.xs[kNode];
  REQUIRE((after - about).norm() > 1e-3);
  const RowMatrixXd gains = makePolicy(solution).stages()[kNode].K;
  const double scale = gains.cwiseAbs().maxCoeff();
  CHECK((gains - calcDifferences(solution, kNode, about)).cwiseAbs().maxCoeff() < 1e-11 * scale);
  CHECK((gains - calcDifferences(solution, kNode, after)).cwiseAbs().maxCoeff() > 1e-6 * scale);
}

namespace {

// Bases of the tangent space at a closed configuration, by the coordinates of the robot: what unit gains are mapped to.
RowMatrixXd calcBases(const RobotProblem& problem, const VectorXd& q) {
  VectorXd x = problem.initialState();
  x.head(q.size()) = q;
  RobotEvaluator evaluator(problem);
  const int nv = problem.model().nv(), size = problem.tangentSize(0);
  RowMatrixXd bases;
  problem.mapGains(evaluator.evaluate(0, x, VectorXd::Zero(problem.model().nu())), RowMatrixXd::Identity(size, size),
                   bases);
  return bases.topLeftCorner(size / 2, nv);
}

// The gains of the second stage of a robot that is to stand, after its configuration was measured.
RowMatrixXd findGains(const Model& model, const VectorXd& q) {
  LocomotionOptions gait;
  gait.contact_kp = 0;
  PredictiveOptions options;
  options.threads = 1;
  CommandedWalk walk(
      model, gait, {}, [](double) { return VelocityCommand(); }, makeStandingRobot(model));
  const double stage = walk.timeStep();
  PredictiveController controller(std::move(walk), options);
  VectorXd u(model.nu());
  for (double time : {0.0, stage}) controller.update({time, q, VectorXd::Zero(model.nv())}, u);
  REQUIRE(controller.counts().failed == 0);
  return controller.policy().stages()[1].K;
}

}  // namespace

// The ankles of this robot, as it stands, are where their bases turn round.
TEST_CASE("policy: gains of predictive control belong to the states about which they were found") {
  const LoadedRobot robot = loadRobot(BIELLE_SOURCE_DIR "/robots/rsu_biped");
  const Model& model = robot.model;
  const VectorXd rest = makeStandingPosture(model);
  StageSpec stage;
  stage.constraints = makeConstraintSet(model);
  const RobotProblem problem(model, rest, VectorXd::Zero(model.nv()), {stage, {}}, Formulation::Reduced);
  const RowMatrixXd expected = findGains(model, rest), bases = calcBases(problem, rest);
  RobotEvaluator evaluator(problem);
  evaluator.evaluate(0, problem.initialState(), VectorXd::Zero(model.nu()));
  constexpr double kOff = 2e-3;
  int turned = 0;
  testing::Selection selection(1);
  for (int i = 6; i < problem.tangentSize(0) / 2; ++i)
    for (const double off : {-kOff, kOff}) {
      const VectorXd q = evaluator.integrate(off * VectorXd::Unit(problem.tangentSize(0), i)).head(model.nq());
      turned += (calcBases(problem, q).cwiseProduct(bases).rowwise().sum().array() < 0).any();
      if (selection.isLeftOut()) continue;
      const RowMatrixXd found = findGains(model, q);
      for (int column = 0; column < expected.cols(); ++column) {
        CAPTURE(i, off, column, expected.col(column).norm(), found.col(column).norm());
        CHECK((found - expected).col(column).norm() < 0.1 * expected.col(column).norm() + 1e-3 * expected.norm());
      }
    }
  CHECK(turned >= 4);
}

TEST_CASE("policy: gains that look ahead are those of an earlier stage of their phase") {
  SolvedSquat& squat = getSquat();
  const Model& model = squat.robot.model;
  Policy policy = makePolicy(squat.solution), far = policy;
  const auto& stages = policy.stages();
  constexpr int kStages = 5;
  const size_t last = stages.size() - 1;  // a squat has one phase
  far.setLookAhead(kStages * stages[last].duration);
  const auto calcFeedback = [&](Policy& by, size_t k) {
    Measurement at{stages[k].start, stages[k].q, stages[k].v};
    VectorXd on(model.nu()), off(model.nu());
    by.update(at, on);
    at.v[0] += 0.01;
    by.update(at, off);
    return VectorXd(off - on);
  };
  const VectorXd early = calcFeedback(policy, 20);
  CHECK(calcFeedback(far, 20) == early);
  const VectorXd expected = 0.01 * stages[last + 1 - kStages].K.col(model.nv());
  CHECK((calcFeedback(far, last - 1) - expected).norm() < 1e-6 * expected.norm());
  CHECK((calcFeedback(policy, last - 1) - expected).norm() > 1e-3 * expected.norm());
}

TEST_CASE("policy: without gains the state does not matter; the plan ends at rest") {
  SolvedSquat& squat = getSquat();
  const Model& model = squat.robot.model;
  Policy open = makePolicy(squat.solution.motion, squat.solution.trajectory);
  VectorXd u(model.nu()), other(model.nu());
  open.update(measure(model, 0.4, squat.solution.trajectory.xs[0]), u);
  open.update(measure(model, 0.4, squat.solution.trajectory.xs[90]), other);
  CHECK(u == other);
  VectorXd q = model.makeNeutral(), v(model.nv());
  open.getReference(100, q, v);
  CHECK(v.isZero(0));
  CHECK(model.difference(squat.solution.trajectory.xs.back().head(model.nq()), q).norm() < 1e-12);
}

TEST_CASE("policy: after its end the torques hold the last posture, and gains call the robot back") {
  SolvedSquat& squat = getSquat();
  const Model& model = squat.robot.model;
  Policy policy = makePolicy(squat.solution);
  Measurement at{policy.duration() + 0.5, model.makeNeutral(), VectorXd::Zero(model.nv())};
  policy.getReference(at.time, at.q, at.v);
  VectorXd u(model.nu()), other(model.nu());
  policy.update(at, u);
  Workspace ws(model);
  ConstrainedWorkspace cws;
  ConstraintSet set = makeConstraintSet(model, squat.solution.motion.schedule.phases.back().contacts);
  for (Closure& closure : set.closures) closure.kp = closure.kd = 0;  // the feet may stand where they are
  const auto calcAcceleration = [&](const VectorXd& torques) {
    updateConstrainedDynamics(model, ws, cws, set, at.q, at.v, calcMotorForces(model, torques));
    return cws.a.norm();
  };
  CHECK(calcAcceleration(u) < 1e-6);
  other = u;
  other[3] *= 1.001;
  CHECK(calcAcceleration(other) > 1e-3);
  at.v[0] += 0.01;  // forwards
  policy.update(at, other);
  CHECK((other - u).norm() > 0.01);
}

TEST_CASE("policy: an update does not allocate") {
  SolvedSquat& squat = getSquat();
  const Model& model = squat.robot.model;
  Policy policy = makePolicy(squat.solution);
  const Measurement at = measure(model, 0, squat.solution.trajectory.xs[0]);
  Measurement now = at;
  VectorXd u(model.nu());
  const long before = num_allocations;
  for (int i = 0; i < 300; ++i) {
    now.time = 0.01 * i;
    policy.update(now, u);
  }
  const long allocations = num_allocations - before;
  CHECK(allocations == 0);
}

namespace {

// Hears, and answers with the speeds of the motors.
class Echo : public Controller {
 public:
  explicit Echo(const Model& model) : model_(model) {}
  void update(const Measurement& measurement, VectorRef u) override {
    heard = measurement;
    for (int m = 0; m < model_.nu(); ++m) u[m] = measurement.v[model_.motors()[m].dof];
  }
  double getPlanTime(double time) const override { return 2 * time; }
  Measurement heard;

 private:
  const Model model_;
};

}  // namespace

TEST_CASE("restricted controller: it hears of the joints that its model has, and its torques reach the same motors") {
  const Model &model = getSquat().robot.model, cut = cutAtBalls(model);
  REQUIRE(cut.nv() < model.nv());
  auto echo = std::make_unique<Echo>(cut);
  const Echo& inner = *echo;
  RestrictedController controller(model, cut, std::move(echo));
  Measurement measurement{
      0.5, VectorXd::LinSpaced(model.nq(), 0, 1), VectorXd::LinSpaced(model.nv(), -1, 1), {1, 0}, 3e-3};
  VectorXd u(model.nu());
  controller.update(measurement, u);
  CHECK(inner.heard.time == 0.5);
  CHECK(inner.heard.delay == 3e-3);
  CHECK(inner.heard.contacts == std::vector<char>{1, 0});
  CHECK(inner.heard.q == restrictConfiguration(model, cut, measurement.q));
  CHECK(inner.heard.v == restrictVelocity(model, cut, measurement.v));
  for (int m = 0; m < model.nu(); ++m) CHECK(u[m] == measurement.v[model.motors()[m].dof]);
  CHECK(controller.getPlanTime(1) == 2);
  const long before = num_allocations_here;
  controller.update(measurement, u);
  CHECK(num_allocations_here == before);
}

}  // namespace bielle
