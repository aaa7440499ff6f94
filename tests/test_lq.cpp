// Oracle: the dense optimality (KKT) system of the whole problem with all its multipliers; for the box QP, every active
// set.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <chrono>
#include <random>

#include "solve/lq_sweep.h"
#include "weighted_model.h"

using namespace bielle;

namespace {

std::mt19937 rng(3);

MatrixXd random(int rows, int cols) {
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, cols, [&](Eigen::Index, Eigen::Index) { return normal(rng); });
}

MatrixXd makePositive(int n, double shift) {
  const MatrixXd A = random(n, n);
  return A * A.transpose() / n + shift * MatrixXd::Identity(n, n);
}

// Stages of the given tangent and control sizes with gaps and cross terms.
std::vector<StageModel> makeModels(const std::vector<int>& ndx, const std::vector<int>& nu) {
  std::vector<StageModel> models(ndx.size());
  for (size_t k = 0; k < ndx.size(); ++k) {
    StageModel& m = models[k];
    const bool terminal = k + 1 == ndx.size();
    const int n = ndx[k], u = terminal ? 0 : nu[k], next = terminal ? 0 : ndx[k + 1];
    m.resize(n, u, next);
    m.Fx() = random(next, n) / std::sqrt(double(n));
    m.Fu() = random(next, u);
    m.gap = random(next, 1);
    m.lx = random(n, 1);
    m.lu = random(u, 1);
    const MatrixXd H = makePositive(n + u, 0.1);
    m.lxx() = H.topLeftCorner(n, n);
    m.luu() = H.bottomRightCorner(u, u);
    m.lux() = H.bottomLeftCorner(u, n);
  }
  return models;
}

// The program (1) of lq_sweep.h as min 1/2 z.H z + g.z, A z = b with z = (dx_0, du_0, dx_1, ...).
struct DenseProgram {
  MatrixXd H, A;
  VectorXd g, b;
  std::vector<int> x_at, u_at;

  DenseProgram(const std::vector<StageModel>& models, const LqRegularization& mu) {
    int size = 0, rows = static_cast<int>(models[0].lx.size());
    for (const StageModel& m : models) {
      x_at.push_back(size);
      u_at.push_back(size + static_cast<int>(m.lx.size()));
      size += static_cast<int>(m.lx.size() + m.lu.size());
      rows += static_cast<int>(m.gap.size());
    }
    H.setZero(size, size);
    A.setZero(rows, size);
    g.setZero(size);
    b.setZero(rows);
    const auto n0 = models[0].lx.size();
    A.topLeftCorner(n0, n0).setIdentity();
    int row = static_cast<int>(n0);
    for (size_t k = 0; k < models.size(); ++k) {
      const StageModel& m = models[k];
      const auto n = m.lx.size(), u = m.lu.size(), next = m.gap.size();
      const int x = x_at[k], c = u_at[k];
      H.block(x, x, n, n) = m.lxx() + mu.state * MatrixXd::Identity(n, n);
      H.block(c, c, u, u) = m.luu() + mu.control * MatrixXd::Identity(u, u);
      H.block(c, x, u, n) = m.lux();
      H.block(x, c, n, u) = m.lux().transpose();
      g.segment(x, n) = m.lx;
      g.segment(c, u) = m.lu;
      if (k + 1 == models.size()) break;
      A.block(row, x, next, n) = -m.Fx();
      A.block(row, c, next, u) = -m.Fu();
      A.block(row, x_at[k + 1], next, next).setIdentity();
      b.segment(row, next) = m.gap;
      row += static_cast<int>(next);
    }
  }

  VectorXd calcSolution() const {
    const auto n = H.rows(), m = A.rows();
    MatrixXd kkt = MatrixXd::Zero(n + m, n + m);
    kkt.topLeftCorner(n, n) = H;
    kkt.topRightCorner(n, m) = A.transpose();
    kkt.bottomLeftCorner(m, n) = A;
    VectorXd rhs(n + m);
    rhs << -g, b;
    return kkt.fullPivLu().solve(rhs).head(n);
  }
  double calcValue(const VectorXd& z) const { return 0.5 * z.dot(H * z) + g.dot(z); }
  // Gradient along the feasible directions and violation of the dynamics.
  double calcResidual(const VectorXd& z) const {
    const MatrixXd Z = A.fullPivLu().kernel();
    return std::max((Z.transpose() * (H * z + g)).cwiseAbs().maxCoeff(), (A * z - b).cwiseAbs().maxCoeff());
  }
};

VectorXd stack(const std::vector<VectorXd>& dx, const std::vector<VectorXd>& du, const DenseProgram& dense) {
  VectorXd z(dense.g.size());
  for (size_t k = 0; k < dx.size(); ++k) z.segment(dense.x_at[k], dx[k].size()) = dx[k];
  for (size_t k = 0; k < du.size(); ++k) z.segment(dense.u_at[k], du[k].size()) = du[k];
  return z;
}

// Largest distance between the sweep's step and the dense program's solution.
double calcStepError(LqSweep& sweep, const std::vector<StageModel>& models, const DenseProgram& dense,
                     const LqRegularization& mu) {
  REQUIRE(sweep.update(models, mu).status == NumericalStatus::Ok);
  std::vector<VectorXd> dx, du;
  sweep.calcStep(models, dx, du);
  return (stack(dx, du, dense) - dense.calcSolution()).cwiseAbs().maxCoeff();
}

const std::vector<int> kTangents = {3, 5, 4, 4, 6, 1, 7}, kControls = {2, 3, 0, 5, 1, 2};

}  // namespace

TEST_CASE("the sweep solves the dense program, whatever the sizes, gaps and regularization") {
  LqSweep sweep;
  for (int trial = 0; trial < 10; ++trial) {
    const auto models = makeModels(kTangents, kControls);
    const LqRegularization mu{trial % 2 ? 0.3 : 0.0, trial % 3 ? 0.7 : 0.0};
    const DenseProgram dense(models, mu);
    const LqResult result = sweep.update(models, mu);
    REQUIRE(result.status == NumericalStatus::Ok);
    CHECK(result.node == -1);
    std::vector<VectorXd> dx, du;
    const double slope = sweep.calcStep(models, dx, du);
    const VectorXd z = stack(dx, du, dense);
    CHECK((z - dense.calcSolution()).cwiseAbs().maxCoeff() < 1e-10);
    CHECK(dense.calcResidual(z) < 1e-10);
    CHECK(result.expected_change == Approx(dense.calcValue(z)).epsilon(1e-11));
    CHECK(slope == Approx(dense.g.dot(z)).epsilon(1e-11));
    for (const LqSweep::Node& node : sweep.nodes()) CHECK(node.Vxx == node.Vxx.transpose());
  }
}

TEST_CASE("weights of constraints are the same as terms of the cost") {
  auto models = makeModels(kTangents, kControls);
  std::vector<ConstraintWeights> weights;
  std::vector<StageModel> folded;
  for (size_t k = 0; k < models.size(); ++k) {
    const int rows = static_cast<int>(k) % 4;
    models[k].setRows(rows);
    models[k].Ct() = random(static_cast<int>(models[k].Ct().rows()), rows);
    weights.push_back({random(rows, 1), random(rows, 1).cwiseAbs()});
    if (rows > 1) weights[k].gradient[0] = weights[k].hessian[1] = 0;
    if (rows > 2) weights[k].hessian[2] = weights[k].gradient[2] = 0, models[k].Ct().col(2).setConstant(NAN);
    folded.push_back(models[k]);
    if (rows > 2) folded[k].Ct().col(2).setZero();
    testing::addWeights(weights[k], folded[k]);
  }
  LqSweep sweep, expected;
  std::vector<VectorXd> dx, du, dx1, du1;
  const auto calcError = [&] {
    const LqResult result = sweep.update(models, {0.1, 0.2}, {}, weights);
    REQUIRE(result.status == NumericalStatus::Ok);
    double error = std::abs(result.expected_change - expected.result().expected_change);
    error = std::max(error, std::abs(sweep.calcStep(models, dx, du) - expected.calcStep(folded, dx1, du1)));
    for (size_t k = 0; k < dx.size(); ++k) {
      error = std::max(error, (dx[k] - dx1[k]).norm());
      error = std::max(error, (sweep.nodes()[k].Vxx - expected.nodes()[k].Vxx).norm());
      if (k < du.size()) error = std::max(error, (du[k] - du1[k]).norm());
    }
    return error;
  };
  REQUIRE(expected.update(folded, {0.1, 0.2}).status == NumericalStatus::Ok);
  CHECK(calcError() < 1e-10);
  CHECK(calcError() < 1e-10);  // the models are as they were
  models[3].Ct()(1, 0) += 1e-4;
  CHECK(calcError() > 1e-7);
}

TEST_CASE("the sweep solves the dense program of larger sizes, with every number of lanes and columns left over") {
  LqSweep sweep;
  std::uniform_int_distribution<int> size(1, 63), control_size(0, 17);
  for (int trial = 0; trial < 12; ++trial) {
    std::vector<int> ndx, nu;
    for (int k = 0; k < 4; ++k) ndx.push_back(size(rng));
    for (int k = 0; k < 3; ++k) nu.push_back(control_size(rng));
    CAPTURE(ndx, nu);
    const auto models = makeModels(ndx, nu);
    const DenseProgram dense(models, {});
    CHECK(calcStepError(sweep, models, dense, {}) < 1e-9);
    for (const LqSweep::Node& node : sweep.nodes()) CHECK(node.Vxx == node.Vxx.transpose());
  }
}

TEST_CASE("without gaps the expected change is half the slope, the sum of Qu.k") {
  auto models = makeModels(kTangents, kControls);
  for (StageModel& m : models) m.gap.setZero();
  LqSweep sweep;
  const LqResult result = sweep.update(models, {});
  std::vector<VectorXd> dx, du;
  double sum = 0;
  for (size_t k = 0; k < kControls.size(); ++k) sum += sweep.nodes()[k].Qu.dot(sweep.nodes()[k].k);
  CHECK(sweep.calcStep(models, dx, du) == Approx(sum).epsilon(1e-11));
  CHECK(result.expected_change == Approx(0.5 * sum).epsilon(1e-11));
}

TEST_CASE("the value function is the optimal cost to go from any deviation") {
  auto models = makeModels(kTangents, kControls);
  LqSweep sweep;
  REQUIRE(sweep.update(models, {}).status == NumericalStatus::Ok);
  const int k = 2;
  const LqSweep::Node node = sweep.nodes()[k];
  const std::vector<StageModel> tail(models.begin() + k, models.end());
  DenseProgram dense(tail, {});
  const VectorXd d = random(kTangents[k], 1);
  const double at_zero = dense.calcValue(dense.calcSolution());
  dense.b.head(d.size()) = d;
  const double at_d = dense.calcValue(dense.calcSolution());
  CHECK(node.Vx.dot(d) + 0.5 * d.dot(node.Vxx * d) == Approx(at_d - at_zero).epsilon(1e-10));
}

TEST_CASE("state costs may be indefinite as long as the program is convex") {
  auto models = makeModels({4, 4, 4, 4}, {4, 4, 4});
  for (size_t k = 1; k < models.size(); ++k)
    models[k].lxx().diagonal().array() -= 0.5;  // reached through invertible Fu
  for (size_t k = 0; k + 1 < models.size(); ++k) models[k].luu().diagonal().array() += 30;
  const Eigen::LDLT<MatrixXd> ldlt(models[2].lxx());
  REQUIRE_FALSE(ldlt.isPositive());
  const DenseProgram dense(models, {});
  const MatrixXd Z = dense.A.fullPivLu().kernel();
  REQUIRE(Eigen::LLT<MatrixXd>(Z.transpose() * dense.H * Z).info() == Eigen::Success);
  LqSweep sweep;
  CHECK(calcStepError(sweep, models, dense, {}) < 1e-10);
}

TEST_CASE("one poisoned entry of any block moves the step away from the dense solution") {
  const auto models = makeModels(kTangents, kControls);
  const DenseProgram dense(models, {});
  LqSweep sweep;
  REQUIRE(calcStepError(sweep, models, dense, {}) < 1e-10);
  const auto poisoned = [&](auto&& poison) {
    auto copy = models;
    poison(copy[3]);
    return calcStepError(sweep, copy, dense, {});
  };
  CHECK(poisoned([](StageModel& m) { m.Fx()(1, 2) += 1e-4; }) > 1e-7);
  CHECK(poisoned([](StageModel& m) { m.Fu()(1, 2) += 1e-4; }) > 1e-7);
  CHECK(poisoned([](StageModel& m) { m.gap(1) += 1e-4; }) > 1e-7);
  CHECK(poisoned([](StageModel& m) { m.lx(1) += 1e-4; }) > 1e-7);
  CHECK(poisoned([](StageModel& m) { m.lu(1) += 1e-4; }) > 1e-7);
  CHECK(poisoned([](StageModel& m) { m.lxx()(2, 1) += 1e-4; }) > 1e-7);
  CHECK(poisoned([](StageModel& m) { m.lux()(2, 1) += 1e-4; }) > 1e-7);
  CHECK(poisoned([](StageModel& m) { m.luu()(2, 1) += 1e-4; }) > 1e-7);
}

TEST_CASE("an indefinite control block and a value that is not finite are reported with their node") {
  const auto models = makeModels(kTangents, kControls);
  LqSweep sweep;
  auto bad = models;
  bad[3].luu() -= 1e4 * MatrixXd::Identity(5, 5);
  LqResult result = sweep.update(bad, {});
  CHECK(result.status == NumericalStatus::Indefinite);
  CHECK(result.node == 3);
  CHECK(sweep.update(bad, {2e4, 0}).status == NumericalStatus::Ok);

  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto poisoned = [&](auto&& poison) {
    auto copy = models;
    poison(copy[3]);
    return sweep.update(copy, {});
  };
  for (const LqResult& r :
       {poisoned([&](StageModel& m) { m.Fx()(1, 2) = nan; }), poisoned([&](StageModel& m) { m.Fu()(1, 2) = nan; }),
        poisoned([&](StageModel& m) { m.gap(1) = nan; }), poisoned([&](StageModel& m) { m.lx(1) = nan; }),
        poisoned([&](StageModel& m) { m.lu(1) = nan; }), poisoned([&](StageModel& m) { m.lxx()(2, 1) = nan; }),
        poisoned([&](StageModel& m) { m.lux()(2, 1) = nan; }), poisoned([&](StageModel& m) { m.luu()(2, 1) = nan; })}) {
    CHECK(r.status == NumericalStatus::NotFinite);
    CHECK((r.node == 3 || r.node == 2));
  }
}

TEST_CASE("box QP: the best of all active sets, with its free factor") {
  BoxQp qp;
  const double inf = std::numeric_limits<double>::infinity();
  int clamped_in_all = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + trial % 5;
    const MatrixXd H = makePositive(n, 0.01);
    const VectorXd g = random(n, 1);
    VectorXd lower = -random(n, 1).cwiseAbs(), upper = random(n, 1).cwiseAbs();
    if (trial % 3 == 0) lower[0] = -inf;
    if (trial % 4 == 0) upper[n - 1] = inf;
    if (trial % 7 == 0) lower[0] = upper[0] = 0;

    double best = inf;
    VectorXd oracle(n);
    for (int code = 0; code < std::pow(3, n); ++code) {  // each component free, at its lower or at its upper bound
      VectorXd d = VectorXd::Zero(n);
      std::vector<int> free;
      for (int i = 0, c = code; i < n; ++i, c /= 3) {
        if (c % 3 == 0) free.push_back(i);
        if (c % 3 == 1) d[i] = lower[i];
        if (c % 3 == 2) d[i] = upper[i];
      }
      if (!d.allFinite()) continue;
      const VectorXd r = H * d + g;
      if (!free.empty()) d(free) = -MatrixXd(H(free, free)).fullPivLu().solve(VectorXd(r(free)));
      if ((d - lower).minCoeff() < -1e-12 || (upper - d).minCoeff() < -1e-12) continue;
      const double value = 0.5 * d.dot(H * d) + g.dot(d);
      if (value < best) best = value, oracle = d;
    }

    VectorXd d = 3 * random(n, 1);
    REQUIRE(qp.solve(H, g, lower, upper, d) == NumericalStatus::Ok);
    CHECK((d - oracle).cwiseAbs().maxCoeff() < 1e-9);
    CHECK((d - lower).minCoeff() >= 0);
    CHECK((upper - d).minCoeff() >= 0);
    const MatrixXd L = MatrixXd(qp.freeFactor()).triangularView<Eigen::Lower>();
    std::vector<int> free;
    for (int i = 0; i < qp.numFree(); ++i) free.push_back(qp.getFreeIndex(i));
    clamped_in_all += n - qp.numFree();
    if (!free.empty()) CHECK((L * L.transpose() - MatrixXd(H(free, free))).cwiseAbs().maxCoeff() < 1e-13 * n);
  }
  CHECK(clamped_in_all > 200);
  VectorXd d = VectorXd::Zero(2);
  const VectorXd wide = VectorXd::Constant(2, 1.0);
  CHECK(qp.solve(-MatrixXd::Identity(2, 2), VectorXd::Zero(2), -wide, wide, d) == NumericalStatus::Indefinite);
  CHECK(qp.solve(MatrixXd::Identity(2, 2), VectorXd::Constant(2, NAN), -wide, wide, d) ==
        NumericalStatus::NotConverged);
}

TEST_CASE("a sweep with boxes: wide ones change nothing, tight ones clamp k and empty the rows of K") {
  const auto models = makeModels(kTangents, kControls);
  LqSweep free, boxed;
  const LqResult unbounded = free.update(models, {});
  std::vector<ControlBox> boxes(kControls.size());
  for (size_t k = 0; k < boxes.size(); ++k) {
    boxes[k].lower = VectorXd::Constant(kControls[k], -1e3);
    boxes[k].upper = -boxes[k].lower;
  }
  const LqResult wide = boxed.update(models, {}, boxes);
  CHECK(wide.expected_change == Approx(unbounded.expected_change).epsilon(1e-11));
  for (size_t k = 0; k < boxes.size(); ++k) {
    CHECK((boxed.nodes()[k].Vxx - free.nodes()[k].Vxx).norm() < 1e-10);
    CHECK((boxed.nodes()[k].Vx - free.nodes()[k].Vx).norm() < 1e-10);
    CHECK((boxed.nodes()[k].K - free.nodes()[k].K).norm() < 1e-10);
  }

  // The value function must be that of the policy du = k + K dx, rolled out through the models.
  for (ControlBox& box : boxes) box.lower *= 2e-4, box.upper *= 2e-4;
  const LqResult tight = boxed.update(models, {}, boxes);
  REQUIRE(tight.status == NumericalStatus::Ok);
  int clamped = 0;
  for (size_t k = 0; k < boxes.size(); ++k) {
    for (int i = 0; i < kControls[k]; ++i) {
      const bool at_bound = std::abs(boxed.nodes()[k].k[i]) == 0.2;
      clamped += at_bound;
      if (at_bound) CHECK(boxed.nodes()[k].K.row(i).isZero(0));
    }
  }
  CHECK(clamped > 2);
  std::vector<VectorXd> dx, du;
  boxed.calcStep(models, dx, du);
  const DenseProgram dense(models, {});
  CHECK(tight.expected_change == Approx(dense.calcValue(stack(dx, du, dense))).epsilon(1e-10));
}

TEST_CASE("a sweep with any control clamped: gains and value function of the free ones, as by dense elimination") {
  const int n = 7, nu = 5;
  for (int which = 0; which < nu; ++which) {
    CAPTURE(which);
    const auto models = makeModels(std::vector<int>(4, n), std::vector<int>(3, nu));
    std::vector<ControlBox> boxes(3, {VectorXd::Constant(nu, -1e3), VectorXd::Constant(nu, 1e3)});
    for (ControlBox& box : boxes) box.lower[which] = box.upper[which] = 0.1;
    LqSweep sweep;
    REQUIRE(sweep.update(models, {}, boxes).status == NumericalStatus::Ok);
    std::vector<int> free;
    for (int i = 0; i < nu; ++i)
      if (i != which) free.push_back(i);
    MatrixXd V = models[3].lxx();
    for (int k = 2; k >= 0; --k) {
      const StageModel& m = models[k];
      const MatrixXd Quu = m.luu() + m.Fu().transpose() * V * m.Fu(), Qux = m.lux() + m.Fu().transpose() * V * m.Fx();
      const MatrixXd free_Qux = Qux(free, Eigen::all);
      const MatrixXd K = -MatrixXd(Quu(free, free)).ldlt().solve(free_Qux);
      V = m.lxx() + m.Fx().transpose() * V * m.Fx() + free_Qux.transpose() * K;
      const auto& node = sweep.nodes()[k];
      CHECK((node.Vxx - V).norm() < 1e-10 * V.norm());
      CHECK((MatrixXd(node.K(free, Eigen::all)) - K).norm() < 1e-10 * (1 + K.norm()));
      CHECK(node.K.row(which).isZero(0));
    }
  }
}

TEST_CASE("time of a sweep in products of its tangent size", "[.][time]") {
  const int n = GENERATE(36, 108);
  const auto models = makeModels(std::vector<int>(251, n), std::vector<int>(250, 12));
  const auto time = [](int repeat, auto&& f) {
    double best = 1e9;
    for (int i = 0; i < repeat; ++i) {
      const auto start = std::chrono::steady_clock::now();
      f();
      best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    return best;
  };
  MatrixXd A = random(108, 108), B = random(108, 108), C(108, 108);
  const double unit = time(500, [&] { C.noalias() = A * B; });
  LqSweep sweep;
  std::vector<VectorXd> dx, du;
  const double sweep_time = time(20, [&] { sweep.update(models, {}); }) / 250;
  const double step_time = time(20, [&] { sweep.calcStep(models, dx, du); }) / 250;
  WARN("n = " << n << ": unit " << unit * 1e6 << " us; per node: sweep " << sweep_time / unit << " units, step "
              << step_time / unit << " units");
}
