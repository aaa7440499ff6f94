#pragma once
/// \file Costs: activations of residuals, and diagonal costs of state and control. Path constraints: residuals within bounds.
#include "bielle/ocp/residual.h"

namespace bielle {

enum class ActivationKind { Quadratic, Barrier, Energy };

/// Scalar function of a residual r (n). Weights, here and below, are finite and not negative: RobotProblem refuses others.
///   Quadratic:  1/2 sum_i w_i r_i^2
///   Barrier:    1/2 sum_i w_i (max(0, lower_i - r_i)^2 + max(0, r_i - upper_i)^2)
///   Energy:     sum_i w_i (share P_i + (1 - share) (P_i + sqrt(P_i^2 + e^2)) / 2),   r = (P, u) of makeElectricalPower():
///               energy drawn by the motors, minus the reused share of the regenerated energy. It exceeds
///               max(P, 0) + share min(P, 0) by at most (1 - share) e/2 per motor, and by e^2 / (4 |P|) where |P| is
///               large. The second derivative of the term loss u^2 counts in the rows of u, whose gradient is zero;
///               that of u w does not.
struct Activation {
  ActivationKind kind = ActivationKind::Quadratic;
  VectorXd weights;       ///< n
  VectorXd lower, upper;  ///< n, barriers only
  VectorXd losses;        ///< n/2, energies only, W/(N m)^2
  double share = 0;       ///< energies only, within 0 .. 1
  double smoothing = 0;   ///< e, energies only, W

  static Activation makeQuadratic(const VectorXd& weights);
  static Activation makeBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper);
  static Activation makeEnergy(const VectorXd& weights, const VectorXd& losses, double share, double smoothing);
  /// Whether weights and bounds have the sizes that a residual of `rows` rows needs.
  bool hasSize(Eigen::Index rows) const;
  double calc(ConstVectorRef r) const;
  /// Whether it is a weighted sum of squares, which grows in all directions.
  bool isSquare() const { return kind != ActivationKind::Energy; }
  /// Gradient (n) and diagonal of the Hessian (n), without negative entries, with respect to r.
  void calcDerivatives(ConstVectorRef r, VectorRef gradient, VectorRef hessian) const;
};

/// weight * activation(residual); the name is for reports.
struct Cost {
  std::string name;
  double weight = 1;
  Activation activation;
  std::shared_ptr<const Residual> residual;
  bool defines = false;  ///< it defines the motion, and keeps its weight for every objective
};

/// lower <= r <= upper, row by row; equal bounds make an equation, infinite ones leave a side open. The solver sees r and its
/// bounds over `scale`: the violation that counts as 1.
struct PathConstraint {
  std::string name;
  std::shared_ptr<const Residual> residual;
  VectorXd lower, upper;  ///< n
  VectorXd scale;         ///< n, positive, in the unit of r

  bool hasSize(Eigen::Index rows) const;
};

/// 1/2 weight sum_i w_i d_i^2 with d = (q (-) q_ref, v - v_ref) (2 nv).
struct StateCost {
  double weight = 0;
  VectorXd q_ref, v_ref;  ///< nq, nv
  VectorXd weights;       ///< 2 nv
};

/// 1/2 weight sum_i w_i (u_i - u_ref_i)^2.
struct ControlCost {
  double weight = 0;
  VectorXd reference;  ///< nu
  VectorXd weights;    ///< nu
};

}  // namespace bielle
