#pragma once
/// \file How an optimum moves with its problem: derivatives of measures other than its cost.
///
/// With P(p) and the path x(p), u(p) of envelope.h, Eq. (5), the optimum of P(p) is that path and a step, of first order
/// in p, which solves the linear-quadratic problem of the conditions of an optimum about the path (lq_sweep.h, Eq. 1):
///
///     z*(p) = z(p) (+) dz,    K dz = -grad L(p, z(p)),                                                             (1)
///
/// with active constraints and bounds those of P(0), the former by an augmented Lagrangian whose penalty is so large that
/// the multipliers may stay. The solver's K leaves out second derivatives of dynamics and constraints. With the exact
/// gradient after the step of (1), the next sweep corrects part of the error,
///
///     z_{j+1} = z_j (+) dz_j,    K dz_j = -grad L(p, z_j),                                                         (2)
///
/// and so on: a full step of the solver each time, without a search. Where rows or bounds become active, or cease to be, the
/// derivative of an optimum jumps; that of (1) holds them.
///
/// Differences between (2) for p and for p = 0 are derivatives of the optimum, in which the residual of
/// the solve cancels; the sweeps of the latter serve all p. Let s_j be that of some smooth function of z_j. With H the exact Hessian of the Lagrangian along the constraints,
///
///     s_{j+1} = s_j - K^-1 (H s_j + dgrad L/dp),                                                                   (3)
///
/// is linear, and converges where the eigenvalues of K^-1 H are in (0, 2), slowly where they are near the ends. s_1 alone is
/// the implicit derivative with the solver's K in place of H, which may have the wrong sign (docs/design_reference.md). Reduced
/// rank extrapolation, the same as GMRES preconditioned by K where s has all of dz (Sidi, "Vector Extrapolation Methods", 2017,
/// ch. 2), combines sweeps such that the remaining step is as small as possible:
///
///     s = sum_j g_j s_{j+1},    min_g |sum_j g_j (s_{j+1} - s_j)|,    sum_j g_j = 1.                               (4)
#include <functional>
#include <memory>
#include <optional>

#include "bielle/solve/fddp.h"

namespace bielle {

/// z of Eq. (2) after some sweeps, for a problem near that of the optimum; empty if it cannot be followed, as at a dead
/// point.
/// \param optimum, multipliers  as for Envelope
/// \throws std::invalid_argument when nodes, states, controls or constraints differ in number
std::optional<ShootingTrajectory> followOptimum(const ShootingProblem& problem, const ShootingTrajectory& optimum,
                                                const Multipliers& multipliers, const ShootingProblem& changed,
                                                int sweeps = 2);

struct OptimumDerivative {
  VectorXd value;       ///< s of Eq. (4), over the unit of p
  int sweeps = 0;       ///< of the changed problem
  double residual = 0;  ///< the norm that (4) minimizes, over that of s
};

/// Smooth numbers computed from an optimum; of the same size for all problems.
using OptimumReader = std::function<VectorXd(const ShootingTrajectory& optimum)>;

inline constexpr double kFollowTolerance = 1e-3;  ///< of OptimumDerivative::residual
inline constexpr int kMostSweeps = 10;            ///< after which it may be larger

/// Derivatives of numbers computed from an optimum, by any number of parameters.
class FollowedOptimum {
 public:
  /// \param problem  of the optimum   \param here  the same, made as changed ones are, so that what their making rounds cancels
  /// \param read  of the optimum of `here`
  /// The problems must outlive it.
  FollowedOptimum(const ShootingProblem& problem, const ShootingTrajectory& optimum, const Multipliers& multipliers,
                  const ShootingProblem& here, OptimumReader read);
  ~FollowedOptimum();
  FollowedOptimum(FollowedOptimum&&) noexcept;

  /// Empty if the optimum cannot be followed.
  /// \param changed  problem at `step` (units of p) from that of the optimum   \param read  of its optimum
  /// \throws std::invalid_argument as followOptimum()
  std::optional<OptimumDerivative> differentiate(const ShootingProblem& changed, double step,
                                                 const OptimumReader& read);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace bielle
