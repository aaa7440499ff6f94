// Several nodes at once: numbers in lanes equal those of double, and the result of a lane does not depend on the
// others.
#include <catch2/catch.hpp>
#include <numeric>
#include <random>

#include "bielle/math/se3.h"
#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"
#include "dynamics/reduction.h"
#include "math/small_dense.h"
#include "math/so3.h"
#include "mechanisms.h"
#include "model/joint.h"
#include "motion/benchmark_walk.h"
#include "problem_probe.h"

using namespace bielle;

namespace {

// The benchmark walk, shortened, and a trajectory near its guess whose states are closed.
struct Walk {
  explicit Walk(const Model& model)
      : motion(makeBenchmarkWalk(model, makeOptions(), Formulation::Reduced)),
        problem(*motion.problem),
        xs(motion.guess.xs),
        us(motion.guess.us) {
    std::mt19937 rng(1);
    std::normal_distribution<double> normal;
    testing::ProblemProbe probe(problem);
    for (int k = 0; k < problem.numStages(); ++k) {
      VectorXd dx(problem.tangentSize(k));
      for (double& x : dx) x = 0.01 * normal(rng);
      xs[k] = probe.integrate(xs[k], dx);
      for (double& u : us[k]) u += normal(rng);
    }
  }
  static BenchmarkWalkOptions makeOptions() {
    BenchmarkWalkOptions options;
    options.start_nodes = 3;
    options.swing_nodes = 4;
    options.cycles = 1;
    options.total_nodes = 16;
    return options;
  }
  Motion motion;
  const RobotProblem& problem;
  std::vector<VectorXd>&xs, &us;
};

// Evaluations of a problem and what is made of them, some nodes together.
struct Evaluations {
  explicit Evaluations(const RobotProblem& p) : problem(p), scratch(p.makeScratch()), models(p.numStages() + 1) {
    const int N = p.numStages();
    for (int k = 0; k <= N; ++k) {
      nodes.push_back(p.makeEvaluation());
      models[k].resize(p.tangentSize(k), k < N ? p.controlSize(k) : 0, k < N ? p.tangentSize(k + 1) : 0);
    }
    all.resize(N + 1);
    std::iota(all.begin(), all.end(), 0);
  }
  const RobotEvaluation& at(int k) const { return static_cast<const RobotEvaluation&>(*nodes[k]); }
  void evaluate(const std::vector<int>& some, const std::vector<VectorXd>& xs, const std::vector<VectorXd>& us) {
    std::vector<EvaluateTask> tasks;
    for (int k : some)
      tasks.push_back({k, &xs[k], k < problem.numStages() ? &us[k] : nullptr, nullptr, nodes[k].get()});
    problem.evaluate(tasks.data(), static_cast<int>(tasks.size()), scratch.get());
  }
  std::vector<NumericalStatus> linearize(const std::vector<int>& some) {
    std::vector<LinearizeTask> tasks;
    for (int k : some) {
      tasks.emplace_back();
      tasks.back().node = k;
      tasks.back().at = nodes[k].get();
      tasks.back().next = k < problem.numStages() ? nodes[k + 1].get() : nullptr;
      tasks.back().out = &models[k];
    }
    problem.linearize(tasks.data(), static_cast<int>(tasks.size()), scratch.get());
    std::vector<NumericalStatus> statuses;
    for (const LinearizeTask& task : tasks) statuses.push_back(task.status);
    return statuses;
  }
  const RobotProblem& problem;
  std::unique_ptr<ProblemScratch> scratch;
  std::vector<std::unique_ptr<NodeEvaluation>> nodes;
  std::vector<StageModel> models;
  std::vector<int> all;
};

MatrixXd getLower(ConstMatrixMap A) { return A.triangularView<Eigen::Lower>(); }

bool isSame(const StageModel& a, const StageModel& b) {
  return a.Fx() == b.Fx() && a.Fu() == b.Fu() && a.gap == b.gap && a.cost == b.cost && a.lx == b.lx && a.lu == b.lu &&
         getLower(a.hessian()) == getLower(b.hessian());
}

bool isSame(const RobotEvaluation& a, const RobotEvaluation& b) {
  return a.status == b.status && a.x_next == b.x_next && a.cost == b.cost && a.a == b.a && a.lambda == b.lambda;
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

// In a symmetric posture closure rows are equally long and some entries vanish, so that rounding could change their
// order. Coordinates of one point in two bases would mean different motions.
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
      REQUIRE(!any(!updateClusterState<Lanes>(cluster, scratch, q_lanes, lanes)));
      MatrixXd N(point.basis().N.rows(), point.basis().N.cols());
      unpackLane(lanes.basis.N.data(), i % kLane, N.size(), N.data());
      CHECK((N - point.basis().N).norm() < 1e-9 * point.basis().N.norm());
    }
  }
}

// Stages whose contacts differ in all that they may: none, one, both, twice the same, points, a hinge.
TEST_CASE("nodes with all sorts of contacts go together") {
  const Model model = loadRobot("bipetto").model;
  const Walk walk(model);
  const std::vector<VectorXd>&xs = walk.xs, &us = walk.us;
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
  const std::unique_ptr<RobotProblem> problem = makeProblem();
  const int N = problem->numStages();
  const std::vector<VectorXd> points(N + 1, xs[2]), controls(N, us[2]);
  Evaluations together(*problem), alone(*problem);
  together.evaluate(together.all, points, controls);
  together.linearize(together.all);
  for (int k = N; k >= 0; --k) {
    CAPTURE(k);
    alone.evaluate({k}, points, controls);
    REQUIRE(alone.at(k).status == NumericalStatus::Ok);
    REQUIRE(alone.linearize({k}) == std::vector<NumericalStatus>{NumericalStatus::Ok});
    CHECK(isSame(together.at(k), alone.at(k)));
    CHECK(isSame(together.models[k], alone.models[k]));
    if (k > 0 && k < N) CHECK((together.models[k].Fx() - together.models[k - 1].Fx()).norm() > 1e-3);
  }
}

TEST_CASE("what comes out of a node does not depend on which come together, by the bit") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model);
  const int N = walk.problem.numStages();
  Evaluations all(walk.problem), others(walk.problem);
  all.evaluate(all.all, walk.xs, walk.us);
  all.linearize(all.all);
  for (const std::vector<int>& some : {std::vector<int>{9, 2, 14}, {4, 3}, {0, 1, 5, 6, 7, 8, 10, 11, 12, 13, 15}, {N}})
    others.evaluate(some, walk.xs, walk.us);
  others.linearize({3, 4, 5});
  others.linearize({9});
  for (int k = 0; k <= N; ++k) {
    REQUIRE(all.at(k).status == NumericalStatus::Ok);
    CHECK(isSame(all.at(k), others.at(k)));
  }
  for (int k : {3, 4, 5, 9}) CHECK(isSame(all.models[k], others.models[k]));
  others.models[4].lxx()(2, 1) += 1e-15 + others.models[4].lxx()(2, 1) * 1e-15;
  CHECK(!isSame(all.models[4], others.models[4]));
}

TEST_CASE("a step from where the one before has led is the one that starts there, by the bit") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model);
  Evaluations nodes(walk.problem);
  nodes.evaluate({2}, walk.xs, walk.us);
  const auto followed = walk.problem.makeEvaluation(), fresh = walk.problem.makeEvaluation();
  const VectorXd& x = nodes.at(2).x_next;
  EvaluateTask tasks[] = {{3, &x, &walk.us[3], nodes.nodes[2].get(), followed.get()},
                          {3, &x, &walk.us[3], nullptr, fresh.get()}};
  walk.problem.evaluate(tasks, 1, nodes.scratch.get());
  walk.problem.evaluate(tasks + 1, 1, nodes.scratch.get());
  CHECK(isSame(static_cast<RobotEvaluation&>(*followed), static_cast<RobotEvaluation&>(*fresh)));
  walk.problem.evaluate(tasks, 2, nodes.scratch.get());  // and together
  CHECK(isSame(static_cast<RobotEvaluation&>(*followed), static_cast<RobotEvaluation&>(*fresh)));
}

TEST_CASE("states are moved and compared together as alone, and differences undo sums") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model);
  const int N = walk.problem.numStages();
  Evaluations nodes(walk.problem);
  nodes.evaluate(nodes.all, walk.xs, walk.us);
  std::mt19937 rng(5);
  std::normal_distribution<double> normal;
  std::vector<VectorXd> dxs(N + 1, VectorXd(walk.problem.tangentSize(0)));
  for (VectorXd& dx : dxs)
    for (double& x : dx) x = 0.02 * normal(rng);
  const auto move = [&](const std::vector<int>& some, std::vector<VectorXd>& moved) {
    std::vector<IntegrateTask> tasks;
    for (int k : some) tasks.push_back({k, nodes.nodes[k].get(), &dxs[k], &moved[k]});
    walk.problem.integrate(tasks.data(), static_cast<int>(tasks.size()), nodes.scratch.get());
  };
  std::vector<VectorXd> moved(N + 1, walk.xs[0]), again = moved, back = dxs;
  move(nodes.all, moved);
  move({3, 5}, again);
  CHECK((again[3] == moved[3] && again[5] == moved[5]));
  std::vector<DifferenceTask> differences;
  for (int k = 0; k <= N; ++k) differences.push_back({k, nodes.nodes[k].get(), &moved[k], &back[k]});
  walk.problem.difference(differences.data(), N + 1, nodes.scratch.get());
  for (int k = 0; k <= N; ++k) {
    CHECK((back[k] - dxs[k]).norm() < 1e-10 * dxs[k].norm());
    CHECK((moved[k] - walk.xs[k]).norm() > 1e-3);
  }
  dxs[5] *= 1e4;  // beyond the reach of every closure
  move({4, 5, 7}, again);
  CHECK(!again[5].allFinite());
  CHECK(again[7] == moved[7]);
}

TEST_CASE("a step that fails does so alone, and says why") {
  const LoadedRobot robot = loadRobot("bipetto");
  Walk walk(robot.model);
  Evaluations good(walk.problem), bad(walk.problem);
  good.evaluate({2, 4, 5, 6}, walk.xs, walk.us);
  walk.us[4].setConstant(1e9);  // beyond the reach of every closure
  walk.us[6][0] = std::numeric_limits<double>::quiet_NaN();
  bad.evaluate({2, 4, 5, 6}, walk.xs, walk.us);
  CHECK(bad.at(4).status == NumericalStatus::Failed);
  CHECK(bad.at(4).failure.find("closure") != std::string::npos);
  CHECK(bad.at(6).status == NumericalStatus::Failed);
  for (int k : {2, 5}) {
    CHECK(bad.at(k).status == NumericalStatus::Ok);
    CHECK(isSame(bad.at(k), good.at(k)));
  }
}
