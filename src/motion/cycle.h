#pragma once
/// \file Cycles out of the middle of a gait.
#include "motion/gait.h"

namespace bielle {

/// Keeps of a gait the two steps of each cycle after the first `lead` ones of its task: from the middle of a stance phase to the
/// middle of that after the last of them, so that all landings lie within; and moves it to where the robot stands. The task keeps these steps and
/// those that are under way at the end. Returns where the end is from the beginning.
/// \pre `lead` is even and positive, and at least two steps follow the cycles
SE3 cutCycle(const SE3& middle, LocomotionTask& task, Gait& gait);

}  // namespace bielle
