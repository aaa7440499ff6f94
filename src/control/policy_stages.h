#pragma once
// The stages of a policy from nodes of a trajectory.
#include "bielle/control/policy.h"
#include "bielle/solve/node_evaluator.h"

namespace bielle {

/// A stage of a policy without gains. \param x_next  state at its end
void fillStage(const RobotProblem& problem, int node, double start, const VectorXd& x, const VectorXd& u,
               const VectorXd& x_next, Policy::Stage& stage);

/// Policy's Eq. (2) about the last evaluation. \param K  of the solver, nu x tangent size
void calcGains(const Model& model, NodeEvaluator& evaluator, const RowMatrixXd& K, RowMatrixXd& gains);

}  // namespace bielle
