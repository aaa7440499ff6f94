#pragma once
// Forces of soles that do not lie on the ground as planned.
#include "bielle/ocp/residual.h"

namespace bielle {

// A copy of a residual of makeContactForce, makeCenterOfPressure or makeWrenchCone in the axes of the place where its contact
// belongs (ContactTarget::X_WT); null for other residuals. A sole that rests aslant on an edge is pushed along the normal of the
// ground, not along its own: with a friction of 0.3 its own cone holds no force that carries the robot once it leans by 0.3 rad.
std::shared_ptr<const Residual> useGroundAxes(const Residual& residual);

}  // namespace bielle
