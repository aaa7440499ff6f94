#pragma once
/// \file The plan at the nodes of a motion that happened, to be compared with it row by row.
#include "bielle/control/policy.h"
#include "bielle/motion/record.h"

namespace bielle::worlds {

/// The plan at the times of `happened`: q, v, the centre of mass and the torques without feedback; after the end of the
/// plan, the posture it holds. Accelerations, wrenches and gaps, which a policy does not know, are NaN; there are
/// no predicted footholds.
MotionRecord makePlannedRecord(const Model& model, const Policy& plan, const MotionRecord& happened);

}  // namespace bielle::worlds
