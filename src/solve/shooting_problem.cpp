#include "bielle/solve/shooting_problem.h"

#include <atomic>
#include <limits>

namespace bielle {

namespace {

std::uint64_t makeId() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

ShootingProblem::Id::Id() : value(makeId()) {}
ShootingProblem::Id& ShootingProblem::Id::operator=(const Id&) {
  value = makeId();
  return *this;
}

void ShootingProblem::getControlBounds(int, VectorRef lower, VectorRef upper) const {
  lower.setConstant(-std::numeric_limits<double>::infinity());
  upper.setConstant(std::numeric_limits<double>::infinity());
}

bool ShootingProblem::hasControlBounds() const {
  VectorXd lower, upper;
  for (int k = 0; k < numStages(); ++k) {
    lower.resize(controlSize(k));
    upper.resize(controlSize(k));
    getControlBounds(k, lower, upper);
    if (lower.array().isFinite().any() || upper.array().isFinite().any()) return true;
  }
  return false;
}

void ShootingProblem::getConstraintBounds(int, VectorRef lower, VectorRef upper) const {
  lower.setConstant(-std::numeric_limits<double>::infinity());
  upper.setConstant(std::numeric_limits<double>::infinity());
}

std::string ShootingProblem::getConstraintName(int, int row) const { return "constraint " + std::to_string(row); }

std::unique_ptr<NodeEvaluation> ShootingProblem::makeEvaluation() const { return std::make_unique<NodeEvaluation>(); }

void NodewiseProblem::evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const {
  for (int i = 0; i < count; ++i) evaluate(tasks[i], scratch);
}

void NodewiseProblem::linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const {
  for (int i = 0; i < count; ++i) linearize(tasks[i], scratch);
}

void NodewiseProblem::integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const {
  for (int i = 0; i < count; ++i) integrate(tasks[i], scratch);
}

void NodewiseProblem::difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const {
  for (int i = 0; i < count; ++i) difference(tasks[i], scratch);
}

}  // namespace bielle
