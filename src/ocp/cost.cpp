#include "bielle/ocp/cost.h"

#include <algorithm>
#include <cmath>

namespace bielle {
namespace {

// The distance that counts in row i: of the residual, or of what is outside the bounds.
double calcDistance(const Activation& activation, Eigen::Index i, double r) {
  if (activation.kind == ActivationKind::Quadratic) return r;
  return std::min(0.0, r - activation.lower[i]) + std::max(0.0, r - activation.upper[i]);
}

}  // namespace

Activation Activation::makeQuadratic(const VectorXd& weights) {
  Activation out;
  out.weights = weights;
  return out;
}

Activation Activation::makeBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper) {
  Activation out = makeQuadratic(weights);
  out.kind = ActivationKind::Barrier;
  out.lower = lower, out.upper = upper;
  return out;
}

Activation Activation::makeEnergy(const VectorXd& weights, const VectorXd& losses, double share, double smoothing) {
  Activation out;
  out.kind = ActivationKind::Energy;
  out.weights = weights;
  out.losses = losses;
  out.share = share;
  out.smoothing = smoothing;
  return out;
}

bool PathConstraint::hasSize(Eigen::Index rows) const {
  return lower.size() == rows && upper.size() == rows && scale.size() == rows;
}

bool Activation::hasSize(Eigen::Index rows) const {
  if (kind == ActivationKind::Energy)
    return weights.size() == losses.size() && rows == 2 * losses.size() && smoothing > 0;
  return weights.size() == rows &&
         (kind == ActivationKind::Quadratic || (lower.size() == rows && upper.size() == rows));
}

double Activation::calc(ConstVectorRef r) const {
  double sum = 0;
  if (kind == ActivationKind::Energy) {
    for (Eigen::Index i = 0; i < losses.size(); ++i)
      sum += weights[i] * (share * r[i] + (1 - share) * (r[i] + std::hypot(r[i], smoothing)) / 2);
    return sum;
  }
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const double d = calcDistance(*this, i, r[i]);
    sum += 0.5 * weights[i] * d * d;
  }
  return sum;
}

void Activation::calcDerivatives(ConstVectorRef r, VectorRef gradient, VectorRef hessian) const {
  if (kind == ActivationKind::Energy) {
    const Eigen::Index n = losses.size();
    for (Eigen::Index i = 0; i < n; ++i) {
      const double root = std::hypot(r[i], smoothing), slope = share + (1 - share) * (1 + r[i] / root) / 2;
      gradient[i] = weights[i] * slope;
      hessian[i] = weights[i] * (1 - share) * smoothing * smoothing / (2 * root * root * root);
      gradient[n + i] = 0;
      hessian[n + i] = weights[i] * slope * 2 * losses[i];
    }
    return;
  }
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const double d = calcDistance(*this, i, r[i]);
    gradient[i] = weights[i] * d;
    hessian[i] = kind == ActivationKind::Quadratic || d != 0 ? weights[i] : 0;
  }
}

Matrix3d StateCost::calcCoupling(Eigen::Index first) const {
  const Matrix3d own = weights.segment<3>(first).asDiagonal();
  return axes.transpose() * own * axes - own;
}

}  // namespace bielle
