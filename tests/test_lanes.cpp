// Several nodes at once: numbers in lanes are those of double, and what comes out of one lane does not depend on the others.
#include <catch2/catch.hpp>
#include <random>

#include "bielle/dynamics/reduction.h"
#include "bielle/math/se3.h"
#include "bielle/math/small_dense.h"
#include "bielle/model/reader.h"
#include "bielle/motion/benchmark_walk.h"
#include "bielle/motion/motion.h"
#include "count_allocations.h"
#include "mechanisms.h"

using namespace bielle;

namespace {

// The benchmark walk, shortened, and a trajectory near its guess whose states are closed.
struct Walk {
  explicit Walk(const Model& model) : motion(makeBenchmarkWalk(model, makeOptions(), Formulation::Reduced)) {
    std::mt19937 rng(1);
    std::normal_distribution<double> normal;
    for (int k = 0; k < motion.problem->numStages(); ++k) {
      VectorXd dx(motion.problem->tangentSize(k));
      for (double& x : dx) x = 0.01 * normal(rng);
      motion.problem->integrate(k, motion.guess.xs[k], dx, motion.guess.xs[k]);
      for (double& u : motion.guess.us[k]) u += normal(rng);
    }
    next.assign(motion.guess.xs.size(), motion.guess.xs.front());
    deviations.assign(next.size(), VectorXd::Zero(motion.problem->tangentSize(0)));
    models.resize(next.size());
    statuses.assign(next.size(), StepStatus::Failed);
  }
  static BenchmarkWalkOptions makeOptions() {
    BenchmarkWalkOptions options;
    options.start_nodes = 3;
    options.swing_nodes = 4;
    options.cycles = 1;
    options.total_nodes = 16;
    return options;
  }
  // Steps of some stages together; what came out is in `next`, `deviations` and the tasks.
  std::vector<StepTask> step(const std::vector<int>& stages) {
    std::vector<StepTask> tasks;
    for (int k : stages) {
      StepTask task;
      task.stage = k;
      task.x = &motion.guess.xs[k];
      task.u = &motion.guess.us[k];
      task.x_next = &next[k + 1];
      task.origin = &motion.guess.xs[k + 1];
      task.deviation = &deviations[k + 1];
      tasks.push_back(task);
    }
    motion.problem->stepStages(tasks);
    return tasks;
  }
  // Stages `first` to `last` - 1 together; what came out is in `models` and `statuses`.
  void linearize(int first, int last) {
    motion.problem->linearizeStages(first, last, motion.guess.xs, motion.guess.us, models, statuses);
  }
  Motion motion;
  std::vector<VectorXd> next, deviations;
  std::vector<StageModel> models;
  std::vector<StepStatus> statuses;
};

MatrixXd getLower(ConstPaddedMap H) { return H.triangularView<Eigen::Lower>(); }

bool isSame(const StageModel& a, const StageModel& b) {
  return a.Fx() == b.Fx() && a.Fu() == b.Fu() && a.gap == b.gap && a.cost == b.cost && a.lx == b.lx && a.lu == b.lu &&
         getLower(a.H()) == getLower(b.H());
}

}  // namespace

TEST_CASE("lanes: sine and cosine, rotations, twists and their logarithms are those of double") {
  std::mt19937 rng(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (double range : {1e-3, 0.05, 1.0, 3.0, 1e3, 1e7}) {
    std::array<Vector6d, kLane> twists;
    Vector6<Lanes> packed;
    std::array<const double*, kLane> in;
    for (size_t l = 0; l < kLane; ++l) {
      for (double& x : twists[l]) x = uniform(rng);
      twists[l].tail<3>() *= (l % 2 ? 1e-2 : 1) * range;  // small and large ones side by side
      in[l] = twists[l].data();
    }
    packLanes(in, 6, packed.data());
    Lanes sine, cosine;
    calcSineCosine(packed[5], sine, cosine);
    const Vector3<Lanes> w = angular(packed);
    const Matrix3<Lanes> R = exp3(w), Jr = calcRightJacobian3(w), JrInv = calcRightJacobianInverse3(w);
    const Vector6<Lanes> log = log6(SE3Of<Lanes>(R, linear(packed)));
    for (int l = 0; l < kLane; ++l) {
      const Vector3d w_l = angular(twists[l]);
      CHECK(std::abs(sine[l] - std::sin(w_l[2])) < 3e-16);
      CHECK(std::abs(cosine[l] - std::cos(w_l[2])) < 3e-16);
      if (range > 3) continue;
      Matrix3d one;
      unpackLane(R.data(), l, 9, one.data());
      CHECK((one - exp3(w_l)).norm() < 1e-15);
      unpackLane(Jr.data(), l, 9, one.data());
      CHECK((one - calcRightJacobian3(w_l)).norm() < 1e-15);
      unpackLane(JrInv.data(), l, 9, one.data());
      CHECK((one - calcRightJacobianInverse3(w_l)).norm() < 1e-13);
      Vector6d log_l;
      unpackLane(log.data(), l, 6, log_l.data());
      CHECK((log_l - log6(SE3(exp3(w_l), linear(twists[l])))).norm() < 1e-13);
    }
  }
}

TEST_CASE("lanes: derivatives of differences are those of double, for every kind of joint") {
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (JointKind kind : testing::kJointKinds)
    for (double range : {1e-4, 0.3, 2.0}) {
      Joint joint;
      joint.kind = kind;
      const int n = joint.nv = getNv(kind);
      CAPTURE(getName(kind), range);
      std::array<VectorXd, kLane> d;
      std::array<const double*, kLane> in;
      for (size_t l = 0; l < kLane; ++l) {
        d[l] = VectorXd::NullaryExpr(n, [&] { return (l % 2 ? 1e-2 : 1) * range * uniform(rng); });
        in[l] = d[l].data();
      }
      VectorX<Lanes> packed(n);
      packLanes(in, n, packed.data());
      MatrixX<Lanes> J(n, n);
      calcJointDifferenceJacobian(joint, packed, J);
      for (int l = 0; l < kLane; ++l) {
        MatrixXd expected(n, n), one(n, n);
        calcJointDifferenceJacobian(joint, d[l], expected);
        unpackLane(J.data(), l, n * n, one.data());
        CHECK((one - expected).norm() < 1e-12);
      }
    }
}

TEST_CASE("lanes: each has its own pivots, and a singular one is told from the others") {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr int n = 5;
  std::array<MatrixXd, kLane> A;
  MatrixX<Lanes> factors(n, n);
  VectorX<Lanes> x = VectorX<Lanes>::Constant(n, 1.0);
  std::array<const double*, kLane> in;
  for (size_t l = 0; l < kLane; ++l) {
    A[l] = MatrixXd::NullaryExpr(n, n, [&] { return uniform(rng); });
    if (l == 3) A[l].row(2).setZero();
    in[l] = A[l].data();
  }
  packLanes(in, n * n, factors.data());
  std::vector<LogicOf<Lanes>::Index> pivots(n);
  const LaneMask regular = factorizeSmall(factors, pivots);
  solveFactorized(factors, pivots, x);
  for (size_t l = 0; l < kLane; ++l) {
    CHECK(regular[l] == (l != 3));
    if (l == 3) continue;
    VectorXd x_l(n);
    unpackLane(x.data(), l, n, x_l.data());
    CHECK((A[l] * x_l - VectorXd::Ones(n)).norm() < 1e-11);
  }
}

// In a symmetric posture closure rows are equally long and entries of them vanish: what one rounding puts first another puts
// second. Coordinates of one point in two bases would mean different motions.
TEST_CASE("a point has one basis, whatever the rounding on the way to it") {
  const Model model = loadRobot("bipetto").model;
  const VectorXd q = makeStandingPosture(model);
  const Reduction reduction = makeReduction(model, q);
  REQUIRE(reduction.clusters.size() == 4);
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> uniform(-1e-13, 1e-13);
  for (const ReducedCluster& cluster : reduction.clusters) {
    VectorXd q_cluster(cluster.model.nq()), moved(cluster.model.nq());
    gatherConfiguration(model, cluster, q, q_cluster);
    ClusterPoint point(cluster), other(cluster);
    REQUIRE(point.update(cluster, q_cluster));
    for (int i = 0; i < 50; ++i) {
      for (Eigen::Index k = 0; k < moved.size(); ++k) moved[k] = q_cluster[k] + uniform(rng);
      REQUIRE(other.update(cluster, moved));
      CHECK((other.basis().N - point.basis().N).norm() < 1e-9 * point.basis().N.norm());
      VectorX<Lanes> q_lanes = moved.cast<Lanes>();
      ClusterScratchOf<Lanes> scratch(cluster);
      ClusterStateOf<Lanes> lanes(cluster);
      REQUIRE(!any(!lanes.update(cluster, scratch, q_lanes)));
      MatrixXd N(point.basis().N.rows(), point.basis().N.cols());
      unpackLane(lanes.basis().N.data(), i % kLane, N.size(), N.data());
      CHECK((N - point.basis().N).norm() < 1e-9 * point.basis().N.norm());
    }
  }
}

// Stages whose contacts differ in all that they may: none, one, both, twice the same, points, a hinge.
TEST_CASE("nodes with all sorts of contacts go together") {
  const Model model = loadRobot("bipetto").model;
  const Walk walk(model);
  const auto& [xs, us] = walk.motion.guess;
  const int left = model.findContact("foot_left"), right = model.findContact("foot_right");
  REQUIRE((left >= 0 && right >= 0));
  const std::vector<std::vector<int>> feet = {{left, right},       {},           {right}, {left, left},
                                              {left, right, left}, {right, left}};
  const VectorXd q = xs[0].head(model.nq()), v = xs[0].tail(model.nv());
  const auto makeProblem = [&] {
    std::vector<StageSpec> stages;
    for (ClosureKind kind : {ClosureKind::Weld6D, ClosureKind::Ball3D, ClosureKind::Hinge5D})
      for (const std::vector<int>& contacts : feet) {
        StageSpec stage;
        stage.dt = 0.01 + 1e-3 * stages.size();
        stage.constraints = makeConstraintSet(model, makeContactTargets(model, q, contacts, 20, 5));
        ConstraintSet& set = stage.constraints;
        if (!contacts.empty()) {
          set.closures[set.num_loops].kind = kind;
          set.closures[set.num_loops].axis = Vector3d::UnitX();  // of the hinge
        }
        set.rows = 0;
        for (size_t c = 0; c < set.closures.size(); ++c) {
          set.offsets[c] = set.rows;
          set.rows += getRows(set.closures[c].kind);
        }
        stages.push_back(std::move(stage));
      }
    stages.emplace_back();
    return std::make_unique<RobotProblem>(model, q, v, std::move(stages), Formulation::Reduced);
  };
  const std::unique_ptr<RobotProblem> problem = makeProblem(), other = makeProblem();
  const int N = problem->numStages();
  const std::vector<VectorXd> points(N + 1, xs[2]), controls(N, us[2]);
  std::vector<StageModel> together(N + 1);
  std::vector<StepStatus> statuses(N + 1, StepStatus::Failed);
  problem->linearizeStages(0, N, points, controls, together, statuses);
  for (int k = 0; k < N; ++k) {
    CAPTURE(k);
    REQUIRE(statuses[k] == StepStatus::Ok);
    StageModel alone;
    REQUIRE(other->linearize(k, points[k], controls[k], points[k + 1], alone) == StepStatus::Ok);
    // Redundant rows magnify rounding by 1e7 (saddle_point.h, Eq. 3).
    const bool redundant = std::count(feet[k % feet.size()].begin(), feet[k % feet.size()].end(), left) > 1;
    const double tolerance = redundant ? 1e-8 : 1e-12;
    CHECK((together[k].gap - alone.gap).norm() < tolerance * alone.gap.norm());
    CHECK((together[k].Fx() - alone.Fx()).norm() < tolerance * alone.Fx().norm());
    CHECK((together[k].Fu() - alone.Fu()).norm() < tolerance * alone.Fu().norm());
    if (k > 0) CHECK((together[k].Fx() - together[k - 1].Fx()).norm() > 1e-5 * alone.Fx().norm());
  }
}

TEST_CASE("steps taken together are those taken alone, whichever come together") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model), other(robot.model);
  const int N = walk.motion.problem->numStages();
  std::vector<int> all(N);
  for (int k = 0; k < N; ++k) all[k] = k;
  const std::vector<StepTask> tasks = walk.step(all);
  for (const std::vector<int>& some : {std::vector<int>{9, 2, 14}, {4, 3}, {0, 1, 5, 6, 7, 8, 10, 11, 12, 13, 15}}) {
    for (const StepTask& task : other.step(some)) {
      REQUIRE(task.status == StepStatus::Ok);
      CHECK(other.next[task.stage + 1] == walk.next[task.stage + 1]);  // by the bit
      CHECK(task.cost == tasks[task.stage].cost);
    }
  }
  for (int k : all) {
    Walk alone(robot.model);
    CHECK(alone.step({k}).front().status == StepStatus::Ok);
    CHECK((alone.next[k + 1] - walk.next[k + 1]).norm() < 1e-11 * walk.next[k + 1].norm());
  }
}

TEST_CASE("deviations of steps taken together are differences, with and without the bases of a linearization") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model);
  RobotProblem& problem = *walk.motion.problem;
  const auto& [xs, us] = walk.motion.guess;
  const int N = problem.numStages();
  const std::vector<int> some = {0, 3, 7, 8, 11, N - 1};
  const auto check = [&] {
    for (VectorXd& u : walk.motion.guess.us) u.array() += 0.1;
    walk.step(some);
    for (int k : some) {
      VectorXd expected(problem.tangentSize(k + 1));
      problem.difference(k + 1, xs[k + 1], walk.next[k + 1], expected);
      CHECK(expected.norm() > 1e-3);
      CHECK((walk.deviations[k + 1] - expected).norm() < 1e-11 * expected.norm());
    }
  };
  check();
  walk.linearize(0, N);
  problem.linearizeTerminal(xs[N], walk.models[N]);
  check();
}

TEST_CASE("states moved together are those moved alone, whichever come together") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model);
  RobotProblem& problem = *walk.motion.problem;
  const auto& [xs, us] = walk.motion.guess;
  const int N = problem.numStages();
  std::mt19937 rng(5);
  std::normal_distribution<double> normal;
  std::vector<VectorXd> dxs(N + 1, VectorXd(problem.tangentSize(0)));
  for (VectorXd& dx : dxs)
    for (double& x : dx) x = 0.02 * normal(rng);
  const auto move = [&](const std::vector<int>& nodes, std::vector<VectorXd>& moved) {
    std::vector<IntegrateTask> tasks;
    for (int k : nodes) tasks.push_back({k, &xs[k], &dxs[k], &moved[k]});
    problem.integrateNodes(tasks);
  };
  std::vector<VectorXd> before(N + 1, xs[0]), moved = before, again = before;
  move({0, 2, 3, 5, 7, 8, 9, 11, 12, 15}, before);  // no bases at hand
  walk.linearize(0, N);
  const std::vector<int> some = {0, 2, 3, 5, 7, 8, 9, 11, 12, 15};
  move(some, moved);
  move({3, 5}, again);
  CHECK((again[3] == moved[3] && again[5] == moved[5]));  // by the bit
  for (int k : some) {
    VectorXd alone(problem.stateSize()), dx(problem.tangentSize(k));
    problem.integrate(k, xs[k], dxs[k], alone);
    CHECK((moved[k] - alone).norm() < 1e-11 * alone.norm());
    CHECK((moved[k] - before[k]).norm() < 1e-11 * alone.norm());
    problem.difference(k, xs[k], moved[k], dx);
    CHECK((dx - dxs[k]).norm() < 1e-10 * dx.norm());
  }
  dxs[5] *= 1e4;  // beyond the reach of every loop
  move(some, again);
  CHECK(!again[5].allFinite());
  CHECK(problem.getFailure(5).find("closure") != std::string::npos);
  CHECK(again[7] == moved[7]);
}

TEST_CASE("a step that fails does so alone, and says why") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model), other(robot.model);
  other.motion.guess.us[4].setConstant(1e9);  // beyond the reach of every loop
  other.motion.guess.us[6][0] = std::numeric_limits<double>::quiet_NaN();
  walk.step({2, 4, 5, 6});
  const std::vector<StepTask> tasks = other.step({2, 4, 5, 6});
  CHECK(tasks[1].status == StepStatus::Failed);
  CHECK(other.motion.problem->getFailure(4).find("closure") != std::string::npos);
  CHECK(tasks[3].status == StepStatus::Failed);
  for (int i : {0, 2}) {
    CHECK(tasks[i].status == StepStatus::Ok);
    CHECK(other.next[tasks[i].stage + 1] == walk.next[tasks[i].stage + 1]);
  }
}

TEST_CASE("models made together are those made one by one, by the bit") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model);
  RobotProblem& problem = *walk.motion.problem;
  const auto& [xs, us] = walk.motion.guess;
  const int N = problem.numStages();
  std::vector<StageModel> others(N + 1);
  walk.linearize(0, N);
  for (int k = 0; k < N; ++k) {
    REQUIRE(walk.statuses[k] == StepStatus::Ok);
    REQUIRE(problem.linearize(k, xs[k], us[k], xs[k + 1], others[k]) == StepStatus::Ok);
    CHECK(isSame(walk.models[k], others[k]));
  }
  for (int k = 3; k < 6; ++k) walk.models[k] = {};
  walk.linearize(3, 6);
  for (int k = 3; k < 6; ++k) CHECK(isSame(walk.models[k], others[k]));
  others[4].lxx()(2, 1) += 1e-15 + others[4].lxx()(2, 1) * 1e-15;
  CHECK(!isSame(walk.models[4], others[4]));
}

TEST_CASE("steps and models made together allocate nothing after the first") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model);
  const int N = walk.motion.problem->numStages();
  std::vector<StepTask> tasks = walk.step({1, 4, 8});
  const std::vector<VectorXd>& xs = walk.motion.guess.xs;
  VectorXd dx = VectorXd::Constant(walk.motion.problem->tangentSize(0), 1e-3), moved = xs[0];
  const std::vector<IntegrateTask> starts = {{2, &xs[2], &dx, &moved}};
  walk.linearize(0, N);
  for (VectorXd& u : walk.motion.guess.us) u.array() += 0.1;
  const long before = num_allocations;
  const VectorXd counted(100);
  CHECK(num_allocations == before + 1);
  walk.motion.problem->stepStages(tasks);
  walk.linearize(0, N);
  walk.motion.problem->integrateNodes(starts);
  CHECK(num_allocations == before + 1);
}
