#include "solve/peak_problem.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace bielle {
namespace {

constexpr double kLeastShare = 1e-6;  // of the limits: (2) must stay invertible

}  // namespace

PeakProblem::PeakProblem(const ShootingProblem& inner, const VectorXd& limits, double weight, double most)
    : WrappedProblem(inner, 0, 1), limits_(limits), weight_(weight), most_(most) {
  if (!(limits.array() > 0).all() || !limits.array().isFinite().any())
    throw std::invalid_argument("PeakProblem: limits must be positive, and one of them finite");
  if (!(weight > 0 && std::isfinite(weight) && most > kLeastShare))
    throw std::invalid_argument("PeakProblem: weight and largest share must be positive");
  start_[inner.stateSize()] = 1;
}

void PeakProblem::getControlBounds(int stage, VectorRef lower, VectorRef upper) const {
  const int nu = inner_.controlSize(stage);
  inner_.getControlBounds(stage, lower.head(nu), upper.head(nu));
  for (int i = 0; i < nu; ++i)
    if (counts(i)) lower[i] = -1, upper[i] = 1;
  if (stage > 0) return;
  lower[nu] = kLeastShare;
  upper[nu] = most_;
}

// Eq. (2)
void PeakProblem::setControls(int node, WrappedEvaluation& at) const {
  const int nu = inner_.controlSize(node);
  const double share = getShare(node, at.x, at.u);
  at.inner->u = at.u.head(nu);
  for (int i = 0; i < nu; ++i) at.inner->u[i] *= getFactor(i, share);
}

void PeakProblem::finish(int node, WrappedEvaluation& at, ProblemScratch*) const {
  if (node == numStages()) return;
  const int nx = inner_.stateSize();
  const double share = getShare(node, at.x, at.u);
  if (node == 0) at.cost += weight_ * share * share;
  at.x_next.resize(nx + 1);
  if (at.inner->x_next.size() == nx) at.x_next.head(nx) = at.inner->x_next;
  at.x_next[nx] = share;
}

// In the order of (2): controls, with s after them at the first stage, and tangents, with s after them at other nodes.
void PeakProblem::setModel(LinearizeTask& task, const StageModel* model, ProblemScratch*) const {
  const int node = task.node;
  const NodeEvaluation& at = *task.at;
  const StageModel& inner = *model;
  StageModel& out = *task.out;
  const Eigen::Index nu = inner.lu.size(), ndx = inner.lx.size(), n = inner.gap.size();
  const Eigen::Index first_x = node > 0 ? nu : nu + 1, s = node > 0 ? nu + ndx : nu;
  const bool running = node < numStages();
  const double share = running ? getShare(node, at.x, at.u) : 0;
  out.cost = at.cost;
  out.lx.head(ndx) = inner.lx;
  double& slope = node > 0 ? out.lx[ndx] : out.lu[nu];
  slope = running && node == 0 ? 2 * weight_ * share : 0;
  for (Eigen::Index i = 0; i < nu; ++i) {
    out.lu[i] = getFactor(i, share) * inner.lu[i];
    if (counts(i)) slope += limits_[i] * at.u[i] * inner.lu[i];
  }
  setHessian(node, at, inner, out);
  const auto transform = [&](ConstMatrixMap from, auto&& to) {
    to.middleRows(first_x, ndx) = from.bottomRows(ndx);
    to.row(s).setZero();
    for (Eigen::Index i = 0; i < nu; ++i) {
      to.row(i) = getFactor(i, share) * from.row(i);
      if (counts(i)) to.row(s) += limits_[i] * at.u[i] * from.row(i);
    }
  };
  transform(inner.Ct(), out.Ct());
  if (!running) return;
  MatrixMap Ft = out.Ft();
  transform(inner.Ft(), Ft.leftCols(n));
  Ft.col(n).setZero();
  Ft(s, n) = 1;
  out.gap.head(n) = inner.gap;
  out.gap[n] = share - task.next->x[task.next->x.size() - 1];
}

void PeakProblem::setHessian(int node, const NodeEvaluation& at, const StageModel& inner, StageModel& out) const {
  const Eigen::Index nu = inner.lu.size(), ndx = inner.lx.size(), s = node > 0 ? nu + ndx : nu;
  const Eigen::Index first_x = node > 0 ? nu : nu + 1;
  const double share = node < numStages() ? getShare(node, at.x, at.u) : 0;
  const ConstMatrixMap from = inner.hessian();
  MatrixMap to = out.hessian();
  const auto getPlace = [&](Eigen::Index j) { return j < nu ? j : j - nu + first_x; };
  for (Eigen::Index j = 0; j < nu + ndx; ++j) {
    const double factor = j < nu ? getFactor(j, share) : 1;
    double by_share = 0;
    for (Eigen::Index i = 0; i < nu; ++i)
      if (counts(i)) by_share += limits_[i] * at.u[i] * from(std::max(i, j), std::min(i, j));
    to(std::max(s, getPlace(j)), std::min(s, getPlace(j))) = by_share * factor;
    for (Eigen::Index i = j; i < nu + ndx; ++i)
      to(getPlace(i), getPlace(j)) = factor * (i < nu ? getFactor(i, share) : 1) * from(i, j);
  }
  double curvature = node == 0 ? 2 * weight_ : 0;
  for (Eigen::Index i = 0; i < nu; ++i)
    for (Eigen::Index j = 0; j < nu; ++j)
      if (counts(i) && counts(j))
        curvature += limits_[i] * at.u[i] * limits_[j] * at.u[j] * from(std::max(i, j), std::min(i, j));
  to(s, s) = curvature;
}

double PeakProblem::calcPeak(const ShootingTrajectory& inner) const {
  double peak = 0;
  for (const VectorXd& u : inner.us)
    for (Eigen::Index i = 0; i < limits_.size(); ++i) peak = std::max(peak, std::abs(u[i]) / limits_[i]);
  return peak;
}

ShootingTrajectory PeakProblem::wrap(const ShootingTrajectory& inner) const {
  const double share = std::clamp(calcPeak(inner), kLeastShare, most_);
  ShootingTrajectory out = inner;
  for (size_t k = 0; k < out.xs.size(); ++k) {
    VectorXd& x = out.xs[k];
    x.conservativeResize(x.size() + 1);
    x[x.size() - 1] = k > 0 ? share : 1;
  }
  for (VectorXd& u : out.us)
    for (Eigen::Index i = 0; i < limits_.size(); ++i) u[i] /= getFactor(i, share);
  VectorXd& first = out.us.front();
  first.conservativeResize(first.size() + 1);
  first[first.size() - 1] = share;
  return out;
}

ShootingTrajectory PeakProblem::unwrap(const ShootingTrajectory& trajectory) const {
  ShootingTrajectory out = trajectory;
  for (size_t k = 0; k < out.us.size(); ++k) {
    const double share = getShare(static_cast<int>(k), trajectory.xs[k], trajectory.us[k]);
    out.us[k].conservativeResize(inner_.controlSize(static_cast<int>(k)));
    for (Eigen::Index i = 0; i < limits_.size(); ++i) out.us[k][i] *= getFactor(i, share);
  }
  for (VectorXd& x : out.xs) x.conservativeResize(inner_.stateSize());
  return out;
}

}  // namespace bielle
