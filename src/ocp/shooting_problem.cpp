#include "bielle/ocp/shooting_problem.h"

#include <limits>

namespace bielle {

void StageModel::resize(int ndx, int nu, int ndx_next) {
  ndx_ = ndx;
  nu_ = nu;
  ndx_next_ = ndx_next;
  gap.setZero(ndx_next);
  cost = 0;
  lx.setZero(ndx);
  lu.setZero(nu);
  Ft_.setZero(getRows() * ndx_next);
  H_.setZero(getRows() * (nu + ndx));
}

bool StageModel::hasSizes(int ndx, int nu, int ndx_next) const {
  return ndx_ == ndx && nu_ == nu && ndx_next_ == ndx_next && gap.size() == ndx_next && lx.size() == ndx &&
         lu.size() == nu;
}

void ShootingProblem::integrateNodes(const std::vector<IntegrateTask>& tasks) const {
  for (const IntegrateTask& task : tasks) integrate(task.node, *task.x, *task.dx, *task.x_out);
}

void ShootingProblem::stepStages(std::vector<StepTask>& tasks) {
  for (StepTask& task : tasks) {
    task.status = task.continues ? continueStep(task.stage, *task.x, *task.u, *task.x_next, task.cost)
                                 : step(task.stage, *task.x, *task.u, *task.x_next, task.cost);
    if (task.deviation && task.status == StepStatus::Ok)
      difference(task.stage + 1, *task.origin, *task.x_next, *task.deviation);
  }
}

void ShootingProblem::linearizeStages(int begin, int end, const std::vector<VectorXd>& xs,
                                      const std::vector<VectorXd>& us, std::vector<StageModel>& models,
                                      std::vector<StepStatus>& statuses) {
  for (int k = begin; k < end; ++k) statuses[k] = linearize(k, xs[k], us[k], xs[k + 1], models[k]);
}

void ShootingProblem::getControlBounds(int, VectorRef lower, VectorRef upper) const {
  lower.setConstant(-std::numeric_limits<double>::infinity());
  upper.setConstant(std::numeric_limits<double>::infinity());
}

std::string ShootingProblem::getFailure(int) const { return {}; }

}  // namespace bielle
