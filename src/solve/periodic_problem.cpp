#include "solve/periodic_problem.h"

#include <array>
#include <limits>
#include <stdexcept>
#include <utility>

#include "solve/wrapped_problem.h"

namespace bielle {
namespace {

// Of rows of (3), over which they are compared with other constraints: a hundredth of a rad, m, rad/s or m/s is much of them. With 1
// cycles take half as many iterations more, with 10 to 100 about the same number.
constexpr double kClosingScale = 100;

WrappedScratch& getScratch(ProblemScratch* memory) { return static_cast<WrappedScratch&>(*memory); }

}  // namespace

PeriodicProblem::PeriodicProblem(const ShootingProblem& inner, StateMap map)
    : inner_(inner), map_(std::move(map)), n_(inner.tangentSize(0)) {
  const int N = inner.numStages();
  if (inner.tangentSize(N) != n_)
    throw std::invalid_argument("PeriodicProblem: first and last node have tangent spaces of different size");
  start_.setZero(stateSize());
  start_.head(inner.stateSize()) = inner.initialState();
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

std::unique_ptr<NodeEvaluation> PeriodicProblem::makeEvaluation() const { return wrapEvaluation(inner_); }

std::unique_ptr<ProblemScratch> PeriodicProblem::makeScratch() const {
  return std::make_unique<WrappedScratch>(inner_);
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

void PeriodicProblem::evaluate(EvaluateTask* tasks, int count, ProblemScratch* memory) const {
  WrappedScratch& scratch = getScratch(memory);
  std::vector<EvaluateTask>& inner = scratch.evaluations;
  inner.clear();
  for (int i = 0; i < count; ++i) {
    const EvaluateTask& task = tasks[i];
    auto& at = static_cast<WrappedEvaluation&>(*task.out);
    at.x = *task.x;
    if (task.node < numStages()) at.u = *task.u;
    if (task.node == 0) continue;
    at.inner->x = getState(at.x);
    if (task.node < numStages()) at.inner->u = at.u;
    const NodeEvaluation* previous = task.node > 1 ? getInner(task.previous) : nullptr;
    inner.push_back({task.node - 1, &at.inner->x, &at.inner->u, previous, at.inner.get()});
  }
  inner_.evaluate(inner.data(), static_cast<int>(inner.size()), scratch.inner.get());
  for (int i = 0; i < count; ++i) {
    auto& at = static_cast<WrappedEvaluation&>(*tasks[i].out);
    if (tasks[i].node == 0) {
      at.cost = 0;
      at.x_next.resize(stateSize());
      at.x_next << calcStart(at.u, scratch.inner.get()), at.u;
      at.status = at.x_next.allFinite() ? NumericalStatus::Ok : NumericalStatus::NotFinite;
      at.failure = at.status == NumericalStatus::Ok ? "" : "there is no such beginning of the cycle";
      continue;
    }
    at.status = at.inner->status;
    at.failure = at.inner->failure;
    at.cost = at.inner->cost;
    at.constraints = at.inner->constraints;
    if (at.status != NumericalStatus::Ok) continue;
    if (tasks[i].node < numStages()) {
      at.x_next.resize(stateSize());
      at.x_next << at.inner->x_next, at.x.tail(n_);
    } else {
      at.constraints.resize(at.inner->constraints.size() + n_);
      at.constraints << at.inner->constraints, calcError(at.x.tail(n_), *at.inner, scratch.inner.get());
    }
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

void PeriodicProblem::linearize(LinearizeTask* tasks, int count, ProblemScratch* memory) const {
  WrappedScratch& scratch = getScratch(memory);
  std::vector<LinearizeTask>& inner = scratch.linearizations;
  inner.clear();
  scratch.models.takeBack();
  for (int i = 0; i < count; ++i) {
    const int node = tasks[i].node - 1;
    if (node < 0) continue;
    const bool running = node < inner_.numStages();
    LinearizeTask task;
    task.node = node;
    task.at = getInner(tasks[i].at);
    task.next = getInner(tasks[i].next);
    task.rows = tasks[i].rows;
    task.out = &scratch.takeModel(inner_.tangentSize(node), running ? inner_.controlSize(node) : 0,
                                  running ? inner_.tangentSize(node + 1) : 0, inner_.constraintSize(node));
    inner.push_back(task);
  }
  inner_.linearize(inner.data(), static_cast<int>(inner.size()), scratch.inner.get());
  auto done = inner.begin();
  for (int i = 0; i < count; ++i) {
    if (tasks[i].node == 0) {
      linearizeStart(tasks[i], scratch.inner.get());
      continue;
    }
    tasks[i].status = done->status;
    tasks[i].failure = done->failure;
    if (done->status == NumericalStatus::Ok) {
      setModel(tasks[i], *done->out);
      if (tasks[i].node == numStages() && tasks[i].rows) setClosing(tasks[i], scratch.inner.get());
    }
    ++done;
  }
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
void PeriodicProblem::setModel(const LinearizeTask& task, const StageModel& inner) const {
  const Eigen::Index size = inner.lu.size() + inner.lx.size(), n = inner.gap.size();
  StageModel& out = *task.out;
  out.cost = inner.cost;
  out.lu = inner.lu;
  out.lx << inner.lx, VectorXd::Zero(n_);
  out.hessian().setZero();
  out.hessian().topLeftCorner(size, size) = inner.hessian();
  out.Ct().topLeftCorner(size, inner.Ct().cols()) = inner.Ct();
  out.Ct().bottomRows(n_).setZero();
  if (n == 0) return;
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

void PeriodicProblem::integrate(const IntegrateTask* tasks, int count, ProblemScratch* memory) const {
  WrappedScratch& scratch = getScratch(memory);
  std::vector<IntegrateTask>& inner = scratch.integrations;
  inner.clear();
  scratch.vectors.takeBack();
  for (int i = 0; i < count; ++i) {
    if (tasks[i].node == 0) continue;
    VectorXd& dx = scratch.takeVector(tasks[i].dx->size() - n_);
    dx = tasks[i].dx->head(dx.size());
    inner.push_back({tasks[i].node - 1, getInner(tasks[i].at), &dx, &scratch.takeVector(inner_.stateSize())});
  }
  inner_.integrate(inner.data(), static_cast<int>(inner.size()), scratch.inner.get());
  auto done = inner.begin();
  for (int i = 0; i < count; ++i) {
    if (tasks[i].node == 0)
      *tasks[i].x_out = start_;
    else
      *tasks[i].x_out << *done++->x_out, tasks[i].at->x.tail(n_) + tasks[i].dx->tail(n_);
  }
}

void PeriodicProblem::difference(const DifferenceTask* tasks, int count, ProblemScratch* memory) const {
  WrappedScratch& scratch = getScratch(memory);
  std::vector<DifferenceTask>& inner = scratch.differences;
  inner.clear();
  scratch.vectors.takeBack();
  for (int i = 0; i < count; ++i) {
    if (tasks[i].node == 0) continue;
    VectorXd& x1 = scratch.takeVector(inner_.stateSize());
    x1 = getState(*tasks[i].x1);
    inner.push_back(
        {tasks[i].node - 1, getInner(tasks[i].at), &x1, &scratch.takeVector(inner_.tangentSize(tasks[i].node - 1))});
  }
  inner_.difference(inner.data(), static_cast<int>(inner.size()), scratch.inner.get());
  auto done = inner.begin();
  for (int i = 0; i < count; ++i)
    if (tasks[i].node > 0) *tasks[i].dx << *done++->dx, tasks[i].x1->tail(n_) - tasks[i].at->x.tail(n_);
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
