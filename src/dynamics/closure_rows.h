#pragma once
/// \file The rows of a closure in full vectors, and how they change as it moves: Eqs. (1) to (4), (8) and (9) of closure.h.
#include "bielle/dynamics/closure.h"
#include "dynamics/closure_change.h"
#include "model/joint.h"

namespace bielle {

/// The two reduced joint vectors normal to the axis of a closure, as columns.
inline Eigen::Matrix<double, 3, 2> getAxisNormals(const Closure& c) { return makePlaneBasis(c.axis).leftCols<2>(); }

/// Transforms full vectors from world coordinates to frame 1 and writes their rows to columns of a matrix. A coupler has none: its
/// row becomes zero.
template <typename T>
class ClosureRows {
 public:
  /// \param change  of the closure, or null
  ClosureRows(const WorkspaceOf<T>& ws, const Closure& c, const ClosureChangeOf<T>* change = nullptr)
      : ws_(ws), c_(c), X_W1_(ws.X_WB[c.body1] * c.X_B1) {
    if (change) X_W1_.p += X_W1_.R * change->shift1;
    if (hasAxis(c.kind)) normals_ = getAxisNormals(c);
    if (c.kind != ClosureKind::Distance) return;
    p_ = X_W1_.inverseTimes(ws.X_WB[c.body2] * c.X_B2).p;
    per_length_ = change ? T(1 / change->length) : T(1 / c.length);
  }

  /// out = s times the rows of `full`.
  void write(double s, const Vector6<T>& full, T* out) const {
    if (c_.kind == ClosureKind::Coupler) {
      out[0] = 0;
      return;
    }
    const Vector6<T> local = X_W1_.actInvMotion(full);
    switch (c_.kind) {
      case ClosureKind::Weld6D:
        for (int i = 0; i < 6; ++i) out[i] = s * local[i];
        return;
      case ClosureKind::Ball3D:
        for (int i = 0; i < 3; ++i) out[i] = s * local[i];
        return;
      case ClosureKind::Hinge5D:
        for (int i = 0; i < 3; ++i) out[i] = s * local[i];
        for (int i = 0; i < 2; ++i) out[3 + i] = s * normals_.col(i).dot(angular(local));
        return;
      case ClosureKind::Slider:
        for (int i = 0; i < 2; ++i) out[i] = s * normals_.col(i).dot(linear(local));
        for (int i = 0; i < 3; ++i) out[2 + i] = s * local[3 + i];
        return;
      case ClosureKind::Distance:
        out[0] = s * per_length_ * p_.dot(linear(local));
        return;
      case ClosureKind::Coupler:
        return;
    }
  }

  /// out = s times the change of the velocity rows by a displacement D of frame 1 against frame 2 that changes the full velocity
  /// by dnu; needs the velocities of the workspace.
  void writeVelocityChange(double s, const Vector6<T>& D, const Vector6<T>& dnu, T* out) const {
    write(s, dnu, out);
    if (c_.kind != ClosureKind::Distance) return;
    const Vector3<T> dp = calcPointRate(X_W1_.actInvMotion(D));
    out[0] += s * per_length_ * dp.dot(linear(calcVelocity()));  // Eq. (9)
  }

  /// The same of the acceleration rows, for the change da of the full acceleration; needs the accelerations as well.
  void writeAccelerationChange(double s, const Vector6<T>& D, const Vector6<T>& dnu, const Vector6<T>& da,
                               T* out) const {
    write(s, da, out);
    if (c_.kind != ClosureKind::Distance) return;
    const Vector6<T> nu = calcVelocity(), a = X_W1_.actInvMotion(calcFullAcceleration(ws_, c_));
    const Vector6<T> dnu_1 = X_W1_.actInvMotion(dnu);
    const Vector3<T> dp = calcPointRate(X_W1_.actInvMotion(D));
    const Vector3<T> dp_rate = calcPointRate(dnu_1) - angular(nu).cross(dp);
    out[0] += s * per_length_ *
              (dp.dot(linear(a)) + calcPointRate(nu).dot(linear(dnu_1)) + dp_rate.dot(linear(nu)));  // Eq. (9)
  }

  /// What the turning of a distance in frame 1, by a displacement D of frame 1 against frame 2, adds to its world wrench W.
  Vector6<T> calcTurned(const Vector6<T>& W, const Vector6<T>& D) const {
    Vector6<T> turned = Vector6<T>::Zero();
    if (c_.kind != ClosureKind::Distance) return turned;
    const T tension_per_length = linear(X_W1_.actInvForce(W)).dot(p_) / p_.dot(p_);
    linear(turned) = tension_per_length * calcPointRate(X_W1_.actInvMotion(D));
    return X_W1_.actForce(turned);
  }

  /// Rows of the acceleration that the workspace holds.
  void writeAcceleration(T* out) const {
    write(1, calcFullAcceleration(ws_, c_), out);
    if (c_.kind != ClosureKind::Distance) return;
    const Vector6<T> nu = calcVelocity();
    out[0] += per_length_ * calcPointRate(nu).dot(linear(nu));  // Eq. (8)
  }

 private:
  static Vector6<T> calcFullAcceleration(const WorkspaceOf<T>& ws, const Closure& c) {
    return ws.A[c.body1] - ws.A[c.body2] + crossMotion(ws.V[c.body1], ws.V[c.body2]);
  }
  // Of frame 1 against frame 2, in frame 1.
  Vector6<T> calcVelocity() const { return X_W1_.actInvMotion(ws_.V[c_.body1] - ws_.V[c_.body2]); }
  // Of p, by a twist of frame 1 against frame 2.
  Vector3<T> calcPointRate(const Vector6<T>& twist) const { return -(linear(twist) + angular(twist).cross(p_)); }

  const WorkspaceOf<T>& ws_;
  const Closure& c_;
  SE3Of<T> X_W1_;
  Eigen::Matrix<double, 3, 2> normals_;
  Vector3<T> p_;  // of a distance, Eq. (8)
  T per_length_ = 0;
};

}  // namespace bielle
