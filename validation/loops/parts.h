#pragma once
// Parts of mechanisms.
#include <string>

#include "bielle/model/builder.h"

namespace bielle::loops {

inline Joint makeJoint(const std::string& name, JointKind kind, const Vector3d& at, const Vector3d& axis,
                       const Vector3d& axis2 = Vector3d::UnitY()) {
  Joint joint;
  joint.name = name;
  joint.kind = kind;
  joint.X_PJ.p = at;
  joint.axis = axis;
  joint.axis2 = axis2;
  return joint;
}
inline Joint makeHinge(const std::string& name, const Vector3d& at, const Vector3d& axis) {
  return makeJoint(name, JointKind::Continuous, at, axis);
}

inline Inertia makeInertia(double mass, const Vector3d& com, const Vector3d& moments) {
  Inertia inertia;
  inertia.mass = mass;
  inertia.com = com;
  inertia.I_com = moments.asDiagonal();
  return inertia;
}

// Of a rod from the origin to `end`, by its moments of inertia along and across.
inline Inertia makeRod(double mass, const Vector3d& end, double along, double across) {
  const Vector3d d = end.normalized();
  Inertia inertia = makeInertia(mass, 0.5 * end, Vector3d::Constant(across));
  inertia.I_com += (along - across) * d * d.transpose();
  return inertia;
}

inline SE3 makePlace(const Vector3d& p) { return {Matrix3d::Identity(), p}; }

// A reference `start` with these coordinates.
inline void addStart(ModelBuilder& builder, const std::vector<std::pair<std::string, std::vector<double>>>& joints) {
  Reference start;
  start.name = "start";
  for (const auto& [name, q] : joints) start.joints[name] = q;
  builder.addReference(start);
}

}  // namespace bielle::loops
