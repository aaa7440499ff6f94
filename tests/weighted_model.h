#pragma once
// What a solver makes of the constraints of a quadratic model.
#include <utility>

#include "solve/lq_sweep.h"

namespace bielle::testing {

/// All constraints of a node, as LinearizeTask::rows.
inline std::vector<char> listRows(const ShootingProblem& problem, int node) {
  return std::vector<char>(problem.constraintSize(node), true);
}

/// Adds the derivatives of weights.gradient . c, and the Hessian C^T diag(weights.hessian) C.
inline void addWeights(const ConstraintWeights& weights, StageModel& model) {
  const ConstMatrixMap Ct = std::as_const(model).Ct();
  const VectorXd gradient = Ct * weights.gradient;
  model.lu += gradient.head(model.lu.size());
  model.lx += gradient.tail(model.lx.size());
  model.hessian() += Ct * weights.hessian.asDiagonal() * Ct.transpose();
}

}  // namespace bielle::testing
