#pragma once
// The motion of a result made again from its summary.
#include "bielle/results/result.h"

namespace bielle {

// The limits of a motion, which its summary lists with its options. \throws InputError when one is no number
LimitOptions readLimits(const MotionSummary& summary);

// The problem that a result solves, as it was when it was solved. Its guess is that of a first solve.
// \throws InputError when the summary tells too little: durations that were free, the least peak torque, the serial model
Motion remakeMotion(const Model& model, const MotionSummary& summary);

}  // namespace bielle
