#include "bielle/ocp/followed_optimum.h"

#include <algorithm>
#include <stdexcept>

#include "ocp/optimum_path.h"

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
    const std::vector<StageModel> models = linearizeNodes(problem_, at_, weights, scratch_.get());
    if (sweepNodes(problem_, models, z_.us, sweep_, dx_, du_) != LqStatus::Ok) return false;
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

  ShootingTrajectory take() { return std::move(z_); }

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

}  // namespace

std::optional<ShootingTrajectory> followOptimum(const ShootingProblem& problem, const ShootingTrajectory& optimum,
                                                const Multipliers& multipliers, const ShootingProblem& changed,
                                                int sweeps) {
  requireSameSizes(problem, changed);
  std::optional<ShootingTrajectory> path = calcPath(problem, optimum, changed);
  if (!path) return {};
  Follower follower(changed, std::move(*path), multipliers);
  for (int i = 0; i < sweeps; ++i)
    if (!follower.step()) return {};
  return follower.take();
}

}  // namespace bielle
