#pragma once
/// \file An explicit Runge-Kutta method of order 8 with estimates of its error: DOP853 of Hairer, Norsett and Wanner, "Solving
/// Ordinary Differential Equations I", II.5, with the coefficients of Dormand and Prince.
#include <array>
#include <functional>

#include "bielle/math/types.h"

namespace bielle {

/// Steps of x' = f(x). No function allocates after the constructor, beyond what f does.
class RungeKutta {
 public:
  static constexpr int kStages = 12, kOrder = 8;
  /// Writes x' (size) for x (size). \returns false where x has no derivative
  using Derivative = std::function<bool(const VectorXd& x, VectorXd& rate)>;

  explicit RungeKutta(Eigen::Index size);

  /// One step of length h from x0 to end(). Only the first `scale.size()` entries count for the error, each over its scale;
  /// the others are quadratures that ride along.
  /// \param rate  f(x0)
  /// \returns the estimated error of the step relative to the scale, root mean square, or infinity where f failed
  double step(const Derivative& f, const VectorXd& x0, const VectorXd& rate, double h, ConstVectorRef scale);
  const VectorXd& end() const { return end_; }

  /// By what factor the length of a step of this error should change: aims at 1, between 1/5 and 6.
  static double calcFactor(double error);

 private:
  std::array<VectorXd, kStages> k_;
  VectorXd stage_, end_;
};

}  // namespace bielle
