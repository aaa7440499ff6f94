#pragma once
/// \file Rotations: exponential, logarithm and their right Jacobians.
///
/// Right Jacobians (Sola, Deray, Atchuthan, "A micro Lie theory", eqs. 143-144):
///     Exp(w + dw) = Exp(w) Exp(Jr(w) dw),    Log(R Exp(dw)) = Log(R) + Jr^{-1}(Log R) dw.
/// With t = |w|, every function is even in t and is evaluated by its series for t^2 < 1e-2, where the truncated terms
/// are below rounding.
#include "bielle/math/se3.h"
#include "math/lanes.h"

namespace bielle {

/// Rotation matrix of the rotation vector w (rad). Here and below, the template is for Lanes.
Matrix3d exp3(const Vector3d& w);
template <typename T>
Matrix3<T> exp3(const Vector3<T>& w);
/// The same as a unit quaternion.
Eigen::Quaterniond exp3AsQuaternion(const Vector3d& w);

template <typename T>
Eigen::Quaternion<T> exp3AsQuaternion(const Vector3<T>& w);

/// Rotation by an angle (rad) about a unit axis.
template <typename T>
Matrix3<T> makeAxisRotation(const Vector3d& axis, const T& angle);

/// Rotation vector of R, |w| in [0, pi]. Well conditioned on the whole range, the angle pi included.
Vector3d log3(const Matrix3d& R);
template <typename T>
Vector3<T> log3(const Matrix3<T>& R);

/// Right Jacobian of exp3 at w, 3x3.
Matrix3d calcRightJacobian3(const Vector3d& w);
template <typename T>
Matrix3<T> calcRightJacobian3(const Vector3<T>& w);

/// (1 / t^2) (1 - (t/2) cot(t/2)), from t^2.
double calcJacobianInverseFactor(double t2);
Lanes calcJacobianInverseFactor(const Lanes& t2);
/// Inverse of the right Jacobian at w: the Jacobian of log3 at exp3(w), 3x3. Singular at |w| = 2 pi.
Matrix3d calcRightJacobianInverse3(const Vector3d& w);
template <typename T>
Matrix3<T> calcRightJacobianInverse3(const Vector3<T>& w);

}  // namespace bielle
