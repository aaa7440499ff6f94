#pragma once
#include <limits>

namespace bielle::testing {

inline constexpr double kInf = std::numeric_limits<double>::infinity();

}  // namespace bielle::testing
