#pragma once
// What the trials of the predictive controller share.

namespace bielle::testing {

inline constexpr int kStageTicks = 12;  // control steps of 1 ms in a stage of a walk by command
inline constexpr int kLeadTicks = 4;    // that a solve begins before its stage, where it is asked to

}  // namespace bielle::testing
