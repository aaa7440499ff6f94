#pragma once
// Frames that move with one coordinate s, and what bodies on them weigh: kinematics and energies of mechanisms of one
// freedom, apart from those of the library.
#include "bielle/math/se3.h"

namespace bielle::loops {

// Placement in the world, and velocities per unit of ds/dt, in the axes of the world.
struct MovingFrame {
  Matrix3d R = Matrix3d::Identity();
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero(), w = Vector3d::Zero();

  Vector3d locate(const Vector3d& point) const { return p + R * point; }
  Vector3d calcVelocity(const Vector3d& point) const { return v + w.cross(R * point); }

  // A frame at a point of this one.
  MovingFrame shifted(const Vector3d& point) const { return {R, locate(point), calcVelocity(point), w}; }
  // Turned by an angle about an axis of this one through its origin.
  MovingFrame turned(const Vector3d& axis, double angle, double rate) const {
    return {R * Eigen::AngleAxisd(angle, axis).toRotationMatrix(), p, v, w + rate * (R * axis)};
  }
  // Moved along an axis of this one.
  MovingFrame moved(const Vector3d& axis, double length, double rate) const {
    MovingFrame out = shifted(length * axis);
    out.v += rate * (R * axis);
    return out;
  }
};

// T = inertia (ds/dt)^2 / 2, potential energy and its derivative by s.
struct Energies {
  double inertia = 0, potential = 0, slope = 0;

  void addBody(const MovingFrame& frame, const Inertia& body, const Vector3d& gravity) {
    const Vector3d w = frame.R.transpose() * frame.w, v = frame.calcVelocity(body.com);
    inertia += body.mass * v.squaredNorm() + w.dot(body.I_com * w);
    potential -= body.mass * gravity.dot(frame.locate(body.com));
    slope -= body.mass * gravity.dot(v);
  }
};

}  // namespace bielle::loops
