#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace bielle {

/// The value that a share of all values does not exceed, rounded up to one of them; 0 if there are none.
inline double calcQuantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace bielle
