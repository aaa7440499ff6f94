#include "bielle/ocp/cost.h"

#include <algorithm>

namespace bielle {
namespace {

// The distance that counts in row i: of the residual, or of what is outside the bounds.
double calcDistance(const Activation& activation, Eigen::Index i, double r) {
  if (activation.kind == ActivationKind::Quadratic) return r;
  return std::min(0.0, r - activation.lower[i]) + std::max(0.0, r - activation.upper[i]);
}

}  // namespace

Activation Activation::makeQuadratic(const VectorXd& weights) { return {ActivationKind::Quadratic, weights, {}, {}}; }

Activation Activation::makeBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper) {
  return {ActivationKind::Barrier, weights, lower, upper};
}

bool PathConstraint::hasSize(Eigen::Index rows) const {
  return lower.size() == rows && upper.size() == rows && scale.size() == rows;
}

bool Activation::hasSize(Eigen::Index rows) const {
  return weights.size() == rows &&
         (kind == ActivationKind::Quadratic || (lower.size() == rows && upper.size() == rows));
}

double Activation::calc(ConstVectorRef r) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const double d = calcDistance(*this, i, r[i]);
    sum += 0.5 * weights[i] * d * d;
  }
  return sum;
}

void Activation::calcDerivatives(ConstVectorRef r, VectorRef gradient, VectorRef hessian) const {
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const double d = calcDistance(*this, i, r[i]);
    gradient[i] = weights[i] * d;
    hessian[i] = kind == ActivationKind::Quadratic || d != 0 ? weights[i] : 0;
  }
}

}  // namespace bielle
