#include "bielle/ocp/shooting_problem.h"

#include <limits>

namespace bielle {

void StageModel::resize(int ndx, int nu, int ndx_next) {
  Fx.setZero(ndx_next, ndx);
  Fu.setZero(ndx_next, nu);
  gap.setZero(ndx_next);
  lx.setZero(ndx);
  lu.setZero(nu);
  lxx.setZero(ndx, ndx);
  lux.setZero(nu, ndx);
  luu.setZero(nu, nu);
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
