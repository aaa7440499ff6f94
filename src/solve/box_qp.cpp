#include "solve/box_qp.h"

#include <limits>

#include "math/decompositions.h"

namespace bielle {

namespace {

constexpr int kMaxIterations = 100;
constexpr double kArmijo = 0.1;
constexpr double kShrink = 0.6;
constexpr double kMinStep = 1e-20;
// A free gradient this small, relative to the terms it is the sum of, is rounding.
constexpr double kTolerance = 4 * std::numeric_limits<double>::epsilon();
// Largest relative gradient still accepted where rounding under an ill-conditioned Hessian ends the search.
constexpr double kAcceptable = 1e-9;

}  // namespace

NumericalStatus BoxQp::solve(ConstMatrixRef H, ConstVectorRef g, ConstVectorRef lower, ConstVectorRef upper,
                             VectorRef d) {
  const int n = static_cast<int>(g.size());
  num_free_ = 0;
  if (n == 0) return NumericalStatus::Ok;
  if (static_cast<int>(free_.size()) < n) {
    free_.resize(n);
    factor_.resize(n, n);
    free_step_.resize(n);
    columns_.resize(n, 5);
  }
  auto r = columns_.col(0).head(n), s = columns_.col(1).head(n), trial = columns_.col(2).head(n);
  auto move = columns_.col(3).head(n), H_move = columns_.col(4).head(n);
  const auto H_sym = H.selfadjointView<Eigen::Lower>();
  const double largest_H = H.diagonal().cwiseAbs().maxCoeff(), largest_g = g.cwiseAbs().maxCoeff();

  d = d.cwiseMax(lower).cwiseMin(upper);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    r = g;
    r.noalias() += H_sym * d;
    if (!r.allFinite()) return NumericalStatus::NotConverged;
    const bool same_set = updateFreeSet(r, d, lower, upper);
    if ((iteration == 0 || !same_set) && !factorize(H)) return NumericalStatus::Indefinite;
    double free_gradient = 0;
    for (int i = 0; i < num_free_; ++i) free_gradient = std::max(free_gradient, std::abs(r[free_[i]]));
    const double scale = largest_g + n * largest_H * d.cwiseAbs().maxCoeff();
    if (free_gradient <= kTolerance * scale) return NumericalStatus::Ok;

    calcNewtonStep(r, s);
    for (double t = 1;; t *= kShrink) {  // Eq. (3), the decrease computed from the move: no cancellation
      trial = (d + t * s).cwiseMax(lower).cwiseMin(upper);
      move = trial - d;
      H_move.noalias() = H_sym * move;
      const double slope = r.dot(move);
      if (-slope - 0.5 * move.dot(H_move) >= -kArmijo * slope) break;
      if (t < kMinStep)
        return free_gradient <= kAcceptable * scale ? NumericalStatus::Ok : NumericalStatus::NotConverged;
    }
    d = trial;
  }
  return NumericalStatus::NotConverged;
}

// Eq. (2). Returns whether the set is the one of the last call.
bool BoxQp::updateFreeSet(ConstVectorRef r, ConstVectorRef d, ConstVectorRef lower, ConstVectorRef upper) {
  int count = 0;
  bool same = true;
  for (int i = 0; i < static_cast<int>(d.size()); ++i) {
    const bool clamped = (d[i] <= lower[i] && r[i] > 0) || (d[i] >= upper[i] && r[i] < 0) || lower[i] == upper[i];
    if (clamped) continue;
    same = same && count < num_free_ && free_[count] == i;
    free_[count++] = i;
  }
  same = same && count == num_free_;
  num_free_ = count;
  return same;
}

bool BoxQp::factorize(ConstMatrixRef H) {
  for (int j = 0; j < num_free_; ++j) {
    for (int i = j; i < num_free_; ++i) factor_(i, j) = H(free_[i], free_[j]);
  }
  Eigen::Ref<MatrixXd> block = factor_.topLeftCorner(num_free_, num_free_);
  return Eigen::LLT<Eigen::Ref<MatrixXd>>(block).info() == Eigen::Success;
}

void BoxQp::calcNewtonStep(ConstVectorRef r, VectorRef step) {
  auto s = free_step_.head(num_free_);
  for (int i = 0; i < num_free_; ++i) s[i] = -r[free_[i]];
  const auto L = freeFactor();
  L.triangularView<Eigen::Lower>().solveInPlace(s);
  L.triangularView<Eigen::Lower>().transpose().solveInPlace(s);
  step.setZero();
  for (int i = 0; i < num_free_; ++i) step[free_[i]] = s[i];
}

}  // namespace bielle
