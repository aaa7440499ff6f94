#pragma once
/// \file The derivative of an optimal cost with respect to the problem, by the envelope theorem.
///
/// Let P(p) be shooting problems of a robot that differ in a number p, a length of its mechanism for instance, with the
/// same stages and constraints by number, kind and size, and J*(p) the optimal cost. About an optimum of P(0), with states
/// x_k, controls u_k and multipliers y_k (fddp.h, Eq. 13), the Lagrangian is
///
///     L(p, x, u) = sum_k (l_k + y_k . (c_k - b_k)) + sum_k lambda_{k+1} . (f_k(x_k, u_k) (-) x_{k+1}),             (1)
///
/// where l, c, f and the bounds b are those of P(p), and b is the bound that the sign of y names. The costates
///
///     lambda_N = d(l_N + y_N . c_N)/dx,    lambda_k = d(l_k + y_k . c_k)/dx + F_x^T lambda_{k+1}                   (2)
///
/// make L stationary in x_1 .. x_N. At an optimum it is also stationary in all controls that are not at a bound. (2)
/// itself would multiply rounding as a robot falls over, ten-thousandfold within a second of walking. Where L is stationary in
/// the controls, the same costates follow from the LQ sweep (lq_sweep.h), whose gains hold the robot upright:
///
///     lambda_k = Vx_k + Vxx_k dx_k,                                                                                (3)
///
/// with dx the remaining step to the optimum, of the size of the gaps. Along any smooth path x(p), u(p) on which x_0
/// is the initial state of P(p), states are states of P(p), and controls at a bound stay at it, therefore
///
///     dJ*/dp = d/dp L(p, x(p), u(p))    at p = 0:                                                                  (4)
///
/// neither costates nor multipliers need to change, and nothing is solved again. The path chosen here:
///
///     x_0(p) = initial state of P(p),    x_k(p) = x_k (+) 0 in P(p),    u_k(p) = u_k, or its bound in P(p).         (5)
///
/// In the reduced formulation x (+) 0 closes the loops of the changed mechanism by the least motion (reduction.h, Eq. 2)
/// and turns the velocity into them; in the full one it is x. The caller defines P(p); quantities it keeps fixed are
/// treated as fixed. If a motion is planned again for the changed robot, its starting posture, references, footholds
/// and bounds move with the mechanism, and (4) includes their share.
///
/// The differences in (1) are of first order in p. Taken joint by joint, d = (f (-) x)(p), their coordinates about the
/// optimum are those of (x_{k+1} (+) d) (-) x_{k+1} in P(0), to which lambda belongs, up to terms of second order that are
/// even in p. (4) is the central difference of (1), one evaluation of all nodes on each side, and so is exact up to the
/// square of the step: every residual, user-defined ones included, every constraint and every parameter is covered.
///
/// Errors of the optimum matter: (4) is wrong by dL/du . du*/dp, that is in proportion to the remaining gradient
/// (fddp.h, Eq. 6), and by the error of the multipliers times the change of their constraints.
#include "bielle/ocp/robot_problem.h"
#include "bielle/solve/fddp.h"

namespace bielle {

class Envelope {
 public:
  /// Linearizes all nodes once, and sweeps over them, for (3).
  /// \param model  of the problem, whose states begin with (q, v): a RobotProblem, or a PeakProblem around one
  /// \param optimum, multipliers  of a solve that converged; without values if there are no constraints
  /// The problem and the optimum must outlive it.
  /// \throws std::invalid_argument when sizes do not match
  Envelope(const Model& model, const ShootingProblem& problem, const ShootingTrajectory& optimum,
           const Multipliers& multipliers);
  ~Envelope();

  /// J* of the problem itself, its cost at the optimum.
  double cost() const;
  /// lambda of node k = 1 .. N, Eq. (3), in the tangent coordinates of an evaluation at the optimum.
  const VectorXd& getCostate(int node) const;
  /// L of Eq. (1) on the path (5), for a problem near that of the optimum. NaN if it cannot be evaluated there.
  /// \throws std::invalid_argument when its nodes, states, controls or constraints differ in number
  double calcLagrangian(const ShootingProblem& changed) const;
  /// Eq. (4). \param step  distance of `ahead`, and of `behind` on the other side, in units of p
  double calcDerivative(const ShootingProblem& ahead, const ShootingProblem& behind, double step) const {
    return (calcLagrangian(ahead) - calcLagrangian(behind)) / (2 * step);
  }

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace bielle
