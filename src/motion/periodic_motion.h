#pragma once
/// \file The problem of a motion that repeats, and what a solution of it is.
#include "bielle/motion/solve.h"
#include "solve/periodic_problem.h"

namespace bielle {

/// S of a motion with a cycle, which must outlive it.
StateMap makeStateMap(const Motion& motion);

/// The problem that solve() solves for a motion that repeats; null for others. The motion must outlive it.
std::unique_ptr<PeriodicProblem> makePeriodicProblem(const Motion& motion);

/// Sets gains and Floquet multiplier of the solution of a cycle, with the penalty of the solve. The robot's feet stay where they land: no
/// stabilization draws them back to their places, as it does in the steps of the problem.
void setCyclicFeedback(Solution& solution);

/// Largest entry of the difference between a last state (q, v) and the first one, moved: rad, m, rad/s and m/s.
double calcClosingError(const Model& model, const SE3& cycle, const VectorXd& first, const VectorXd& last);

}  // namespace bielle
