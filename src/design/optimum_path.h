#pragma once
// The path along which an optimum follows a changing problem, envelope.h Eq. (5), and what its sensitivities share.
#include <optional>

#include "bielle/solve/fddp.h"
#include "solve/lq_sweep.h"
#include "solve/node_evaluations.h"

namespace bielle {

EvaluationList makeEvaluations(const ShootingProblem& problem, int count);
bool allOk(const EvaluationList& evaluations, int count);

// \throws std::invalid_argument when nodes, states, controls or constraints differ in number
void requireSameSizes(const ShootingProblem& a, const ShootingProblem& b);

// Eq. (5); none where the changed problem cannot follow.
std::optional<ShootingTrajectory> calcPath(const ShootingProblem& problem, const ShootingTrajectory& optimum,
                                           const ShootingProblem& changed);

// Weights of Eq. (11) of docs/solver.md about constraints c, of the rows that are active by their multipliers y.
ConstraintWeights makeActiveWeights(const ShootingProblem& problem, int node, const VectorXd& y, const VectorXd& c,
                                    double penalty);

// The bound that y names. \param lower, upper  of the row
inline double getActiveBound(double y, double lower, double upper) { return y > 0 ? upper : lower; }

// Quadratic models of all nodes about evaluations. \throws std::invalid_argument when a node has none
std::vector<StageModel> linearizeNodes(const ShootingProblem& problem, const EvaluationList& at,
                                       ProblemScratch* scratch);

// A sweep over all nodes within the bounds of the controls us, and its step. Not Ok: no step.
NumericalStatus sweepNodes(const ShootingProblem& problem, const std::vector<StageModel>& models,
                           const std::vector<ConstraintWeights>& weights, const std::vector<VectorXd>& us,
                           LqSweep& sweep, std::vector<VectorXd>& dx, std::vector<VectorXd>& du);

}  // namespace bielle
