#include "bielle/ocp/cost.h"

#include <algorithm>

namespace bielle {
namespace {

// Signed distance outside [lower, upper], zero inside.
double calcExcess(double r, double lower, double upper) { return r < lower ? r - lower : (r > upper ? r - upper : 0); }

}  // namespace

Activation Activation::makeQuadratic(const VectorXd& weights) { return {ActivationKind::Quadratic, weights, {}, {}}; }

Activation Activation::makeBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper) {
  return {ActivationKind::Barrier, weights, lower, upper};
}

double Activation::calc(ConstVectorRef r) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const double d = kind == ActivationKind::Quadratic ? r[i] : calcExcess(r[i], lower[i], upper[i]);
    sum += 0.5 * weights[i] * d * d;
  }
  return sum;
}

void Activation::calcDerivatives(ConstVectorRef r, VectorRef gradient, VectorRef hessian) const {
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const double d = kind == ActivationKind::Quadratic ? r[i] : calcExcess(r[i], lower[i], upper[i]);
    gradient[i] = weights[i] * d;
    hessian[i] = kind == ActivationKind::Quadratic || d != 0 ? weights[i] : 0;
  }
}

}  // namespace bielle
