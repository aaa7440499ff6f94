#pragma once
#include <atomic>
#include <chrono>

namespace bielle {

using Clock = std::chrono::steady_clock;
inline double calcSecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Adds to a sum that several threads share.
inline void addSeconds(double seconds, std::atomic<double>& sum) {
  for (double before = sum.load(); !sum.compare_exchange_weak(before, before + seconds);) {
  }
}

}  // namespace bielle
