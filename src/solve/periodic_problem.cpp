#include "solve/periodic_problem.h"

#include <array>
#include <limits>
#include <stdexcept>
#include <utility>

namespace bielle {
namespace {

// Of rows of (3), over which they are compared with other constraints: a hundredth of a rad, m, rad/s or m/s is much of them. With 1
// cycles take half as many iterations more, with 10 to 100 about the same number.
constexpr double kClosingScale = 100;

}  // namespace

PeriodicProblem::PeriodicProblem(const ShootingProblem& inner, StateMap map)
    : WrappedProblem(inner, 1, inner.tangentSize(0)), map_(std::move(map)), n_(inner.tangentSize(0)) {
  const int N = inner.numStages();
  if (inner.tangentSize(N) != n_)
    throw std::invalid_argument("PeriodicProblem: first and last node have tangent spaces of different size");
  start_.tail(n_).setZero();
  reference_ = inner.makeEvaluation();
  const VectorXd u = VectorXd::Zero(inner.controlSize(0));
  EvaluateTask task{0, &inner.initialState(), &u, nullptr, reference_.get()};
  inner.evaluate(&task, 1, inner.makeScratch().get());
  if (reference_->status != NumericalStatus::Ok)
    throw std::invalid_argument("PeriodicProblem: the initial state cannot be evaluated: " + reference_->failure);
}

void PeriodicProblem::getControlBounds(int stage, VectorRef lower, VectorRef upper) const {
  if (stage > 0) return inner_.getControlBounds(stage - 1, lower, upper);
  upper.setConstant(std::numeric_limits<double>::infinity());
  lower = -upper;
}

int PeriodicProblem::constraintSize(int node) const {
  return node == 0 ? 0 : inner_.constraintSize(node - 1) + (node == numStages() ? n_ : 0);
}

void PeriodicProblem::getConstraintBounds(int node, VectorRef lower, VectorRef upper) const {
  if (node == 0) return;
  const int rows = inner_.constraintSize(node - 1);
  inner_.getConstraintBounds(node - 1, lower.head(rows), upper.head(rows));
  lower.tail(lower.size() - rows).setZero();
  upper.tail(upper.size() - rows).setZero();
}

std::string PeriodicProblem::getConstraintName(int node, int row) const {
  const int rows = inner_.constraintSize(node - 1);
  return row < rows ? inner_.getConstraintName(node - 1, row)
                    : "end of the cycle against its beginning, row " + std::to_string(row - rows);
}

// Eq. (2)
VectorXd PeriodicProblem::calcStart(ConstVectorRef theta, ProblemScratch* inner) const {
  const VectorXd dx = theta;
  VectorXd x(inner_.stateSize());
  const IntegrateTask task{0, reference_.get(), &dx, &x};
  inner_.integrate(&task, 1, inner);
  return x;
}

// Eq. (3). \param last  evaluation of the inner problem at x_N
VectorXd PeriodicProblem::calcError(const VectorXd& theta, const NodeEvaluation& last, ProblemScratch* inner) const {
  const VectorXd wanted = map_(calcStart(theta, inner));
  VectorXd error(n_);
  const DifferenceTask task{inner_.numStages(), &last, &wanted, &error};
  inner_.difference(&task, 1, inner);
  return kClosingScale * error;
}

void PeriodicProblem::setControls(int, WrappedEvaluation& at) const { at.inner->u = at.u; }

void PeriodicProblem::finish(int node, WrappedEvaluation& at, ProblemScratch* inner) const {
  if (node == 0) {
    at.cost = 0;
    at.x_next.resize(stateSize());
    at.x_next << calcStart(at.u, inner), at.u;
    at.status = at.x_next.allFinite() ? NumericalStatus::Ok : NumericalStatus::NotFinite;
    at.failure = at.status == NumericalStatus::Ok ? "" : "there is no such beginning of the cycle";
    return;
  }
  if (at.status != NumericalStatus::Ok) return;
  if (node < numStages()) {
    at.x_next.resize(stateSize());
    at.x_next << at.inner->x_next, at.x.tail(n_);
  } else {
    at.constraints.resize(at.inner->constraints.size() + n_);
    at.constraints << at.inner->constraints, calcError(at.x.tail(n_), *at.inner, inner);
  }
}

// Derivatives by theta of x_0 (-) at or, where it maps, of S(x_0) (-) at.
MatrixXd PeriodicProblem::differentiate(const VectorXd& theta, bool maps, const NodeEvaluation& at,
                                        ProblemScratch* inner) const {
  constexpr double kStep = 1e-3;
  constexpr std::array<std::pair<double, double>, 4> kPoints{
      {{-2, 1.0 / 12}, {-1, -8.0 / 12}, {1, 8.0 / 12}, {2, -1.0 / 12}}};
  const int size = 4 * n_, node = maps ? inner_.numStages() : 0;
  std::vector<VectorXd> moved(size, theta), states(size, VectorXd(inner_.stateSize())), ends(size, VectorXd(n_));
  std::vector<IntegrateTask> sums;
  std::vector<DifferenceTask> differences;
  for (int i = 0; i < size; ++i) {
    moved[i][i / 4] += kStep * kPoints[i % 4].first;
    sums.push_back({0, reference_.get(), &moved[i], &states[i]});
    differences.push_back({node, &at, &states[i], &ends[i]});
  }
  inner_.integrate(sums.data(), size, inner);
  if (maps)
    for (VectorXd& x : states) x = map_(x);
  inner_.difference(differences.data(), size, inner);
  MatrixXd by_theta = MatrixXd::Zero(n_, n_);
  for (int i = 0; i < size; ++i) by_theta.col(i / 4) += kPoints[i % 4].second / kStep * ends[i];
  return by_theta;
}

void PeriodicProblem::linearizeStart(LinearizeTask& task, ProblemScratch* inner) const {
  const NodeEvaluation& next = *getInner(task.next);
  StageModel& out = *task.out;
  const VectorXd x = getState(task.at->x_next);
  VectorXd gap(n_);
  const DifferenceTask difference{0, &next, &x, &gap};
  inner_.difference(&difference, 1, inner);
  out.cost = 0;
  out.lu.setZero();
  out.hessian().setZero();
  out.gap << gap, task.at->u - task.next->x.tail(n_);
  out.Fu().topRows(n_) = differentiate(task.at->u, false, next, inner);
  out.Fu().bottomRows(n_).setIdentity();
  task.status = out.Fu().allFinite() ? NumericalStatus::Ok : NumericalStatus::NotFinite;
}

// In the order (u, x, theta).
void PeriodicProblem::setModel(LinearizeTask& task, const StageModel* model, ProblemScratch* scratch) const {
  if (!model) return linearizeStart(task, scratch);
  const StageModel& inner = *model;
  const Eigen::Index size = inner.lu.size() + inner.lx.size(), n = inner.gap.size();
  StageModel& out = *task.out;
  out.cost = inner.cost;
  out.lu = inner.lu;
  out.lx << inner.lx, VectorXd::Zero(n_);
  out.hessian().setZero();
  out.hessian().topLeftCorner(size, size) = inner.hessian();
  out.Ct().topLeftCorner(size, inner.Ct().cols()) = inner.Ct();
  out.Ct().bottomRows(n_).setZero();
  if (task.node == numStages()) {
    if (task.rows) setClosing(task, scratch);
    return;
  }
  out.gap << inner.gap, task.at->x.tail(n_) - task.next->x.tail(n_);
  out.Ft().setZero();
  out.Ft().topLeftCorner(size, n) = inner.Ft();
  out.Ft().bottomRightCorner(n_, n_).setIdentity();
}

// Derivatives of Eq. (3).
void PeriodicProblem::setClosing(const LinearizeTask& task, ProblemScratch* inner) const {
  auto Ct = task.out->Ct().rightCols(n_);
  Ct.topRows(n_) = -kClosingScale * MatrixXd::Identity(n_, n_);
  Ct.bottomRows(n_) = kClosingScale * differentiate(task.at->x.tail(n_), true, *getInner(task.at), inner).transpose();
}

ShootingTrajectory PeriodicProblem::wrap(const ShootingTrajectory& inner) const {
  VectorXd theta(n_);
  const DifferenceTask task{0, reference_.get(), &inner.xs.front(), &theta};
  inner_.difference(&task, 1, inner_.makeScratch().get());
  ShootingTrajectory out{{start_}, {theta}};
  for (const VectorXd& x : inner.xs) {
    out.xs.emplace_back(stateSize());
    out.xs.back() << x, theta;
  }
  out.us.insert(out.us.end(), inner.us.begin(), inner.us.end());
  return out;
}

ShootingTrajectory PeriodicProblem::unwrap(const ShootingTrajectory& trajectory) const {
  ShootingTrajectory out;
  for (size_t k = 1; k < trajectory.xs.size(); ++k) out.xs.push_back(getState(trajectory.xs[k]));
  out.us.assign(trajectory.us.begin() + 1, trajectory.us.end());
  return out;
}

Multipliers PeriodicProblem::wrap(Multipliers inner) const {
  if (!inner.values.empty() && inner.values.back().size() >= n_) inner.values.back().tail(n_) /= kClosingScale;
  inner.values.insert(inner.values.begin(), VectorXd());
  return inner;
}

Multipliers PeriodicProblem::unwrap(Multipliers multipliers) const {
  multipliers.values.erase(multipliers.values.begin());
  multipliers.values.back().tail(n_) *= kClosingScale;
  return multipliers;
}

}  // namespace bielle
