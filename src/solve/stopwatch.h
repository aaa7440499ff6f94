#pragma once
#include <chrono>

namespace bielle {

using Clock = std::chrono::steady_clock;
inline double calcSecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace bielle
