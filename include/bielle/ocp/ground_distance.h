#pragma once
/// \file Distance of shapes from the ground.
#include "bielle/dynamics/distance.h"
#include "bielle/ocp/contact_schedule.h"

namespace bielle {

/// Least distance of a shape from the plane and from the boxes that rise over it, m; where they overlap, minus the
/// smallest displacement that separates them. Point b is on the ground; for addDistanceGradient b is Shape(), which is
/// fixed in the world. \param X_WB  placement of the body
ShapeDistance calcGroundDistance(const Ground& ground, const Shape& shape, const SE3& X_WB);

}  // namespace bielle
