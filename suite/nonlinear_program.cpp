#include "nonlinear_program.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/model/error.h"

namespace bielle {

NonlinearProgram::NonlinearProgram(const RobotProblem& problem, ShootingTrajectory guess)
    : problem_(problem), guess_(std::move(guess)), scratch_(problem.makeScratch()) {
  if (problem.hasFreeTimings())
    throw InputError(problem.model().name(), "nonlinear program", "durations are variables",
                     "make the motion without free durations");
  guess_.xs.front() = problem.initialState();
  for (size_t k = 0; k < guess_.us.size(); ++k) {
    VectorXd lower(guess_.us[k].size()), upper(lower.size());
    problem.getControlBounds(static_cast<int>(k), lower, upper);
    guess_.us[k] = guess_.us[k].cwiseMax(lower).cwiseMin(upper);
  }
  trajectory_ = guess_;
  std::vector<EvaluateTask> tasks;
  for (size_t k = 0; k < guess_.xs.size(); ++k) {
    guesses_.push_back(problem.makeEvaluation());
    EvaluateTask task;
    task.node = static_cast<int>(k);
    task.x = &guess_.xs[k];
    task.u = k < guess_.us.size() ? &guess_.us[k] : nullptr;
    task.out = guesses_.back().get();
    tasks.push_back(task);
    places_.emplace_back();
    places_.back().nu = k < guess_.us.size() ? problem.controlSize(static_cast<int>(k)) : 0;
    listPathRows(static_cast<int>(k), places_.back());
  }
  problem.evaluate(tasks.data(), static_cast<int>(tasks.size()), scratch_.get());
}

void NonlinearProgram::listPathRows(int k, Place& place) const {
  const int size = problem_.constraintSize(k);
  place.wanted.assign(size, true);
  VectorXd lower(size), upper(size);
  problem_.getConstraintBounds(k, lower, upper);
  int first = 0;
  for (const PathConstraint& constraint : problem_.spec(k).path_constraints) {
    const Residual& residual = *constraint.residual;
    for (int i = first; i < first + residual.size(); ++i) {
      if ((k == 0 && !dependsOnControls(residual)) || (std::isinf(lower[i]) && std::isinf(upper[i]))) continue;
      place.kept.push_back(i);
      place.residuals.push_back(&residual);
    }
    first += residual.size();
  }
}

void NonlinearProgram::setBounds(int variables, int rows) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  variables_.lower.setConstant(variables, -kInfinite);
  variables_.upper.setConstant(variables, kInfinite);
  rows_.lower.setZero(rows);
  rows_.upper.setZero(rows);
  for (size_t k = 0; k < places_.size(); ++k) {
    const Place& place = places_[k];
    const int node = static_cast<int>(k);
    if (place.nu > 0)
      problem_.getControlBounds(node, variables_.lower.segment(place.u, place.nu),
                                variables_.upper.segment(place.u, place.nu));
    VectorXd lower(place.wanted.size()), upper(place.wanted.size());
    problem_.getConstraintBounds(node, lower, upper);
    for (int i = 0; i < place.numRows(); ++i) {
      rows_.lower[place.c + i] = lower[place.kept[i]];
      rows_.upper[place.c + i] = upper[place.kept[i]];
    }
  }
}

bool NonlinearProgram::fail(const std::string& why) {
  failure_ = why;
  return false;
}

bool NonlinearProgram::evaluate(ConstVectorRef z) {
  if (z_.size() == z.size() && z_ == z) return evaluated_;
  z_ = z;
  evaluated_ = linearized_ = false;
  return evaluated_ = update();
}

bool NonlinearProgram::linearize(ConstVectorRef z) {
  if (!evaluate(z)) return false;
  if (!linearized_) linearized_ = differentiate();
  return linearized_;
}

double NonlinearProgram::calcCost() const {
  double sum = 0;
  for (const auto& at : evaluations_) sum += at->cost;
  return sum;
}

void NonlinearProgram::getPathRows(VectorRef out) const {
  for (size_t k = 0; k < places_.size(); ++k)
    for (int i = 0; i < places_[k].numRows(); ++i)
      out[places_[k].c + i] = evaluations_[k]->constraints[places_[k].kept[i]];
}

Multipliers NonlinearProgram::expand(ConstVectorRef multipliers) const {
  Multipliers out;
  for (const Place& place : places_) {
    out.values.push_back(VectorXd::Zero(static_cast<Eigen::Index>(place.wanted.size())));
    for (int i = 0; i < place.numRows(); ++i) out.values.back()[place.kept[i]] = multipliers[place.c + i];
  }
  return out;
}

double NonlinearProgram::calcViolation() const {
  double worst = 0;
  for (size_t k = 0; k < places_.size(); ++k)
    for (int i = 0; i < places_[k].numRows(); ++i) {
      const int row = places_[k].c + i;
      const double c = evaluations_[k]->constraints[places_[k].kept[i]];
      worst = std::max({worst, rows_.lower[row] - c, c - rows_.upper[row]});
    }
  return worst;
}

}  // namespace bielle
