#include "solve/peak_problem.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "solve/wrapped_problem.h"

namespace bielle {
namespace {

constexpr double kLeastShare = 1e-6;  // of the limits: (2) must stay invertible

}  // namespace

PeakProblem::PeakProblem(const ShootingProblem& inner, const VectorXd& limits, double weight, double most)
    : inner_(inner), limits_(limits), weight_(weight), most_(most) {
  if (!(limits.array() > 0).all() || !limits.array().isFinite().any())
    throw std::invalid_argument("PeakProblem: limits must be positive, and one of them finite");
  if (!(weight > 0 && std::isfinite(weight) && most > kLeastShare))
    throw std::invalid_argument("PeakProblem: weight and largest share must be positive");
  x0_.setOnes(stateSize());
  x0_.head(inner.stateSize()) = inner.initialState();
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

std::unique_ptr<NodeEvaluation> PeakProblem::makeEvaluation() const { return wrapEvaluation(inner_); }

std::unique_ptr<ProblemScratch> PeakProblem::makeScratch() const {
  auto out = std::make_unique<WrappedScratch>(inner_);
  const int size = batchSize();
  out->evaluations.reserve(size);
  out->linearizations.reserve(size);
  out->integrations.reserve(size);
  out->differences.reserve(size);
  for (int k = 0; k <= numStages(); ++k) {  // a whole batch of each size
    const bool running = k < numStages();
    const int ndx = inner_.tangentSize(k), nu = running ? inner_.controlSize(k) : 0;
    out->models.takeBack();
    out->vectors.takeBack();
    for (int i = 0; i < size; ++i) {
      out->takeModel(ndx, nu, running ? inner_.tangentSize(k + 1) : 0, inner_.constraintSize(k));
      out->takeVector(ndx);
      out->takeVector(inner_.stateSize());
    }
  }
  return out;
}

void PeakProblem::evaluate(EvaluateTask* tasks, int count, ProblemScratch* memory) const {
  auto& scratch = static_cast<WrappedScratch&>(*memory);
  std::vector<EvaluateTask>& inner = scratch.evaluations;
  inner.resize(count);
  const int nx = inner_.stateSize();
  for (int i = 0; i < count; ++i) {
    const EvaluateTask& task = tasks[i];
    auto& at = static_cast<WrappedEvaluation&>(*task.out);
    at.x = *task.x;
    at.inner->x = at.x.head(nx);
    if (task.node < numStages()) {
      at.u = *task.u;
      const int nu = inner_.controlSize(task.node);
      const double share = getShare(task.node, at.x, at.u);
      at.inner->u = at.u.head(nu);
      for (int j = 0; j < nu; ++j) at.inner->u[j] *= getFactor(j, share);
    }
    inner[i] = {task.node, &at.inner->x, &at.inner->u, getInner(task.previous), at.inner.get()};
  }
  inner_.evaluate(inner.data(), count, scratch.inner.get());
  for (int i = 0; i < count; ++i) {
    auto& at = static_cast<WrappedEvaluation&>(*tasks[i].out);
    at.status = at.inner->status;
    at.failure = at.inner->failure;
    at.cost = at.inner->cost;
    at.constraints = at.inner->constraints;
    if (tasks[i].node == numStages()) continue;
    const double share = getShare(tasks[i].node, at.x, at.u);
    if (tasks[i].node == 0) at.cost += weight_ * share * share;
    at.x_next.resize(nx + 1);
    if (at.inner->x_next.size() == nx) at.x_next.head(nx) = at.inner->x_next;
    at.x_next[nx] = share;
  }
}

void PeakProblem::linearize(LinearizeTask* tasks, int count, ProblemScratch* memory) const {
  auto& scratch = static_cast<WrappedScratch&>(*memory);
  std::vector<LinearizeTask>& inner = scratch.linearizations;
  inner.resize(count);
  scratch.models.takeBack();
  for (int i = 0; i < count; ++i) {
    const int node = tasks[i].node;
    const bool running = node < numStages();
    const int ndx = inner_.tangentSize(node), nu = running ? inner_.controlSize(node) : 0;
    const int ndx_next = running ? inner_.tangentSize(node + 1) : 0;
    inner[i].node = node;
    inner[i].at = getInner(tasks[i].at);
    inner[i].next = getInner(tasks[i].next);
    inner[i].rows = tasks[i].rows;
    inner[i].out = &scratch.takeModel(ndx, nu, ndx_next, inner_.constraintSize(node));
    inner[i].status = NumericalStatus::Failed;
    inner[i].failure.clear();
  }
  inner_.linearize(inner.data(), count, scratch.inner.get());
  for (int i = 0; i < count; ++i) {
    tasks[i].status = inner[i].status;
    tasks[i].failure = inner[i].failure;
    if (inner[i].status == NumericalStatus::Ok)
      setModel(tasks[i].node, *tasks[i].at, tasks[i].next, *inner[i].out, *tasks[i].out);
  }
}

// In the order of (2): controls, with s after them at the first stage, and tangents, with s after them at other nodes.
void PeakProblem::setModel(int node, const NodeEvaluation& at, const NodeEvaluation* next, const StageModel& inner,
                           StageModel& out) const {
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
  out.gap[n] = share - next->x[next->x.size() - 1];
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

void PeakProblem::integrate(const IntegrateTask* tasks, int count, ProblemScratch* memory) const {
  auto& scratch = static_cast<WrappedScratch&>(*memory);
  std::vector<IntegrateTask>& inner = scratch.integrations;
  inner.resize(count);
  scratch.vectors.takeBack();
  const int nx = inner_.stateSize();
  for (int i = 0; i < count; ++i) {
    VectorXd& dx = scratch.takeVector(inner_.tangentSize(tasks[i].node));
    dx = tasks[i].dx->head(dx.size());
    inner[i] = {tasks[i].node, getInner(tasks[i].at), &dx, &scratch.takeVector(nx)};
  }
  inner_.integrate(inner.data(), count, scratch.inner.get());
  for (int i = 0; i < count; ++i) {
    tasks[i].x_out->head(nx) = *inner[i].x_out;
    const VectorXd& dx = *tasks[i].dx;
    (*tasks[i].x_out)[nx] = tasks[i].at->x[nx] + (tasks[i].node > 0 ? dx[dx.size() - 1] : 0);
  }
}

void PeakProblem::difference(const DifferenceTask* tasks, int count, ProblemScratch* memory) const {
  auto& scratch = static_cast<WrappedScratch&>(*memory);
  std::vector<DifferenceTask>& inner = scratch.differences;
  inner.resize(count);
  scratch.vectors.takeBack();
  const int nx = inner_.stateSize();
  for (int i = 0; i < count; ++i) {
    VectorXd& x1 = scratch.takeVector(nx);
    x1 = tasks[i].x1->head(nx);
    inner[i] = {tasks[i].node, getInner(tasks[i].at), &x1, &scratch.takeVector(inner_.tangentSize(tasks[i].node))};
  }
  inner_.difference(inner.data(), count, scratch.inner.get());
  for (int i = 0; i < count; ++i) {
    const Eigen::Index ndx = inner[i].dx->size();
    tasks[i].dx->head(ndx) = *inner[i].dx;
    if (tasks[i].node > 0) (*tasks[i].dx)[ndx] = (*tasks[i].x1)[nx] - tasks[i].at->x[nx];
  }
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
