#pragma once

namespace bielle {

/// Times closer than this are the same instant, s: clocks and the starts of stages are sums of many steps.
constexpr double kClockTolerance = 1e-9;

}  // namespace bielle
