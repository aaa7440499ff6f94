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

void ShootingProblem::getControlBounds(int, VectorRef lower, VectorRef upper) const {
  lower.setConstant(-std::numeric_limits<double>::infinity());
  upper.setConstant(std::numeric_limits<double>::infinity());
}

std::string ShootingProblem::getFailure(int) const { return {}; }

}  // namespace bielle
