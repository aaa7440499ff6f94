#pragma once
/// \file The options of problems, of the solver and of lifting by name (bielle/model/options.h). Programs have some of them as flags,
/// Python all as keyword arguments.
#include "bielle/model/options.h"
#include "bielle/motion/lift.h"

namespace bielle {

/// Without those by motor, and `enforced`.
void describe(OptionFields& fields, LimitOptions& options);
/// Without the scale.
void describe(OptionFields& fields, ObjectiveOptions& options);
/// Formulation, limits and objective.
void describe(OptionFields& fields, ProblemOptions& options);
void describe(OptionFields& fields, ConstraintOptions& options);
/// Without the constraints.
void describe(OptionFields& fields, FddpOptions& options);
void describe(OptionFields& fields, LiftOptions& options);

}  // namespace bielle
