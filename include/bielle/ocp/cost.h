#pragma once
/// \file Costs: activations of residuals, and diagonal costs of state and control. Path constraints: residuals within bounds.
#include "bielle/ocp/residual.h"

namespace bielle {

enum class ActivationKind { Quadratic, Barrier, LogBarrier };

/// Scalar function of a residual r (n).
///   Quadratic:  1/2 sum_i w_i r_i^2
///   Barrier:    1/2 sum_i w_i (max(0, lower_i - r_i)^2 + max(0, r_i - upper_i)^2)
///   LogBarrier: sum_i w_i (beta(r_i - lower_i) + beta(upper_i - r_i)), finite bounds only, relaxed within the distance
///               delta_i so that it is defined everywhere and twice differentiable (Feller and Ebenbauer, "Relaxed
///               logarithmic barrier function based model predictive control of linear systems", 2017):
///                   beta(d) = -ln(d / delta)  for d > delta,    1/2 ((d / delta - 2)^2 - 1)  otherwise.
struct Activation {
  ActivationKind kind = ActivationKind::Quadratic;
  VectorXd weights;       ///< n
  VectorXd lower, upper;  ///< n, barriers only
  VectorXd relaxation;    ///< delta, n, positive, logarithmic barrier only

  static Activation makeQuadratic(const VectorXd& weights);
  static Activation makeBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper);
  static Activation makeLogBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper,
                                   const VectorXd& relaxation);
  /// Whether weights, bounds and relaxation have the sizes that a residual of `rows` rows needs.
  bool hasSize(Eigen::Index rows) const;
  double calc(ConstVectorRef r) const;
  /// Gradient (n) and diagonal of the Hessian (n) with respect to r.
  void calcDerivatives(ConstVectorRef r, VectorRef gradient, VectorRef hessian) const;
};

/// weight * activation(residual); the name is for reports.
struct Cost {
  std::string name;
  double weight = 1;
  Activation activation;
  std::unique_ptr<Residual> residual;
};

/// lower <= r <= upper, row by row; equal bounds make an equation, infinite ones leave a side open. The solver sees r and its
/// bounds over `scale`: the violation that counts as 1.
struct PathConstraint {
  std::string name;
  std::unique_ptr<Residual> residual;
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
