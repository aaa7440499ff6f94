#pragma once
#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"

namespace bielle::testing {

/// Of the residuals of all loops by v, rows x nv.
inline MatrixXd calcLoopJacobian(const Model& model, const VectorXd& q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  const ConstraintSet loops = makeConstraintSet(model);
  MatrixXd J = MatrixXd::Zero(loops.rows, model.nv());
  for (size_t c = 0; c < loops.closures.size(); ++c)
    calcClosureJacobian(ws, loops.closures[c], J.middleRows(loops.offsets[c], getRows(loops.closures[c].kind)));
  return J;
}

}  // namespace bielle::testing
