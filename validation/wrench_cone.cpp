#include "wrench_cone.h"

#include <algorithm>
#include <cmath>

namespace bielle::validation {

ConeMargin calcConeMargin(const Vector6d& wrench, double X, double Y, double mu, double least_load) {
  if (!wrench.allFinite()) return {std::numeric_limits<double>::quiet_NaN(), "not finite"};
  const double load = std::max(wrench[2], least_load);
  const Vector6d w = wrench / load;  // its third number now is one, or is treated as one
  const double least = -mu * (X + Y) + std::abs(Y * w[0] - mu * w[3]) + std::abs(X * w[1] - mu * w[4]);
  const double most = mu * (X + Y) - std::abs(Y * w[0] + mu * w[3]) - std::abs(X * w[1] + mu * w[4]);
  ConeMargin margin{std::min(most - w[5], w[5] - least), "torque"};
  const auto consider = [&margin](double value, const char* limit) {
    if (value < margin.value) margin = {value, limit};
  };
  consider(std::min(Y - std::abs(w[3]), X - std::abs(w[4])), "pressure");
  consider((X + Y) * (mu - std::max(std::abs(w[0]), std::abs(w[1]))), "friction");
  if (w[2] < 0) consider((X + Y) * w[2], "pull");
  return margin;
}

}  // namespace bielle::validation
