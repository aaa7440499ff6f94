#include "motion/half_cycle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "math/largest.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kSameStep = 1e-9;  // of a state after a stage: rad, m, rad/s and m/s
// Of costs and constraints, relative to themselves or 1: the plan of a gait forgets its beginning only step by step (kCycleLead).
constexpr double kSameCost = 1e-6;

// Components of the deviations at which a problem is compared with its mirror image, of any size and without a pattern.
VectorXd makeDeviation(Eigen::Index size, int node, double scale) {
  VectorXd out(size);
  for (Eigen::Index i = 0; i < size; ++i) out[i] = scale * std::sin(1 + 2.3 * static_cast<double>(i) + 0.7 * node);
  return out;
}

double calcStateDistance(const Model& model, const VectorXd& a, const VectorXd& b) {
  return getLarger(model.difference(a.head(model.nq()), b.head(model.nq())).lpNorm<Eigen::Infinity>(),
                   (a.segment(model.nq(), model.nv()) - b.segment(model.nq(), model.nv())).lpNorm<Eigen::Infinity>());
}

// Of a foot that stands at node 0 to its partner that stands at node h; the reflection of the world, if there is one.
std::optional<SE3> findReflection(const Motion& motion, const MirroredRobot& robot, int h) {
  for (const ContactTarget& foot : motion.schedule.getPhase(0).contacts)
    for (const ContactTarget& other : motion.schedule.getPhase(h).contacts)
      if (other.contact == robot.getContact(foot.contact))
        return other.X_WT * robot.getContactMap(foot.contact).inverse() * foot.X_WT.inverse();
  return {};
}

std::vector<StageSpec> listStages(const RobotProblem& whole) {
  std::vector<StageSpec> stages;
  for (int k = 0; k < whole.numStages() / 2; ++k) stages.push_back(whole.spec(k));
  stages.push_back(whole.spec(whole.numStages()));
  return stages;
}

// Constraints at a node with their bounds.
struct Rows {
  VectorXd values, lower, upper;

  Rows(const ShootingProblem& problem, int node, const VectorXd& at)
      : values(at), lower(problem.constraintSize(node)), upper(lower.size()) {
    problem.getConstraintBounds(node, lower, upper);
  }
  // How far a row is from `sign` times another one; infinite where their bounds differ.
  double compare(Eigen::Index i, const Rows& o, Eigen::Index j, double sign) const {
    const double low = sign > 0 ? o.lower[j] : -o.upper[j], high = sign > 0 ? o.upper[j] : -o.lower[j];
    const auto same = [](double a, double b) { return a == b || std::abs(a - b) < kSameCost * (1 + std::abs(a)); };
    if (!same(lower[i], low) || !same(upper[i], high)) return std::numeric_limits<double>::infinity();
    return std::abs(values[i] - sign * o.values[j]) / (1 + std::abs(values[i]));
  }
};

}  // namespace

HalfCycle::HalfCycle(const RobotProblem& whole, MirroredRobot robot, const SE3& G)
    : whole_(&whole), robot_(std::move(robot)), G_(G) {
  const VectorXd& x0 = whole.initialState();
  const Model& model = whole.model();
  problem_ = std::make_shared<RobotProblem>(model, x0.head(model.nq()), x0.segment(model.nq(), model.nv()),
                                            listStages(whole), whole.formulation());
}

std::optional<HalfCycle> HalfCycle::find(const Motion& motion, std::string& why) {
  const RobotProblem& whole = *motion.problem;
  const int N = whole.numStages(), h = N / 2;
  std::vector<int> feet;
  for (const ContactPhase& phase : motion.schedule.phases)
    for (const ContactTarget& foot : phase.contacts)
      if (std::find(feet.begin(), feet.end(), foot.contact) == feet.end()) feet.push_back(foot.contact);
  if (feet.size() != 2 || N % 2 != 0) {
    why = "its steps are not alternately those of two feet";
    return {};
  }
  std::optional<MirroredRobot> robot = MirroredRobot::find(whole.model(), feet[0], feet[1], why);
  if (!robot) return {};
  const std::optional<SE3> G = findReflection(motion, *robot, h);
  const auto is_same = [](const SE3& a, const SE3& b) {
    return (a.R - b.R).norm() < kSameStep && (a.p - b.p).norm() < kSameStep;
  };
  if (!G || !is_same(*G * *G, *motion.cycle)) {
    why = "no step is the mirror image of the other";
    return {};
  }
  HalfCycle half(whole, std::move(*robot), *G);
  if (!half.compare(motion.guess, why)) return {};
  return half;
}

bool HalfCycle::compare(const ShootingTrajectory& guess, std::string& why) {
  const RobotProblem& whole = *whole_;
  const int N = whole.numStages(), h = N / 2;
  RobotEvaluator evaluator(whole);
  const auto refuse = [&](int k, const std::string& what) {
    why = what + " at stage " + formatNumber(k) + " of the " + formatNumber(h) + " of a step";
    return false;
  };
  const auto match = [&](const Rows& image, const std::vector<std::pair<int, Rows>>& sources, int at) {
    std::vector<Row> rows;
    std::vector<std::vector<char>> taken;
    for (const auto& source : sources) taken.emplace_back(source.second.values.size(), false);
    for (Eigen::Index i = 0; i < image.values.size(); ++i) {
      double nearest = kSameCost;
      size_t from = 0;
      Row best{-1};
      for (size_t s = 0; s < sources.size(); ++s)
        for (Eigen::Index j = 0; j < sources[s].second.values.size(); ++j)
          for (double sign : {1.0, -1.0}) {
            const double off = taken[s][static_cast<size_t>(j)] ? 1 : image.compare(i, sources[s].second, j, sign);
            if (off < nearest) nearest = off, from = s, best = {sources[s].first, static_cast<int>(j), sign};
          }
      if (best.node < 0) return refuse(at - h, whole.getConstraintName(at, static_cast<int>(i)) + " differs");
      taken[from][static_cast<size_t>(best.row)] = true;
      rows.push_back(best);
    }
    rows_.push_back(std::move(rows));
    return true;
  };
  constexpr double kBeside = 0.02;  // rad, m, rad/s, m/s; of torques over those of the guess, or N m
  for (int k = 0; k < h; ++k) {
    evaluator.evaluate(k, guess.xs[static_cast<size_t>(k)], guess.us[static_cast<size_t>(k)]);
    const VectorXd x = evaluator.integrate(makeDeviation(whole.tangentSize(k), k, kBeside));
    const VectorXd u = guess.us[static_cast<size_t>(k)] + makeDeviation(whole.controlSize(k), k, 1);
    const RobotEvaluation& at = evaluator.evaluate(k, x, u);
    if (at.status != NumericalStatus::Ok) return refuse(k, "the guess cannot be evaluated");
    const double cost = at.cost;
    const VectorXd next = mapState(at.x_next), mirrored = mapState(x);
    std::vector<std::pair<int, Rows>> sources{{k, Rows(whole, k, at.constraints)}};
    VectorXd lower(u.size()), upper(u.size()), low(u.size()), high(u.size());
    whole.getControlBounds(k, lower, upper);
    whole.getControlBounds(k + h, low, high);
    const VectorXd a = robot_.mapTorques(lower), b = robot_.mapTorques(upper);
    if (a.cwiseMin(b) != low || a.cwiseMax(b) != high) return refuse(k, "the limits of torques differ");
    if (k == 0) sources.emplace_back(h, Rows(whole, N, evaluator.evaluate(N, mirrored).constraints));
    const RobotEvaluation& image = evaluator.evaluate(k + h, mirrored, robot_.mapTorques(u));
    if (image.status != NumericalStatus::Ok || !(calcStateDistance(whole.model(), next, image.x_next) < kSameStep))
      return refuse(k, "accelerations differ");
    if (!(std::abs(image.cost - cost) < kSameCost * (1 + cost))) return refuse(k, "costs differ");
    if (!match(Rows(whole, k + h, image.constraints), sources, k + h)) return false;
  }
  evaluator.evaluate(N, guess.xs[static_cast<size_t>(h)]);
  const VectorXd x = evaluator.integrate(makeDeviation(whole.tangentSize(N), h, kBeside));
  const Rows end(whole, N, evaluator.evaluate(N, x).constraints);
  return match(Rows(whole, N, evaluator.evaluate(N, mapState(x)).constraints), {{h, end}}, N);
}

MatrixXd HalfCycle::differentiateMap(const VectorXd& x) const {
  const int h = problem_->numStages();
  RobotEvaluator from(*problem_), to(*whole_);
  from.evaluate(h, x);
  to.evaluate(whole_->numStages(), mapState(x));
  return bielle::differentiateMap([this](const VectorXd& state) { return mapState(state); }, problem_->tangentSize(h),
                                  from, to);
}

StartingPoint HalfCycle::take(const StartingPoint& start) const {
  const int h = problem_->numStages(), n = problem_->tangentSize(h);
  StartingPoint half;
  half.trajectory.xs.assign(start.trajectory.xs.begin(), start.trajectory.xs.begin() + h + 1);
  half.trajectory.us.assign(start.trajectory.us.begin(), start.trajectory.us.begin() + h);
  const std::vector<VectorXd>& values = start.multipliers.values;
  const int rows = problem_->constraintSize(h);
  if (values.size() != static_cast<size_t>(2 * h + 1) || values.back().size() != rows + n) return half;
  half.multipliers = {{values.begin(), values.begin() + h}, start.multipliers.penalty};
  VectorXd last(rows + n);
  for (int i = 0; i < rows; ++i) last[rows_.back()[i].row] = rows_.back()[i].sign * values.back()[i];
  last.tail(n) = differentiateMap(half.trajectory.xs.back()).transpose() * values.back().tail(n);
  half.multipliers.values.push_back(std::move(last));
  return half;
}

ShootingTrajectory HalfCycle::unfold(const ShootingTrajectory& half) const {
  ShootingTrajectory whole = half;
  for (size_t k = 1; k < half.xs.size(); ++k) whole.xs.push_back(mapState(half.xs[k]));
  for (const VectorXd& u : half.us) whole.us.push_back(robot_.mapTorques(u));
  return whole;
}

Multipliers HalfCycle::unfold(const ShootingTrajectory& half, const Multipliers& multipliers) const {
  const int n = problem_->tangentSize(problem_->numStages());
  Multipliers whole = multipliers;
  whole.values.pop_back();
  for (const std::vector<Row>& rows : rows_) {
    whole.values.emplace_back(rows.size());
    for (size_t i = 0; i < rows.size(); ++i)
      whole.values.back()[static_cast<Eigen::Index>(i)] =
          rows[i].sign * multipliers.values[static_cast<size_t>(rows[i].node)][rows[i].row];
  }
  VectorXd& last = whole.values.back();
  last.conservativeResize(last.size() + n);
  last.tail(n) = differentiateMap(half.xs.back()).transpose().fullPivLu().solve(multipliers.values.back().tail(n));
  return whole;
}

}  // namespace bielle
