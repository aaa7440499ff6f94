#pragma once
/// \file How an optimum itself moves with its problem: the derivative of measures other than its cost.
///
/// With P(p) and the path x(p), u(p) of envelope.h, Eq. (5), the optimum of P(p) is that path and a step, of first order
/// in p, which solves the linear-quadratic problem of the conditions of an optimum about the path (lq_sweep.h, Eq. 1):
///
///     z*(p) = z(p) (+) dz,    K dz = -grad L(p, z(p)),                                                             (1)
///
/// with active constraints and bounds those of P(0), the former by an augmented Lagrangian whose penalty is so large that
/// the multipliers may stay. The solver's K leaves out second derivatives of dynamics and constraints. With the exact
/// gradient about the step of (1), the next sweep makes up for most of what the one before left out,
///
///     z_{j+1} = z_j (+) dz_j,    K dz_j = -grad L(p, z_j),                                                         (2)
///
/// and so on: a full step of the solver each time, without a search. Where rows or bounds become active, or cease to be, the
/// derivative of an optimum jumps; that of (1) holds them.
///
/// Differences of (2) across p, both ahead and behind, are derivatives of the optimum, in which what the solve left cancels.
#include <optional>

#include "bielle/solve/fddp.h"

namespace bielle {

/// z of Eq. (2) after some sweeps, for a problem near that of the optimum; none if it cannot follow, as at a dead point.
/// \param optimum, multipliers  as for Envelope
/// \throws std::invalid_argument when nodes, states, controls or constraints differ in number
std::optional<ShootingTrajectory> followOptimum(const ShootingProblem& problem, const ShootingTrajectory& optimum,
                                                const Multipliers& multipliers, const ShootingProblem& changed,
                                                int sweeps = 2);

}  // namespace bielle
