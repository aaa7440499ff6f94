#pragma once
// How high and how low the centre of mass can be while feet stand.
#include <vector>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/model.h"

namespace bielle {

// The height (m, world) nearest to `target` at which the centre of mass was found, with all closures of the set closed, feet among them,
// within ranges of joints. From q, closed, along the gradient in the tangent space of the closures, each step corrected onto them,
// until the target is reached or the height gains nothing more: legs are straight, or joints at their limits. Balance and motors
// do not count.
// \param feet  as targets of an assembly
double calcReachedComHeight(const Model& model, const ConstraintSet& constraints, const std::vector<FrameTarget>& feet,
                            ConstVectorRef q, double target);

}  // namespace bielle
