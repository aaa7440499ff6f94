#pragma once
// The options of problems, of the solver and of lifting that programs have as flags (bielle/model/options.h).
#include "bielle/model/options.h"
#include "bielle/motion/lift.h"

namespace bielle {

// Without those by motor, and `enforced`.
void describe(OptionFields& fields, LimitOptions& options);
// Without the scale.
void describe(OptionFields& fields, ObjectiveOptions& options);
// Formulation, limits and objective.
void describe(OptionFields& fields, ProblemOptions& options);
// How long it may take, on how many threads.
void describe(OptionFields& fields, FddpOptions& options);
void describe(OptionFields& fields, LiftOptions& options);

}  // namespace bielle
