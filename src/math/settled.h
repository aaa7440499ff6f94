#pragma once
/// \file Rotations and places whose last digits stay as they are when files are written and read in turn. Turning a matrix into
/// angles or a quaternion and back, or composing frames and taking them apart, changes last digits each time, by some 1e-16, and
/// without end. Here they are rounded to a grid that is coarse beside that, so what is settled stays, bit by bit, after any such detour.
#include "bielle/math/types.h"

namespace bielle {

inline constexpr int kSettledBits = 48;
inline constexpr double kSettled = 1e-14;  ///< more than settling, writing and reading turn a frame by, rad

/// The rotation of the grid next to R, at most 6e-15 rad away: one of the 24 rotations of a cube, which stay exact, and from there a
/// quaternion whose vector is rounded to 2^-48. Mechanisms in a coordinate plane stay in it.
Matrix3d settleRotation(const Matrix3d& R, int bits = kSettledBits);

/// A unit vector likewise, for axes that were turned, or found from points. \param bits  of the quaternion's rounding
Vector3d settleDirection(const Vector3d& direction, int bits = kSettledBits);

/// Rounded to decimals, 14 behind the first digit of a size. \param size  of what it was composed of, > 0
Vector3d settlePoint(const Vector3d& p, double size);

}  // namespace bielle
