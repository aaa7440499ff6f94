#pragma once
// Solves of a motion as it is; motion/solve.cpp has those that change it: stages, margins, scales.
#include "bielle/motion/solve.h"

namespace bielle {

// One solve: of a cycle, of a peak, or of the problem itself. Multipliers of the start count where the problem has their rows.
Solution attempt(const Motion& motion, const FddpOptions& solver, const FddpObserver& observer,
                 const StartingPoint& start);

// One, and another one if that cannot begin, from nodes at rest; if it ends as infeasible, from a larger regularization or
// without multiple shooting; or if that has come nowhere after 80 iterations.
Solution solveAlone(const Motion& motion, const FddpOptions& options, const FddpObserver& observer,
                    StartingPoint start);

// Adds what the solve before this one took.
void addWork(const FddpSummary& before, FddpSummary& summary);

}  // namespace bielle
