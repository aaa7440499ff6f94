#include "bielle/ocp/cost.h"

#include <algorithm>
#include <cmath>

namespace bielle {
namespace {

// Value and derivatives of a function of one number.
struct Jet {
  double value = 0, slope = 0, curvature = 0;
};

Jet calcSquare(double d) { return {0.5 * d * d, d, 1}; }

// Half the squared distance outside [lower, upper].
Jet calcExcess(double r, double lower, double upper) {
  if (r < lower) return calcSquare(r - lower);
  if (r > upper) return calcSquare(r - upper);
  return {};
}

// The relaxed logarithm beta at the distance d.
Jet calcLogarithm(double d, double delta) {
  if (d > delta) return {-std::log(d / delta), -1 / d, 1 / (d * d)};
  const double e = d / delta - 2;
  return {0.5 * (e * e - 1), e / delta, 1 / (delta * delta)};
}

Jet calcLogBarrier(double r, double lower, double upper, double delta) {
  Jet sum;
  if (std::isfinite(lower)) sum = calcLogarithm(r - lower, delta);
  if (!std::isfinite(upper)) return sum;
  const Jet above = calcLogarithm(upper - r, delta);
  return {sum.value + above.value, sum.slope - above.slope, sum.curvature + above.curvature};
}

// The term of row i, without its weight.
Jet calcTerm(const Activation& activation, Eigen::Index i, double r) {
  switch (activation.kind) {
    case ActivationKind::Quadratic:
      return calcSquare(r);
    case ActivationKind::Barrier:
      return calcExcess(r, activation.lower[i], activation.upper[i]);
    case ActivationKind::LogBarrier:
      return calcLogBarrier(r, activation.lower[i], activation.upper[i], activation.relaxation[i]);
  }
  return {};
}

}  // namespace

Activation Activation::makeQuadratic(const VectorXd& weights) {
  return {ActivationKind::Quadratic, weights, {}, {}, {}};
}

Activation Activation::makeBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper) {
  return {ActivationKind::Barrier, weights, lower, upper, {}};
}

Activation Activation::makeLogBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper,
                                      const VectorXd& relaxation) {
  return {ActivationKind::LogBarrier, weights, lower, upper, relaxation};
}

bool PathConstraint::hasSize(Eigen::Index rows) const {
  return lower.size() == rows && upper.size() == rows && scale.size() == rows;
}

bool Activation::hasSize(Eigen::Index rows) const {
  const bool barrier = kind != ActivationKind::Quadratic;
  return weights.size() == rows && (!barrier || (lower.size() == rows && upper.size() == rows)) &&
         (kind != ActivationKind::LogBarrier || relaxation.size() == rows);
}

double Activation::calc(ConstVectorRef r) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < r.size(); ++i) sum += weights[i] * calcTerm(*this, i, r[i]).value;
  return sum;
}

void Activation::calcDerivatives(ConstVectorRef r, VectorRef gradient, VectorRef hessian) const {
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const Jet term = calcTerm(*this, i, r[i]);
    gradient[i] = weights[i] * term.slope;
    hessian[i] = weights[i] * term.curvature;
  }
}

}  // namespace bielle
