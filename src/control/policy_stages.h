#pragma once
// The stages of a policy from nodes of a trajectory.
#include "bielle/control/policy.h"

namespace bielle {

/// A stage of a policy without gains. \param x_next  state at its end
void fillStage(const RobotProblem& problem, int node, double start, const VectorXd& x, const VectorXd& u,
               const VectorXd& x_next, Policy::Stage& stage);

}  // namespace bielle
