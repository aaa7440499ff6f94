#pragma once
/// \file Rotations that are given by a direction alone, or by three angles.
#include "bielle/math/types.h"

namespace bielle {

/// The smallest rotation that takes z to the direction of a vector, which has a length; by pi about x where that is -z. Eigen's
/// Quaternion::FromTwoVectors, too, but this decomposes two rows where they are opposite, and takes every file that calls it a
/// third of a minute to compile.
Matrix3d calcRotationOfZ(const Vector3d& direction);

/// The coordinate axis nearest to a direction, the first of those as near to a millionth, and the smallest rotation that takes it there.
struct NearestAxis {
  Vector3d axis;  ///< with its sign
  double angle;   ///< rad, at most acos(1 / sqrt(3))
  Matrix3d turn;
};
NearestAxis findNearestAxis(const Vector3d& direction);

/// Rz(yaw) Ry(pitch) Rx(roll). \param rpy  roll, pitch and yaw, rad
Matrix3d makeRotation(const Vector3d& rpy);
/// Its inverse, pitch within -pi/2 .. pi/2. Where that is a right angle to 1e-15 rad, roll and yaw turn about one axis, and yaw is 0;
/// near it they are known less and less, but what they make of R is not: each is that which fits the other.
Vector3d calcRollPitchYaw(const Matrix3d& R);

}  // namespace bielle
