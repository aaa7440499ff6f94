#include "design/followed_optimum.h"

#include <algorithm>
#include <stdexcept>

#include "design/optimum_path.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr double kPenalty = 1e5;  // in the unit of the cost over that of c squared

class Follower {
 public:
  Follower(const ShootingProblem& problem, ShootingTrajectory start, const Multipliers& multipliers)
      : problem_(problem),
        N_(problem.numStages()),
        penalty_(std::max(kPenalty, multipliers.penalty)),
        y_(multipliers.values),
        z_(std::move(start)),
        at_(makeEvaluations(problem, N_ + 1)),
        scratch_(problem.makeScratch()) {
    if (y_.empty()) y_.resize(N_ + 1);
  }

  // Eq. (2)
  bool step() {
    if (!evaluate()) return false;
    std::vector<ConstraintWeights> weights;
    for (int k = 0; k <= N_; ++k)
      weights.push_back(makeActiveWeights(problem_, k, y_[k], at_[k]->constraints, penalty_));
    const std::vector<StageModel> models = linearizeNodes(problem_, at_, scratch_.get());
    if (sweepNodes(problem_, models, weights, z_.us, sweep_, dx_, du_) != NumericalStatus::Ok) return false;
    std::vector<IntegrateTask> tasks;
    std::vector<VectorXd> xs(z_.xs);
    for (int k = 0; k <= N_; ++k) {
      tasks.push_back({k, at_[k].get(), &dx_[k], &xs[k]});
      if (k < N_) z_.us[k] += du_[k];
    }
    problem_.integrate(tasks.data(), N_ + 1, scratch_.get());
    z_.xs = std::move(xs);
    return std::all_of(z_.xs.begin(), z_.xs.end(), [](const VectorXd& x) { return x.allFinite(); });
  }

  const ShootingTrajectory& get() const { return z_; }

 private:
  bool evaluate() {
    std::vector<EvaluateTask> tasks;
    for (int k = 0; k <= N_; ++k) tasks.push_back({k, &z_.xs[k], k < N_ ? &z_.us[k] : nullptr, nullptr, at_[k].get()});
    problem_.evaluate(tasks.data(), N_ + 1, scratch_.get());
    return allOk(at_, N_ + 1);
  }

  const ShootingProblem& problem_;
  int N_;
  double penalty_;
  std::vector<VectorXd> y_;
  ShootingTrajectory z_;
  EvaluationList at_;
  std::unique_ptr<ProblemScratch> scratch_;
  LqSweep sweep_;
  std::vector<VectorXd> dx_, du_;
};

// About the path of a changed problem; null where it cannot follow.
std::unique_ptr<Follower> startFollower(const ShootingProblem& problem, const ShootingTrajectory& optimum,
                                        const Multipliers& multipliers, const ShootingProblem& changed) {
  requireSameSizes(problem, changed);
  std::optional<ShootingTrajectory> path = calcPath(problem, optimum, changed);
  return path ? std::make_unique<Follower>(changed, std::move(*path), multipliers) : nullptr;
}

// Eq. (4) of s_0 .. s_n, n > 0, with its residual.
OptimumDerivative extrapolate(const std::vector<VectorXd>& s) {
  const Eigen::Index n = static_cast<Eigen::Index>(s.size()) - 1;
  MatrixXd steps(s[0].size(), n), ends(s[0].size(), n);
  for (Eigen::Index j = 0; j < n; ++j) ends.col(j) = s[j + 1], steps.col(j) = s[j + 1] - s[j];
  // The last weight is what the others leave of 1.
  VectorXd g = VectorXd::Ones(n);
  if (n > 1) {
    const MatrixXd others = steps.leftCols(n - 1).colwise() - steps.col(n - 1);
    g.head(n - 1) = -others.colPivHouseholderQr().solve(steps.col(n - 1));
    g[n - 1] = 1 - g.head(n - 1).sum();
  }
  OptimumDerivative out{ends * g, static_cast<int>(n), 0};
  const double size = out.value.norm();
  out.residual = size > 0 ? (steps * g).norm() / size : 0;
  return out;
}

}  // namespace

std::optional<ShootingTrajectory> followOptimum(const ShootingProblem& problem, const ShootingTrajectory& optimum,
                                                const Multipliers& multipliers, const ShootingProblem& changed,
                                                int sweeps) {
  const std::unique_ptr<Follower> follower = startFollower(problem, optimum, multipliers, changed);
  if (!follower) return {};
  for (int i = 0; i < sweeps; ++i)
    if (!follower->step()) return {};
  return follower->get();
}

struct FollowedOptimum::Data {
  const ShootingProblem& problem;
  ShootingTrajectory optimum;
  Multipliers multipliers;
  const ShootingProblem& here;
  OptimumReader read;
  std::unique_ptr<Follower> follower;  // of `here`
  std::vector<VectorXd> numbers;       // after 0, 1, ... sweeps of it

  // After so many sweeps; null where it cannot be followed.
  const VectorXd* get(size_t sweeps) {
    if (!follower) {
      follower = startFollower(problem, optimum, multipliers, here);
      if (!follower) return nullptr;
      numbers = {read(follower->get())};
    }
    while (numbers.size() <= sweeps) {
      if (!follower->step()) return nullptr;
      numbers.push_back(read(follower->get()));
    }
    return &numbers[sweeps];
  }
};

FollowedOptimum::FollowedOptimum(const ShootingProblem& problem, const ShootingTrajectory& optimum,
                                 const Multipliers& multipliers, const ShootingProblem& here, OptimumReader read)
    : data_(new Data{problem, optimum, multipliers, here, std::move(read), {}, {}}) {}
FollowedOptimum::~FollowedOptimum() = default;
FollowedOptimum::FollowedOptimum(FollowedOptimum&&) noexcept = default;

std::optional<OptimumDerivative> FollowedOptimum::differentiate(const ShootingProblem& changed, double step,
                                                                const OptimumReader& read) {
  const std::unique_ptr<Follower> to = startFollower(data_->problem, data_->optimum, data_->multipliers, changed);
  if (!to) return {};
  std::vector<VectorXd> s;
  const auto add = [&] {
    const VectorXd* from = data_->get(s.size());
    if (from) s.push_back((read(to->get()) - *from) / step);
    return from != nullptr;
  };
  if (!add()) return {};
  OptimumDerivative out;
  do {
    if (!to->step() || !add()) return {};
    out = extrapolate(s);
  } while (out.residual > kFollowTolerance && out.sweeps < kMostSweeps);
  return out;
}

}  // namespace bielle
