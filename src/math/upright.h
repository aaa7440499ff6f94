#pragma once
/// \file Frames whose axes are named otherwise than x forward, z up: as those of bodies that were drawn lying, or z down.
#include "bielle/math/se3.h"

namespace bielle {

/// Rotation A by right angles whose third column is the axis of a frame, or its opposite, nearest to `up`, a direction in that frame:
/// with R the attitude of the frame, R A is upright where R is so but for right angles. The identity within 45 degrees of z.
Matrix3d findUprightAxes(const Vector3d& up);

}  // namespace bielle
