#pragma once
/// \file Inertia of a rigid body.
#include "bielle/math/se3.h"

namespace bielle {

/// Mass, centre of mass and rotational inertia of a body, in the body's frame.
struct Inertia {
  double mass = 0;                    ///< kg
  Vector3d com = Vector3d::Zero();    ///< centre of mass, m
  Matrix3d I_com = Matrix3d::Zero();  ///< about the centre of mass, in the axes of the body frame, kg m^2

  /// The same inertia seen from frame A, this one being given in frame B.
  Inertia transformed(const SE3& X_AB) const { return {mass, X_AB.act(com), X_AB.R * I_com * X_AB.R.transpose()}; }
  /// Sum of two inertias given in one frame (parallel axis theorem).
  Inertia operator+(const Inertia& o) const;
  /// 6x6 spatial inertia about the frame's origin: momentum = matrix * twist.
  Matrix6d toMatrix() const;
};

}  // namespace bielle
