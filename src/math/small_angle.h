#pragma once
// Even functions of an angle t, from t^2: by series for small angles, in closed form for others.
#include <array>

#include "math/lanes.h"

namespace bielle {

constexpr double kSmallAngleSquared = 1e-2;  // below it the truncated terms of the series are below rounding

// Replaces the series in lanes whose angle is not small by the values of `calc`, a function of double.
template <size_t n, typename Calc>
std::array<Lanes, n> replaceLarge(const Lanes& t2, std::array<Lanes, n> series, const Calc& calc) {
  for (Eigen::Index l = 0; l < kLane; ++l) {
    if (t2[l] < kSmallAngleSquared) continue;
    const std::array<double, n> one = calc(t2[l]);
    for (size_t k = 0; k < n; ++k) series[k].set(l, one[k]);
  }
  return series;
}

}  // namespace bielle
