#pragma once
// Bounds as text with few digits, for remedies: what is given as the text says is still within.
#include <cmath>

#include "model/number_text.h"

namespace bielle {

// The largest number of so many digits that is not above the value.
inline std::string formatBelow(double value, int digits) {
  if (value == 0 || !std::isfinite(value)) return formatNumber(value);
  const double unit = std::pow(10, std::floor(std::log10(std::abs(value))) + 1 - digits);
  return formatNumber(std::floor(value / unit + 1e-9) * unit, "%.10g");
}

// The smallest one that is not below it.
inline std::string formatAbove(double value, int digits) {
  return formatNumber(-*parseNumber(formatBelow(-value, digits)), "%.10g");
}

}  // namespace bielle
