#include "solve/slack_barrier.h"

#include <algorithm>
#include <cmath>

#include "bielle/solve/shooting_problem.h"

namespace bielle {

namespace {

// A step may use up kBoundary of a multiplier, and of a slack as well, unless this is then below mu / (kBarrierFall y); always half of it.
constexpr double kBoundary = 0.995, kBarrierFall = 2, kBarrierHalf = 0.5;
constexpr double kFirstSlack = 1;  // least, in the units of c, in which a violation of 1 is a large one
constexpr double kCentrality = 2;  // largest ratio of y s and mu, and its inverse

}  // namespace

void SlackBarrier::resize(size_t num_nodes) {
  nodes_.resize(num_nodes);
  size_ = 0;
}

void SlackBarrier::setBounds(int node, const VectorXd& lower, const VectorXd& upper) {
  std::vector<Side>& sides = nodes_[node];
  sides.clear();
  for (Eigen::Index i = 0; i < lower.size(); ++i) {
    if (lower[i] == upper[i]) continue;
    if (std::isfinite(lower[i])) sides.push_back({static_cast<int>(i), -1, lower[i]});
    if (std::isfinite(upper[i])) sides.push_back({static_cast<int>(i), 1, upper[i]});
  }
  size_ += static_cast<int>(sides.size());
}

// Eq. (15)
double SlackBarrier::Side::calcSlack(double excess, double alpha, double mu) const {
  const double least = std::max((1 - kBoundary) * s, std::min(kBarrierHalf * s, mu / (kBarrierFall * y)));
  return std::max((1 - alpha) * gap - excess, least);
}

void SlackBarrier::start(int node, const VectorXd& c, const VectorXd& multipliers) {
  for (Side& side : nodes_[node]) {
    const double excess = side.calcExcess(c);
    side.s = std::max(-excess, kFirstSlack);
    side.gap = excess + side.s;
    side.y = std::max(mu_ / side.s, side.sign * multipliers[side.row]);
  }
}

void SlackBarrier::step(int node, const VectorXd& c, double alpha) {
  for (Side& side : nodes_[node]) {
    const double excess = side.calcExcess(c), h = side.y / side.s, dc = excess - (side.gap - side.s);
    const double y = side.y + alpha * (mu_ / side.s - side.y + h * side.gap) + h * dc;  // Eq. (16)
    side.s = side.calcSlack(excess, alpha, mu_);
    side.gap = excess + side.s;
    side.y =
        std::clamp(std::max(y, (1 - kBoundary) * side.y), mu_ / (kCentrality * side.s), kCentrality * mu_ / side.s);
  }
}

double SlackBarrier::calc(int node, const VectorXd& c, double alpha) const {
  double out = 0;
  for (const Side& side : nodes_[node]) {
    const double excess = side.calcExcess(c), s = side.calcSlack(excess, alpha, mu_);
    out += weight_ * side.y * (excess + s) - mu_ * std::log(s);
  }
  return out;
}

void SlackBarrier::addWeights(int node, ConstraintWeights& weights, VectorXd& multipliers, Measures& measures) const {
  for (const Side& side : nodes_[node]) {
    const double h = side.y / side.s;
    weights.gradient[side.row] += side.sign * (mu_ / side.s + h * side.gap);
    weights.hessian[side.row] += h;
    multipliers[side.row] += side.sign * side.y;
    measures.value -= mu_ * std::log(side.s);
    measures.gap += side.y * side.gap;
    measures.largest_gap = std::max(measures.largest_gap, side.gap);
    measures.offset += mu_ / side.s * side.gap + 0.5 * h * side.gap * side.gap;
    measures.complementarity = std::max(measures.complementarity, side.y * side.s);
  }
}

}  // namespace bielle
