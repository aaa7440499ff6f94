#pragma once
/// \file Bielle's dynamics against MuJoCo's, on the states of validate.h, without contacts.
///
/// Mass matrix and bias agree to rounding. At a closed state whose velocity keeps it closed, its accelerations obey
///
///     M a + b = tau + J^T f,   J a + R f = 0                                                                       (1)
///
/// R > 0, diagonal, makes closures soft, and version 2.2.2 leaves out dJ/dt v. Four rows say what that costs:
/// - "as MuJoCo has them": (1);
/// - "rigid closures": R -> 0, by linear extrapolation from two R that are smaller than MuJoCo's;
/// - "rigid closures, dJ/dt v added": to the left side of the rows, from differences of MuJoCo's J;
/// - "rigid closures, at rest": v = 0.
/// The first two only inform.
#include "validate.h"

namespace bielle::validation {

/// \throws InputError when MuJoCo refuses the robot
ValidationReport validateByMujoco(const Model& model, const ValidationOptions& options = {});

/// The same with MuJoCo's robot made from another model with the same joints and closures: a wrong model must fail.
ValidationReport validateAgainstMujoco(const Model& model, const Model& oracle, const ValidationOptions& options = {});

}  // namespace bielle::validation
